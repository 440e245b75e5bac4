"""Rooms with one air: the zones of a building that a study balances as one air node each.

Faces, windows and sun stay those of the rooms, and so do view factors; air, gains, set points and
loads are the zone's.  Walls between its rooms have the zone's air on both sides.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.errors import DataError
from scenes.results import ShadingYear
from scenes.room.shading_rules import MOST_CONDITIONS
from scenes.room.zone import RoomAlternatives, RoomServices, RoomZone
from thermal.climate import Solar
from thermal.control import combinations_of, levels_of, number_of
from thermal.network import framed
from thermal.ventilation import WindowAiring
from thermal.zone import Gains, Zone

FloatArray = NDArray[np.float64]
SUNS = (
    "absorbed_outer",
    "absorbed_inner",
    "inside",
    "facade",
    "window_inside",
    "window_facade",
    "absorbed_middle",
    "state",
)


def with_air_nodes(
    rooms: Sequence[RoomZone], links: FloatArray, nodes: Mapping[str, str]
) -> tuple[list[RoomZone], FloatArray, dict[str, str]]:
    """Coupled rooms, those of an air node as one in the place of its first.

    Args:
        links: air between the rooms [Z, Z] [m3/s].
        nodes: name of the air node of rooms, by the rooms' GUID.

    Returns: the rooms, the air between them, and the name of the zone of every room by its GUID.
    """
    node_of = {r.zone.name: nodes[r.space.guid] for r in rooms if r.space.guid in nodes}
    names = [node_of.get(room.zone.name, room.zone.name) for room in rooms]
    order = list(dict.fromkeys(names))
    groups: dict[str, list[RoomZone]] = {name: [] for name in order}
    for room, name in zip(rooms, names, strict=True):
        beside = _beside(room, node_of)
        groups[name].append(_renamed(beside) if room.zone.name in node_of else beside)
    merged = [_in_alternatives(name, group) if name in nodes.values() else group[0] for name, group in groups.items()]
    place = [order.index(name) for name in names]
    between = np.zeros((len(order), len(order)))
    np.add.at(between, np.ix_(place, place), links)
    np.fill_diagonal(between, 0.0)
    return merged, between, {r.space.guid: n for r, n in zip(rooms, names, strict=True)}


def _named(room: str, part: str) -> str:
    """Name of a part of a room in its air node."""
    return f"{room}, {part}"


def _beside(room: RoomZone, node_of: Mapping[str, str]) -> RoomZone:
    """The room, its neighbours' faces under the names that they have in air nodes."""
    surfaces = tuple(
        replace(one, outside=node_of[one.outside], partner=_named(one.outside, one.partner))
        if one.partner and one.outside in node_of
        else one
        for one in room.zone.surfaces
    )
    return replace(room, room=replace(room.room, zone=replace(room.zone, surfaces=surfaces)))


def _renamed(room: RoomZone) -> RoomZone:
    """The room with names of surfaces and windows that differ from those of other rooms."""
    zone = room.zone
    zone = replace(
        zone,
        surfaces=tuple(replace(s, name=_named(zone.name, s.name)) for s in zone.surfaces),
        windows=tuple(replace(w, name=_named(zone.name, w.name)) for w in zone.windows),
    )
    return replace(room, room=replace(room.room, zone=zone))


def _in_alternatives(name: str, rooms: Sequence[RoomZone]) -> RoomZone:
    """The rooms as one, in an alternative for all levels of the conditions of their shading.

    The conditions are of the temperature of the air node, the operative one of all its faces.

    Raises: `DataError` for more than 2^`MOST_CONDITIONS` alternatives.
    """
    choices = [room.alternatives for room in rooms if room.alternatives is not None]
    conditions = tuple(dict.fromkeys(one for each in choices for one in each.conditions))
    read = tuple(dict.fromkeys(one for each in choices for one in each.read))
    if combinations_of(read) > 2**MOST_CONDITIONS:
        message = f"the rules by the temperature of {name} have {combinations_of(read)} combinations"
        message = f"{message} of states; at most {2**MOST_CONDITIONS} are computed"
        raise DataError(message, element=name, field="control")

    def those(number: int) -> Iterator[RoomZone]:
        levels = dict(zip(read, levels_of(number, read), strict=True))
        for room in rooms:
            if room.alternatives is None:
                yield room
                continue
            of_room = room.alternatives.read
            one = room.alternatives.rooms[number_of([levels[k] for k in of_room], of_room)]
            zone = replace(room.zone, gains=one.zone.gains)  # with the names of the air node
            yield replace(one, room=replace(room.room, zone=zone))

    whole = _merged(name, rooms)
    if not choices:
        return whole
    every = tuple(_merged(name, list(those(n))) for n in range(combinations_of(read)))
    return replace(whole, alternatives=RoomAlternatives(conditions, read, every))


def _merged(name: str, rooms: Sequence[RoomZone]) -> RoomZone:
    """The rooms as one, their parts in the order of the rooms."""
    first, areas = rooms[0], np.array([room.space.floor_area for room in rooms])
    lit = [room.daylight is not None for room in rooms]
    daylight = None
    if any(lit):
        plane = [room.daylight for room in rooms if room.daylight is not None]
        daylight = np.average(plane, axis=0, weights=areas[lit])
    return replace(
        first,
        space=_space(name, [room.space for room in rooms]),
        room=_thermal_room(name, [room.room for room in rooms]),
        solar=_solar(rooms),
        gains={
            key: _total(room.gains[key] for room in rooms if key in room.gains)
            for key in dict.fromkeys(key for room in rooms for key in room.gains)
        },
        shading=_shading(rooms),
        lamps=_total(room.lamps for room in rooms),
        occupied=np.any([room.occupied for room in rooms], axis=0),
        daylight=daylight,
        services=_services([room.services for room in rooms]),
        fenestration=tuple(row for room in rooms for row in room.fenestration),
        states=max((room.states for room in rooms), key=len),
    )


def _total(values: Iterable[Any]) -> Any:  # of numbers or arrays [H]
    return sum(values, start=0.0)


def _space(name: str, spaces: Sequence[Space]) -> Space:
    return replace(
        spaces[0],
        guid=name,
        name=name,
        long_name="",
        faces=tuple(face for space in spaces for face in space.faces),
        windows=tuple(window for space in spaces for window in space.windows),
        **{key: sum(getattr(space, key) for space in spaces) for key in ("volume", "floor_area", "room_volume")},
    )


def _thermal_room(name: str, rooms: Sequence[ThermalRoom]) -> ThermalRoom:
    before = np.cumsum([0, *(len(room.zone.surfaces) for room in rooms)])
    return ThermalRoom(
        _zone(name, [room.zone for room in rooms]),
        np.concatenate([r.surface_of_face + n for r, n in zip(rooms, before, strict=False)]),
        np.concatenate([r.outdoor + n for r, n in zip(rooms, before, strict=False)]),
        tuple(guid for room in rooms for guid in room.neighbours),
    )


def _zone(name: str, zones: Sequence[Zone]) -> Zone:
    """One air of the zones' volume; what acts on the air is added up."""
    first, volume = zones[0], sum(zone.volume for zone in zones)

    def mean(values: Iterable[Any]) -> Any:
        """Air changes of all volumes by those of each."""
        return _total(v * z.volume for v, z in zip(values, zones, strict=True)) / volume

    fans = [zone.supply for zone in zones if zone.supply is not None]
    supply = None
    if fans:
        supply = replace(fans[0], ach=mean(z.supply.ach if z.supply else 0.0 for z in zones))
    return replace(
        first,
        name=name,
        volume=volume,
        supply=supply,
        surfaces=tuple(one for zone in zones for one in zone.surfaces),
        windows=tuple(one for zone in zones for one in zone.windows),
        infiltration_ach=mean(zone.infiltration_ach for zone in zones),
        other_air_ach=mean(zone.other_air_ach for zone in zones),
        air_capacity_factor=mean(zone.air_capacity_factor for zone in zones),
        gains=Gains(_total(zone.gains.convective for zone in zones), _total(zone.gains.radiant for zone in zones)),
        loads=replace(
            first.loads,
            **{key: _total(getattr(zone.loads, key) for zone in zones) for key in ("heating_limit", "cooling_limit")},
        ),
        leakage=replace(
            first.leakage, **{key: _total(getattr(zone.leakage, key) for zone in zones) for key in ("stack", "wind")}
        ),
        airing=_airing([zone.airing for zone in zones if zone.airing is not None]),
        beside=tuple(one for zone in zones for one in zone.beside),
        bridges=_total(zone.bridges for zone in zones),
        view_factors=_view_factors(zones),
    )


def _airing(openings: Sequence[WindowAiring]) -> WindowAiring | None:
    """Opened windows whose flows add up: the sum of square roots by wind and by stack."""
    if not openings:
        return None
    return replace(
        openings[0],
        wind=sum(np.sqrt(one.wind) for one in openings) ** 2,
        stack=sum(np.sqrt(one.stack) for one in openings) ** 2,
        flow=sum(one.flow for one in openings),
    )


def _view_factors(zones: Sequence[Zone]) -> FloatArray | None:
    """View factors in each room, none between rooms; None where a room has none."""
    if any(zone.view_factors is None for zone in zones):
        return None
    kinds = [(len(z.surfaces), len(z.windows), len(framed(z))) for z in zones]
    starts = np.cumsum([0, *np.sum(kinds, axis=0)])  # of all surfaces, windows, frames
    factors, done = np.zeros((starts[-1], starts[-1])), np.zeros(3, dtype=int)
    for zone, counts in zip(zones, kinds, strict=True):
        at = np.concatenate(
            [start + begun + np.arange(count) for start, begun, count in zip(starts, done, counts, strict=False)]
        )
        factors[np.ix_(at, at)] = zone.view_factors
        done += counts
    return factors


def _solar(rooms: Sequence[RoomZone]) -> Solar:
    """The sun of all faces and windows; what a room has none of is zero."""
    joined: dict[str, Any] = {}
    for name in SUNS:
        parts = [getattr(room.solar, name) for room in rooms]
        blank = [np.zeros((len(r.solar.inside), len(r.zone.windows))) for r in rooms]
        there = [b if p is None else p for p, b in zip(parts, blank, strict=True)]
        joined[name] = None if all(p is None for p in parts) else np.concatenate(there, axis=1)
    return Solar(**joined)


def _shading(rooms: Sequence[RoomZone]) -> ShadingYear:
    years = [room.shading for room in rooms if len(room.zone.windows)]
    if not years:
        return rooms[0].shading
    labels = [room.space.label for room in rooms if len(room.zone.windows)]
    before = np.cumsum([0, *(len(year.groups) for year in years)])
    reasons = tuple(dict.fromkeys(reason for year in years for reason in year.reasons))
    moved_by = []
    for year in years:
        numbers = np.array([*map(reasons.index, year.reasons), -1], dtype=np.int64)
        of_none = np.full_like(year.states, -1)
        moved_by.append(of_none if year.moved_by is None else numbers[year.moved_by])
    return ShadingYear(
        tuple(f"{label} {g}" for label, y in zip(labels, years, strict=True) for g in y.groups),
        tuple(rule for year in years for rule in year.rules),
        np.concatenate([year.states for year in years], axis=1),
        np.concatenate([year.number + n for year, n in zip(years, before, strict=False)]),
        np.concatenate(moved_by, axis=1),
        reasons,
        tuple(view for year in years for view in year.views),
    )


def _services(services: Sequence[RoomServices]) -> RoomServices:
    return replace(
        services[0], equipment=_total(one.equipment for one in services), vapour=_total(one.vapour for one in services)
    )
