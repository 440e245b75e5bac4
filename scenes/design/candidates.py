"""A candidate of a design: values of its variables, its systems of panes and a blind, and the study they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import tomlkit
from pydantic import BaseModel

from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import write_text
from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.source_code import code_version
from scenes.design.design_file import OWN, SYSTEM, BlindTable, Design, DesignSystem, VariableTable
from scenes.fenestration.slats import layers_bsdf
from scenes.fenestration.thermal_file import GlazingLayerTable
from scenes.quick import ROOM, picks
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions
from scenes.study.study_file import Study
from scenes.toml_file import TomlTable, read_table, set_key, validated, with_absolute_files

SLAT_RULES = ("cut-off",)  # rules that need the size of the slats


def states_of(system: DesignSystem, folder: Path, *, traced: bool = True) -> list[dict[str, Any]]:
    """The `[[system]]` tables of an operation file: the panes alone, then the blind at its tilts.

    Args: folder: of the BSDF files; traced: they are made where they are missing.

    Raises: `DataError` for sizes that do not go together.
    """
    panes = [_plain(layer) for layer in system.layers]
    raised: dict[str, Any] = {"layers": panes}
    if system.blind is None:
        return [raised]
    return [raised, *(_lowered(system, system.blind, tilt, folder, traced) for tilt in system.blind.tilts)]


def with_slats(control: dict[str, Any], blind: BlindTable) -> dict[str, Any]:
    """The table of a control whose rules know the size of the slats, where it states none."""
    changed = dict(control)
    if changed.get("rule") in SLAT_RULES:
        changed = {"slat_width": blind.slat_width, "slat_spacing": blind.slat_spacing} | changed
    for key in ("parts", "group"):
        if key in changed:
            changed[key] = [with_slats(one, blind) for one in changed[key]]
    return changed


def write_once(folder: Path, stem: str, suffix: str, text: str) -> Path:
    """A file named by its content."""
    path = folder / f"{stem}-{digest(text)[:16]}{suffix}"
    if not path.is_file():
        write_text(path, text)
    return path


def operation_text(table: dict[str, Any]) -> str:
    """An operation file as TOML."""
    return tomlkit.dumps(table)


def _lowered(system: DesignSystem, blind: BlindTable, tilt: float, folder: Path, traced: bool) -> dict[str, Any]:
    """The state with the blind at a tilt."""
    slats = {
        "width": blind.slat_width,
        "spacing": blind.slat_spacing,
        "tilt_deg": tilt,
        "visible": blind.visible,
        "solar": blind.visible if blind.solar is None else blind.solar,
        "specular": blind.specular,
        "roughness": blind.roughness,
    }
    if blind.slat_radius:
        slats["radius"] = blind.slat_radius
    shade: dict[str, Any] = {"slats": slats, "emissivity": [blind.emissivity, blind.emissivity]}
    panes = [_plain(layer) for layer in system.layers]
    if blind.position == "outdoors":
        layers = [shade | {"gap": {"width": blind.distance}}, *panes]
    else:
        layers = [*panes[:-1], panes[-1] | {"gap": {"width": blind.distance}}, shade]
    return {
        "bsdf": str(_bsdf_file(system, blind, tilt, layers, folder, traced)),
        "tilt_deg": tilt,
        "see_through": "specular",
        "layers": layers,
    }


def _bsdf_file(
    system: DesignSystem, blind: BlindTable, tilt: float, layers: Sequence[dict[str, Any]], folder: Path, traced: bool
) -> Path:
    """The BSDF file of the panes with the blind at a tilt, traced where it is missing."""
    of_light = blind.model_dump_json(exclude={"tilt_deg", "tilts_deg", "emissivity", "distance"})
    panes = [layer.model_dump_json() for layer in system.layers]
    key = digest(code_version("mitsuba_cfs.bsdf.generate"), code_version(layers_bsdf.__module__), of_light, tilt, panes)
    path = folder / f"blind-{key[:16]}.xml"
    if path.is_file() or not traced:
        return path
    try:
        tables = [validated(GlazingLayerTable, layer, Path()) for layer in layers]
        (bands,) = layers_bsdf(tables, paths=blind.paths, seed=blind.seed)
    except DataError as error:  # sizes that do not go together
        raise DataError(error.message, field="system.blind") from None
    name = f"{system.name}, {tilt:g} deg"
    file = BsdfFile(dict(bands), name=name, emissivity_front=blind.emissivity, emissivity_back=0.84)
    write_bsdf_xml(file, path, digits=5)
    return path


def _plain(table: TomlTable) -> dict[str, Any]:
    """A table as TOML holds it: stated keys alone, paths as texts."""
    return table.model_dump(mode="json", exclude_unset=True, exclude_none=True)


Point = tuple[float | int, ...]  # of each variable: the number of its option, or a number
OPERATION = "operation"
# keys of a box's window that stand for others: its height by its head, plates round it
OF_WINDOW = ("head", "overhang", "fins")
LOWERED = {"rule": "always", "state": 1}  # of a blind without a rule
CHEAP = {"methods": ["three-phase"], "glare": "sDGP"}  # of the search where `search.quick`
DEGREES, METRES = "_deg", ("slat_width", "slat_spacing", "slat_radius", "distance", "width", "height", "sill", "depth")


@dataclass(frozen=True, slots=True)
class Candidate:
    """A point of a design, and the study of it; equal studies have equal cases."""

    point: Point
    label: str  # its values in words
    values: tuple[tuple[str, str], ...]  # of each variable that matters to it: name and value
    system: DesignSystem | None
    study: Study


def candidate(
    design: Design, point: Point, folder: Path, *, quick: bool = False, seed: int = 0, traced: bool = True
) -> Candidate:
    """The candidate of a point.

    Args:
        folder: of the systems and operation files that it is made of.
        quick: with the methods of the search.
        seed: added to that of the study's options.
        traced: whether blinds are traced; without, the study is checked and cannot be computed.

    Raises: `DataError` for values that do not go together.
    """
    values = {one.name: value_of(one, at) for one, at in zip(design.variable, point, strict=True)}
    table = design.model_dump(exclude_unset=True, exclude=set(OWN))
    settings = [(one, key, value) for one in design.variable for key, value in one.settings(values[one.name]).items()]
    system = _chosen(design, [(key, value) for _, key, value in settings])
    own: dict[str, Any] = {} if system is None else next(t for t in table["system"] if t["name"] == system.name)
    operation: dict[str, Any] = {}
    acting = set()
    for variable, key, value in settings:
        try:
            acts = _set(table, own, operation, key, value)
        except DataError as error:
            raise DataError(error.message, field=f"variable {variable.name}, {key}") from None
        if acts:
            acting.add(variable.name)
    _shape_windows(table)
    words = tuple((one.name, _words(one, values[one.name])) for one in design.variable if one.name in acting)
    named = {SYSTEM, *(one.name for one in design.variable if one.choices)}  # by their values alone
    label = ", ".join(text if one in named else f"{one} {text}" for one, text in words)
    if system is not None:
        system = _validated(DesignSystem, own)
        operated = _operated(system, table.get(OPERATION), operation, folder, traced)
        table["system"] = [{k: v for k, v in operated.items() if v is not None} | {"name": label or system.name}]
    elif operation:
        base = table.get(OPERATION)
        table[OPERATION] = _write_operation(_base(base), operation, folder)
    if quick:
        stated = cast(BaseModel, design.options).model_fields_set
        table |= CHEAP | ({"glare": "none"} if design.glare == "none" else {})
        if any(one.needs_sun for one in design.constraint):
            table["methods"] = ["five-phase"]
        table["options"] = table.get("options", {}) | picks(ROOM, stated)
        table["quick"] = True
    if seed:
        options = table.get("options", {})
        table["options"] = options | {"seed": options.get("seed", RoomOptions().sampling.seed) + seed}
    return Candidate(point, label, words, system, _validated(Study, table))


def value_of(variable: VariableTable, at: float | int) -> Any:
    """The value at a coordinate of a point."""
    return variable.options[int(at)] if variable.options else float(at)


def mattering(design: Design, folder: Path) -> tuple[frozenset[str], ...]:
    """The names of the variables that matter to each system that may be chosen; one without a choice.

    Raises: `DataError` for the first variable with a value that cannot be, others at their first.
    """
    middle: Point = tuple(0 if one.options else one.span[0] for one in design.variable)
    systems = next((i for i, one in enumerate(design.variable) if one.key == SYSTEM), None)
    starts = [middle]
    if systems is not None:
        count = len(design.variable[systems].options)
        starts = [(*middle[:systems], number, *middle[systems + 1 :]) for number in range(count)]
    found = []
    for start in starts:
        mattered = set() if systems is None else {design.variable[systems].name}
        for number, one in enumerate(design.variable):
            ends = (0, len(one.options) - 1) if one.is_number and one.options else range(len(one.options))
            for at in ends or one.span:
                point = (*start[:number], at, *start[number + 1 :])
                made = candidate(design, point, folder, quick=design.search.quick, traced=False)
                if number != systems:
                    mattered |= {name for name, _ in made.values}
        found.append(frozenset(mattered))
    for number, one in enumerate(design.variable):
        if not any(one.name in mattered for mattered in found):
            key = one.key or next(iter(next(iter(one.choices.values()))), "")
            raise DataError(f"no system has {key!r}", field=f"variable.{number}.key")
    return tuple(found)


def same_candidate(design: Design, matter: tuple[frozenset[str], ...], point: Point) -> Point:
    """The point with the variables that do not matter to its system at their first value.

    Args: matter: of `mattering`.
    """
    systems = next((i for i, one in enumerate(design.variable) if one.key == SYSTEM), None)
    own = matter[0 if systems is None else int(point[systems])]
    firsts = (0 if one.options else one.span[0] for one in design.variable)
    return tuple(
        at if one.name in own else first for one, at, first in zip(design.variable, point, firsts, strict=True)
    )


def _chosen(design: Design, settings: list[tuple[str, Any]]) -> DesignSystem | None:
    names = [value for key, value in settings if key == SYSTEM] or list(design.names[:1])
    return next((one for one in design.system if one.name in names[-1:]), None)


def _set(table: dict[str, Any], own: dict[str, Any], operation: dict[str, Any], key: str, value: Any) -> bool:
    """Set a key of the study's table, its system or its operation; whether it matters there.

    Raises: `DataError` for a key that there is not.
    """
    first, _, rest = key.partition(".")
    if key == SYSTEM:
        return True
    if first == SYSTEM:
        if not own:
            raise DataError("there is no [[system]]")
        if rest.startswith("blind.") and own.get("blind") is None:
            return False
        set_key(own, rest.split("."), value, made=False)
        return True
    if first == OPERATION and rest:
        if rest.partition(".")[0] == "control" and own and _one_state(own):
            return False
        operation[rest] = value
        return True
    set_key(table, key.split("."), value, made=first == "options")
    return True


def _one_state(own: Mapping[str, Any]) -> bool:
    """Whether a system has a single state, which no rule moves."""
    return own.get("bsdf") is not None or (bool(own.get("layers")) and own.get("blind") is None)


def _shape_windows(table: dict[str, Any]) -> None:
    """Heights by heads, and plates as deep as overhangs and fins, of the windows of boxes."""
    for room in table["room"]:
        box = room.get("box")
        plates = [] if box is None else list(box.get("plate", ()))
        for window in () if box is None else box["window"]:
            head, overhang, fins = (window.pop(key, None) for key in OF_WINDOW)
            if head is not None:
                window["height"] = round(head - window["sill"], 6)
            left, bottom = window["x"], window["sill"]
            right, top = left + window["width"], bottom + window["height"]
            side = window.get("side", "front")
            edges = [((left, top), (right, top), overhang)]
            edges += [((x, bottom), (x, top), fins) for x in (left, right)]
            plates += [{"start": a, "end": b, "depth": depth, "side": side} for a, b, depth in edges if depth]
        if plates:
            box["plate"] = plates


def _operated(
    system: DesignSystem, of_study: Path | None, changes: dict[str, Any], folder: Path, traced: bool
) -> dict[str, Any]:
    """A `[[system]]` table of a study, with an operation file of its own where it needs one."""
    plain = system.model_dump(exclude_unset=True, exclude={"layers", "blind", "cost", "carbon"})
    if not system.layers and not changes:
        return plain
    base = _base(system.operation or of_study)
    if system.layers:
        base[SYSTEM] = states_of(system, folder, traced=traced)
    if _one_state(system.model_dump()):
        base.pop("control", None)
    file = _write_operation(base, changes, folder, system)
    return plain | {OPERATION: file}


def _base(path: Path | None) -> dict[str, Any]:
    """An operation file as it stands, the files that it names with absolute paths."""
    return {} if path is None else with_absolute_files(read_table(path), path.parent)


def _write_operation(
    base: dict[str, Any], changes: Mapping[str, Any], folder: Path, system: DesignSystem | None = None
) -> Path:
    """The operation file of a candidate."""
    table = deepcopy(base)
    for key, value in changes.items():
        set_key(table, key.split("."), value, made=True)
    if system is not None and system.blind is not None:
        table["control"] = with_slats(table.get("control", LOWERED), system.blind)
    _validated(OperationTables, table)
    return write_once(folder, OPERATION, ".toml", operation_text(table))


def _validated(model: Any, table: dict[str, Any]) -> Any:
    """The table as the model; `DataError` that names the first wrong key."""
    try:
        return validated(model, table, Path())
    except DataError as error:
        raise DataError(error.message, field=error.field) from error


def _words(variable: VariableTable, value: Any) -> str:
    """A value with its unit."""
    if variable.choices or isinstance(value, str):
        return str(Path(value).stem) if Path(str(value)).is_absolute() else str(value)
    unit = variable.unit
    if unit is None:
        last = variable.key.rpartition(".")[2]
        unit = "°" if last.endswith(DEGREES) else " m" if last in (*METRES, *OF_WINDOW) else ""
    elif unit and unit[0] not in "°%":
        unit = f" {unit}"
    return (f"{value:g}" if isinstance(value, int | float) else str(value)) + unit
