"""Every command that writes: how it is called, what it writes, the place that it writes to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from _pytest.mark.structures import ParameterSet

from mitsuba_cfs.files import TEMPORARY
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import fisheye
from scenes import cli
from scenes.demo import OFFICE, STUDY, VENETIAN_BLIND, WEATHER
from scenes.explore.case_files import CASE
from scenes.explore.folder import write_data
from tests.conftest import REPOSITORY
from tests.scenes.study_files import FEW_RAYS, study_file
from tests.thermal.test_study import study_file as thermal_file

PV_STUDY = REPOSITORY / "scenes" / "demo" / "facade_pv.toml"
CONTROLLED = STUDY.with_name("controlled.toml")
ONE_LINE = 1


@dataclass(frozen=True)
class Job:
    """How a command is called, and what it writes."""

    words: Callable[[Path, Path], list[object]]  # of the folder of inputs and the output
    name: str = "out"  # of the output
    folder: bool = False
    adds: bool = False  # to a folder that may hold anything


def to_folder(*words: object, **options) -> Job:
    """A job that writes a folder of results."""
    return Job(lambda _inputs, out: [*words, "--out", out], folder=True, **options)


def _study(inputs: Path, out: Path) -> list[object]:
    return ["study", study_file(inputs, "orientations_deg = [0, 90]\n"), "--out", out]


def _fit(inputs: Path, out: Path) -> list[object]:
    """Temperatures of two days that rise evenly, and the air change."""
    study = thermal_file(inputs, "")
    rows = [f"2017-05-{day:02d}T{hour:02d}:00,{20 + day + hour / 24:.3f}\n" for day in (2, 3) for hour in range(24)]
    (inputs / "measured.csv").write_text("time,air\n" + "".join(rows))
    file = inputs / "fit.toml"
    head = f'study = "{study.name}"\nmeasured = "measured.csv"\n'
    head += '[[measurement]]\ncolumn = "air"\nquantity = "air temperature"\n'
    file.write_text(head + '[[parameter]]\nkey = "air.infiltration_ach"\nmean = 0.5\ndeviation = 0.2\nlow = 0.02\n')
    return ["fit", file, "--out", out]


def _design(inputs: Path, out: Path) -> list[object]:
    head = '[[variable]]\nkey = "room.box.window.width"\nvalues = [1.0, 2.0]\n'
    head += '[[objective]]\nname = "daylight autonomy"\n[search]\nevaluations = 4\nrepeats = 0\n'
    return ["design", study_file(inputs, rest=FEW_RAYS + head), "--out", out]


def _explorer(inputs: Path) -> Path:
    """A folder of results with an explorer of no room."""
    results = inputs / "results"
    (results / "data").mkdir(parents=True, exist_ok=True)
    write_data(results / CASE, {"title": "A", "hours": 8760, "rooms": []})
    return results


def _goniophotometer(inputs: Path, out: Path) -> list[object]:
    rows = [f"{180 - theta} {phi} 0.2" for theta in (10, 40, 70) for phi in (0, 90, 180, 270)]
    head = ["#format: theta phi BSDF", "#incident_angle 30 0"]
    (inputs / "sample.txt").write_text("\n".join([*head, *rows]) + "\n")
    words = ["--basis", "quarter", "--out", out]
    return ["bsdf", "interpolate", inputs / "sample.txt", *words]


def _layers(inputs: Path, out: Path) -> list[object]:
    slats = "[[layers]]\nslats = { width = 0.08, spacing = 0.072, visible = 0.5 }\ngap = { width = 0.1 }\n"
    pane = "[[layers]]\nthickness = 0.004\nsolar = [0.84, 0.075, 0.075]\n"
    (inputs / "layers.toml").write_text(slats + pane)
    return ["bsdf", "system", inputs / "layers.toml", "--paths", 16, "--out", out]


def _corrected(inputs: Path, out: Path) -> list[object]:
    (inputs / "office.ifc").write_bytes(OFFICE.read_bytes())
    (inputs / "office.corrections.toml").write_text("north = 30.0\n")
    return ["ifc", "correct", inputs / "office.ifc", "--out", out]


def _measured(inputs: Path, out: Path) -> list[object]:
    rows = "time,global_horizontal,diffuse_horizontal\n2020-06-21 12:00,500,200\n"
    (inputs / "m.csv").write_text(rows + "2020-06-21 13:00,500,200\n")
    place = ["--latitude", 49, "--longitude", 8, "--timezone", 1]
    return ["sky", "measured", inputs / "m.csv", out, *place]


def _glare(option: str) -> Callable[[Path, Path], list[object]]:
    def words(inputs: Path, out: Path) -> list[object]:
        view = fisheye([0, 0, 1], [0, 1, 0], 64)
        write_hdr(inputs / "desk.hdr", np.full((64, 64), 500.0, np.float32), view)
        return ["glare", option, out, inputs / "desk.hdr"]

    return words


GENERATE = "bsdf generate --depth-mm 80 --spacing-mm 72 --visible 0.5 --out".split()
JOBS = {
    "run": to_folder("run", OFFICE, "--weather", WEATHER, "--cfs", VENETIAN_BLIND),
    "demo": to_folder("demo"),
    "thermal": Job(lambda inputs, out: ["thermal", thermal_file(inputs, ""), "--out", out], folder=True),
    "comply": to_folder("comply", OFFICE, "--weather", WEATHER, "--standard", "en17037"),
    "comply --write-ifc": Job(
        lambda inputs, out: [
            "comply",
            OFFICE,
            "--weather",
            WEATHER,
            "--standard",
            "en17037",
            "--out",
            inputs / "results",
            "--write-ifc",
            out,
        ],
        "out.ifc",
    ),
    "pv": to_folder("pv", OFFICE, "--weather", WEATHER, "--study", PV_STUDY),
    "site neighbours": to_folder(
        "site", "neighbours", OFFICE, "--weather", WEATHER, "--proposed", REPOSITORY / "tests/site/tower.obj"
    ),
    "site reflections": to_folder(
        "site", "reflections", OFFICE, "--weather", WEATHER, "--points", REPOSITORY / "tests/site/street.csv"
    ),
    "dgp": to_folder("dgp"),
    "explore": Job(lambda inputs, out: ["explore", _explorer(inputs), "--out", out], folder=True),
    "study": Job(_study, folder=True),
    "design": Job(_design, folder=True),
    "fit": Job(_fit, folder=True),
    "study --write-ifc": Job(
        lambda inputs, out: ["study", _study_of_the_office(inputs), "--out", inputs / "results", "--write-ifc", out],
        "out.ifc",
    ),
    "check": Job(lambda _, out: ["check", OFFICE, "--csv", out], "out.csv"),
    "check --html": Job(lambda _, out: ["check", OFFICE, "--html", out], "out.html"),
    "check --json": Job(lambda _, out: ["check", OFFICE, "--json", out], "out.json"),
    "check --bcf": Job(lambda _, out: ["check", OFFICE, "--bcf", out], "out.bcfzip"),
    "ifc correct": Job(_corrected, "out.ifc"),
    "ifc attach": Job(lambda _, out: ["ifc", "attach", OFFICE, "--all", "--u", 1.1, "-o", out], "out.ifc"),
    "ifc control": Job(lambda _, out: ["ifc", "control", OFFICE, CONTROLLED, "-o", out], "out.ifc"),
    "export --radiance": Job(lambda _, out: ["export", OFFICE, "--radiance", out], folder=True, adds=True),
    "export --mitsuba": Job(lambda _, out: ["export", OFFICE, "--mitsuba", out], folder=True, adds=True),
    "export --epjson": Job(lambda _, out: ["export", OFFICE, "--epjson", out], "out.epJSON"),
    "export --honeybee": Job(lambda _, out: ["export", OFFICE, "--honeybee", out], "out.hbjson"),
    "export --gbxml": Job(lambda _, out: ["export", OFFICE, "--gbxml", out], "out.xml"),
    "export --gltf": Job(lambda _, out: ["export", OFFICE, "--gltf", out], "out.glb"),
    "ifc templates": to_folder("ifc", "templates"),
    "ifc bonsai": Job(lambda _, out: ["ifc", "bonsai", "--out", out], "out.zip"),
    "ifc info": Job(lambda _, out: ["ifc", "info", OFFICE, "--json", out], "out.json"),
    "ifc survey": Job(lambda _, out: ["ifc", "survey", OFFICE, "--markdown", out], "out.md"),
    "bsdf plot": Job(lambda _, out: ["bsdf", "plot", VENETIAN_BLIND, "--incident", 40, 0, "--out", out], "out.png"),
    "bsdf thermal": Job(lambda _, out: ["bsdf", "thermal", VENETIAN_BLIND, "--out", out], "out.csv"),
    "bsdf thermal --toml": Job(lambda _, out: ["bsdf", "thermal", VENETIAN_BLIND, "--toml", out], "out.toml"),
    "bsdf generate": Job(lambda _, out: [*GENERATE, out], "out.xml"),
    "bsdf system": Job(_layers, "out.xml"),
    "bsdf library": Job(lambda _, out: ["bsdf", "library", "--glazing", "triple low-e", "--out", out], "out.xml"),
    "bsdf interpolate": Job(_goniophotometer, "out.xml"),
    "bsdf combine": Job(lambda _, out: ["bsdf", "combine", VENETIAN_BLIND, VENETIAN_BLIND, "--out", out], "out.xml"),
    "bsdf combine --absorptances": Job(
        lambda inputs, out: [
            "bsdf",
            "combine",
            VENETIAN_BLIND,
            VENETIAN_BLIND,
            "--out",
            inputs / "both.xml",
            "--absorptances",
            out,
        ],
        "out.csv",
    ),
    "sky matrix": Job(lambda _, out: ["sky", "matrix", WEATHER, out, "-5", "-m", 1], "out.smx"),
    "sky positions": Job(lambda _, out: ["sky", "positions", WEATHER, out], "out.csv"),
    "sky wea": Job(lambda _, out: ["sky", "wea", WEATHER, out], "out.wea"),
    "sky measured": Job(_measured, "out.wea"),
    "sky cie": Job(lambda _, out: ["sky", "cie", "overcast", out], "out.smx"),
    "glare -c": Job(_glare("-c"), "out.hdr"),
    "glare --csv": Job(_glare("--csv"), "out.csv"),
    "glare --png": Job(_glare("--png"), folder=True, adds=True),
    **{
        f"picture {kind}": Job(lambda _, out: ["picture", "--at", "06-21 12:00", "--out", out], f"out.{kind}")
        for kind in ("hdr", "exr", "png")
    },
    "calibrate": Job(lambda _, out: ["calibrate", "--out", out], "out.json"),
}
# they take ten seconds and more; the same code writes for the others, which stay quick
HEAVY = ("study", "design", "fit", "study --write-ifc", "demo", "pv", "ifc survey", "comply", "comply --write-ifc")


def heavy_ones_slow(names: Iterable[str]) -> list[ParameterSet]:
    """The names as parameters, the heavy jobs among them only in the slow set."""
    return [pytest.param(name, marks=pytest.mark.slow if name in HEAVY else ()) for name in names]


FOLDERS = [name for name, job in JOBS.items() if job.folder]
OWN = [name for name in FOLDERS if not JOBS[name].adds]
FILES = [name for name, job in JOBS.items() if not job.folder]


def _study_of_the_office(inputs: Path) -> Path:
    path = study_file(inputs)
    text = path.read_text()
    start, end = text.index("[[room]]"), text.index("[[system]]")
    path.write_text(text[:start] + f'[[room]]\nbuilding = "{OFFICE}"\n' + text[end:])
    return path


@dataclass
class Place:
    """A folder of inputs, and the output of one command in another folder."""

    job: Job
    inputs: Path
    out: Path

    @property
    def words(self) -> list[str]:
        """What follows `cfs`."""
        return [str(word) for word in self.job.words(self.inputs, self.out)]

    def content(self) -> dict[str, bytes]:
        """Every file beside and in the output, but for what a study or a year keeps on the way."""
        root = self.out.parent
        found = {p.relative_to(root).as_posix(): p for p in root.rglob("*") if p.is_file()}
        return {
            name: path.read_bytes()
            for name, path in found.items()
            if not {"cases", "ratings", "filler"} & set(name.split("/"))
        }

    def newest(self) -> float:
        """When the last file of the output was written [s since 1970]."""
        return max(p.stat().st_mtime for p in (self.out, *self.out.rglob("*")) if p.is_file())

    def temporaries(self) -> list[Path]:
        """What is left of unfinished work."""
        roots = (self.out.parent, self.inputs)
        return [p for root in roots for p in root.rglob("*") if TEMPORARY.fullmatch(p.name)]


def refused(place: Place, capsys, *words: str, code: int = 1) -> str:
    """The one line of a command that fails."""
    capsys.readouterr()
    assert cli.run(place.words) == code
    told = capsys.readouterr().err
    lines = [line for line in told.splitlines() if line.startswith(("error", "cfs"))]
    assert len(lines) == ONE_LINE and "Traceback" not in told, told
    assert all(word in lines[0] for word in words), lines
    assert not place.temporaries()
    return lines[0]
