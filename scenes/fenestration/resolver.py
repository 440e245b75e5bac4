"""What fills each window: the one resolver of every command and export.

    flag          --cfs; --u and --g in place of the windows' own U and g
    study file    its [[system]] tables
    attached      BSDF, U and g that the IFC file holds for the window or its type
    stated        U, g and transmittances of the IFC file's property sets, as a clear glazing;
                  --tau goes before the stated visible transmittance
    generic       --glazing, for values that the file does not state; honeybee's default pane for
                  an HBJSON file that states none

The first of them that there is fills a window; where there is none, that is an error that says
what to do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.building_file import held_states, is_ifc
from bim.fenestration import AngularGValue, PlainGlass, ShadingState
from bim.model import Window
from mitsuba_cfs.bsdf.angular import roos_table, specular_matrices
from mitsuba_cfs.bsdf.glazing import (
    HIGH_U,
    Glazing,
    solar_reflectance,
    solar_transmittance,
    specular_klems,
    visible_reflectances,
)
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.notes import Note
from scenes.fenestration.generic_glazing import GENERIC_GLAZINGS, HONEYBEE_DEFAULT
from scenes.fenestration.systems import FenestrationSystem, States, WindowOverrides, system_of, with_see_through
from scenes.fenestration.thermal_file import ThermalFile
from scenes.language.catalogue import N_
from thermal.gvalue import TYPICAL_SYSTEMS

Held = Mapping[str, tuple[ShadingState, ...]]  # by window, as `read_fenestration` gives them


def attached_systems(held: Held, windows: Iterable[Window], path: Path) -> dict[str, States]:
    """The systems by state of each window that has a BSDF attached, by its GUID.

    The state without a name is the usual one and comes first; the others follow in the file's
    order.  Windows whose data are the same share their systems.

    Args: path: of the IFC file.
    """
    equal: dict[str, list[Window]] = {}
    for window in windows:
        states = usual_first(held.get(window.guid, ()))
        if any(state.bands for state in states):
            equal.setdefault(digest(*(_content(state) for state in states)), []).append(window)
    result = {}
    for group in equal.values():
        states = usual_first(held[group[0].guid])
        source = _source([usual_first(held[window.guid])[0] for window in group], path)
        systems = tuple(_system(state, group[0], path, source) for state in states)
        result |= {window.guid: systems for window in group}
    return result


def usual_first(states: Iterable[ShadingState]) -> list[ShadingState]:
    """The states, the one without a name first."""
    return sorted(states, key=lambda state: state.name != "")


def _content(state: ShadingState) -> list[Any]:
    bands = [[name, bsdf] for name, bsdf in sorted(state.bands.items())]
    thermal = [state.g_value, state.u_value, state.g_normal, state.g_by_patch]
    beside = None if state.file is None else str(state.file)
    held = [*thermal, state.closure, state.shading_position, state.angular]
    return [state.name, bands, *held, beside, [str(file) for file in state.layers]]


def _system(state: ShadingState, window: Window, path: Path, source: str) -> FenestrationSystem:
    name = state.name or window.type_name or window.name or window.guid
    if not state.bands:
        label = f"state {state.name!r} has no BSDF" if state.name else "has no BSDF"
        raise DataError(label, file=path, element=f"window {window.name or window.guid}")
    named = "" if state.file is None else f" as {state.file.name}"
    thermal = held_thermal(state)
    angular = thermal.pop("angular") if state.angular is not None else None
    share = thermal.pop("see_through")
    if state.layers:
        share = stated_share([_beside(file).see_through for file in state.layers])
    thermal |= {"source": f"{source}{named}", "file": state.file, "layers": state.layers}
    system = system_of(state.bands, name, path=path, **thermal)
    system = system if angular is None else replace(system, angular=angular)
    return system if share is None else with_see_through(system, share)


def _source(states: Iterable[ShadingState], path: Path) -> str:
    """What holds the data of some windows, one state of each."""
    types = dict.fromkeys(state.of_type for state in states)
    names = [name or "without a name" for name in types if name is not None]
    holders = [f"window type {', '.join(names)}"] if names else []
    holders += ["the window itself"] if None in types else []
    return f"what is attached to {' and '.join(holders)} in {path.name}"


def held_thermal(state: ShadingState) -> dict[str, Any]:
    """U, g, closure and place of the shade: of the model, else of the file beside the BSDF's."""
    beside = ThermalFile() if state.file is None else _beside(state.file)
    g_normal, by_patch = state.g_normal, state.g_by_patch
    if state.g_value is not None:
        by_patch = g_by_patch(state.g_value)
    elif g_normal is None and by_patch is None:
        g_normal, by_patch = beside.g_value, beside.g_value_by_patch
    return {
        "u_value": beside.u_value if state.u_value is None else state.u_value,
        "g_value": g_normal,
        "g_by_patch": by_patch,
        "closure": state.closure or beside.closure,
        "shading_position": state.shading_position or beside.shading_position,
        "angular": state.angular or beside.angular,
        "see_through": beside.see_through,
        "spectrum": beside.spectrum,
    }


def g_by_patch(table: AngularGValue) -> NDArray[np.float64]:
    """g [K] at the middles of the Klems full basis' incident patches, linear between the angles.

    Azimuths are those of the basis; outside the polar angles the nearest value holds.
    """
    theta, phi = KLEMS_FULL.centres()
    by_azimuth = np.stack([np.interp(theta, table.polar, column) for column in table.values.T])
    if len(table.azimuth) == 1:
        return by_azimuth[0]
    return np.array(
        [np.interp(p, table.azimuth, column, period=2 * np.pi) for p, column in zip(phi, by_azimuth.T, strict=True)]
    )


NAMED = 5  # windows that one sentence names


def fill_windows(windows: Iterable[Window], overrides: WindowOverrides, file: Path | None) -> dict[str, States]:
    """The systems by state of each window, by its GUID; windows of the same data share theirs.

    Args: file: the IFC file of the windows; None for a box.

    Raises: `DataError` that names the windows that nothing fills, and says what to give.
    """
    windows = list(windows)
    result, unfilled = held_systems(windows, overrides, file)
    result = _with_peaks(result, overrides)
    for missing, names in unfilled.items():
        attach = (
            ", attach data (cfs ifc attach), or state VisibleLightTransmittance and "
            "SolarHeatGainTransmittance (Pset_DoorWindowGlazingType)"
        )
        raise DataError(
            f"has no BSDF attached {missing}: give {overrides.ask}{attach if is_ifc(file) else ''}",
            file=file,
            element=f"window {_listed(names)}",
        )
    return result


def _with_peaks(systems: dict[str, States], overrides: WindowOverrides) -> dict[str, States]:
    """The systems with the user's shares of their peaks that pass straight on.

    Raises: `DataError` for a name that is of no system.
    """
    known = {id(s): s for states in systems.values() for s in states}
    for name, _ in overrides.see_through:
        if not any(name in (s.name, *s.names) for s in known.values()):
            there = ", ".join(dict.fromkeys(name for s in known.values() for name in s.names))
            raise DataError(f"no system is {name!r}; there are {there}", field="--see-through")
    stated = dict(overrides.see_through)
    for i, system in known.items():
        share = stated.get(system.name)
        if share is None:
            share = stated_share([stated.get(name) for name in system.names])
        known[i] = system if share is None else with_see_through(system, share)
    return {guid: tuple(known[id(s)] for s in states) for guid, states in systems.items()}


def stated_share(shares: Iterable[float | None]) -> float | None:
    """Share of the peak of layers in series that passes straight on, from those that are stated."""
    known = [share for share in shares if share is not None]
    return float(np.prod(known)) if known else None


def _beside(file: Path) -> ThermalFile:
    """What is stated beside a BSDF's file."""
    return ThermalFile.read(file.with_suffix(".toml"))


def held_systems(
    windows: Iterable[Window], overrides: WindowOverrides, file: Path | None
) -> tuple[dict[str, States], dict[str, list[str]]]:
    """As `fill_windows`, and the names of the windows that nothing fills by what is missing."""
    windows = list(windows)
    own = _by_name(windows, overrides, file)
    windows = [window for window in windows if window.guid not in own]
    if overrides.states or not windows:
        return own | {window.guid: overrides.states for window in windows}, {}
    if file is None:
        element = f"window {_listed([window.name for window in windows])}" if own else None
        message = f"a box holds no fenestration data: give {overrides.ask}"
        raise DataError(message, element=element, field="box")

    held = held_states(windows, file)
    result = _with_overrides(attached_systems(held, windows, file), overrides)
    left = [window for window in windows if window.guid not in result]
    result |= stated_systems(held, left, file, overrides)
    unfilled: dict[str, list[str]] = {}
    for window in left:
        if window.guid not in result:
            missing = stated_values(held, window, file, overrides).missing(overrides.light_only)
            unfilled.setdefault(missing, []).append(window.name or window.guid)
    return own | result, unfilled


def _by_name(windows: list[Window], overrides: WindowOverrides, file: Path | None) -> dict[str, States]:
    """The systems of the windows that the user names.

    Raises: `DataError` for a name that no window has, or that two systems have.
    """
    result: dict[str, States] = {}
    for names, states in overrides.named:
        for name in names:
            meant = [window.guid for window in windows if name in (window.guid, window.name)]
            if not meant:
                there = _listed([window.name or window.guid for window in windows])
                message = f"no window of the rooms is called {name!r}; there are {there}"
                raise DataError(message, file=file, field="system.windows")
            twice = [guid for guid in meant if guid in result and result[guid] is not states]
            if twice:
                message = f"{name!r} is named with other windows too: name a window's states alike"
                raise DataError(message, file=file, field="system.windows")
            result |= dict.fromkeys(meant, states)
    return result


def _with_overrides(systems: Mapping[str, States], overrides: WindowOverrides) -> dict[str, States]:
    """The systems with the user's U and g; the same ones stay the same."""
    if overrides.u_value is None and overrides.g_value is None:
        return dict(systems)
    known: dict[int, FenestrationSystem] = {}
    for states in systems.values():
        for system in states:
            known.setdefault(id(system), _changed(system, overrides))
    return {guid: tuple(known[id(s)] for s in states) for guid, states in systems.items()}


def _changed(system: FenestrationSystem, overrides: WindowOverrides) -> FenestrationSystem:
    source = system.source
    if overrides.u_value is not None:
        system = replace(system, u_value=overrides.u_value)
        source += ", U of --u"
    if overrides.g_value is not None:
        system = replace(system, g_value=overrides.g_value, g_by_patch=None)
        source += ", g of --g"
    return replace(system, source=source)


def window_sources(windows: Iterable[Window], systems: Mapping[str, States]) -> list[dict[str, Any]]:
    """Each system once: its name, its source, and the windows that it fills."""
    result: dict[int, dict[str, Any]] = {}
    for window in windows:
        for system in systems[window.guid]:
            about = {"system": system.name, "source": system.source, "windows": []}
            of_system = result.setdefault(id(system), about)["windows"]
            of_system.append(window.name or window.guid)
    return list(result.values())


def source_notes(sources: Iterable[dict[str, Any]]) -> tuple[str, ...]:
    """A sentence for each system on what it fills and where it is from."""
    return tuple(
        Note(
            "{windows}: {system}, from {source}.",
            windows=windows_named(one["windows"]),
            system=one["system"],
            source=one["source"],
        )
        for one in sources
    )


def windows_named(names: Sequence[str]) -> str:
    """Windows in words, the first few by name; the noun where their names have it not."""
    listed = _listed(names)
    if all(name.casefold().startswith("window") for name in names):
        return listed if isinstance(listed, Note) else listed[:1].upper() + listed[1:]
    if len(names) == 1:
        return Note("Window {names}", names=listed)
    return Note("Windows {names}", names=listed)


def _listed(names: Sequence[str]) -> str:
    """The first few names, each once with how many have it, and how many windows there are more."""
    counts = list(Counter(names).items())
    shown = [name if count == 1 else f"{name} ({count})" for name, count in counts[:NAMED]]
    left = sum(count for _, count in counts[NAMED:])
    text = ", ".join(shown)
    return Note("{names} and {count} more", names=text, count=left) if left else text


VALUE_NAMES = {  # of `StatedValues`, in words
    "u_value": N_("U"),
    "g_value": N_("g"),
    "visible": N_("visible transmittance"),
    "solar": N_("solar transmittance"),
}
PANES = (1, 2, 3)  # that Roos' factor knows
NO_SHADE = (None, "none")
HONEYBEE_SUFFIXES = (".hbjson",)


@dataclass(frozen=True, slots=True)
class StatedValues:
    """What is known of a glazing at normal incidence."""

    visible: float | None
    solar: float | None
    g_value: float | None
    u_value: float | None  # [W/(m2 K)]
    panes: int | None
    shade: bool = False  # there is one, of which no BSDF is known
    glass: PlainGlass | None = None  # a single pane, whose law of the angle is known
    generic: str = ""  # name of the generic glazing that values come from
    unstated: bool = False  # all of them, as the file states none
    by_user: tuple[str, ...] = ()  # names of the values that the user gives
    assumed: tuple[str, ...] = ()  # names of the values that are the generic glazing's

    def missing(self, light_only: bool) -> str:
        """What is needed and not stated, in words; empty where nothing is missing."""
        needed = {"no visible transmittance": self.visible is None}
        known = light_only or self.g_value is not None or self.glass is not None
        needed["no g"] = not known
        needed = [name for name, is_missing in needed.items() if is_missing]
        if self.shade:
            return "for its shade"
        return f"and its property sets state {' and '.join(needed)}" if needed else ""


def stated_systems(held: Held, windows: Iterable[Window], path: Path, overrides: WindowOverrides) -> dict[str, States]:
    """The glazing of each window of which enough is attached or stated, the same ones shared."""
    result: dict[str, States] = {}
    known: dict[StatedValues, States] = {}
    for window in windows:
        values = stated_values(held, window, path, overrides)
        if values.missing(overrides.light_only):
            continue
        if values not in known:
            system = glazing_system(values, path.name)
            if any(system.name == other.name for (other,) in known.values()):
                system = glazing_system(values, path.name, digits=6)
            known[values] = (system,)
        result[window.guid] = known[values]
    return result


def stated_values(held: Held, window: Window, path: Path, overrides: WindowOverrides) -> StatedValues:
    """What the user gives goes before what is attached, and that before what is stated."""
    states = usual_first(held.get(window.guid, ()))
    thermal = held_thermal(states[0]) if states else {}
    by_patch = thermal.get("g_by_patch")
    attached_g = thermal.get("g_value") if by_patch is None else float(by_patch[0])
    values = StatedValues(
        _first(overrides.visible, window.visible_transmittance),
        window.solar_transmittance,
        _first(overrides.g_value, attached_g, window.g_value),
        _first(overrides.u_value, thermal.get("u_value"), window.u_value),
        window.panes if window.panes in PANES else None,
        any(state.shading_position not in NO_SHADE for state in states),
        window.glass if overrides.visible is None else None,
        by_user=tuple(name for name in VALUE_NAMES if name != "solar" and getattr(overrides, name) is not None),
    )
    values = _completed(values, overrides, path)
    for name in ("visible", "solar", "g_value"):
        value = getattr(values, name)
        is_black = name == "visible" and value == 0 and values.glass is not None
        if value is not None and not (0 < value <= 1 or is_black):
            what = name if name == "g_value" else f"{name} transmittance"
            message = f"states {value:g} as its {what}: expected more than 0, at most 1"
            raise DataError(message, file=path, element=f"window {window.name or window.guid}")
    return values


def _completed(values: StatedValues, overrides: WindowOverrides, path: Path) -> StatedValues:
    """The values with those of a generic glazing where the file states none."""
    unknown = values.visible is None and values.g_value is None and values.u_value is None
    if values.shade or values.glass is not None:
        return values
    if overrides.glazing is not None:
        name, generic = overrides.glazing, GENERIC_GLAZINGS[overrides.glazing]
    elif unknown and path.suffix.lower() in HONEYBEE_SUFFIXES:
        name, generic = "honeybee's default pane", HONEYBEE_DEFAULT
    else:
        return values
    if None not in (values.visible, values.g_value, values.u_value):
        return values
    solar = generic.solar if values.g_value is None else None
    return replace(
        values,
        visible=_first(values.visible, generic.visible),
        solar=_first(values.solar, solar),
        g_value=_first(values.g_value, generic.g_value),
        u_value=_first(values.u_value, generic.u_value),
        panes=values.panes or generic.panes,
        generic=name,
        unstated=unknown,
        assumed=tuple(
            name
            for name in VALUE_NAMES
            if getattr(values, name) is None
            and getattr(generic, name) is not None
            and (name != "solar" or values.g_value is None)
        ),
    )


def _first(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)


def glazing_system(values: StatedValues, file: str, digits: int = 3) -> FenestrationSystem:
    """A glazing of known values at normal incidence; its name has them with so many digits.

    Light: a single pane whose transmissivity and index are known follows Fresnel's equations, any
    other glazing falls with the angle after Roos et al. 2001. Sun: what is not stated follows from
    U and g by the simple window model (`mitsuba_cfs.bsdf.glazing`).
    """
    u = TYPICAL_SYSTEMS["none"][0] if values.u_value is None else values.u_value
    panes = values.panes or (1 if u > HIGH_U else 2)
    name = Note("glazing, {values}", values=_in_words(values, digits))
    if values.glass is None:
        front, back = visible_reflectances(values.visible)
        clear = Glazing(name, values.visible, front, back, panes)
        visible, table = specular_klems(clear, KLEMS_FULL), roos_table(clear)
        template = (
            N_("{system}: no BSDF; modelled as clear single glazing (Roos et al. 2001).")
            if panes == 1
            else N_("{system}: no BSDF; modelled as clear glazing with {panes} panes (Roos et al. 2001).")
        )
        notes = [Note(template, system=name, panes=panes)]
    else:
        table = values.glass.table
        visible = specular_matrices(table)
        count = len(values.glass.panes)
        notes = [Note("{system}: uncoated glass by Fresnel's equations, panes: {count}.", system=name, count=count)]
    if values.generic:
        notes.append(
            Note(
                "{system}: the file states no complete glazing data; missing values are those of {generic}.",
                system=name,
                generic=values.generic,
            )
        )
    solar, tau, g = visible, values.solar, values.g_value
    if g is not None:
        tau = solar_transmittance(u, g) if tau is None else tau
        rho = solar_reflectance(u, g, tau)
        solar = specular_klems(Glazing(name, tau, rho, rho, panes), KLEMS_FULL)
        if values.solar is None:
            notes.append(
                Note(
                    "{system}: solar transmittance {tau:.2f} from U and g (Arasteh et al. 2009).", system=name, tau=tau
                )
            )
    elif values.glass is not None:
        notes.append(
            Note(
                "{system} has no {band} band; its {other} band is used instead.",
                system=name,
                band="Solar",
                other="Visible",
            )
        )
    return FenestrationSystem(
        name,
        visible,
        solar,
        u_value=values.u_value,
        g_value=g,
        shading_position="none",
        notes=tuple(notes),
        source=_values_source(values, file),
        angular=table,
        from_values=True,
    )


def _values_source(values: StatedValues, file: str) -> Note:
    """Where the values of a glazing are from."""
    if values.unstated:
        return Note("the values of {generic}, as {file} states none", generic=values.generic, file=file)
    known = [name for name in VALUE_NAMES if getattr(values, name) is not None]
    stated = [name for name in known if name not in (*values.by_user, *values.assumed)]
    if known == stated:
        return Note("the values stated in {file}", file=file)
    parts = []
    if values.by_user:
        parts.append(Note("the given values ({values})", values=_named(values.by_user)))
    if stated:
        parts.append(Note("{file} ({values})", file=file, values=_named(stated)))
    if values.assumed:
        template = N_("{generic}, assumed where the file states no value ({values})")
        parts.append(Note(template, generic=values.generic, values=_named(values.assumed)))
    if len(parts) == 1:
        return parts[0]
    if len(parts) == 2:
        return Note("{first} and {second}", first=parts[0], second=parts[1])
    return Note("{first}, {second} and {third}", first=parts[0], second=parts[1], third=parts[2])


def _named(values: Sequence[str]) -> Note:
    """Values of a glazing by name, in the order of `VALUE_NAMES`."""
    names = {name: Note(VALUE_NAMES[name]) for name in VALUE_NAMES if name in values}
    return Note(", ".join(f"{{{name}}}" for name in names), **names)


def _in_words(values: StatedValues, digits: int) -> Note:
    def rounded(value: float) -> float:
        return float(f"{value:.{digits}g}")

    parts = {}
    if values.u_value is not None:
        parts["u"] = Note("U {value:g}", value=rounded(values.u_value))
    if values.g_value is not None:
        parts["g"] = Note("g {value:g}", value=rounded(values.g_value))
    if values.visible is not None:
        parts["visible"] = Note("visible transmittance {value:g}", value=rounded(values.visible))
    if values.solar is not None:
        parts["solar"] = Note("solar transmittance {value:g}", value=rounded(values.solar))
    return Note(", ".join(f"{{{key}}}" for key in parts), **parts)
