"""The head of every result: what was left out, what was assumed, and how much it matters.

The terminal, `run.json` and the pages of every command show the same lines.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from bim.account import NOT_USABLE
from bim.model import JOINED, NOT_USED, TREES, Building, Problem, Space
from bim.ranking import ranked
from mitsuba_cfs.bsdf.klems_peak import through_peak
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.resolver import source_notes, window_sources
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.thermal_system import thermal_system

NOTED = (JOINED, NOT_USED, TREES)  # kinds of problems that are notes of a result
FAR_SITE_DEG = 2.0  # a weather station further than this from the building's site is reported
SHOWN = 8  # kinds of losses that the head lists
LEAST_PEAK = 0.01  # transmittance at normal incidence below which a peak is not noted


@dataclass(frozen=True, slots=True)
class Head:
    """The first lines of a result."""

    model: tuple[str, ...]  # rooms and glass of the model that were read, and a verdict
    left_out: tuple[str, ...] = ()  # losses of the model, the largest glass area first
    assumed: tuple[str, ...] = ()  # sentences: of the model, the systems, the weather, the site

    @property
    def lines(self) -> tuple[str, ...]:
        """The head as the terminal shows it."""
        return (
            *self.model,
            *(f"left out: {text}" for text in self.left_out),
            *(f"assumed: {text}" for text in self.assumed),
        )

    def with_assumptions(self, sentences: Iterable[str]) -> Head:
        """The head with further assumptions."""
        return replace(self, assumed=tuple(dict.fromkeys([*self.assumed, *sentences])))

    @property
    def record(self) -> dict[str, list[str]]:
        """The head as `run.json` has it."""
        return {
            "model": list(self.model),
            "left_out": list(self.left_out),
            "assumed": list(self.assumed),
        }


NO_HEAD = Head(())


def joined(heads: Iterable[Head]) -> Head:
    """One head of several results, each line once."""
    heads = list(heads)
    parts = ("model", "left_out", "assumed")
    return Head(
        *(tuple(dict.fromkeys(x for head in heads for x in getattr(head, name))) for name in parts)
    )


def head_of(
    building: Building,
    spaces: Sequence[Space] = (),
    systems: Mapping[str, States] | None = None,
    weather: Weather | None = None,
    *,
    notes: Iterable[str] = (),
    light_only: bool = False,
) -> Head:
    """The head of what is computed of a building.

    Args:
        spaces: the rooms that are computed; systems: of their windows, by GUID.
        notes: further assumptions; light_only: neither U nor g of the systems is used.
    """
    systems = systems or {}
    windows = [w for space in spaces for w in space.windows if w.guid in systems]
    used = {id(one): one for states in systems.values() for one in states}.values()
    assumed = [
        *model_notes(building),
        *notes,
        *source_notes(window_sources(windows, systems)),
        *system_notes(used, light_only=light_only),
        *([] if weather is None else [*weather.notes, *site_notes(building, weather)]),
    ]
    return Head(model_lines(building), losses(building.problems), tuple(dict.fromkeys(assumed)))


def model_lines(building: Building) -> tuple[str, ...]:
    """Rooms and glass that were read; with the verdict where the reader gives an account."""
    if building.account is not None:
        return building.account.lines
    glass = sum(window.area for window in building.windows)
    return (
        f"Rooms read: {len(building.spaces)}",
        f"Glass: {glass:.1f} m2 in {len(building.windows)} windows",
    )


def losses(problems: Iterable[Problem]) -> tuple[str, ...]:
    """The parts of the model that no result has, those with the largest glass area first."""
    lost = ranked([problem for problem in problems if problem.lost or problem.glass])
    texts = [_text(one.what, one.first.consequence, one.glass) for one in lost[:SHOWN]]
    if len(lost) > SHOWN:
        more = sum(one.count for one in lost[SHOWN:])
        texts.append(f"{more} more of {len(lost) - SHOWN} kinds: cfs check lists all")
    return tuple(texts)


def _text(what: str, consequence: str, glass: float) -> str:
    area = f" ({glass:.2f} m2 of glass)" if glass else ""
    return f"{what}: {consequence}{area}"


def model_notes(building: Building) -> tuple[str, ...]:
    """Whether the model will do, what of it was joined, and what of it no result depends on."""
    told = (p for p in building.problems if p.kind in NOTED)
    return (*_account_notes(building), *(f"{p.what}: {p.consequence}." for p in told))


def unused_notes(building: Building) -> tuple[str, ...]:
    """What of a building's file a command with uses, sensors and eyes of its own leaves out."""
    held = {
        "uses of rooms": building.uses, "sensor grids": building.grids, "views": building.views,
    }  # fmt: skip
    counts = [f"{len(some)} {what}" for what, some in held.items() if some]
    if not counts or building.file is None:
        return ()
    return (f"{building.file.name} holds {', '.join(counts)}: not used here.",)


def tree_notes(building: Building) -> tuple[str, ...]:
    """How much light the trees outdoors let pass."""
    told = (p for p in building.problems if p.kind == TREES)
    return tuple(f"{p.what}: {p.consequence}." for p in told)


def system_notes(
    systems: Iterable[FenestrationSystem], *, light_only: bool = False
) -> tuple[str, ...]:
    """What was assumed of fenestration systems: bands, see-through peaks, U, g and window model."""
    systems = list(systems)
    notes = [note for system in systems for note in (*system.notes, *_peak_note(system))]
    for heat in [] if light_only else map(thermal_system, systems):
        notes += [*heat.notes, heat.named_model]
    return tuple(dict.fromkeys(notes))


def _peak_note(system: FenestrationSystem) -> tuple[str, ...]:
    """A sentence where the light that passes straight on is taken from the Klems patches."""
    if system.angular is not None or system.tree is not None:
        return ()
    bsdf = system.visible.filled()
    peak = float(through_peak(bsdf.transmission_front, bsdf.basis_in).transmittance[0])
    if peak < LEAST_PEAK:
        return ()
    return (
        f"{system.name}: direct sun and view pass straight on by a see-through peak of the Klems "
        f"patches, transmittance {peak:.2f} at normal incidence.",
    )


def _account_notes(building: Building) -> tuple[str, ...]:
    """Why the model will not do, where that is so."""
    account = building.account
    return account.lines[:1] if account is not None and account.verdict == NOT_USABLE else ()


def site_notes(building: Building, weather: Weather) -> tuple[str, ...]:
    """A sentence where building and weather lie far apart."""
    if building.latitude_deg is None or building.longitude_deg is None:
        return ()
    north = building.latitude_deg - weather.latitude_deg
    east = (building.longitude_deg - weather.longitude_deg + 180) % 360 - 180
    if max(abs(north), abs(east)) <= FAR_SITE_DEG:
        return ()
    return (
        f"The building's site ({building.latitude_deg:.1f} N, {building.longitude_deg:.1f} E) is "
        f"far from the weather station {weather.site} ({weather.latitude_deg:.1f} N, "
        f"{weather.longitude_deg:.1f} E): the sun is the weather station's.",
    )
