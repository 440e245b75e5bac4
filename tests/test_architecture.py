"""Which package may import which, and the rules of size and naming, read from the source."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.modules import MODULES, PACKAGES, REPOSITORY, dotted, file_name, imports

MAY_IMPORT = {
    "mitsuba_cfs": {"mitsuba_cfs"},
    "thermal": {"thermal", "mitsuba_cfs.compiled"},  # how code is kept knows nothing of light
    "bim": {"bim", "mitsuba_cfs", "thermal"},
    "scenes": {"scenes", "bim", "mitsuba_cfs", "thermal"},
}
# Only where rays are traced or a plugin is defined.
TRACING = (
    "mitsuba_cfs/variants.py",
    "mitsuba_cfs/trace/",
    "mitsuba_cfs/images/exr.py",
    "mitsuba_cfs/bsdf/plugin",
    "mitsuba_cfs/bsdf/generate.py",
    "mitsuba_cfs/bsdf/tensor_plugin.py",
    "mitsuba_cfs/bsdf/traced_",
    "scenes/commands/self_test.py",
)
# Solvers: they call the tracers, and so start Dr.Jit where they are imported.
SOLVERS = tuple(
    f"mitsuba_cfs/methods/{name}.py"
    for name in (
        "coefficients",
        "colour_view",
        "glare",
        "glare_map",
        "light",
        "optics",
        "phase_light",
        "phase_matrices",
        "phase_pictures",
        "point_in_time",
        "reflected_sun",
        "standard_error",
        "coloured_room",
        "sensitivity",
        "spectral_light",
        "sun_by_patches",
        "view_cache",
        "window_reflection",
    )
)
IFC = ("bim/ifc/", "scenes/demo/")
PLOTTING = ("scenes/",)
LIMITED = {"mitsuba": TRACING, "drjit": TRACING, "ifcopenshell": IFC, "matplotlib": PLOTTING}
LONGEST_MODULE = 800  # advice: one subject; a module with a single importer belongs on its page
CATCH_ALL_NAMES = {"utils.py", "util.py", "common.py", "helpers.py", "misc.py"}


def _faults(name: str, source: str) -> list[str]:
    """What a module does against the rules."""
    tree = ast.parse(source)
    package = name.partition("/")[0]
    faults = []
    for whole, line in dict.fromkeys(imports(tree)):
        imported = whole.partition(".")[0]
        may = tuple(f"{other}." for other in MAY_IMPORT[package])
        if imported in PACKAGES and not f"{whole}.".startswith(may):
            faults.append(f"{name}:{line}: {package} must not import {imported}")
        if imported in LIMITED and not name.startswith(LIMITED[imported]):
            faults.append(f"{name}:{line}: {imported} only in {', '.join(LIMITED[imported])}")
        if imported == "tests":
            faults.append(f"{name}:{line}: the product does not import its tests")
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names):
            faults.append(f"{name}:{node.lineno}: import *")
        if isinstance(node, ast.ImportFrom) and node.level:
            faults.append(f"{name}:{node.lineno}: a module is imported by its whole name")
    if len(source.splitlines()) > LONGEST_MODULE:
        faults.append(f"{name}: longer than {LONGEST_MODULE} lines")
    if Path(name).name in CATCH_ALL_NAMES:
        faults.append(f"{name}: a name that says nothing")
    if not package == "scenes" and re.search(r"^\s*print\(", source, re.MULTILINE):
        faults.append(f"{name}: the library never prints")
    return faults


@pytest.mark.parametrize("path", MODULES, ids=file_name)
def test_module_keeps_to_the_rules(path: Path) -> None:
    assert not _faults(file_name(path), path.read_text())


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("mitsuba_cfs/x.py", "from bim.model import Building"),
        ("thermal/x.py", "def f():\n    import mitsuba_cfs.errors"),
        ("thermal/x.py", "from mitsuba_cfs.directions import incident_azimuth"),
        ("bim/x.py", "import scenes"),
        ("thermal/x.py", "import mitsuba as mi"),
        ("mitsuba_cfs/sky/x.py", "from importlib import import_module\nimport_module('drjit')"),
        ("bim/x.py", "import ifcopenshell.geom"),
        ("bim/x.py", "import matplotlib.pyplot as plt"),
        ("bim/x.py", "from bim.model import *"),
        ("bim/x.py", "from . import model"),
        ("scenes/x.py", "from tests import validation"),
        ("scenes/room/x.py", "def f():\n    from tests.benchmarks import harness"),
        ("bim/utils.py", ""),
        ("bim/x.py", "x = 1\n" * (LONGEST_MODULE + 1)),
        ("bim/x.py", "def f():\n    print(1)\n"),
    ],
)
def test_planted_fault_is_found(name: str, source: str) -> None:
    assert len(_faults(name, source)) == 1


def test_modules_were_found() -> None:
    assert {file_name(path).partition("/")[0] for path in MODULES} == set(PACKAGES)


def test_the_wheel_holds_exactly_the_four_packages() -> None:
    settings = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]
    expected = {pattern for package in PACKAGES for pattern in (package, f"{package}.*")}
    found = settings["packages"]["find"]
    assert set(found["include"]) == expected
    assert "exclude" not in found


def test_every_folder_of_modules_is_a_package() -> None:
    folders = {path.parent for path in MODULES}
    missing = [file_name(folder) for folder in folders if not (folder / "__init__.py").is_file()]
    assert not missing, "these would be left out of the wheel"


@pytest.mark.parametrize("package", PACKAGES)
def test_data_files_are_packed_into_the_wheel(package: str) -> None:
    """Every file that is no Python source has an ending that pyproject.toml lists."""
    settings = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]
    endings = {pattern.removeprefix("**/*") for pattern in settings["package-data"]["*"]}
    files = [path for path in (REPOSITORY / package).rglob("*") if path.is_file()]
    data = [path for path in files if path.suffix != ".py" and "__pycache__" not in path.parts]
    unpacked = [file_name(path) for path in data if path.suffix not in endings]
    assert not unpacked


def test_modules_that_trace_no_rays_start_without_mitsuba() -> None:
    """Importing a reader, a table or a formula must not start Dr.Jit (and choose its LLVM)."""
    names = [file_name(path) for path in MODULES]
    tracing = [place for place in TRACING if place != "mitsuba_cfs/variants.py"]
    pure = [name for name in names if not name.startswith((*tracing, *SOLVERS, "scenes/"))]
    modules = [dotted(name) for name in pure]
    code = "\n".join(
        [
            "import importlib, sys",
            f"for name in {modules!r}:",
            "    importlib.import_module(name)",
            "    assert not {'mitsuba', 'drjit'} & set(sys.modules), name",
        ]
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
