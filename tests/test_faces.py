"""What `import scenes`, `mitsuba_cfs`, `bim` and `thermal` give: light, whole, and documented."""

from __future__ import annotations

import ast
import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.scenes.test_checked_first import NOT_FOR_HELP

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("scenes", "mitsuba_cfs", "bim", "thermal")
HEAVY = {*NOT_FOR_HELP, "numpy", "jinja2"}


def face(package: str) -> dict[str, str]:
    """The module of each name of a package's face, from its `__init__.pyi`."""
    found: dict[str, str] = {}
    tree = ast.parse((REPOSITORY / package / "__init__.pyi").read_text(encoding="utf-8"))
    for node in tree.body[1:]:  # after the docstring
        assert isinstance(node, ast.ImportFrom) and node.level == 1, ast.unparse(node)
        for alias in node.names:
            assert alias.asname == alias.name, f"{alias.name} is not given on to type checkers"
            assert alias.name not in found, f"{alias.name} comes twice"
            found[alias.name] = f"{package}.{node.module}" if node.module else package
    return found


NAMES = [(package, name) for package in PACKAGES for name in face(package)]


@pytest.mark.parametrize("package", PACKAGES)
def test_an_import_loads_nothing_heavy(package: str) -> None:
    code = (
        f"import json, sys, {package} as face\n"
        "names = dir(face)\n"
        "print(json.dumps([names, face.__all__, sorted(sys.modules)]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names, everything, loaded = json.loads(done.stdout)
    assert not HEAVY & set(loaded)
    assert set(names) == set(everything) == set(face(package))


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_a_name_is_there_and_says_what_it_is(package: str, name: str) -> None:
    found = getattr(importlib.import_module(package), name)
    module = importlib.import_module(face(package)[name])
    assert found is getattr(module, name)
    made_by_dataclass = f"{name}("  # what a dataclass without a docstring says of itself
    assert found.__doc__ and not found.__doc__.startswith(made_by_dataclass)


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_no_module_hides_a_name(package: str, name: str) -> None:
    """`import bim.shoebox` sets an attribute of `bim`: the function has to stay."""
    place = REPOSITORY / package / name
    if not (place.with_suffix(".py").is_file() or (place / "__init__.py").is_file()):
        return
    module = importlib.import_module(f"{package}.{name}")
    found = getattr(importlib.import_module(package), name)
    own = face(package)[name] == package  # the module itself is the name
    assert (found is module) == own


def test_read_ifc_is_the_function() -> None:
    import bim
    import bim.ifc.building

    assert callable(bim.read_ifc) and bim.read_ifc is bim.ifc.building.read_ifc


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_tells_that_it_is_typed(package: str) -> None:
    assert (REPOSITORY / package / "py.typed").is_file()


def from_faces(source: str) -> list[str]:
    """Names that a module takes from a face in place of the module that has them."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module in PACKAGES and not node.level:
            names = face(node.module)
            found += [a.name for a in node.names if names.get(a.name, node.module) != node.module]
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_the_program_itself_imports_modules(package: str) -> None:
    """The keys of caches follow imports to modules; a face would cut them off."""
    for path in (REPOSITORY / package).rglob("*.py"):
        assert not from_faces(path.read_text(encoding="utf-8")), path


def test_a_planted_import_from_a_face_is_found() -> None:
    assert from_faces("def f():\n    from mitsuba_cfs import View, variants") == ["View"]


@pytest.mark.parametrize("first", ["optics", "matrices"])
def test_the_variant_is_chosen_by_itself(first: str) -> None:
    """At the first use, whatever is first: matrices of a scene, or a system's optics."""
    use = {
        "optics": "light = cfs.PathLight(scene, [[optics]], sky, few); cfs.illuminance(light)",
        "matrices": "assert cfs.phase_matrices(scene, few).sensors.values.max() > 0",
    }[first]
    code = f"""
import numpy as np
import mitsuba
import mitsuba_cfs as cfs
from scenes.demo import VENETIAN_BLIND
bsdf = cfs.read_bsdf_xml(str(VENETIAN_BLIND)).band("Visible")
optics = cfs.BsdfOptics(cfs.klems_of(bsdf), bsdf)
pane = np.array([[[0, 0, 0], [1, 0, 0], [1, 0, 1.0]]])
groups = [cfs.WindowGroup("south", (cfs.WindowSurface("pane", pane),))]
points = np.array([[0.5, 1.0, 0.3]])
scene = cfs.DaylightScene(
    cfs.Surfaces.none(), cfs.Surfaces.none(), groups, points, np.array([[0.0, -1.0, 0.0]])
)
few = cfs.Sampling(sensor_samples=256, patch_samples=64, hour_samples=64, subdivision=1)
sky = cfs.given_sky([[0, -0.8, 0.6]], [800.0], [90.0], 1, day_of_year=172)
assert mitsuba.variant() is None
{use}
assert mitsuba.variant() is not None
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
