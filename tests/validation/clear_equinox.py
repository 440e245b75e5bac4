"""LEED's option 2 and LM-83's direct sun against Radiance under the same skies and suns.

    python -m tests.validation clear_equinox [--rooms ROOM ...] [--runs N]

With several runs, whose paths differ in both programs, the noise of the sensors near a limit of
option 2 is told instead.

Ours is what `cfs comply` computes of a room; theirs is rtrace with every hour's sky patches and
the sun's disc, and rcontrib without reflections for the sun of each hour of the year.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from bim.model import Building
from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import furnished_surfaces
from mitsuba_cfs.bsdf.glazing import Pane, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.hdr import EFFICACY
from mitsuba_cfs.metrics import lm83
from mitsuba_cfs.metrics.autonomy import area_share
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.sun import SUN_RADIUS
from scenes.comply.comply import lights_of
from scenes.comply.findings import Calendar, Findings, GridLight, calendar_of
from scenes.comply.needs import Equinox, SunlightExposure
from scenes.demo import WEATHER
from scenes.fenestration.systems import FenestrationSystem
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.light import room_light
from scenes.room.options import RoomOptions, SensorGrid
from scenes.room.windows import in_all_windows
from tests.benchmarks import radiance
from tests.validation.rendered_scene import RenderedScene

FloatArray = NDArray[np.float64]

TAU, SUBDIVISION = 0.88, 2
GRID = SensorGrid(spacing=1.0, height=0.76, margin=0.0)
NEED = Equinox(what="equinox", low=300, high=3000, clocks=(9, 15), at_least=0.55)
ASE = SunlightExposure(what="ase", lux=1000, hours=250, at_most=0.1)
DIVISIONS = 2048  # of rtrace's hemisphere; another number is another sample of paths
POINT = "-ab 7 -lr -12 -lw 1e-6 -as 0 -aa 0"
SUN_OMEGA = 2 * np.pi * (1 - np.cos(SUN_RADIUS))
ROOMS = {
    "south-east": shoebox(4.0, 6.0, facing_deg=150),
    "south, high window": shoebox(5.0, 7.0, facing_deg=180, windows=[WindowRectangle(0.8, 1.6, 3.4, 1.0)]),
    "north-west": shoebox(4.0, 5.0, facing_deg=315),
}


@dataclass(frozen=True, slots=True)
class Sides:
    """Both programs' light on one grid."""

    ours: GridLight
    clear: FloatArray  # [h, S] [lx] Radiance's at the clear hours
    hours: NDArray[np.int64]  # [h] these hours
    direct: NDArray[np.float32]  # [H, S] [lx] Radiance's direct sun
    calendar: Calendar

    @property
    def theirs(self) -> GridLight:
        """Radiance's light as `cfs comply` takes it."""
        light = np.zeros_like(self.ours.open)
        light[self.hours] = self.clear
        return GridLight(self.ours.points, light, self.direct, self.ours.factor)

    def shares(self, need: Equinox | SunlightExposure) -> tuple[float, float]:
        """A need's value, ours and theirs [%]."""
        lights = (self.ours, self.theirs)
        found = [need.value(Findings(self.calendar, light)) for light in lights]
        return 100 * (found[0] or 0.0), 100 * (found[1] or 0.0)

    def clocks(self) -> FloatArray:
        """Illuminance [2, C, S] [lx] at the clock hours of option 2, ours and theirs."""
        lights = (self.ours.open, self.theirs.open)
        hours = [self.calendar.clear_hours(clock) for clock in NEED.clocks]
        return np.array([[light[h].mean(axis=0) for h in hours] for light in lights], dtype=float)

    def sunlit(self) -> tuple[FloatArray, FloatArray]:
        """Hours with 1000 lx of direct sun of each sensor [S], ours and theirs."""
        ours, theirs = (lm83.sunlit_hours(light.direct, self.calendar.ten) for light in (self.ours, self.theirs))
        return ours, theirs


def glass() -> FenestrationSystem:
    """One clear pane of Radiance's index."""
    klems = specular_klems(Pane("clear", TAU, 0.08, 0.08), KLEMS_FULL)
    return FenestrationSystem("clear", klems, klems, source="made")


def compared(building: Building, folder: Path, sensor_samples: int = 4096, *, seed: int = 0) -> Sides:
    """A room in both programs; each seed is another sample of paths in both."""
    weather, space = read_epw(WEATHER), building.spaces[0]
    options = RoomOptions.of(
        sky_subdivision=SUBDIVISION, sensor_samples=sensor_samples, patch_samples=1024, sun_points=128, seed=seed
    )
    skies = skies_for(weather, options.sampling)
    room = room_inputs(building, space, in_all_windows(space, glass()), weather, options, skies=skies, grids=[GRID])
    light, calendar = room_light(room), calendar_of(weather)
    hours = np.unique(np.concatenate([calendar.clear_hours(clock) for clock in NEED.clocks]))
    scene = _scene(building, folder)
    up = np.tile([0.0, 0.0, 1.0], (len(light.scene.points), 1))
    sensors = radiance.sensors_text(light.scene.points, up)
    options_of_point = f"{POINT} -ad {DIVISIONS + 7 * seed}"
    clear = [_traced(scene, skies, int(h), sensors, options_of_point) for h in np.searchsorted(skies.lit, hours)]
    direct = _direct(scene, skies, sensors)
    (ours,) = lights_of(room, light, ())
    whole = skies.whole_year(direct.astype(np.float32).T).T
    return Sides(ours, np.array(clear), hours, whole, calendar)


def _scene(building: Building, folder: Path) -> RenderedScene:
    """The room and its glass as Radiance's files."""
    space = building.spaces[0]
    radiance.write_surfaces(furnished_surfaces(space, "visible"), folder / "room.rad")
    t = TAU
    tn = (np.sqrt(0.8402528435 + 0.0072522239 * t * t) - 0.9166530661) / 0.0036261119 / t
    lines = [f"void glass pane\n0\n0\n3 {tn:.6g} {tn:.6g} {tn:.6g}\n"]
    for window in space.windows:
        lines += [radiance.polygon("pane", f"w{i}", t) for i, t in enumerate(window.triangles)]
    (folder / "glass.rad").write_text("\n".join(lines))
    return RenderedScene(folder, "room.rad glass.rad", "", POINT)


def _traced(scene: RenderedScene, skies: AnnualSky, hour: int, sensors: bytes, options: str) -> FloatArray:
    """Illuminance [S] [lx] of an hour by rtrace."""
    luminance = float(skies.illuminance[hour]) / SUN_OMEGA
    patches = skies.without_sun(slice(hour, hour + 1))[:, 0]
    scene.set_sky(patches, SUBDIVISION, skies.direction[hour], luminance)
    command = f"rtrace -h -I+ -dc 1 -dt 0 -dj 0 -ds 0.1 -st 0 {options} scene.oct"
    lines = radiance.run(command, scene.folder, sensors).decode().split()
    return np.array(lines, dtype=float).reshape(-1, 3)[:, 0] * EFFICACY


def _direct(scene: RenderedScene, skies: AnnualSky, sensors: bytes) -> FloatArray:
    """Direct light of the sun [L, S] [lx] by rcontrib, a source for every hour of the year."""
    shining = np.flatnonzero((skies.illuminance > 0) & (skies.direction[:, 2] > 0))
    degrees = 2 * np.degrees(SUN_RADIUS)
    suns = [
        f"void light sun{i}\n0\n0\n3 1 1 1\nsun{i} source disc{i}\n0\n0\n4 {x:.9g} {y:.9g} {z:.9g} {degrees:.6g}\n"
        for i, (x, y, z) in enumerate(skies.direction[shining].tolist())
    ]
    (scene.folder / "suns.rad").write_text("".join(suns))
    names = "".join(f"sun{i}\n" for i in range(len(shining)))
    (scene.folder / "suns.mod").write_text(names)
    radiance.run(f"oconv suns.rad {scene.files} > suns.oct", scene.folder)
    command = "rcontrib -h -I+ -fad -ab 0 -dc 1 -dt 0 -dj 0 -dr 0 -st 0 -M suns.mod suns.oct"
    data = radiance.run(command.replace("-fad", "-faa"), scene.folder, sensors)
    values = np.array(data.split(), dtype=float).reshape(-1, len(shining), 3)[:, :, 0]
    found = np.zeros((len(skies.lit), len(values)))
    found[shining] = values.T * (skies.illuminance[shining] / SUN_OMEGA)[:, None]
    return found


def near_limits(runs: FloatArray) -> list[str]:
    """Sensors within 10 % of a limit: mean and deviation of both programs' runs [N, 2, C, S]."""
    mean, off = runs.mean(axis=0), runs.std(axis=0, ddof=1)
    found = []
    for limit in (NEED.low, NEED.high):
        for c, sensor in np.argwhere((np.abs(mean / limit - 1) < 0.1).any(axis=0)):
            ours, theirs = (f"{mean[i, c, sensor]:.0f} ± {off[i, c, sensor]:.0f}" for i in (0, 1))
            where = f"{NEED.clocks[c]} o'clock, sensor {sensor}"
            found.append(f"  {where}: {ours} lx, Radiance {theirs} lx, limit {limit:g}")
    return found


def told_runs(name: str, count: int) -> None:
    """Print a room's sensors near a limit over several runs."""
    shares, clocks = [], []
    for seed in range(count):
        with tempfile.TemporaryDirectory() as place:
            both = compared(ROOMS[name], Path(place), seed=seed)
        shares.append("{:.1f} {:.1f}".format(*both.shares(NEED)))
        clocks.append(both.clocks())
    print(f"{name}: option 2 of each run, ours and Radiance's: {'; '.join(shares)}")
    print("\n".join(near_limits(np.array(clocks))))


def main(*, rooms: Annotated[Sequence[str], ROOMS] = tuple(ROOMS), runs: int = 1) -> None:
    """Print both programs' figures."""
    if runs > 1:
        for name in rooms:
            told_runs(name, runs)
        return
    print("room: ours/Radiance, half of the sensors within; option 2, ASE [%]; hours off")
    for name in rooms:
        with tempfile.TemporaryDirectory() as place:
            both = compared(ROOMS[name], Path(place))
        light, wanted = both.ours.open[both.hours], both.clear
        off = np.median(np.abs(light / wanted - 1))
        (a, b), (c, d) = both.shares(NEED), both.shares(ASE)
        ours, theirs = both.sunlit()
        print(
            f"{name}: {light.sum() / wanted.sum():.3f}, {off:.3f}; "
            f"{a:.1f} {b:.1f}; {c:.1f} {d:.1f}; "
            f"{np.abs(ours - theirs).max():.0f} of {theirs.max():.0f}, "
            f"{100 * area_share(ours == theirs):.0f} % of sensors equal"
        )
