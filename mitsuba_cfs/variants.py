"""Choose and activate the Mitsuba variant: LLVM, or CUDA where the user asks for it, else scalar.

The validation tables were made with LLVM; on a GPU only a part of the tests and one building have
run, so that CUDA is never chosen without being asked for (`CFS_DEVICE=cuda`, `cfs --device cuda`).

Mitsuba and Dr.Jit are imported inside the functions, after the LLVM library has been chosen.
"""

from __future__ import annotations

import atexit
import ctypes
import logging
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from mitsuba_cfs import llvm
from mitsuba_cfs.errors import VariantError

BLAS_THREADS = "OPENBLAS_NUM_THREADS"  # environment variable
DEVICE = "CFS_DEVICE"  # environment variable: one of DEVICES; worker processes inherit it
DEVICES = ("cpu", "cuda")
CUDA, LLVM, SCALAR = "cuda_ad_mono", "llvm_ad_mono", "scalar_rgb"

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Choice:
    """A Mitsuba variant and why it was chosen."""

    variant: str
    reason: str


def activate(preferred: str | None = None, *, vectorised: bool = True) -> str:
    """Activate the Mitsuba variant and return its name; repeated calls are fast.

    Without a preference the variant that is active already stays; else the one of `choose`. CUDA
    is refused where it loses rays of a launch that traces two scenes, as several kernels do.

    Args:
        preferred: a Mitsuba variant that must be used, such as `llvm_ad_rgb`.
        vectorised: whether Dr.Jit arrays are needed (every matrix is). If not, the scalar
            variant is taken, with a warning, where there is no LLVM library.

    Raises:
        VariantError: no usable variant; the message says what to install.
    """
    mi = _tracer("mitsuba")
    current = mi.variant()
    if current and preferred in (None, current) and not (vectorised and _is_scalar(current)):
        return current
    variant = _checked(preferred) if preferred else choose(vectorised=vectorised).variant
    if _is_scalar(variant):
        log.warning("tracing without LLVM (%s) is slow: %s", variant, llvm.INSTALL_HINT)
    try:
        mi.set_variant(variant)
    except ImportError as error:
        raise VariantError(f"{variant}: {error}; {llvm.INSTALL_HINT}") from error
    if variant.startswith("cuda") and (fault := two_scenes_fault()):
        raise VariantError(f"{variant}: {fault}; use the LLVM variant ({DEVICE}=cpu)")
    return variant


def load_scene(mesh: Any) -> Any:
    """A `mi.Scene` of one mesh, which a launch can trace together with others.

    Dr.Jit allows one OptiX shader binding table in a launch, and switches rays off where there are
    more. On CUDA all scenes therefore share the table of one scene: Mitsuba appends the records
    of a scene to the table of the scene that it is given.
    """
    mi = _tracer("mitsuba")
    entries = {"type": "scene", "mesh": mesh}
    if mi.variant().startswith("cuda"):
        entries["table"] = _scene_of_table(mi.variant())
    return mi.load_dict(entries, parallel=False)


def triangle_mesh(corners: Any) -> Any:
    """A `mi.Mesh` of triangles without shared vertices; corners [N, 3, 3]."""
    mi = _tracer("mitsuba")
    count = len(corners)
    mesh = mi.Mesh("surfaces", vertex_count=3 * count, face_count=count)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(corners.reshape(-1).astype(np.float32))
    parameters["faces"] = mi.UInt32(np.arange(3 * count, dtype=np.uint32))
    parameters.update()
    return mesh


@cache
def _scene_of_table(variant: str) -> Any:
    """The scene of a CUDA variant that holds the shader binding table of all others."""
    atexit.register(_scene_of_table.cache_clear)  # before Dr.Jit ends
    mesh = triangle_mesh(np.eye(3)[None])
    return _tracer("mitsuba").load_dict({"type": "scene", "mesh": mesh}, parallel=False)


def two_scenes_fault() -> str | None:
    """Whether the active variant loses rays where one launch traces two scenes; None if not."""
    mi, dr = _tracer("mitsuba"), _tracer("drjit")
    square = np.array([[[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]]])
    scenes = [load_scene(triangle_mesh(square + np.array([0, 0, distance]))) for distance in (1.0, 2.0)]
    ray = mi.Ray3f(dr.zeros(mi.Point3f, 4), mi.Vector3f(0.0, 0.0, 1.0))
    distances = [scene.ray_intersect_preliminary(ray).t for scene in scenes]
    dr.eval(*distances)  # one launch
    if all(bool(dr.allclose(t, d)) for t, d in zip(distances, (1.0, 2.0), strict=True)):
        return None
    return "a launch that traces two scenes loses rays"


def share_cores(processes: int) -> None:
    """Limit the threads of Dr.Jit and of BLAS to this process' share of the cores.

    Threads that wait for work are busy, and two processes' on one core wait for each other. A
    number of BLAS threads that the user has set (`OPENBLAS_NUM_THREADS`) is left as it is.

    Args: processes: how many of them compute at the same time.
    """
    threads = max((os.cpu_count() or 1) // processes, 1)
    _tracer("drjit").set_thread_count(threads)
    if BLAS_THREADS not in os.environ:
        os.environ[BLAS_THREADS] = str(threads)  # read by a library that is loaded later
        threadpool_limits(threads, user_api="blas")


def return_memory() -> None:
    """Give freed memory back to the system, which Dr.Jit and the C library keep for later.

    After a room's stage that is as much as the next one needs, in arrays of other sizes.
    """
    _tracer("drjit").flush_malloc_cache()
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)):
        trim(0)  # glibc's


def choose(*, vectorised: bool = True) -> Choice:
    """The variant for this machine, with the reason; activates nothing.

    Raises: `VariantError` where the device of `CFS_DEVICE` is unknown or cannot be used.
    """
    device = os.environ.get(DEVICE) or "cpu"
    if device not in DEVICES:
        raise VariantError(f"{DEVICE}={device}: choose one of {', '.join(DEVICES)}")
    if device == "cuda":
        return Choice(_checked(CUDA), f"{DEVICE}=cuda")
    library_fault = llvm_fault()
    if library_fault is None:
        return Choice(LLVM, f"LLVM at {llvm.select_library()}")
    if vectorised:
        raise VariantError(f"{library_fault}: {llvm.INSTALL_HINT}")
    return Choice(SCALAR, library_fault)


def register(callback: Callable[[str], None]) -> None:
    """Call `callback(variant)` now if a variant is active, and again whenever it changes.

    Mitsuba keeps plugins per variant: a module that defines one registers it in such a callback.
    """
    mi = _tracer("mitsuba")

    def changed(old: str | None, new: str) -> None:
        callback(new)

    mi.detail.add_variant_callback(changed)
    if mi.variant():
        callback(mi.variant())


def cuda_fault() -> str | None:
    """Why this machine cannot trace on a GPU; None if it can."""
    windows = sys.platform == "win32"
    driver = os.environ.get("DRJIT_LIBCUDA_PATH", "nvcuda.dll" if windows else "libcuda.so.1")
    if not _loads(driver):  # asked first: Dr.Jit starts LLVM too, and complains if it cannot
        return "no NVIDIA GPU"
    dr = _tracer("drjit")
    if not dr.has_backend(dr.JitBackend.CUDA):
        return "no usable NVIDIA GPU"
    optix = os.environ.get("DRJIT_LIBOPTIX_PATH", "nvoptix.dll" if windows else "libnvoptix.so.1")
    return None if _loads(optix) else f"the GPU's driver has no OptiX ({optix})"


def llvm_fault() -> str | None:
    """Why this machine cannot trace with LLVM; None if it can."""
    dr = _tracer("drjit")  # raises where Dr.Jit itself cannot be loaded
    library = llvm.select_library()
    if library is None:
        rejected = [f"{candidate.path}: {candidate.reason}" for candidate in llvm.candidates()]
        return "; ".join(["no usable LLVM library", *rejected[:2]])
    if not _exists(library):
        return f"{llvm.VARIABLE}={library} is no such file"
    if not dr.has_backend(dr.JitBackend.LLVM):
        return f"Dr.Jit cannot load the LLVM library {library}"
    return None


def _tracer(name: str) -> ModuleType:
    """The module `mitsuba` or `drjit`, imported after the LLVM library has been chosen.

    Even asking Dr.Jit about CUDA makes it load LLVM.
    """
    llvm.select_library()
    try:
        return import_module(name)
    except (ImportError, NameError) as error:  # drjit 1.5 hides the first behind the second
        cause = error.__context__ or error
        hint = "apt-get install libatomic1" if "libatomic" in str(cause) else "install it again"
        raise VariantError(f"{name} cannot be loaded: {cause}: {hint}") from error


def _loads(library: str) -> bool:
    """Whether the system's linker finds and loads a library of the GPU's driver."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _exists(library: Path) -> bool:
    """Whether a library exists; a bare file name is left to the system's linker."""
    return library.name == str(library) or library.is_file()


def _checked(variant: str) -> str:
    mi = _tracer("mitsuba")
    if variant not in mi.variants():
        raise VariantError(f"no variant {variant!r} in this Mitsuba: {', '.join(mi.variants())}")
    fault = None
    if variant.startswith("cuda"):
        fault = cuda_fault()
    elif variant.startswith("llvm"):
        fault = llvm_fault()
    if fault is None:
        return variant
    hint = f"use the LLVM variant ({DEVICE}=cpu)"
    if variant.startswith("llvm"):
        hint = llvm.INSTALL_HINT
    raise VariantError(f"{variant}: {fault}; {hint}")


def _is_scalar(variant: str) -> bool:
    return variant.startswith("scalar")
