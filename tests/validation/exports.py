"""Buildings as HBJSON, gbXML and epJSON, run unedited by the programs that they are for.

    python -m tests.validation exports [FILES...] [--peers PYTHON] [--keep FOLDER]

By default four buildings of ../shared/data/ifc/buildings.  `cfs ifc attach` gives U and g alone to
the windows that face south, and the demo's venetian blind (BSDF, U, g) to the others; `cfs export
--tau` writes the three formats.  honeybee and OpenStudio are those of another Python (`pip install
honeybee-energy honeybee-radiance honeybee-openstudio openstudio`): honeybee checks the model and
writes its own input of EnergyPlus and its Radiance folder, which `oconv` compiles.  EnergyPlus (of
pyenergyplus-lbnl) runs each model for DAYS days as it was written, and is then stopped; its table
of the glazing is that of a copy that asks for it.

Columns: rooms; faults (of honeybee's own check, of gbXML's schema 7.03 in OpenStudio, severe errors
of EnergyPlus); EnergyPlus' warnings of surfaces that it drops or changes; then of the glazing the
area as a ratio, and the greatest differences of U, g, visible transmittance and BSDF.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from bim.exported_glazing import ExportedGlazing
from bim.ifc.building import read_ifc
from bim.model import Window
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from scenes.cli import run as cfs
from scenes.demo import VENETIAN_BLIND
from scenes.fenestration.systems import WindowOverrides
from scenes.fenestration_exports import known_fenestration
from tests.benchmarks import radiance

FOLDER = Path("../shared/data/ifc/buildings")
FILES = ("Duplex_A_20110907.ifc", "AC20-FZK-Haus.ifc", "House_Renga.ifc", "SampleHouse4_Revit_IFC4.ifc")
U_VALUE, G_VALUE, VISIBLE = 1.1, 0.5, 0.7  # of the windows without a BSDF
SOUTH, OTHERS = "134-226", "226-134"  # azimuths [deg]
DAYS = 2
COMPLEX = "Construction:ComplexFenestrationState"
GEOMETRY = ("egenerate", "olinear", "collapsed", "zero area", "not convex", "Dropping Vertex")
HEAD = (
    "| building | format | rooms | faults | surfaces | area | U | g | visible | BSDF |\n"
    "|---|---|---|---|---|---|---|---|---|---|"
)
RUN = """
import sys
from pyenergyplus.api import EnergyPlusAPI
api = EnergyPlusAPI(); state = api.state_manager.new_state()
api.runtime.set_console_output_status(state, False)
def stop(state):
    days = int(sys.argv[1])
    if not api.exchange.warmup_flag(state) and api.exchange.day_of_year(state) > days:
        api.runtime.stop_simulation(state)
api.runtime.callback_end_zone_timestep_after_zone_reporting(state, stop)
sys.exit(api.runtime.run_energyplus(state, sys.argv[2:]))
"""


@dataclass(frozen=True)
class Pane:
    """Glazing of a window as a program reads it."""

    area: float  # [m2]
    u_value: float | None  # [W/(m2 K)]
    g_value: float | None
    visible: float | None
    bsdf: np.ndarray | None = None  # [K, K] transmission from outdoors [1/sr]


def main(
    files: Sequence[Path] = tuple(FOLDER / name for name in FILES),
    *,
    peers: Annotated[Path | None, "Python that has honeybee and OpenStudio"] = None,
    keep: Annotated[Path | None, "folder for the files"] = None,
) -> None:
    """Print the table, a line for each building and format."""
    print(HEAD)
    for path in files:
        with tempfile.TemporaryDirectory() as temporary:
            folder = (keep or Path(temporary)) / path.stem
            folder.mkdir(parents=True, exist_ok=True)
            for line in rows(path, folder, peers):
                print(line, flush=True)


def rows(path: Path, folder: Path, peers: Path | None) -> list[str]:
    """The lines of one building."""
    attached = folder / "attached.ifc"
    attach(path, folder / "bsdf.ifc", "--facade", OTHERS, "--bsdf", str(VENETIAN_BLIND))
    values = ("--g", str(G_VALUE), "--u", str(U_VALUE))
    attach(folder / "bsdf.ifc", attached, "--facade", SOUTH, *values)
    files = {"--honeybee": "model.hbjson", "--gbxml": "model.xml", "--epjson": "model.epJSON"}
    words = [word for option, name in files.items() for word in (option, str(folder / name))]
    command("export", str(attached), "--tau", str(VISIBLE), *words)
    expected = known_panes(attached)
    result = []
    if peers is not None:
        script = Path(__file__).with_name("exports_peers.py")
        call = [str(peers), str(script), str(folder / "model.hbjson"), str(folder / "model.xml")]
        subprocess.run([*call, str(folder)], check=True, capture_output=True)
        read = json.loads((folder / "peers.json").read_text())
        for name, part in read.items():
            panes = [Pane(*one[1:5], bsdf_of(one[5], folder)) for one in part["panes"]]
            result.append((name, part["rooms"], len(part["faults"]), "-", panes))
        radiance.run(
            "oconv model/scene/*.mat model/scene/*.rad model/aperture/*.mat model/aperture/*.rad > scene.oct",
            folder / "radiance",
        )
    counts = energyplus(folder / "model.epJSON", folder / "energyplus")
    rooms = len(json.loads((folder / "model.epJSON").read_text())["Zone"])
    result.append(("epJSON", rooms, *counts, tabled_panes(folder)))
    return [row(path.stem, *one[:-1], differences(one[-1], expected)) for one in result]


def row(*cells: object) -> str:
    """A line of the table."""
    return f"| {' | '.join(map(str, cells[:-1]))} | {' | '.join(cells[-1])} |"


def attach(source: Path, target: Path, *options: str) -> None:
    """Attach data to windows by the command."""
    command("ifc", "attach", str(source), *options, "--out", str(target))


def command(*words: str) -> None:
    """Run a command of this program without its output; `RuntimeError` where it fails."""
    with contextlib.redirect_stdout(io.StringIO()):
        if cfs(list(words)):
            raise RuntimeError(f"cfs {' '.join(words)} failed")


def known_panes(path: Path) -> list[Pane]:
    """The windows as a run takes them."""
    building = read_ifc(path)
    overrides = WindowOverrides(visible=VISIBLE, light_only=True)
    known = known_fenestration(building.spaces, path, overrides).glazings()[0]
    return [pane_of(window, known[window.guid]) for window in building.windows]


def pane_of(window: Window, data: ExportedGlazing) -> Pane:
    """A window with its data."""
    bsdf = None if data.bsdf is None else data.bsdf.bands["Visible"].transmission_front
    return Pane(window.area, data.u_value, data.g_value, data.visible_transmittance, bsdf)


def bsdf_of(text: str | None, folder: Path) -> np.ndarray | None:
    """Transmission of a BSDF that a model holds as XML."""
    if text is None:
        return None
    path = folder / "read.xml"
    path.write_text(text)
    return read_bsdf_xml(path).bands["Visible"].transmission_front


def energyplus(model: Path, folder: Path, days: int = DAYS) -> tuple[int, int]:
    """Severe errors, and warnings of changed surfaces, of a run of some days."""
    folder.mkdir(exist_ok=True)
    call = [sys.executable, "-c", RUN, str(days), "-w", str(weather()), "-d", str(folder)]
    subprocess.run([*call, str(model)], check=False, capture_output=True)
    lines = (folder / "eplusout.err").read_text().splitlines()
    if not any("EnergyPlus Completed" in line or "Stopped" in line for line in lines):
        raise RuntimeError(f"{model}: {lines[-5:]}")
    severe = sum("** Severe" in line or "**  Fatal" in line for line in lines)
    return severe, sum(any(word in line for word in GEOMETRY) for line in lines)


def weather() -> Path:
    """The weather file that comes with EnergyPlus."""
    import pyenergyplus.api

    home = Path(pyenergyplus.api.__file__).parent
    return next((home / "data" / "weather").glob("*Chicago*.epw"))


def tabled_panes(folder: Path) -> list[Pane]:
    """EnergyPlus' table of the glazing, of a copy of the model that asks for it.

    It has neither g nor transmittance of a system with a BSDF: its matrix is that of the model.
    """
    model = json.loads((folder / "model.epJSON").read_text())
    report = {"reports": [{"report_name": "EnvelopeSummary"}]}
    model["Output:Table:SummaryReports"] = {"tables": report}
    model["OutputControl:Table:Style"] = {"style": {"column_separator": "Comma"}}
    year = model["RunPeriod"]["year"]
    year |= {"end_month": 1, "end_day_of_month": 1}
    copy = folder / "table"
    copy.mkdir(exist_ok=True)
    (copy / "model.epJSON").write_text(json.dumps(model))
    energyplus(copy / "model.epJSON", copy)
    with (copy / "eplustbl.csv").open(newline="") as stream:
        table = list(csv.reader(stream))
    start = next(i for i, line in enumerate(table) if line[:1] == ["Exterior Fenestration"])
    titles = next(line for line in table[start:] if "Construction" in line)
    columns = [
        titles.index(next(t for t in titles if t.startswith(name)))
        for name in ("Glass Area", "Glass U-Factor", "Glass SHGC", "Glass Visible")
    ]
    panes, construction = [], titles.index("Construction")
    systems = {name.upper(): name for name in model.get(COMPLEX, {})}
    for line in table[table.index(titles) + 1 :]:
        if len(line) < 2 or "Total" in line[1]:
            break
        area, u_value, *values = (float(line[c]) for c in columns)
        system = systems.get(line[construction])
        if system is None:
            panes.append(Pane(area, u_value, *values))
        else:
            matrix = model["Matrix:TwoDimension"][f"{system} visible front_transmittance"]
            numbers = [entry["value"] for entry in matrix["values"]]
            panes.append(Pane(area, u_value, None, None, np.reshape(numbers, (145, 145))))
    return panes


def differences(panes: Sequence[Pane], expected: Sequence[Pane]) -> list[str]:
    """Area as a ratio, and the greatest difference of each value; windows in order of values."""
    if not panes:
        return ["-"] * 5
    area = sum(p.area for p in panes) / sum(p.area for p in expected)
    cells = [f"{area:.4f}"]
    for field in ("u_value", "g_value", "visible"):
        is_partial = any(getattr(p, field) is None for p in panes)
        chosen = [[p for p in some if not (is_partial and p.bsdf is not None)] for some in (panes, expected)]
        if any(getattr(p, field) is None for p in chosen[0]) or not chosen[0]:
            cells.append("none")
            continue
        cells.append(f"{distance(*(by_value(some, field) for some in chosen)):.4f}")
    bsdfs = [[p for p in some if p.bsdf is not None] for some in (panes, expected)]
    if not bsdfs[0]:
        return [*cells, "-"]
    shares = [sum(p.area for p in some) for some in bsdfs]
    expected_bsdf = bsdfs[1][0].bsdf
    apart = max(float(np.abs(p.bsdf - expected_bsdf).max()) for p in bsdfs[0]) / expected_bsdf.max()
    return [*cells, f"{apart:.0e} on {shares[0] / shares[1]:.3f} of it"]


def by_value(panes: Sequence[Pane], field: str) -> list[tuple[float, float]]:
    """Values of the panes with their areas, in rising order."""
    return sorted((getattr(pane, field), pane.area) for pane in panes)


def distance(read: list[tuple[float, float]], expected: list[tuple[float, float]]) -> float:
    """Greatest difference of two values at one share of the area (0.5 to 99.5 %)."""
    shares = np.linspace(0.005, 0.995, 199)
    columns = []
    for pairs in (read, expected):
        values, areas = np.array(pairs, dtype=float).T
        columns.append(values[np.searchsorted(np.cumsum(areas) / areas.sum(), shares)])
    return float(np.abs(columns[0] - columns[1]).max())
