"""Activating a variant; each case in a process of its own, for Dr.Jit starts only once."""

from __future__ import annotations

import os
import subprocess
import sys

from mitsuba_cfs import llvm


def _python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
        timeout=120,
    )


def test_preferred_variant_is_activated_and_stays() -> None:
    done = _python("from mitsuba_cfs import variants\nprint(variants.activate('llvm_ad_rgb'), variants.activate())")
    assert done.stdout.split() == ["llvm_ad_rgb", "llvm_ad_rgb"], done.stderr


def test_callback_is_called_now_and_at_every_change() -> None:
    done = _python(
        "from mitsuba_cfs import variants\n"
        "variants.register(lambda name: print('early', name))\n"
        "variants.activate('llvm_ad_mono')\n"
        "variants.register(lambda name: print('late', name))\n"
        "variants.activate('llvm_ad_rgb')\n"
    )
    lines = done.stdout.splitlines()
    assert lines[:2] == ["early llvm_ad_mono", "late llvm_ad_mono"], done.stderr
    # Mitsuba keeps its callbacks in no order
    assert sorted(lines[2:]) == ["early llvm_ad_rgb", "late llvm_ad_rgb"]


def test_unusable_library_is_an_error_not_an_abort() -> None:
    code = (
        "from mitsuba_cfs import errors, variants\n"
        "try:\n"
        "    variants.activate('llvm_ad_mono')\n"
        "except errors.VariantError as error:\n"
        "    print(error)\n"
    )
    done = _python(code, **{llvm.VARIABLE: "/nowhere/libLLVM.so.19"})
    assert done.returncode == 0, done.stderr
    assert "is no such file" in done.stdout
    assert "apt-get install libllvm19" in done.stdout
    assert len(done.stdout.splitlines()) == 1


def test_unknown_variant_is_named() -> None:
    code = (
        "from mitsuba_cfs import errors, variants\n"
        "try:\n"
        "    variants.activate('llvm_mono')\n"
        "except errors.VariantError as error:\n"
        "    print(error)\n"
    )
    assert "no variant 'llvm_mono'" in _python(code).stdout


def test_scalar_is_the_last_resort_with_a_warning() -> None:
    code = "from mitsuba_cfs import variants\nprint(variants.activate(vectorised=False))"
    done = _python(code, **{llvm.VARIABLE: "/nowhere/libLLVM.so.19"})
    assert done.stdout.strip() == "scalar_rgb"
    assert "apt-get install libllvm19" in done.stderr


def test_missing_system_library_is_named() -> None:
    """Dr.Jit 1.5 hides the ImportError of a missing libatomic behind a NameError."""
    code = (
        "import sys\n"
        "from importlib.abc import MetaPathFinder\n"
        "class NoAtomic(MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'drjit._drjit_ext':\n"
        "            raise ImportError('libatomic.so.1: cannot open shared object file')\n"
        "sys.meta_path.insert(0, NoAtomic())\n"
        "from mitsuba_cfs import errors, variants\n"
        "try:\n"
        "    variants.choose()\n"
        "except errors.VariantError as error:\n"
        "    print(error)\n"
    )
    done = _python(code)
    assert "libatomic.so.1" in done.stdout, done.stderr
    assert "apt-get install libatomic1" in done.stdout


def test_a_gpu_is_used_only_where_it_is_asked_for() -> None:
    code = (
        "from mitsuba_cfs import errors, variants\n"
        "variants.cuda_fault = lambda: {fault}\n"
        "try:\n"
        "    print(variants.choose().variant)\n"
        "except errors.VariantError as error:\n"
        "    print(error)\n"
    )
    usable, missing = code.format(fault="None"), code.format(fault="'no NVIDIA GPU'")
    assert _python(usable).stdout.strip() == "llvm_ad_mono"
    assert _python(usable, CFS_DEVICE="cuda").stdout.strip() == "cuda_ad_mono"
    refused = _python(missing, CFS_DEVICE="cuda").stdout.strip()
    assert refused == "cuda_ad_mono: no NVIDIA GPU; use the LLVM variant (CFS_DEVICE=cpu)"
    assert "CFS_DEVICE=tpu: choose one of cpu, cuda" in _python(usable, CFS_DEVICE="tpu").stdout


def test_a_device_that_loses_the_second_scene_of_a_launch_is_named() -> None:
    """On OptiX Dr.Jit 1.5 switches off the ray tracing of a second scene, with a warning."""
    code = (
        "import mitsuba as mi\n"
        "from mitsuba_cfs import variants\n"
        "variants.activate('llvm_ad_mono')\n"
        "print(variants.two_scenes_fault())\n"
        "traced, scenes = mi.Scene.ray_intersect_preliminary, []\n"
        "def first_scene_only(scene, ray):\n"
        "    scenes.append(scene)\n"
        "    return traced(scene, ray, active=len(scenes) == 1)\n"
        "mi.Scene.ray_intersect_preliminary = first_scene_only\n"
        "print(variants.two_scenes_fault())\n"
    )
    done = _python(code)
    assert done.stdout.splitlines() == ["None", "a launch that traces two scenes loses rays"], done.stderr
