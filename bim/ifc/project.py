"""The IFC file itself: opening it, site, units, and the text of its elements."""

from __future__ import annotations

import shutil
import uuid
import zipfile
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.element
import ifcopenshell.util.unit

from bim.ifc.damage import Damage, entities, instances, type_of
from bim.ifc.head import SCHEMAS, ZIPPED, check_head, model_names
from bim.report.issue import Issue
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import scratch_folder

STOREYS = ("IfcBuildingStorey", "IfcFacilityPart")
END = 4096  # bytes in which the end of a STEP file is looked for


def open_ifc(path: str | PathLike[str]) -> ifcopenshell.file:
    """The one model of a file (.ifc, .ifczip); `DataError` where it is none, or has several."""
    models = open_all([path])
    if len(models) > 1:
        message = f"expected one .ifc inside, found {len(models)}: {', '.join(models)}"
        raise DataError(message, file=path)
    return next(iter(models.values()))


def open_all(paths: Sequence[str | PathLike[str]]) -> dict[str, ifcopenshell.file]:
    """The models of files by name, those of an .ifczip each, the one with most spaces first."""
    models: dict[str, ifcopenshell.file] = {}
    for path in map(Path, paths):
        check_head(path)
        if path.suffix.lower() in ZIPPED:
            opened = _open_zipped(path)
        else:
            opened = {path.name: _open_step(path, path)}
        for name, model in opened.items():
            models[name if name not in models else str(path)] = model
    return models


def _open_zipped(path: Path) -> dict[str, ifcopenshell.file]:
    models = {}
    try:
        with zipfile.ZipFile(path) as archive, scratch_folder() as folder:
            inner = folder / "model.ifc"
            names = model_names(archive, path)
            for name in names:
                with archive.open(name) as packed, inner.open("wb") as unpacked:
                    shutil.copyfileobj(packed, unpacked)
                models[name if len(names) > 1 else path.name] = _open_step(inner, path)
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise DataError(f"cannot be unzipped: {error}", file=path) from None
    return dict(sorted(models.items(), key=lambda one: -len(one[1].by_type("IfcSpace"))))


def _open_step(path: Path, shown: Path) -> ifcopenshell.file:
    """Open a STEP file; errors name the file that the user gave."""
    try:
        model = ifcopenshell.open(str(path))
    except (ifcopenshell.Error, OSError, RuntimeError, UnicodeDecodeError) as error:
        reason = (str(error).strip().splitlines() or ["the parser gives no reason"])[0]
        raise DataError(f"cannot be read as IFC: {reason}", file=shown) from None
    if not model.schema.startswith(SCHEMAS):
        raise DataError(f"schema {model.schema}, expected one of {SCHEMAS}", file=shown)
    if not model.by_type("IfcProject") and not model.by_type("IfcProduct"):
        raise DataError("holds no project and no products: damaged or cut off", file=shown)
    _mend_stars(model)
    mend_guids(model)
    return model


def mend_guids(model: ifcopenshell.file) -> None:
    """Give products without a GlobalId the one of their STEP number."""
    for product in model.by_type("IfcProduct"):
        if not product.GlobalId:
            product.GlobalId = numbered_guid(product.id())


def numbered_guid(step_id: int) -> str:
    """The GlobalId for a product without one: the same whenever the file is read."""
    return ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_OID, str(step_id)).hex)


def guid_issues(model: ifcopenshell.file) -> list[Issue]:
    """An issue where products have no GlobalId in the file."""
    products = model.by_type("IfcProduct")
    missing = [one.id() for one in products if one.GlobalId == numbered_guid(one.id())]
    values = {"count": len(missing), "first": min(missing, default=0)}
    return [Issue("guid-missing", "project", values)] if missing else []


def _mend_stars(model: ifcopenshell.file) -> None:
    """Empty the attributes that Renga writes as "*" (derived) though they are not derived.

    The geometry engine gives up on products whose name is a star.
    """
    schema = ifcopenshell.ifcopenshell_wrapper.schema_by_name(model.schema_identifier)
    for product in model.by_type("IfcProduct"):
        if ",*" not in str(product):
            continue
        derived = schema.declaration_by_name(product.is_a()).as_entity().derived()
        for index, value in enumerate(product):
            if value is None and not derived[index]:
                product[index] = None


def ending_issues(path: str | PathLike[str]) -> list[Issue]:
    """An issue for each STEP file that has lost its end."""
    path = Path(path)
    return [Issue("file-cut-off", name) for name, end in _ends(path) if b"END-ISO-10303-21" not in end]


def _ends(path: Path) -> Iterator[tuple[str, bytes]]:
    """Name and last bytes of a STEP file, or of those in a zipped file."""
    if path.suffix.lower() not in ZIPPED:
        with path.open("rb") as stream:
            stream.seek(max(path.stat().st_size - END, 0))
            yield path.name, stream.read()
        return
    with zipfile.ZipFile(path) as archive:
        names = model_names(archive, path)
        for name in names:
            end = b""
            with archive.open(name) as stream:
                while block := stream.read(2**20):
                    end = (end + block)[-END:]
            yield name if len(names) > 1 else path.name, end


def length_issues(model: ifcopenshell.file) -> list[Issue]:
    """An issue where the file states no length unit, or where its units cannot be read."""
    damage = Damage()
    unit = _unit(model, "LENGTHUNIT", damage)
    _unit_scale(model, "LENGTHUNIT", damage)
    missing = unit is None and not damage.issues
    return [Issue("length-unit-missing", "project")] if missing else damage.issues


def area_scale(model: ifcopenshell.file, kind: str) -> float:
    """Factor from the file's unit of "AREAUNIT" or "VOLUMEUNIT" to m2 or m3."""
    if _unit(model, kind, Damage()) is not None:
        return _unit_scale(model, kind, Damage())
    return length_scale(model) ** (2 if kind == "AREAUNIT" else 3)


def length_scale(model: ifcopenshell.file) -> float:
    """Factor from the file's unit of length to m; 1 where `length_issues` reports its units."""
    return _unit_scale(model, "LENGTHUNIT", Damage())


def _unit(model: ifcopenshell.file, kind: str, damage: Damage) -> ifcopenshell.entity_instance | None:
    return damage.read(ifcopenshell.util.unit.get_project_unit, model, kind, of=None, data="units", default=None)


def _unit_scale(model: ifcopenshell.file, kind: str, damage: Damage) -> float:
    return float(
        damage.read(ifcopenshell.util.unit.calculate_unit_scale, model, kind, of=None, data="units", default=1.0)
    )


DEFAULT_SITES = {"Archicad": (24.467, 54.417), "Revit": (42.359, -71.057)}  # latitude, longitude [deg]
SAME_SITE_DEG = 0.005


def site_location(model: ifcopenshell.file) -> tuple[float | None, float | None, float, list[Issue]]:
    """Latitude and longitude (east positive) [deg], elevation [m], and what is wrong with them."""
    for site in model.by_type("IfcSite"):
        latitude, longitude = _degrees(site.RefLatitude), _degrees(site.RefLongitude)
        elevation = float(site.RefElevation or 0.0) * length_scale(model)
        if latitude is None or longitude is None:
            continue
        if abs(latitude) > 90 or abs(longitude) > 180:
            values = {"latitude": latitude, "longitude": longitude}
            return None, None, elevation, [Issue("site-not-on-earth", site.GlobalId, values)]
        if latitude == 0 and longitude == 0:
            return None, None, elevation, [Issue("site-at-zero", site.GlobalId)]
        issues = [
            Issue("site-of-exporter", site.GlobalId, {"latitude": latitude, "longitude": longitude, "program": program})
            for program, place in DEFAULT_SITES.items()
            if max(abs(latitude - place[0]), abs(longitude - place[1])) < SAME_SITE_DEG
        ]
        return latitude, longitude, elevation, issues
    return None, None, 0.0, [Issue("site-without-position", "IfcSite")]


def _degrees(parts: tuple[int, ...] | None) -> float | None:
    """Decimal degrees from degrees, minutes, seconds and millionths of a second."""
    if not parts:
        return None
    values = [abs(float(part)) for part in parts] + [0.0] * 4
    sign = -1.0 if any(part < 0 for part in parts) else 1.0
    return sign * (values[0] + values[1] / 60 + (values[2] + values[3] / 1e6) / 3600)


def storeys_in(model: ifcopenshell.file) -> list[ifcopenshell.entity_instance]:
    """The storeys of buildings, and of IFC4X3's other facilities the parts."""
    return [one for name in STOREYS for one in instances(model, name)]


def storey_of(element: ifcopenshell.entity_instance) -> str:
    """Name of the storey that holds the element, "" if none."""
    container = element
    for _ in range(20):  # aggregates may be nested, a damaged file may hold a loop
        if container is None or any(map(container.is_a, STOREYS)):
            break
        container = parent_of(container)
    return (container.Name or "") if container is not None else ""


def parent_of(element: ifcopenshell.entity_instance) -> ifcopenshell.entity_instance | None:
    """What contains, aggregates or is filled or voided by the element; None at the top."""
    for relations, attribute in (
        ("ContainedInStructure", "RelatingStructure"),
        ("Decomposes", "RelatingObject"),
        ("FillsVoids", "RelatingOpeningElement"),
        ("VoidsElements", "RelatingBuildingElement"),
    ):
        for relation in getattr(element, relations, None) or ():
            parent = getattr(relation, attribute, None)
            if parent is not None:
                return parent
    return None


def definitions_of(holder: ifcopenshell.entity_instance | None) -> list[ifcopenshell.entity_instance]:
    """Property and quantity sets of an element or of a type itself."""
    definitions = entities(getattr(holder, "HasPropertySets", None))
    for relation in getattr(holder, "IsDefinedBy", None) or ():
        for definition in entities(getattr(relation, "RelatingPropertyDefinition", None)):
            is_set = definition.is_a("IfcPropertySetDefinitionSet")
            definitions += entities(definition.wrappedValue) if is_set else [definition]
    return definitions


def psets_of(element: ifcopenshell.entity_instance, damage: Damage | None = None) -> dict[str, dict[str, Any]]:
    """Properties and quantities, by the name of their set, of an element and its type.

    Complex properties are left out: through the numbers of a BSDF it takes a second.
    """
    damage = Damage() if damage is None else damage
    sets: dict[str, dict[str, Any]] = {}
    for holder in (type_of(element, damage), element):
        for definition in definitions_of(holder):
            name = getattr(definition, "Name", None)
            if name is not None:
                values = _plain_values(definition, element, damage)
                sets.setdefault(name, {}).update(values)
    return sets


def _plain_values(
    definition: ifcopenshell.entity_instance, element: ifcopenshell.entity_instance, damage: Damage
) -> dict[str, object]:
    if not definition.is_a("IfcPropertySet"):
        read = ifcopenshell.util.element.get_property_definition
        return damage.read(read, definition, of=element, data="quantities", default={})
    values: dict[str, object] = {}
    for one in entities(definition.HasProperties):
        if not one.is_a("IfcComplexProperty"):
            read = ifcopenshell.util.element.get_properties
            values |= damage.read(read, [one], of=element, data="properties", default={})
    return values
