"""Every command on its own way from its options to its files, with made-up results for its rays.

`python -m tests.scenes.quick_work COMMAND...` is such a `cfs`.  With CFS_TEST_STOP=FILE it makes
that file and stands still just before the first result takes its place.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from mitsuba_cfs.files import TEMPORARY

STOP = "CFS_TEST_STOP"


def _run_job(_options, *_others, **_more):
    from tests.report.synthetic import run_result

    result = run_result(picture_size=64, pictures=1)
    spaces = []
    for room in result.spaces:
        metrics = room.daylight.room_metrics | {"sda300_50": 50.0, "da300": 50.0}
        spaces.append(replace(room, daylight=replace(room.daylight, room_metrics=metrics)))
    return replace(result, spaces=tuple(spaces))


def _thermal(_study, *_others, **_options):
    hours = pd.DataFrame({"air_c": np.linspace(15.0, 30.0, 8760)})
    summary = dict.fromkeys(
        ("operative_min_c", "operative_max_c", "heat_kwh", "cold_kwh", "comfortable_h ASHRAE 55 80 %", "occupied_h"),
        1.0,
    )
    room = SimpleNamespace(
        name="A",
        floor_area=10.0,
        hours=hours,
        summary=summary,
        months=pd.DataFrame({"discomfort": np.zeros(12)}),
        design=None,
        powers=pd.DataFrame({"heat": np.zeros(8760)}),
        energy=pd.DataFrame({"heat [kWh]": np.zeros(12)}),
    )
    return (room,), ()


def _compliance(options, *_others, **_more):
    from scenes.comply.findings import calendar_of
    from scenes.comply.results import Compliance
    from scenes.comply.sunlight import sun_day
    from scenes.head import NO_HEAD
    from scenes.input_files import read_building, read_weather

    weather, building = read_weather(options.weather), read_building(options.building)
    rooms = tuple(_checked(space) for space in building.spaces)
    return Compliance(
        building, {}, rooms, (), calendar_of(weather), weather, sun_day(weather, 3, 21, 11.0), (), NO_HEAD, (), (), {}
    )


def _checked(space):
    from scenes.comply.results import CheckedRoom
    from scenes.comply.uses import RoomUse

    return CheckedRoom(space, RoomUse("office", True, "made up"), (), None, None, None)


def _pv(_options, files, _study, **_others):
    yields = pd.DataFrame(
        {
            "subsystem": ["roof"],
            "modules": [1],
            "peak_kw": [1.0],
            "yield_kwh": [900.0],
            "kwh_per_kw": [900.0],
            "mismatch_loss": [0.01],
        }
    )
    steps = np.arange(100)
    return SimpleNamespace(
        weather=files.weather,
        irradiance=SimpleNamespace(steps=steps, diffuse_error=0.01),
        yields=(SimpleNamespace(name="roof", alternating_current=np.ones(100)),),
        issues=(),
        yield_table=lambda: yields,
        module_table=lambda: yields,
    )


def _read_year(options, *_others):
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.metrics.schedules import working_hours
    from mitsuba_cfs.sky.epw import read_epw
    from scenes.year_of_glare.views import NamedView
    from scenes.year_of_glare.year import GlareYear

    weather = read_epw(options.weather)
    views = [NamedView("eye001_1", fisheye([0, 0, 1], [0, 1, 0], 64))]
    sky = SimpleNamespace(lit=np.arange(100, 4000, 100))
    used = working_hours(weather, 8.0, 18.0)
    return GlareYear(options, "A", views, None, None, weather, sky, used, options.metric)


def _rate_views(year, kept, _progress):
    from mitsuba_cfs.glare.evaluation import evaluate
    from scenes.year_of_glare.year import FIGURES, ViewYear

    times = year.weather.midpoints[year.sky.lit]
    ratings = pd.DataFrame({name: np.linspace(0.2, 0.5, len(times)) for name in FIGURES}, times)
    (kept / "0123456789abcdef01234567.npy").write_bytes(b"ratings")
    picture = np.full((64, 64), 500.0, np.float32)
    rated = evaluate(picture, year.views[0].view)
    worst = year.sky.lit[0 if year.options.seed == 0 else 1]  # other hours with another seed
    yield ViewYear(year.views[0], ratings, {year.weather.midpoints[worst]: (picture, rated)}, 1.0, {})


def _room_picture(_options, *_others):
    from mitsuba_cfs.glare.evaluation import evaluate
    from mitsuba_cfs.images.view import fisheye
    from scenes.view_picture import RoomPicture

    view = fisheye([0, 0, 1], [0, 1, 0], 64)
    luminance = np.full((64, 64), 500.0, np.float32)
    rated = evaluate(luminance, view)
    return RoomPicture(luminance, view, "A", pd.Timestamp("2000-06-21 12:30"), glare=rated)


def _calibrated(size, **_options):
    from scenes.calibration.costs import Calibration
    from scenes.cost.measure import Cost

    return Calibration("m", "now", size, (Cost("five-phase", "DGP", 1.0, 1.0, 1.0),))


def _generated_file(**_options):
    from mitsuba_cfs.bsdf.xml import read_bsdf_xml
    from scenes.demo import VENETIAN_BLIND

    return read_bsdf_xml(VENETIAN_BLIND), "made up", None


def _case(case, *, progress=None):
    from scenes.study.store import CaseResult
    from tests.scenes.study_noted import SAID

    return CaseResult(case.key, {"angle": case.orientation_deg} | dict.fromkeys(SAID, 0.0))


def _study_report(_result, path, _page):
    path.write_text("<html></html>")


WORK = {
    "scenes.run.run.run_job": _run_job,
    "scenes.heat.study.run_study": _thermal,
    "scenes.comply.comply.check_building": _compliance,
    "scenes.photovoltaics.study.run_pv": _pv,
    "scenes.photovoltaics.picture.view_directions": lambda _result: [],
    "scenes.year_of_glare.year.read_year": _read_year,
    "scenes.year_of_glare.year.rate_views": _rate_views,
    "scenes.view_picture.room_picture": _room_picture,
    "scenes.calibration.measure.calibrated": _calibrated,
    "scenes.bsdf_generation.generated_file": _generated_file,
    "scenes.study.one_case.compute_case": _case,
    "scenes.study_report.write_study_report": _study_report,
    "scenes.design.page.write_study_report": _study_report,  # imported by name, perhaps before
}


def quick_work(give: Callable[[object, str, object], object] = setattr, among: str = "") -> None:
    """Give the commands made-up results: `give(module, name, value)` for each function.

    Args: among: only for modules that this command needs; the others load for long.
    """
    needs = {
        "run": "scenes.run",
        "demo": "scenes.study",
        "thermal": "scenes.heat.study",
        "pv": "photovol",
        "comply": "scenes.comply",
        "dgp": "year_of_glare",
        "picture": "view_picture",
        "calibrate": "calibration",
        "bsdf": "bsdf_generation",
        "study": "scenes.study",
    }
    for name, function in WORK.items():
        if among and needs.get(among, "none") not in name:
            continue
        module, _, attribute = name.rpartition(".")
        give(import_module(module), attribute, function)
        if name.startswith("scenes.study.one_case"):
            give(import_module("scenes.study.study"), attribute, function)


def stop_before_the_first_result(announce: Path) -> None:
    """Stand still where the first finished file or folder is about to take its place."""
    for name in ("replace", "rename"):
        move = getattr(Path, name)

        def stopping(self, target, *, move=move):
            if not any(TEMPORARY.fullmatch(part) for part in Path(target).parts):
                announce.touch()
                end = time.monotonic() + 60
                while time.monotonic() < end and not signal.getitimer(signal.ITIMER_REAL)[0]:
                    time.sleep(0.05)  # a signal waits, by this timer, for a file to be whole
            return move(self, target)

        setattr(Path, name, stopping)


if __name__ == "__main__":
    import sys

    from scenes import cli

    quick_work(among=sys.argv[1])
    if STOP in os.environ:
        stop_before_the_first_result(Path(os.environ[STOP]))
    cli.main(sys.argv[1:])
