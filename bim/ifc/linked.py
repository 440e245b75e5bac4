"""Several IFC files of one building as one model: architecture, facade, structure, site.

The first file leads: its units, axes and north hold, and its definition of an element that several
files have (the same GlobalId, class and place).  Another file is placed, in this order, by its map
conversion, its site (the same latitude and longitude) or its origin; where these disagree, by the
first under which repeated elements coincide, else under which the plans overlap.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.element
import ifcopenshell.util.placement
import ifcopenshell.util.unit
import numpy as np
from numpy.typing import NDArray

from bim.ifc.damage import entities, placement_of
from bim.ifc.north import map_conversions, true_north
from bim.ifc.placing import to_map
from bim.ifc.project import length_scale, mend_guids, numbered_guid, site_location, storeys_in
from bim.report.issue import Issue, Phrase
from mitsuba_cfs.errors import DataError

Entity = ifcopenshell.entity_instance
COINCIDES = 0.05  # largest distance between places of a repeated element [m]
STOREY_STEP = 0.5  # storeys of two files whose heights differ by less are one [m]
MARGIN = 20.0  # plans that are farther apart do not belong together [m]
TURNED = 1.0  # norths that differ by more are reported [deg]
ASSIGNMENT = "IfcRelAssigns"  # groups and zones, which may have members of several files


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where a file's axes lie [m]."""

    to_map: tuple[str, NDArray[np.float64]] | None  # coordinate system, [4, 4]
    position: tuple[float | None, float | None]  # latitude and longitude of the site [deg]
    elevation: float  # of the site
    site: NDArray[np.float64] | None  # [4, 4] its placement
    places: NDArray[np.float64]  # [N, 3] of the elements

    @classmethod
    def of(cls, model: ifcopenshell.file) -> _Frame:
        """The frame of a file, in its own units before these are changed."""
        latitude, longitude, elevation, _ = site_location(model)
        site = next(iter(model.by_type("IfcSite")), None)
        place = None if site is None else placement_of(site)
        unit = length_scale(model)
        if place is not None:
            place[:3, 3] *= unit
        drawn = [placement_of(one) for one in model.by_type("IfcElement") if one.Representation]
        places = [unit * one[:3, 3] for one in drawn if one is not None]
        return cls(to_map(model), (latitude, longitude), elevation, place, np.array(places).reshape(-1, 3))

    def gap(self, other: _Frame, matrix: NDArray[np.float64]) -> float:
        """Distance of the plans of both files [m], the other moved by [4, 4]."""
        moved = other.places @ matrix[:3, :3].T + matrix[:3, 3]
        if not len(moved) or not len(self.places):
            return 0.0
        apart = np.maximum(moved.min(0) - self.places.max(0), self.places.min(0) - moved.max(0))
        return float(np.linalg.norm(np.maximum(apart[:2], 0.0)))


@dataclass(frozen=True, slots=True)
class _Transform:
    """From the axes of a file to those of the first one [m]."""

    by: str  # phrase of the catalogue
    matrix: NDArray[np.float64]  # [4, 4]


def one_model(models: Mapping[str, ifcopenshell.file]) -> tuple[ifcopenshell.file, list[Issue]]:
    """The first of the models with what the others add, and how each of these was placed.

    Args: models: by the name of the file; they are changed.

    Raises: `DataError` for a schema that is not the first file's.
    """
    (first_name, model), *others = models.items()
    issues: list[Issue] = []
    if not others:
        return model, issues
    first = _Frame.of(model)
    for name, other in others:
        if other.schema != model.schema:
            message = f"has schema {other.schema}, {first_name} has {model.schema}: export both in one"
            raise DataError(message, file=name)
        frame = _Frame.of(other)
        transforms = [(transform, first.gap(frame, transform.matrix)) for transform in _transforms(first, frame)]
        convert_units(other, model)
        issues += _added(model, other, transforms, names=(name, first_name))
    return model, issues


def _added(
    model: ifcopenshell.file,
    other: ifcopenshell.file,
    transforms: Sequence[tuple[_Transform, float]],
    names: tuple[str, str],
) -> list[Issue]:
    """Add another model to the first one; the issues name how.

    Args:
        ways: that the files state, each with the gap that it leaves between the plans [m].
        names: of the other file and the first.
    """
    name, first_name = names
    unit = length_scale(model)
    known = {(one.GlobalId, one.is_a()): one for one in _roots(model)}
    pairs = [(one, known[key]) for one in _roots(other) if (key := (one.GlobalId, one.is_a())) in known]
    transform, apart = _fitting(model, other, pairs, transforms)
    pairs = [(one, same) for one, same in pairs if _distance(one, same, transform, unit) <= COINCIDES]
    issues = _north_issues(model, other, transform, name, first_name)
    if not np.allclose(transform.matrix, np.eye(4)):
        move(other, transform.matrix, unit)
    _drop_georeference(other, keep=transform.by == "linked-by-origin" and not _georeferenced(model))
    storeys = _same_storeys(model, other, [one for one, _ in pairs])
    repeated = sum(one.is_a("IfcElement") for one, _ in pairs)
    pairs += storeys
    project = model.by_type("IfcProject")
    same = {one.id(): first for one, first in pairs}
    same |= {one.id(): project[0] for one in other.by_type("IfcProject") if project}
    _prune_relations(other, same)
    taken = {one.GlobalId for one in model.by_type("IfcRelationship")}
    clashing = [one for one in other.by_type("IfcRelationship") if one.GlobalId in taken]
    for one in (*clashing, *(other.by_id(step_id) for step_id in same)):
        one.GlobalId = _another_guid(one, name)
    count = len(other.by_type("IfcElement"))
    added = {one.id(): model.add(one) for one in other}
    for old, first in same.items():
        double = added[old]
        if getattr(first, "Representation", 0) is None and double.Representation is not None:
            first.Representation, first.ObjectPlacement = (double.Representation, double.ObjectPlacement)
        for holder in model.get_inverse(double):
            ifcopenshell.util.element.replace_attribute(holder, double, first)
        model.remove(double)
    mend_guids(model)
    values = {
        "file": name,
        "first": first_name,
        "by": Phrase(transform.by),
        "elements": count - repeated,
        "repeated": repeated,
        "storeys": len(storeys),
        "angle": _turn_deg(transform.matrix),
        "distance": float(np.linalg.norm(transform.matrix[:3, 3])),
    }
    issues.append(Issue("file-linked", name, values))
    if apart > MARGIN:
        issues.append(Issue("file-apart", name, {"file": name, "first": first_name, "distance": apart}))
    return issues


def _roots(model: ifcopenshell.file) -> Iterator[Entity]:
    """What has a GlobalId in the file and may be in several files; relations are not."""
    for one in model.by_type("IfcRoot"):
        stated = one.GlobalId and one.GlobalId != numbered_guid(one.id())
        if stated and not one.is_a("IfcRelationship"):
            yield one


# ---- where a file lies ----------------------------------------------------------------------


def _fitting(
    model: ifcopenshell.file,
    other: ifcopenshell.file,
    pairs: Sequence[tuple[Entity, Entity]],
    transforms: Sequence[tuple[_Transform, float]],
) -> tuple[_Transform, float]:
    """The first of the ways that fits, else the first, and the gap that it leaves [m]."""
    unit = length_scale(model)
    drawn = [(one, same) for one, same in pairs if getattr(one, "Representation", None) is not None]
    gaps = []
    for transform, gap in transforms:
        if drawn:
            gap = float(np.median([_distance(one, same, transform, unit) for one, same in drawn]))
        if gap <= (COINCIDES if drawn else MARGIN):
            return transform, gap
        gaps.append(gap)
    return transforms[0][0], gaps[0]


def _transforms(first: _Frame, other: _Frame) -> Iterator[_Transform]:
    """The ways from a file's axes to the first one's that they state, the most reliable first."""
    here, there = first.to_map, other.to_map
    if here is not None and there is not None and here[0] == there[0]:
        yield _Transform("linked-by-map", np.linalg.inv(here[1]) @ there[1])
    known = None not in first.position and first.position == other.position
    if known and first.site is not None and other.site is not None:
        raised = np.eye(4)
        raised[2, 3] = other.elevation - first.elevation
        yield _Transform("linked-by-site", first.site @ raised @ np.linalg.inv(other.site))
    yield _Transform("linked-by-origin", np.eye(4))


def _distance(one: Entity, same: Entity, transform: _Transform, unit: float) -> float:
    """Distance of two elements' places [m]; 0 for what has no place."""
    if not one.is_a("IfcProduct"):
        return 0.0
    here, there = placement_of(same), placement_of(one)
    if here is None or there is None:
        return 0.0
    place = transform.matrix @ np.array([*unit * there[:3, 3], 1.0])
    return float(np.linalg.norm(place[:3] - unit * here[:3, 3]))


def move(model: ifcopenshell.file, matrix: NDArray[np.float64], unit: float) -> None:
    """Move all products of a model by [4, 4] [m]."""
    turn = matrix.copy()
    turn[:3, 3] /= unit
    tops = [one for one in model.by_type("IfcLocalPlacement") if one.PlacementRelTo is None]
    for top in tops:
        place = turn @ ifcopenshell.util.placement.get_local_placement(top)
        top.RelativePlacement = _axes(model, place)
    bare = [one for one in model.by_type("IfcProduct") if one.ObjectPlacement is None]
    for product in (one for one in bare if one.Representation is not None):
        product.ObjectPlacement = model.create_entity("IfcLocalPlacement", RelativePlacement=_axes(model, turn))


def _axes(model: ifcopenshell.file, place: NDArray[np.float64]) -> Entity:
    """An IfcAxis2Placement3D."""
    point = model.create_entity("IfcCartesianPoint", place[:3, 3].tolist())
    z, x = (model.create_entity("IfcDirection", place[:3, k].tolist()) for k in (2, 0))
    return model.create_entity("IfcAxis2Placement3D", point, z, x)


def _turn_deg(matrix: NDArray[np.float64]) -> float:
    return math.degrees(math.atan2(matrix[1, 0], matrix[0, 0])) + 0.0


def _north_issues(
    model: ifcopenshell.file, other: ifcopenshell.file, transform: _Transform, name: str, first_name: str
) -> list[Issue]:
    """An issue where both files state TrueNorth and these differ once the file is placed."""
    norths = [true_north(one)[0] for one in (model, other)]
    if norths[0] is None or norths[1] is None:
        return []
    x, y = transform.matrix[:2, :2] @ norths[1]
    angle = math.degrees(math.atan2(y, x) - math.atan2(norths[0][1], norths[0][0]))
    angle = (angle + 180.0) % 360.0 - 180.0
    values = {"file": name, "first": first_name, "angle": abs(angle)}
    return [Issue("file-north-differs", name, values)] if abs(angle) > TURNED else []


def _georeferenced(model: ifcopenshell.file) -> bool:
    return bool(map_conversions(model)) or true_north(model)[0] is not None


def _drop_georeference(model: ifcopenshell.file, *, keep: bool) -> None:
    """Leave map and north to the first file, unless it states neither and the axes are the same."""
    if keep:
        return
    for context in model.by_type("IfcGeometricRepresentationContext", include_subtypes=False):
        context.TrueNorth = None
    if model.schema != "IFC2X3":
        for one in model.by_type("IfcMapConversion"):
            model.remove(one)


# ---- units ----------------------------------------------------------------------------------


def convert_units(model: ifcopenshell.file, first: ifcopenshell.file) -> None:
    """Give a model the units of the first one: lengths and plane angles are converted."""
    length = length_scale(model) / length_scale(first)
    angle = _angle_scale(model) / _angle_scale(first)
    if not math.isclose(length, 1.0, rel_tol=1e-9):
        _scale(model, "IfcLengthMeasure", length)
    if not math.isclose(angle, 1.0, rel_tol=1e-9):
        _scale(model, "IfcPlaneAngleMeasure", angle)
        for curve in model.by_type("IfcTrimmedCurve"):
            if curve.BasisCurve.is_a("IfcConic"):
                for trim in (*curve.Trim1, *curve.Trim2):
                    if trim.is_a("IfcParameterValue"):
                        trim.wrappedValue *= angle
    units = next(iter(first.by_type("IfcUnitAssignment")), None)
    for project in model.by_type("IfcProject") if units is not None else ():
        project.UnitsInContext = model.add(units)


def _angle_scale(model: ifcopenshell.file) -> float:
    """Radians in the file's unit of plane angles."""
    return float(ifcopenshell.util.unit.calculate_unit_scale(model, "PLANEANGLEUNIT"))


def _scale(model: ifcopenshell.file, measure: str, factor: float) -> None:
    """Multiply every value of a measure."""

    def scaled(value):
        return tuple(map(scaled, value)) if isinstance(value, tuple) else value * factor

    each = ifcopenshell.util.unit.iter_element_and_attributes_per_type(model, measure)
    for element, attribute, value in list(each):
        if isinstance(value, ifcopenshell.entity_instance):
            value.wrappedValue = scaled(value.wrappedValue)
        else:
            setattr(element, attribute.name(), scaled(value))


# ---- what is in both files ------------------------------------------------------------------


def _same_storeys(
    model: ifcopenshell.file, other: ifcopenshell.file, repeated: Sequence[Entity]
) -> list[tuple[Entity, Entity]]:
    """Storeys of the other file, each with the one of the first at its height."""
    unit = length_scale(model)
    taken = {one.id() for one in repeated}
    heights = [
        (float(place[2, 3]), storey) for storey in storeys_in(model) if (place := placement_of(storey)) is not None
    ]
    pairs = []
    for storey in storeys_in(other):
        place = placement_of(storey)
        if storey.id() in taken or place is None or not heights:
            continue
        z, first = min(heights, key=lambda one: abs(one[0] - place[2, 3]))
        if unit * abs(z - place[2, 3]) <= STOREY_STEP:
            pairs.append((storey, first))
    return pairs


def _prune_relations(model: ifcopenshell.file, same: Mapping[int, Entity]) -> None:
    """Leave of the relations what the first file does not say itself.

    Args: same: what the first file has too, by STEP id.
    """
    for relation in model.by_type("IfcRelationship"):
        ends = relation.get_info(recursive=False)
        relating = [v for k, v in ends.items() if k.startswith("Relating") and entities(v)]
        related = [k for k in ends if k.startswith("Related") and entities(ends[k])]
        old = all(one.id() in same for v in relating for one in entities(v))
        for key in related:
            several = isinstance(ends[key], tuple)
            if relation.is_a().startswith(ASSIGNMENT) and not old:
                continue
            rest = [one for one in entities(ends[key]) if one.id() not in same]
            if several and rest:
                setattr(relation, key, rest)
            elif not rest and (several or old):
                model.remove(relation)
                break


def _another_guid(one: Entity, name: str) -> str:
    """A GlobalId for what the first file has too, the same in every run."""
    return ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_OID, f"{name} {one.GlobalId}").hex)
