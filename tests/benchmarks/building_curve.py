"""Error of hourly illuminance against time: `cfs run`, Radiance's `rfluxmtx` and honeybee's recipes.

    python -m tests.benchmarks building_curve BUILDING.ifc --weather CITY.epw --recipes VENV/bin \
        --space 111 --space 103 [--tau 0.6] [--before CHECKOUT] [--keep FOLDER] [--figure FILE.png]

The rooms are exported once with `cfs export --honeybee`.  This model is the input of all: `cfs run`
reads it; `cfs export --radiance` writes the folders whose `run.sh` runs `rfluxmtx`, `rmtxop` and
`rcontrib` by the three- or the five-phase method; the recipes of lbt-recipes (`lbt-recipes` in VENV/bin) get it
with a grid of the same sensors.  `run.sh` works on two rooms at a time, the recipe has two workers,
`cfs run` one core.

Error: root mean square difference of all sensors and hours, divided by the reference's mean.  There
are two references, a converged `cfs run` and a converged recipe, both with another seed or more rays
than any run of the curve.  Processor seconds are those of the command and all that it starts;
`tracing` is what `cfs run` spends on daylight matrices, sun and illuminance, and what the peers'
`rcontrib` takes, which `rfluxmtx` starts.  `--before`: the `cfs` of an earlier version's checkout runs
too, by the command alone.  `--keep`: a run whose result is in FOLDER is not repeated.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tests.benchmarks import radiance
from tests.benchmarks.building import clocked, run_command
from tests.benchmarks.harness import THREADS, PeerFailed, PeerMissing

Light = dict[str, NDArray[np.float64]]  # illuminance [S, 8760] of each room [lx]

# of a run by the clock of `building`: the rest is reading, pictures, heat, files and report
TRACING = (
    "parts of windows",
    "D, D_d",
    "V, V_d of sensors",
    "V, D of rooms together",
    "windows that reflect",
    "straight view",
    "direct sun",
    "reflected sun",
    "illuminance",
)
PREVIEW = ["--quick", "--spacing", "0.5", "--set", "sky_subdivision=4"]


def _samples(factor: float) -> list[str]:
    """Options of the sample counts of `--quick` times a factor."""
    counts = {"sensor_samples": 2_048, "patch_samples": 1_024, "sun_points": 128}
    return [part for name, count in counts.items() for part in ("--set", f"{name}={round(count * factor)}")]


RUNS = {
    "--quick, samples / 8": [*PREVIEW, *_samples(1 / 8)],
    "--quick": PREVIEW,
    "--quick, samples x 8": [*PREVIEW, *_samples(8)],
    "--error 5%": ["--error", "5%"],
}
ONE_CORE = ("taskset", "-c", "0")  # where no thread of Dr.Jit waits for work by polling, 10 ms after each launch
BEFORE = "cfs run, before"
OF_BEFORE = ("--quick", "--quick, samples x 8")
OURS_CONVERGED = [*PREVIEW, *_samples(64), "--seed", "7"]
# variables of run.sh: method, rays of a sensor, of a window's direction, bounces
RFLUXMTX = {
    "three-phase, -ad 500": {"PHASES": 3, "INDOORS": 500, "OUTDOORS": 100, "BOUNCES": 6},
    "three-phase, -ad 2000": {"PHASES": 3, "INDOORS": 2_000, "OUTDOORS": 200, "BOUNCES": 6},
    "three-phase, -ad 8000": {"PHASES": 3, "INDOORS": 8_000, "OUTDOORS": 500, "BOUNCES": 6},
    "five-phase, -ad 500": {"PHASES": 5, "INDOORS": 500, "OUTDOORS": 100, "STRAIGHT": 500, "BOUNCES": 6},
    "five-phase, -ad 8000": {"PHASES": 5, "INDOORS": 8_000, "OUTDOORS": 500, "STRAIGHT": 500, "BOUNCES": 6},
}
SIMPLE, ENHANCED = "annual-daylight", "annual-daylight-enhanced"
RECIPES = {  # the default; levels of Ladybug Tools (`recommended_parameters` of rfluxmtx)
    "annual-daylight, default": (SIMPLE, "-ab 2 -ad 5000 -lw 2e-05 -dr 0"),
    "enhanced, default": (ENHANCED, "-ab 2 -ad 5000 -lw 2e-05 -dr 0"),
    "enhanced, -ab 6 -ad 1000": (ENHANCED, "-ab 6 -ad 1000 -lw 1e-4 -dr 0"),
    "enhanced, -ab 6 -ad 5000": (ENHANCED, "-ab 6 -ad 5000 -lw 2e-05 -dr 0"),
}
RECIPE_CONVERGED = (ENHANCED, "-ab 8 -ad 25000 -lw 4e-06 -dr 0")


@dataclass(frozen=True, slots=True)
class Point:
    """One run of the curve: what it took, without its result."""

    program: str
    settings: str
    processor: float  # of the command and all that it started [s]
    elapsed: float  # [s]
    tracing: float  # processor seconds of it


@dataclass(frozen=True)
class Building:
    """The model that all programs read, the weather and the folder of the results."""

    model: Path  # the export, with grids of the sensors
    rooms: Path  # folders of the Radiance export
    weather: Path
    recipes: Path  # the folder of lbt-recipes
    folder: Path

    @property
    def sensors(self) -> dict[str, int]:
        """Number of sensors by room."""
        return {
            room.name: len((room / "sensors.pts").read_text().splitlines())
            for room in sorted(self.rooms.iterdir())
            if room.is_dir()
        }


def exported(building: Path, weather: Path, space: Sequence[str], tau: float, recipes: Path, folder: Path) -> Building:
    """Export the rooms and give the honeybee model a grid of the sensors of `cfs run`."""
    model, rooms = folder / "model.hbjson", folder / "rooms"
    if not model.exists():
        named = [text for one in space for text in ("--space", one)]
        plain = folder / "plain.hbjson"
        _cfs(["export", str(building), *named, "--tau", str(tau), "--honeybee", str(plain)])
        _cfs(["export", str(plain), "--radiance", str(rooms), "--subdivision", "4"])
        data = json.loads(plain.read_text("utf-8"))
        data["properties"]["radiance"]["sensor_grids"] = [
            _grid(room) for room in sorted(rooms.iterdir()) if room.is_dir()
        ]
        model.write_text(json.dumps(data), "utf-8")
    return Building(model, rooms, weather, recipes, folder)


def _grid(room: Path) -> dict[str, object]:
    rows = [[float(value) for value in line.split()] for line in (room / "sensors.pts").read_text().splitlines()]
    sensors = [{"type": "Sensor", "pos": row[:3], "dir": row[3:]} for row in rows]
    return {"type": "SensorGrid", "identifier": room.name, "display_name": room.name, "sensors": sensors}


def _cfs(arguments: Sequence[str]) -> None:
    subprocess.run([sys.executable, "-m", "scenes.cli", *arguments], check=True, stdout=subprocess.DEVNULL)


def of_run(building: Building, options: Sequence[str], place: Path) -> tuple[Light, float]:
    """Illuminance of `cfs run`, and the processor seconds of its tracing."""
    report = place / "tracing.txt"
    code = f"import sys; from {__name__} import write_tracing; write_tracing(sys.argv[1], sys.argv[2:])"
    arguments = [*ONE_CORE, sys.executable, "-c", code, str(report), *_run_line(building, options, place)]
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
    return _of_rooms(place / "out"), float(report.read_text())


def of_before(building: Building, checkout: Path, options: Sequence[str], place: Path) -> tuple[Light, float]:
    """The same of an earlier version, whose tracing has no clock."""
    arguments = [*ONE_CORE, str(checkout / ".venv" / "bin" / "cfs"), *_run_line(building, options, place)]
    subprocess.run(arguments, cwd=checkout, check=True, stdout=subprocess.DEVNULL)
    return _of_rooms(place / "out"), np.nan


def _run_line(building: Building, options: Sequence[str], place: Path) -> list[str]:
    line = [str(building.model), "--weather", str(building.weather), "--out", str(place / "out")]
    return ["run", *line, "--sun-model", "radiance", "--processes", "1", "--no-cache", "--no-colour", *options]


def _of_rooms(folder: Path) -> Light:
    """Hourly illuminance of a run's rooms."""
    files = sorted(folder.glob("*/illuminance.parquet"))
    return {file.parent.name: pd.read_parquet(file).to_numpy().T for file in files}


def write_tracing(report: str, arguments: Sequence[str]) -> None:
    """Run a line of `cfs` in this process and write the processor seconds of its tracing."""
    with clocked() as clock:
        run_command(arguments)
    Path(report).write_text(f"{sum(clock.parts[part].seconds for part in TRACING)}")


def of_rfluxmtx(building: Building, settings: dict[str, int], place: Path) -> tuple[Light, float]:
    """Illuminance of the folders' `run.sh` two rooms at a time."""
    environment, times = _radiance(place)
    rooms = place / "rooms"
    shutil.copytree(building.rooms, rooms)
    wea = place / "weather.wea"
    subprocess.run(["epw2wea", str(building.weather), str(wea)], env=environment, check=True)
    environment |= {"MATERIALS": "grey.rad", **{name: str(value) for name, value in settings.items()}}

    def one(name: str) -> NDArray[np.float64]:
        _checked(["sh", "run.sh", str(wea)], environment, rooms / name)
        return np.loadtxt(rooms / name / "illuminance.txt")

    with ThreadPoolExecutor(THREADS) as pool:
        light = dict(zip(building.sensors, pool.map(one, building.sensors), strict=True))
    return light, _traced(times)


def of_recipe(building: Building, recipe: tuple[str, str], place: Path) -> tuple[Light, float]:
    """Illuminance of a recipe of lbt-recipes with two workers, its sensors divided among them."""
    environment, times = _radiance(place)
    environment["PATH"] = f"{place / 'radiance' / 'bin'}{os.pathsep}{building.recipes}{os.pathsep}{os.environ['PATH']}"
    environment["PYTHONPATH"] = ""
    name, parameters = recipe
    wea = place / "weather.wea"
    subprocess.run(["epw2wea", str(building.weather), str(wea)], env=environment, check=True)
    least = -(-sum(building.sensors.values()) // THREADS)
    inputs = {"model": str(building.model), "wea": str(wea), "radiance-parameters": parameters}
    (place / "inputs.json").write_text(json.dumps({**inputs, "min-sensor-count": least}))
    command = [str(building.recipes / "lbt-recipes"), "run", name, str(place / "inputs.json")]
    # its exit code is left alone: version 0.29.1 ends with an error after the last step, when it
    # subtracts two times of day; a result that is missing is seen below
    subprocess.run([*command, "-p", str(place), "-w", str(THREADS)], env=environment, check=False, capture_output=True)
    results = place / name.replace("-", "_") / "results"
    if not results.is_dir():
        raise PeerFailed(f"{name}: no results in {results}")
    return _ladybug(results), _traced(times)


def _checked(command: Sequence[str], environment: dict[str, str], folder: Path) -> None:
    done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, check=False)
    if done.returncode:
        raise PeerFailed(f"{' '.join(command)}: {done.stderr.decode()[-800:]}")


def _radiance(place: Path) -> tuple[dict[str, str], Path]:
    """An environment with Radiance's programs, whose `rcontrib` writes its processor seconds to a file."""
    environment = radiance.environment()
    root = Path(environment["PATH"].split(os.pathsep)[0]).parent
    own, times = place / "radiance", place / "rcontrib.txt"
    (own / "bin").mkdir(parents=True)
    (own / "lib").symlink_to(root / "lib")
    for program in (root / "bin").iterdir():
        (own / "bin" / program.name).symlink_to(program)
    timed = own / "bin" / "rcontrib"
    timed.unlink()
    timed.write_text(
        "#!/bin/bash\nTIMEFORMAT='%U %S'\nexec 3>&2\n"
        f'{{ time "{root / "bin" / "rcontrib"}" "$@" 2>&3; }} 2>> "{times}"\n'
    )
    timed.chmod(0o755)
    environment["PATH"] = f"{own / 'bin'}{os.pathsep}{os.environ['PATH']}"
    environment["RAYPATH"] = f".{os.pathsep}{own / 'lib'}"
    return environment, times


def _traced(times: Path) -> float:
    return sum(float(word) for word in times.read_text().split())


def _ladybug(folder: Path) -> Light:
    """Hourly illuminance from a results folder of Ladybug Tools."""
    root = next(folder.rglob("grids_info.json")).parent
    hours = np.loadtxt(root / "sun-up-hours.txt").astype(int)  # in the middle or at the beginning
    light: Light = {}
    for grid in json.loads((root / "grids_info.json").read_text("utf-8")):
        year = np.zeros((grid["count"], 8760))
        year[:, hours] = np.load(next(root.rglob(f"total/{grid['full_id']}.npy")))
        light[grid["full_id"]] = year
    return light


def stored(building: Building, program: str, settings: str) -> Path:
    """Where the result of a run is kept, without the endings."""
    return building.folder / "results" / f"{program} {settings}".replace("/", "_").replace(" ", "-")


def _is_there(kept: Path) -> bool:
    return kept.with_name(f"{kept.name}.npy").exists()


def measured(
    building: Building, program: str, settings: str, work: Callable[[Path], tuple[Light, float]]
) -> tuple[Point, NDArray[np.float64]]:
    """Run once and keep what comes out, or return what was kept: the time and all sensors' hours [S, 8760]."""
    kept = stored(building, program, settings)
    if not _is_there(kept):
        kept.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=building.folder) as place:
            start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
            light, tracing = work(Path(place))
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            point = Point(program, settings, processor, time.perf_counter() - start, tracing)
        kept.with_name(f"{kept.name}.json").write_text(json.dumps(asdict(point)))
        np.save(
            kept.with_name(f"{kept.name}.npy"),
            np.concatenate([light[room] for room in building.sensors]).astype(np.float32),
        )
        print(
            f"{program}, {settings}: {point.processor:.1f} s of the processor, {point.tracing:.1f} tracing", flush=True
        )
    return Point(**json.loads(kept.with_name(f"{kept.name}.json").read_text())), np.load(
        kept.with_name(f"{kept.name}.npy")
    ).astype(float)


def curve(building: Building, *, before: Path | None = None, kept: bool = False) -> pd.DataFrame:
    """All runs with their times and errors; of those that are kept alone, with `kept`."""
    work: list[tuple[str, str, Callable[[Path], tuple[Light, float]]]] = []
    work += [("cfs run", name, partial(of_run, building, options)) for name, options in RUNS.items()]
    if before is not None:
        work += [(BEFORE, name, partial(of_before, building, before, RUNS[name])) for name in OF_BEFORE]
    work += [("rfluxmtx", name, partial(of_rfluxmtx, building, values)) for name, values in RFLUXMTX.items()]
    work += [("recipe", name, partial(of_recipe, building, recipe)) for name, recipe in RECIPES.items()]
    references = {
        "cfs run": measured(building, "cfs run", "converged", partial(of_run, building, OURS_CONVERGED))[1],
        "recipe": measured(building, "recipe", "converged", partial(of_recipe, building, RECIPE_CONVERGED))[1],
    }
    rows = []
    for program, settings, one in work:
        if kept and not _is_there(stored(building, program, settings)):
            continue
        point, light = measured(building, program, settings, one)
        errors = {name: relative_error(light, reference) for name, reference in references.items()}
        rows.append(
            {
                "program": program,
                "settings": settings,
                "processor s": point.processor,
                "tracing s": point.tracing,
                "elapsed s": point.elapsed,
                **{f"error to {name} %": 100 * error for name, error in errors.items()},
                "error %": 100 * float(np.sqrt(np.mean(np.square(list(errors.values()))))),
                **{f"yearly means to {name} %": 100 * yearly_error(light, r) for name, r in references.items()},
                "mean lx": light.mean(),
            }
        )
    return pd.DataFrame(rows)


def relative_error(light: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Root mean square difference of all sensors and hours, as a share of the reference's mean."""
    return float(np.sqrt(np.mean((light - reference) ** 2)) / reference.mean())


def yearly_error(light: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Root mean square over the sensors of the relative error of their yearly mean."""
    return float(np.sqrt(np.mean((light.mean(axis=1) / reference.mean(axis=1) - 1) ** 2)))


def ratios(table: pd.DataFrame) -> pd.DataFrame:
    """Of each run of a peer: the cheapest `cfs run` whose error is no larger, and the peer's times over its times."""
    of_cfs = table[table["program"] == "cfs run"]
    rows = []
    for _, peer in table[table["program"] != "cfs run"].iterrows():
        row = {"program": peer["program"], "settings": peer["settings"], "error %": peer["error %"]}
        for measure in ("processor s", "tracing s"):
            reached = of_cfs[of_cfs["error %"] <= peer["error %"]].sort_values(measure)
            row[measure] = peer[measure] / reached[measure].iloc[0] if len(reached) else np.nan
            row[f"cfs run by {measure}"] = reached["settings"].iloc[0] if len(reached) else "none"
        rows.append(row)
    return pd.DataFrame(rows)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Error against processor seconds, whole commands and tracing alone (PNG)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator

    figure = Figure(figsize=(9, 3.8), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, measure, title in zip(
        panels, ("processor s", "tracing s"), ("Whole command", "Tracing alone"), strict=True
    ):
        for program, rows in table.groupby("program", sort=False):
            by_time = rows.sort_values(measure)
            axes.plot(by_time[measure], by_time["error %"], "o-", label=program, markersize=4, linewidth=1)
            for _, row in by_time.iterrows() if program != BEFORE else ():  # as the points beside them
                at, last = (row[measure], row["error %"]), row[measure] == table[measure].max()
                side: dict[str, Any] = {"ha": "right", "xytext": (4, 5)} if last else {"xytext": (4, 4)}
                axes.annotate(row["settings"], at, textcoords="offset points", fontsize=5.5, **side)
        axes.set(xscale="log", yscale="log", xlabel="processor time [s]", title=title)
        axes.margins(x=0.3, y=0.15)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(LogLocator(subs=(2, 5)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("{x:g}")
            axis.set_tick_params(which="both", labelsize=6)
        axes.grid(alpha=0.3, which="both", linewidth=0.4)
    panels[0].set_ylabel("error of hourly illuminance [% of the mean]")
    panels[0].legend(fontsize=7)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def main(
    building: Path,
    *,
    weather: Path,
    recipes: Annotated[Path, "folder of the program lbt-recipes"],
    space: Sequence[str] = (),
    tau: Annotated[float, "visible transmittance of the windows"] = 0.6,
    before: Annotated[Path | None, "checkout of an earlier version, with its .venv"] = None,
    keep: Annotated[Path | None, "folder of results; those in it are not repeated"] = None,
    kept: Annotated[bool, "no run is made but the converged ones: only what is in --keep"] = False,
    figure: Annotated[Path | None, "PNG file to write"] = None,
) -> dict[str, pd.DataFrame]:
    """The curve, the ratios at equal error, and the figure."""
    if not (recipes / "lbt-recipes").exists():
        raise PeerMissing(f"no lbt-recipes in {recipes}: pip install lbt-recipes there")
    with tempfile.TemporaryDirectory() as place:
        folder = (keep or Path(place)).absolute()
        folder.mkdir(exist_ok=True)
        paths = (building.absolute(), weather.absolute())
        model = exported(*paths, space, tau, recipes.absolute(), folder)
        table = curve(model, before=None if before is None else before.absolute(), kept=kept)
    if figure is not None:
        draw(table, figure)
    return {"Time and error": table, "Time of the peer / time of cfs run": ratios(table)}
