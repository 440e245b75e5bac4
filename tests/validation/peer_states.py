"""sDA, ASE and provision of rooms with blinds against honeybee-radiance-postprocess, with states.

    python -m tests.validation peer_states [--peer PYTHON] [--out FOLDER]

With `--peer`, the Python of an environment that has the peer (AGPL, no part of this project), the
rooms' arrays are written as its result folders, it is run, and its figures go to `peer.json`.
Without it the stored figures are compared.  The arrays are made here: what is judged is what is
done with them.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.metrics import lm83
from mitsuba_cfs.metrics.autonomy import area_share, daylight_autonomy
from mitsuba_cfs.metrics.schedules import daylight_hours, lm83_hours
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import WEATHER

FloatArray = NDArray[np.float64]

STORED = Path(__file__).parents[2] / "tests" / "reference" / "honeybee_states" / "peer.json"
ROOM = (9.0, 7.0, 3.0)  # [m] to the east, to the north, height
SPACING, PLANE = 0.6, 0.76  # of the sensors, above the floor [m]
EFFICACY, PASSED, CLOSED = 105.0, 0.65, 0.05  # [lm/W], of the glass, of the blinds
LUX = (100, 300, 500, 750)
# By room its windows: wall, from and to along it, sill and head [m]
WINDOWS = {
    "three walls": (("E", 1, 3, 0.9, 2.4), ("S", 1, 8, 0.9, 2.6), ("W", 2, 6, 1.2, 2.4)),
    "two slits of a wall": (("S", 1, 4, 0.9, 1.6), ("S", 5, 8, 2.2, 2.7)),
    "small panes": (("S", 1, 2.2, 2.3, 2.6), ("W", 1, 2.2, 2.3, 2.6), ("E", 3, 4.2, 2.3, 2.6)),
    "west": (("W", 0.5, 6.5, 0.8, 2.8),),
}
PEER = """
import json, sys
from pathlib import Path
import numpy as np
from honeybee_radiance_postprocess.results.annual_daylight import AnnualDaylight
from honeybee_radiance_postprocess.leed.leed import leed_option_one
from honeybee_radiance_postprocess.en17037 import en17037_compute
found = {}
for room in sorted(Path(sys.argv[1]).iterdir()):
    folder = room / "results"
    one = {}
    summary = leed_option_one(AnnualDaylight(str(folder)), use_states=True)[0]
    one["states"] = {"sda": summary["sda"], "ase": summary["ase"]}
    array = np.load(room / "daylight_hours.npy")
    made = en17037_compute(array, {"full_id": "room", "count": len(array)})["target_types"]
    one["provision"] = {str(level["threshold"]): level["sda"]
                        for kind in made.values() for level in kind["levels"].values()}
    found[room.name] = one
print(json.dumps(found))
"""


@dataclass(frozen=True, slots=True)
class StatedRoom:
    """A room's light through each window group, open."""

    name: str
    direct: FloatArray  # [G, H, S] [lx]
    total: FloatArray  # [G, H, S] [lx]


def rooms(weather: Weather) -> Iterator[StatedRoom]:
    """The rooms: sun by geometry, the rest a share of the diffuse light that falls with depth."""
    x, y = (np.arange(SPACING / 2, side, SPACING) for side in ROOM[:2])
    points = np.array([(a, b, PLANE) for a in x for b in y])
    sun, up = sun_directions(weather), sun_directions(weather)[:, 2] > 0.02
    beam = np.where(up, EFFICACY * weather.direct_normal, 0.0)
    diffuse = np.where(up, 115.0 * weather.diffuse_horizontal, 0.0)
    for name, windows in WINDOWS.items():
        direct = [beam[:, None] * _lit(points, sun, window) for window in windows]
        rest = [diffuse[:, None] * _sky(points, window)[None] for window in windows]
        total = np.array(direct) + np.array(rest)
        yield StatedRoom(name, np.array(direct), total)


def _lit(points: FloatArray, sun: FloatArray, window: tuple) -> FloatArray:
    """Horizontal light [H, S] for unit beam: where the way to the sun goes through the window."""
    normal, offset, along = _wall(window[0])
    towards = np.where(sun @ normal > 0.01, sun @ normal, np.nan)
    reach = (offset - points @ normal)[None] / towards[:, None]
    across = points @ along + reach * (sun @ along)[:, None]
    height = points[:, 2] + reach * sun[:, 2, None]
    _, start, end, sill, head = window
    hit = (across > start) & (across < end) & (height > sill) & (height < head)
    return PASSED * np.where(hit, np.maximum(sun[:, 2], 0.0)[:, None], 0.0)


def _sky(points: FloatArray, window: tuple) -> FloatArray:
    """Share [S] of the diffuse light at each sensor: a small, dirty window's form factor."""
    normal, offset, along = _wall(window[0])
    _, start, end, sill, head = window
    centre = offset * normal + 0.5 * (start + end) * along + [0, 0, 0.5 * (sill + head)]
    way = centre - points
    far = np.maximum((way**2).sum(axis=1), 0.3)
    cosines = np.maximum(way @ normal, 0) * np.maximum(way[:, 2], 0) / far
    return 0.6 * PASSED * (end - start) * (head - sill) * (cosines / far + 0.002)


def _wall(wall: str) -> tuple[FloatArray, float, FloatArray]:
    """Outward normal, distance from the origin and direction along a wall."""
    east, north = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    return {"E": (east, ROOM[0], north), "S": (-north, 0.0, east), "W": (-east, 0.0, north)}[wall]


def figures(room: StatedRoom, weather: Weather) -> dict[str, dict[str, float]]:
    """What this project finds of a room, in per cent, by the peer's names."""
    ten, half = lm83_hours(weather), daylight_hours(weather)
    closed = lm83.blinds_operated(list(room.direct))
    operated = np.where(closed[:, :, None], CLOSED, 1.0) * room.total
    autonomy = daylight_autonomy(operated.sum(axis=0), ten)
    # the peer counts 250 hours and more, IES more than 250: on its terms here
    ase = lm83.annual_sunlight_exposure(room.direct.sum(axis=0), ten, most_hours=lm83.ASE_HOURS - 1)
    blinds = {"sda": 100 * area_share(autonomy >= lm83.SDA_TIME), "ase": 100 * ase}
    return {"states": blinds, "provision": daylight_shares(room.total.sum(axis=0), half)}


def daylight_shares(light: FloatArray, half: NDArray[np.bool_]) -> dict[str, float]:
    """Per cent of the sensors that have each of LUX for half of the daylight hours."""
    return {str(lux): 100 * area_share(daylight_autonomy(light, half, lux) >= 0.5) for lux in LUX}


def ask_peer(python: Path, made: Sequence[StatedRoom], weather: Weather) -> dict:
    """The peer's figures of the rooms."""
    with tempfile.TemporaryDirectory() as place:
        for room in made:
            _write(Path(place) / room.name, room, weather)
        words = [str(python), "-c", PEER, place]
        ran = subprocess.run(words, check=True, capture_output=True, text=True)
    return json.loads(ran.stdout.splitlines()[-1])


def _write(folder: Path, room: StatedRoom, weather: Weather) -> None:
    results, groups = folder / "results", len(room.total)
    up = room.total.sum(axis=(0, 2)) > 0
    paths = [f"group_{g}" for g in range(groups)]
    for g, path in enumerate(paths):
        for state, share in enumerate((1.0, CLOSED)):
            direct = room.direct[g] if state == 0 else np.zeros_like(room.direct[g])
            for kind, values in (("total", share * room.total[g]), ("direct", direct)):
                place = results / path / f"{state}_{path}" / kind
                place.mkdir(parents=True)
                np.save(place / "room.npy", values[up].T)
    info = {
        "name": "room",
        "identifier": "room",
        "full_id": "room",
        "group": "",
        "count": room.total.shape[2],
        "light_path": [[path] for path in paths],
    }
    states = {path: [f"0_{path}", f"1_{path}"] for path in paths}
    (results / "grids_info.json").write_text(json.dumps([info]))
    (results / "grid_states.json").write_text(json.dumps({"room": states}))
    hours = np.arange(8760) + 0.5
    (results / "sun-up-hours.txt").write_text("\n".join(f"{h}" for h in hours[up]))
    study = {"timestep": 1, "study_hours": list(hours)}
    (results / "study_info.json").write_text(json.dumps(study))
    np.save(folder / "daylight_hours.npy", room.total.sum(axis=0)[daylight_hours(weather)].T)


def main(*, peer: Path | None = None, out: Path = STORED.parent) -> None:
    """Compare, and store the peer's figures where it is given."""
    weather = read_epw(WEATHER)
    made = list(rooms(weather))
    if peer is not None:
        found = ask_peer(peer, made, weather)
        (out / STORED.name).write_text(json.dumps(found, indent=1) + "\n")
    stored = json.loads((out / STORED.name).read_text())
    for room in made:
        own = figures(room, weather)
        for part, values in stored[room.name].items():
            for name, value in values.items():
                line = f"{own[part][name]:7.2f} {value:7.2f} {own[part][name] - value:6.2f}"
                print(f"{room.name:20s} {part:10s} {name:4s} {line}")
