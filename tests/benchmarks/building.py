"""Processor seconds, launches and seconds in kernels of `cfs run --quick`, by part.

    python -m tests.benchmarks building BUILDING.ifc --weather CITY.epw --cfs SYSTEM.xml \
        [--space 111 --space 103] [--cached]

The command runs in this process; a part has what its functions take without the other parts that
they call.  Run it twice: compiled kernels are on disk the second time.  To compare two states run
the same file with each in PYTHONPATH.  `--cached`: with the cache of buildings and matrices
(`CFS_CACHE`), else without.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any

PARTS = {
    "building": ["bim.building_file.read_building_file"],
    "sky": ["scenes.room.inputs.skies_for"],
    "parts of windows": ["mitsuba_cfs.methods.phase_matrices._parts_of_outdoor_groups"],
    "D, D_d": ["mitsuba_cfs.methods.phase_matrices._daylight"],
    "V, V_d of sensors": ["mitsuba_cfs.methods.phase_matrices.with_sensors"],
    "V, D of rooms together": ["scenes.run.together.traced_together"],
    "first plan": ["scenes.run.first_plan.first_plan"],
    "V of pixels": ["mitsuba_cfs.methods.phase_matrices._view"],
    "windows that reflect": ["mitsuba_cfs.methods.phase_matrices.with_exchange"],
    "straight view": ["mitsuba_cfs.methods.coefficients.group_coefficients"],
    "direct sun": ["mitsuba_cfs.methods.phase_light.direct_sun"],
    "reflected sun": [
        "mitsuba_cfs.methods.reflected_sun.reflected_sun",
        "mitsuba_cfs.methods.reflected_sun.reflected_to_sensors",
        "mitsuba_cfs.methods.reflected_sun.sunlit_room",
    ],
    "illuminance": ["mitsuba_cfs.methods.phase_light.illuminance_of_all"],
    "metrics and their errors": ["scenes.room.daylight.room_daylight"],
    "pictures and glare": ["scenes.room.glare.room_glare", "scenes.room.glare.coloured"],
    "undecided peaks": ["scenes.room.lobes.lobe_figures"],
    "solar gains": ["scenes.room.solar.seasonal_outdoors", "scenes.room.solar.solar_gains"],
    "zones": ["scenes.room.zone.zone_surfaces", "scenes.room.zone.room_zone"],
    "heat balance": ["scenes.room.heat.coupled_years", "scenes.room.heat.heat_alone"],
    "files and report": ["scenes.run.outputs.write_results", "scenes.report.page.write_report"],
}
LOADED = ("scenes.commands.run", "scenes.run.run", "scenes.run.outputs", "scenes.report.page")
OF_PRODUCT = ("mitsuba_cfs", "thermal", "bim", "scenes")


@dataclass
class Part:
    """What a part has taken."""

    seconds: float = 0.0  # of the processor
    calls: int = 0
    launches: int = 0  # of Dr.Jit's kernels
    kernel_seconds: float = 0.0  # elapsed in these


@dataclass
class Clock:
    """Processor time by part: the innermost part has it."""

    parts: dict[str, Part] = field(default_factory=lambda: defaultdict(Part))
    running: list[str] = field(default_factory=lambda: ["rest"])
    since: float = field(default_factory=time.process_time)

    def turn(self) -> None:
        """Give what was used since the last turn to the part that runs."""
        import drjit as dr

        now, part = time.process_time(), self.parts[self.running[-1]]
        part.seconds += now - self.since
        for kernel in dr.kernel_history([dr.KernelType.JIT]):
            part.launches += 1
            part.kernel_seconds += kernel["execution_time"] / 1e3
        self.since = time.process_time()

    def timed(self, function: Callable[..., Any], part: str) -> Callable[..., Any]:
        """The function, its time that of the part."""

        @wraps(function)
        def measured(*arguments: Any, **options: Any) -> Any:
            self.turn()
            self.running.append(part)
            self.parts[part].calls += 1
            try:
                return function(*arguments, **options)
            finally:
                self.turn()
                self.running.pop()

        return measured


def measure(clock: Clock) -> None:
    """Time the functions of all parts wherever the product's modules have them."""
    for part, names in PARTS.items():
        for name in names:
            module, _, attribute = name.rpartition(".")
            function = getattr(import_module(module), attribute)
            measured = clock.timed(function, part)
            for loaded in list(sys.modules):
                if loaded.partition(".")[0] in OF_PRODUCT:
                    place = vars(sys.modules[loaded])
                    place.update({key: measured for key in place if place[key] is function})


@contextmanager
def clocked() -> Iterator[Clock]:
    """Measure by part what runs within, imports included."""
    started = time.process_time()
    for name in LOADED:
        import_module(name)
    import drjit as dr

    from mitsuba_cfs import variants

    variants.activate()
    clock = Clock()
    clock.parts["imports"].seconds = time.process_time() - started
    measure(clock)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        yield clock
        clock.turn()


def run_command(arguments: Sequence[str]) -> None:
    """Run a line of `cfs` in this process."""
    from scenes.cli import main as command

    sys.argv = ["cfs", *arguments]
    try:
        command()
    except SystemExit as end:
        if end.code:
            raise


def main(building: Path, *, weather: Path, cfs: Path, space: Sequence[str] = (), cached: bool = False) -> None:
    """Print a line for each part."""
    with tempfile.TemporaryDirectory() as out, clocked() as clock:
        line = [building, "--weather", weather, "--cfs", cfs, "--quick", "--processes", 1, "--out", Path(out) / "out"]
        rooms = [text for one in space for text in ("--space", one)]
        run_command(["run", *map(str, line), *rooms, *([] if cached else ["--no-cache"])])
    for name, part in sorted(clock.parts.items(), key=lambda item: -item[1].seconds):
        kernels = f"{part.launches:6d} launches {part.kernel_seconds:7.2f} s in kernels"
        print(f"{name:26} {part.seconds:7.2f} s {part.calls:5d} calls {kernels}")
    whole = sum(part.seconds for part in clock.parts.values())
    launches = sum(part.launches for part in clock.parts.values())
    print(f"{'all':26} {whole:7.2f} s {'':11} {launches:6d} launches")
