"""The inner order of the packages, read from the source: ranks, circles, names, signatures."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY
from tests.modules import MODULES, dotted, file_name, imports

# The ranks of what lies directly in a package, lowest first: who imports must stand higher than
# what it imports.  What shares a rank knows nothing of the others there.
RANKS = {
    "mitsuba_cfs": (
        {"directions", "errors", "interpreter", "llvm", "notes", "phases", "processes", "progress", "source_code"},
        {"gloss"},
        {"compiled", "files", "spectra", "surfaces", "variants"},
        {"bsdf", "images", "sky", "stored_arrays", "window_parts"},
        {"glare", "matrices", "metrics"},
        {"picture_year", "trace"},
        {"methods"},
    ),
    "mitsuba_cfs.trace": ({"kernels"}, {"matrices"}, {"sun"}, {"paths"}, {"pictures"}),
    "scenes": (
        {"language"},
        {
            "demo",
            "figures",
            "plausible",
            "quick",
            "result_folder",
            "toml_file",
            "user_errors",
            "pictures",
            "room_views",
        },
        {"cluster", "page_options", "provision_levels", "surroundings", "uncertain_inputs"},
        {"workers"},
        {"fenestration", "cost"},
        {"head", "input_options", "bsdf_generation"},
        {"results"},
        {"report", "plots"},
        {"room"},
        {"input_files"},
        {"inputs", "fenestration_exports"},
        {"run", "viewed_room", "picture_options"},
        {"explore"},
        {"comply", "heat", "calibration", "picture_files", "photovoltaics", "simulation", "year_of_glare"},
        {"fit", "study", "view_picture", "site"},
        {"study_report"},
        {"design"},
        {"app"},
        {"commands"},
        {"cli"},
    ),
}
MOST_POSITIONAL = 6
# These decorators compile with numba, which fails where one compiled function calls another by a
# keyword-only parameter (0.68: no such call binds).  `dr.syntax` has no such excuse
COMPILED = {"compiled", "inlined"}

SOURCES = {file_name(path): path.read_text(encoding="utf-8") for path in MODULES}


@cache
def _tree(source: str) -> ast.Module:
    return ast.parse(source)


def _part(module: str, package: str) -> str:
    """The part directly in a package that a module belongs to; empty for the package itself."""
    return module.removeprefix(package).removeprefix(".").partition(".")[0]


def _rank_faults(name: str, source: str) -> list[str]:
    """Imports of a module from parts of its packages that do not rank lower than its own part."""
    module = dotted(name)
    packages = [package for package in RANKS if f"{module}.".startswith(f"{package}.")]
    faults = [fault for package in packages for fault in _upward(package, module, source)]
    return [f"{name}:{line}: {words}" for line, words in dict.fromkeys(faults)]


def _upward(package: str, module: str, source: str) -> Iterator[tuple[int, str]]:
    """Line and message of each import that goes up within one package."""
    rank = {part: level for level, parts in enumerate(RANKS[package]) for part in parts}
    rank[""] = len(RANKS[package])  # the package's face
    importer = _part(module, package)
    for imported, line in imports(_tree(source)):
        other = _part(imported, package)
        if not f"{imported}.".startswith(f"{package}.") or importer == other:
            continue
        if rank.get(importer, -1) <= rank.get(other, rank[""]):
            yield line, f"{package}.{other} does not stand below {package}.{importer}"


def _circle(sources: Mapping[str, str]) -> list[str]:
    """Modules that import each other in a circle, the first one again at the end; none if none."""
    known = {dotted(name) for name in sources}
    graph: dict[str, set[str]] = {}
    for name, source in sources.items():
        targets = (imported for imported, _ in imports(_tree(source)))
        either = {t if t in known else t.rpartition(".")[0] for t in targets}
        graph[dotted(name)] = either & known
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def _repeated_classes(sources: Mapping[str, str]) -> dict[str, list[str]]:
    """Public class names that several modules of the product have, with these."""
    found: dict[str, list[str]] = defaultdict(list)
    for name, source in sources.items():
        for node in ast.walk(_tree(source)):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(name)
    return {name: modules for name, modules in found.items() if len(modules) > 1}


def _long_signatures(name: str, source: str) -> Iterator[str]:
    """Functions with too many positional parameters; `self` and `cls` do not count."""
    for node in ast.walk(_tree(source)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        marks = (m.func if isinstance(m, ast.Call) else m for m in node.decorator_list)
        if COMPILED & {ast.unparse(mark) for mark in marks}:
            continue
        given = [a.arg for a in (*node.args.posonlyargs, *node.args.args)]
        count = len(given) - (given[:1] in (["self"], ["cls"]))
        if count > MOST_POSITIONAL:
            yield f"{name}:{node.lineno}: {node.name} has {count} positional parameters"


def _system_words(name: str, source: str) -> Iterator[str]:
    """Messages that hold what Python says of an error of the system: its number, the file again."""
    for handler in ast.walk(_tree(source)):
        if not (isinstance(handler, ast.ExceptHandler) and handler.type and handler.name):
            continue
        if "OSError" not in ast.unparse(handler.type):
            continue
        for shown in ast.walk(handler):
            if isinstance(shown, ast.FormattedValue):
                value = ast.unparse(shown.value)
                if value == handler.name or value.startswith(f"{handler.name}.strerror"):
                    yield f"{name}:{shown.lineno}: `mitsuba_cfs.files.reason` says why"


def test_errors_of_the_system_are_said_in_words() -> None:
    apart = ("bim/bonsai/",)  # has nothing of this program
    sources = {n: s for n, s in SOURCES.items() if not n.startswith(apart)}
    assert not [fault for module in sources.items() for fault in _system_words(*module)]


def test_modules_import_only_from_below() -> None:
    faults = [fault for module in SOURCES.items() for fault in _rank_faults(*module)]
    assert not faults


@pytest.mark.parametrize("package", RANKS)
def test_the_ranks_hold_each_part_once(package: str) -> None:
    modules = (dotted(name) for name in SOURCES)
    parts = {_part(m, package) for m in modules if m.startswith(f"{package}.")}
    assert sorted(part for level in RANKS[package] for part in level) == sorted(parts)


def test_no_modules_import_each_other_in_a_circle() -> None:
    assert not _circle(SOURCES)


def test_a_public_class_name_exists_once() -> None:
    assert not _repeated_classes(SOURCES)


def test_no_function_takes_many_positional_parameters() -> None:
    faults = [fault for module in SOURCES.items() for fault in _long_signatures(*module)]
    assert not faults


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("mitsuba_cfs/files.py", "from mitsuba_cfs.trace.kernels import scene"),  # upwards
        ("mitsuba_cfs/sky/x.py", "import mitsuba_cfs.bsdf.klems"),  # aside
        ("mitsuba_cfs/sky/x.py", "import mitsuba_cfs.new"),  # to what has no rank
        ("mitsuba_cfs/new.py", "from mitsuba_cfs.errors import DataError"),  # from what has none
        ("mitsuba_cfs/methods/x.py", "import mitsuba_cfs as cfs"),  # the face
        ("mitsuba_cfs/trace/kernels/x.py", "from mitsuba_cfs import methods"),
        ("mitsuba_cfs/trace/kernels/x.py", "import mitsuba_cfs.trace.matrices.view"),
        ("mitsuba_cfs/trace/sun/x.py", "from mitsuba_cfs.trace import paths"),
        ("mitsuba_cfs/trace/sun/x.py", "def f():\n    from mitsuba_cfs.methods.glare import pictures"),
        ("scenes/results.py", "if TYPE_CHECKING:\n    from scenes.report.page import write_report"),
        ("scenes/heat/x.py", "from importlib import import_module\nimport_module('scenes.study')"),
        ("scenes/study/x.py", "from scenes.commands.room_options import seed_option"),
        ("scenes/commands/x.py", "from scenes.cli import run"),
    ],
)
def test_planted_rank_is_found(name: str, source: str) -> None:
    assert len(_rank_faults(name, source)) == 1


@pytest.mark.parametrize(
    "back",
    [
        "import bim.x",
        "from bim import x",
        "from bim.x import X",
        "def f():\n    from bim.x import X",
        "if TYPE_CHECKING:\n    from bim.x import X",
    ],
)
def test_planted_circle_is_found(back: str) -> None:
    straight = {"bim/__init__.py": "", "bim/x.py": "import bim.y", "bim/y.py": "import bim.z"}
    assert not _circle(straight | {"bim/z.py": "import numpy"})
    assert set(_circle(straight | {"bim/z.py": back})) == {"bim.x", "bim.y", "bim.z"}


def test_planted_class_name_is_found() -> None:
    one = {"bim/x.py": "class Window: ...\nclass _Part: ..."}
    assert not _repeated_classes(one | {"bim/y.py": "class Windows: ...\nclass _Part: ..."})
    again = "@dataclass\nclass Window: ..."
    assert _repeated_classes(one | {"bim/y.py": again}) == {"Window": ["bim/x.py", "bim/y.py"]}


@pytest.mark.parametrize(
    "source",
    [
        "def f(a, b, c, d, e, f, g): ...",
        "def f(a, b, c, d, /, e, f, g): ...",
        "def f(a, b, c, d, e, f, g=1, *, h): ...",
        "class A:\n    def __init__(self, a, b, c, d, e, f, g): ...",
        "def f():\n    def g(a, b, c, d, e, f, g): ...",
        "@dr.syntax\ndef f(a, b, c, d, e, f, g): ...",
    ],
)
def test_planted_signature_is_found(source: str) -> None:
    assert len(list(_long_signatures("bim/x.py", source))) == 1


@pytest.mark.parametrize(
    "source",
    [
        "def f(a, b, c, d, e, f, *rest, g, **options): ...",
        "class A:\n    @classmethod\n    def of(cls, a, b, c, d, e, f): ...",
        "@compiled(nogil=True)\ndef f(a, b, c, d, e, f, g): ...",
    ],
)
def test_sound_signature_is_passed(source: str) -> None:
    assert not list(_long_signatures("bim/x.py", source))


def _scenes_made(name: str, source: str) -> Iterator[str]:
    """Mitsuba scenes that a module makes by itself."""
    for node in ast.walk(_tree(source)):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("mi.load_dict", "mi.Scene"):
            text = ast.unparse(node)
            if "'type': 'scene'" in text or text.startswith("mi.Scene"):
                yield f"{name}:{node.lineno}: `mitsuba_cfs.variants.load_scene` makes scenes"


def test_all_scenes_share_one_shader_binding_table() -> None:
    """Else a launch that traces two of them loses rays on CUDA."""
    apart = ("mitsuba_cfs/variants.py", "scenes/commands/self_test.py")  # that traces one alone
    sources = {n: s for n, s in SOURCES.items() if n not in apart}
    assert not [fault for module in sources.items() for fault in _scenes_made(*module)]
    assert list(_scenes_made("planted.py", "mi.load_dict({'type': 'scene', 'mesh': mesh})"))


def test_no_test_is_timed() -> None:
    """Speed is a benchmark: a clock in a test makes it fail on a slow or busy machine."""
    tests = (REPOSITORY / "tests").rglob("test_*.py")
    clocks = re.compile(r"\b(process_time|perf_counter|thread_time|timeit)\b")
    timed = {path.name for path in tests if clocks.search(path.read_text(encoding="utf-8"))}
    assert timed == {Path(__file__).name}
