"""Mistakes in options and small files are named before the building is read, and cheaply.

Each command gets a building whose reading fails the test, and each kind of mistake in turn.
"""

from __future__ import annotations

import importlib
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from scenes import cli
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from tests.conftest import REPOSITORY as ROOT

pytestmark = pytest.mark.early

# Loaded by nothing before the small files are read: the tracer, the readers of IFC, what draws
HEAVY = ("mitsuba", "drjit", "ifcopenshell", "trimesh", "manifold3d", "matplotlib", "colour")
# Modules that take `open_ifc` or `open_all` by its name
OPENING = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for package in ("bim", "scenes")
    for path in (ROOT / package).rglob("*.py")
    if re.search("open_(ifc|all)", path.read_text(encoding="utf-8"))
)
# Loaded by no --help: these too
NOT_FOR_HELP = (*HEAVY, "pandas", "scipy", "pvlib", "numba", "shapely", "pydantic", "rich")
HEAD = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\nnot to be read"
MODULE = """
select = "IfcWindow"
short_circuit_current = 9.5
open_circuit_voltage = 40
current = 9
voltage = 32
"""


class Place:
    """A folder with good inputs and the mistakes to make in them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.write("house.ifc", HEAD)
        self.write("word.ifc", "Dear Sir or Madam")
        self.write("old.ifc", HEAD.replace("IFC4", "IFC1X5"))
        self.write("corrected.ifc", HEAD)
        self.write("corrected.corrections.toml", "leaveout = []")
        self.write("bad.xml", "<WindowElement>")
        rows = WEATHER.read_text(encoding="latin1").splitlines()[:4000]
        self.write("short.epw", "\n".join(rows))
        self.write("pv.toml", f"[module]{MODULE}cells = 60")

    def write(self, name: str, text: str) -> None:
        """Write a file of the folder."""
        (self.folder / name).write_text(text, encoding="utf-8")

    def heat(self, more: str = "", *, weather: object = WEATHER, system: str = "") -> str:
        """A study file of `cfs thermal`."""
        text = f'weather = "{weather}"\nbuilding = "house.ifc"\n{{}}\n[[system]]\n'
        head, tables = (more, "") if "[" not in more else ("", more)
        text = text.format(head) + f'bsdf = "{VENETIAN_BLIND}"\n{system}\n{tables}\n'
        self.write("heat.toml", text)
        return "heat.toml"

    def study(self, more: str = "", *, room: str = "house.ifc", weather: object = WEATHER, system: str = "") -> str:
        """A study file of `cfs study`."""
        self.write(
            "study.toml",
            f'[[room]]\nbuilding = "{room}"\n[[system]]\nbsdf = "{VENETIAN_BLIND}"\n{system}\n'
            f'[[climate]]\nweather = "{weather}"\n{more}\n',
        )
        return "study.toml"

    def design(self, more: str = "", **study: str) -> str:
        """A design file of `cfs design`."""
        choice = '[[variable]]\nkey = "operation"\nvalues = ["a.toml"]\n[[objective]]\nname = "energy"\n'
        self.write("a.toml", "")
        return self.study(choice + more, **study)

    def operation(self, text: str) -> str:
        """An operation file of `cfs run`."""
        self.write("operation.toml", text)
        return "operation.toml"


def _but(usual: dict[str, object], words: tuple[object, ...]) -> list:
    """The usual options, but for those among the words, and the words."""
    return [part for option in usual.items() if option[0] not in words for part in option] + [*words]


def _run(*words: object, building="house.ifc", weather=WEATHER, cfs=VENETIAN_BLIND) -> list:
    return ["run", building, *_but({"--weather": weather, "--cfs": cfs, "--out": "out"}, words)]


def _dgp(*words: object, building: object = "house.ifc") -> list:
    return ["dgp", building, *_but({"--weather": WEATHER, "--out": "out"}, words)]


def _comply(*words: object, building: object = "house.ifc") -> list:
    return ["comply", building, "--standard", "en17037", *_but({"--weather": WEATHER, "--out": "out"}, words)]


def _picture(*words: object, building: object = "house.ifc", at: str = "06-21 12:00") -> list:
    return ["picture", building, *_but({"--weather": WEATHER, "--at": at, "--out": "a.hdr"}, words)]


def _box_study(place: Place) -> str:
    box = "width = 4\ndepth = 6\nheight = 3\nwindow = [{x = 1, sill = 1, width = 2, height = 1}]"
    place.write("box.toml", f'weather = "{WEATHER}"\n[box]\n{box}\n')
    return "box.toml"


def _pv(weather: object = WEATHER, building: object = "house.ifc", study: str = "pv.toml", out: object = "out") -> list:
    return ["pv", building, "--weather", weather, "--study", study, "--out", out]


def _pv_file(place: Place, text: str) -> list:
    place.write("pv.toml", text)
    return _pv()


def _night(place: Place) -> str:
    return place.operation("[air]\nnight = [6, 6]")


SHORT, HOURS = "short.epw: length", "expected two different hours"
FLOOR = "g: 0.01 is below the solar transmittance 0.154, the least that g can be"
MISTAKES: dict[str, tuple[Callable[[Place], list], str]] = {
    "run, head": (lambda p: _run(building="word.ifc"), "word.ifc: not an IFC file"),
    "run, schema": (lambda p: _run(building="old.ifc"), "old.ifc: schema IFC1X5"),
    "run, corrections": (
        lambda p: _run(building="corrected.ifc"),
        "toml: leaveout: no such key; did you mean leave_out?",
    ),
    "run, weather": (lambda p: _run(weather="short.epw"), SHORT),
    "run, BSDF": (lambda p: _run(cfs="bad.xml"), "bad.xml: is not well-formed"),
    "run, --space": (lambda p: _run("--space", " "), "--space: expected the name"),
    "run, --picture": (lambda p: _run("--picture", "noon"), "--picture 'noon': expected"),
    "run, no such hour": (lambda p: _run("--picture", "02-29 12"), "has no such hour"),
    "run, no sun": (lambda p: _run("--picture", "06-21 01"), "the sun is below the horizon"),
    "run, --u": (lambda p: _run("--u", "90"), "'--u': 90.0 is not in the range"),
    "run, --g": (lambda p: _run("--g", "1.5"), "'--g': 1.5 is not in the range"),
    "run, g below its floor": (lambda p: _run("--g", "0.01"), FLOOR),
    "run, night": (lambda p: _run("--operation", _night(p)), f"air.night: {HOURS}"),
    "run, key": (
        lambda p: _run("--operation", p.operation("[air]\nnigth_ach = 3")),
        "operation.toml: air.nigth_ach: no such key; did you mean night_ach?",
    ),
    "run, state": (
        lambda p: _run("--operation", p.operation("[control]\nstate = 3")),
        "control.state: a state outside 0 to 0",
    ),
    "run, folder": (lambda p: _run("--out", p.folder), "--out: "),
    "thermal, weather": (lambda p: ["thermal", p.heat(weather="short.epw"), "--out", "out"], SHORT),
    "thermal, night": (
        lambda p: ["thermal", p.heat("[air]\nnight = [6, 6]"), "--out", "out"],
        f"heat.toml: air.night: {HOURS}",
    ),
    "thermal, g": (lambda p: ["thermal", p.heat(system="g_value = 0.01"), "--out", "out"], FLOOR),
    "thermal, gap": (
        lambda p: [
            "thermal",
            p.heat(system='u_value = 6.9\nu_model = "gap"\n[system.gap]\nwidth = 0.016'),
            "--out",
            "out",
        ],
        "venetian_blind.xml: ",
    ),
    "thermal, room": (lambda p: ["thermal", p.heat('spaces = [""]'), "--out", "out"], "spaces: "),
    "thermal, folder": (lambda p: ["thermal", p.heat(), "--out", p.folder], "--out: "),
    "study, weather": (lambda p: ["study", p.study(weather="short.epw"), "--out", "out"], SHORT),
    "study, head": (lambda p: ["study", p.study(room="word.ifc"), "--out", "out"], "word.ifc: not an IFC file"),
    "study, g": (lambda p: ["study", p.study(system="g_value = 0.01"), "--out", "out"], FLOOR),
    "study, occupied": (
        lambda p: ["study", p.study("[options]\noccupied = [8, 8]"), "--out", "out"],
        f"options.occupied: {HOURS}",
    ),
    "study, operation": (
        lambda p: ["study", p.study(f"[options]\nseed = 1\n[auto]\ntime_budget = '{_night(p)}'"), "--out", "out"],
        "auto.time_budget: expected a time",
    ),
    "study, --dgp-error": (
        lambda p: ["study", p.study(), "--out", "out", "--dgp-error", "much"],
        "auto.dgp_error: expected a share",
    ),
    "study, --write-ifc": (
        lambda p: ["study", p.study(), "--out", "out", "--write-ifc", "none/a.ifc"],
        "no such folder",
    ),
    "design, weather": (lambda p: ["design", p.design(weather="short.epw"), "--out", "out"], SHORT),
    "design, head": (lambda p: ["design", p.design(room="word.ifc"), "--out", "out"], "word.ifc: not an IFC file"),
    "design, rule": (
        lambda p: ["design", p.design('[[constraint]]\nrule = "en17037 glair"'), "--out", "out"],
        "en17037 has no 'glair'",
    ),
    "study, folder": (lambda p: ["study", p.study(), "--out", p.folder], "--out: "),
    "pv, head": (lambda p: _pv(building="word.ifc"), "word.ifc: not an IFC file"),
    "pv, weather": (lambda p: _pv(weather="short.epw"), SHORT),
    "pv, key": (
        lambda p: _pv_file(p, f"[module]{MODULE}cell = 60"),
        "pv.toml: module.cell: no such key; did you mean cells? (and 1 more)",
    ),
    "pv, datasheet": (lambda p: _pv_file(p, f"[module]{MODULE}cells = 6"), "pv.toml: module: no two-diode cell"),
    "pv, folder": (lambda p: _pv(out=p.folder), "--out: "),
    "dgp, head": (lambda p: _dgp(building="word.ifc"), "word.ifc: not an IFC file"),
    "dgp, weather": (lambda p: _dgp("--weather", "short.epw"), SHORT),
    "dgp, BSDF": (lambda p: _dgp("--cfs", "bad.xml"), "bad.xml: is not well-formed"),
    "dgp, view": (lambda p: _dgp("--view", "-vtv -vp 1 1 1 -vd 0 1 0"), "expected a fisheye"),
    "dgp, view file": (lambda p: _dgp("--view", "none.vf"), "none.vf: --view: cannot be read"),
    "dgp, --space": (lambda p: _dgp("--space", ""), "--space: expected the name"),
    "dgp, folder": (lambda p: _dgp("--out", p.folder), "--out: "),
    "dgp, no weather": (lambda p: ["dgp", "house.ifc", "--out", "out"], "--weather is required"),
    "comply, head": (lambda p: _comply(building="word.ifc"), "word.ifc: not an IFC file"),
    "comply, weather": (lambda p: _comply("--weather", "short.epw"), SHORT),
    "comply, rule": (lambda p: _comply("--standard", "en17073"), "--standard: no rule 'en17073'"),
    "comply, BSDF": (lambda p: _comply("--cfs", "bad.xml"), "bad.xml: is not well-formed"),
    "comply, --closed": (lambda p: _comply("--closed", "bad.xml"), "bad.xml: is not well-formed"),
    "comply, --uses": (lambda p: _comply("--uses", "pv.toml"), "pv.toml: module: no such key"),
    "comply, --day": (lambda p: _comply("--day", "12-21"), "expected a day from 02-01 to 03-21"),
    "comply, --space": (lambda p: _comply("--space", ""), "--space: expected the name"),
    "comply, --write-ifc": (lambda p: _comply("--write-ifc", "none/a.ifc"), "no such folder"),
    "comply, folder": (lambda p: _comply("--out", p.folder), "--out: "),
    "picture, no weather": (
        lambda p: ["picture", "house.ifc", "--at", "06-21 12:00", "--out", "a.hdr"],
        "--weather is required",
    ),
    "thermal, box without a system": (
        lambda p: ["thermal", _box_study(p), "--out", "out"],
        "system: is missing; a box holds no fenestration data",
    ),
    "picture, head": (lambda p: _picture(building="word.ifc"), "word.ifc: not an IFC file"),
    "picture, weather": (lambda p: _picture("--weather", "short.epw"), SHORT),
    "picture, BSDF": (lambda p: _picture("--cfs", "bad.xml"), "bad.xml: is not well-formed"),
    "picture, view": (lambda p: _picture("--view", "-vta -vh 400"), "illegal size"),
    "picture, --at": (lambda p: _picture(at="noon"), "expected month, day and hour"),
    "picture, --out": (lambda p: _picture("--out", "none/a.hdr"), "no such folder"),
    "check, head": (lambda p: ["check", "word.ifc"], "word.ifc: not an IFC file"),
    "check, --csv": (lambda p: ["check", "house.ifc", "--csv", "none/a"], "no such fol"),
    "ifc attach, BSDF": (
        lambda p: ["ifc", "attach", "house.ifc", "--all", "--bsdf", "bad.xml", "-o", "b.ifc"],
        "bad.xml: is not well-formed",
    ),
    "export, --gltf": (lambda p: ["export", "house.ifc", "--gltf", "none/a.glb"], "no such folder"),
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Place:
    """The folder, as the current one; a building that is opened fails the test."""
    import bim.ifc.project

    for name in OPENING:  # one that is first imported now would keep what is planted for good
        importlib.import_module(name)

    def opened(path: object) -> None:
        raise AssertionError(f"the building {path} was read before the mistake was named")

    for name in ("open_ifc", "open_all"):
        real = getattr(bim.ifc.project, name)  # which the loop replaces too, at its turn
        for module in list(sys.modules.values()):  # wherever it has been imported to
            if getattr(module, name, None) is real:
                monkeypatch.setattr(module, name, opened)
        monkeypatch.setattr(bim.ifc.project, name, opened)
    monkeypatch.setattr(bim.ifc.project.ifcopenshell, "open", opened)
    monkeypatch.chdir(tmp_path)
    return Place(tmp_path)


@pytest.mark.parametrize(("call", "words"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_named_before_the_building_is_read(place, capsys, call, words) -> None:
    assert cli.run([str(word) for word in call(place)]) in (1, 2)
    said = capsys.readouterr().err
    assert words in said and len(said.splitlines()) == 1, said
    assert not (place.folder / "out").exists()


def test_the_planted_building_is_seen_when_it_is_read(place, capsys) -> None:
    """Without a mistake the building is read, and that fails: the test above can fail."""
    try:
        cli.run([str(word) for word in _run()])
        said = capsys.readouterr().err  # the reader took it for a fault of the file
    except AssertionError as error:
        said = str(error)
    assert "was read before" in said


def _loaded(words: list[str], folder: Path) -> set[str]:
    """Modules in memory when `cfs` has ended, in a process of its own."""
    code = (
        "import json, sys\nfrom scenes import cli\ntry:\n"
        f"    cli.run({words!r})\n"
        "finally:\n    print('\\n' + json.dumps(sorted(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=folder)
    return set(json.loads(done.stdout.splitlines()[-1]))


def _commands() -> list[list[str]]:
    """The words of every command and subcommand."""
    found, context = [[]], click.Context(cli.cfs)
    for name in cli.cfs.list_commands(context):
        command = cli.cfs.get_command(context, name)
        found.append([name])
        found += [[name, inner] for inner in getattr(command, "commands", {})]
    return found


@pytest.mark.parametrize("words", _commands(), ids=" ".join)
def test_help_loads_nothing_heavy(words: list[str], tmp_path: Path) -> None:
    loaded = _loaded([*words, "--help"], tmp_path)
    assert not set(NOT_FOR_HELP) & loaded


@pytest.mark.parametrize(
    "name",
    [
        "run, night",
        "run, BSDF",
        "thermal, g",
        "study, g",
        "design, rule",
        "pv, datasheet",
        "dgp, BSDF",
        "picture, BSDF",
        "ifc attach, BSDF",
    ],
)
def test_a_mistake_is_found_before_anything_heavy_is_loaded(name: str, tmp_path: Path) -> None:
    words = [str(word) for word in MISTAKES[name][0](Place(tmp_path))]
    assert not set(HEAVY) & _loaded(words, tmp_path)


def test_the_demos_inputs_are_no_mistake() -> None:
    from scenes.room.options import RoomOptions
    from scenes.run.files import read_files
    from scenes.run.options import JobOptions

    room = RoomOptions.of(picture_hours=("06-21 12",))
    found = read_files(JobOptions(OFFICE, WEATHER, VENETIAN_BLIND, room=room))
    assert found.overrides.states and len(found.weather.times) == 8760
