"""A building from a honeybee model (HBJSON): `read_honeybee`.

Light is by the modifiers of honeybee-radiance, heat by the constructions of honeybee-energy, as
honeybee's own recipes take them; where one of the two is missing, the other stands for it.

A surface's modifier is its own, else its room's modifier set's, else the model's global set's.

Source: honeybee-schema, "Modifier", "ModifierSet", "SensorGrid", "View".
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.defaults import FACADE_REFLECTANCE
from bim.drawn_building import DrawnModel, drawn_building
from bim.fenestration import PlainGlass, ShadingState
from bim.held_sensors import ModelGrid, ModelView
from bim.honeybee.energy import EnergyLibrary, OpaqueValues
from bim.honeybee.library import OUTDOORS, PARTS, NamedObjects
from bim.honeybee.schema import (
    Condition,
    HoneybeeAperture,
    HoneybeeDoor,
    HoneybeeModel,
    HoneybeeRoom,
    RoomFace,
    Shade,
    ShadeMesh,
    read_model,
)
from bim.honeybee.use import UseLibrary
from bim.model import Building, Element
from bim.planes import newell_normal
from bim.polygon_rooms import DrawnFace, DrawnOpening, DrawnRoom, GlazingValues, SurfaceFinish, triangles_of_rings
from bim.radiance.materials import RadianceMaterial, material_of
from bim.radiance.primitives import VOID, Primitive
from bim.radiance.xform import read_xform
from bim.report.issue import Issue
from mitsuba_cfs.bsdf.angular import glass_table, specular_matrices
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import scratch_folder
from mitsuba_cfs.images.view import KINDS, View


class SensorReader:
    """The grids and views of a model; what cannot be one is in the issues."""

    def __init__(self, model: HoneybeeModel, file: Path) -> None:
        self.radiance, self.scale, self.file = model.properties.radiance, model.scale, file
        self.issues: list[Issue] = []

    def grids(self) -> tuple[ModelGrid, ...]:
        """The sensor grids [m].

        Raises: `DataError` that names the grid.
        """
        grids = []
        for grid in _objects(self.radiance, "sensor_grids"):
            name = str(grid.get("display_name") or grid["identifier"])
            try:
                rows = [(one["pos"], one["dir"]) for one in grid["sensors"]]
                points, towards = np.array(rows, dtype=float).reshape(-1, 2, 3).transpose(1, 0, 2)
                lengths = np.linalg.norm(towards, axis=1, keepdims=True)
                if not (np.isfinite(points).all() and (lengths > 0).all() and len(points)):
                    raise ValueError(name)
            except (KeyError, TypeError, ValueError, OverflowError):
                message = "expected sensors, each with pos and dir of three numbers"
                raise DataError(message, file=self.file, element=name, field="sensors") from None
            grids.append(ModelGrid(name, self.scale * points, towards / lengths))
        return tuple(grids)

    def views(self) -> tuple[ModelView, ...]:
        """The views [m] that can be made; the others are named in the issues."""
        views = []
        for view in _objects(self.radiance, "views"):
            name = str(view.get("display_name") or view["identifier"])
            made = view_of(view, self.scale)
            if made is None:
                self.issues.append(Issue("view-unreadable", self.file.name, {"view": name}))
            else:
                views.append(ModelView(name, made))
        return tuple(views)


def shade_issues(model: HoneybeeModel, file: Path) -> Iterator[Issue]:
    """Issues that name shades with states, and shades that let light through by a schedule."""
    shades = [s for s in _shades(model) if s.properties.radiance.get("states")]
    if shades:
        values = {"count": len(shades), "shades": tuple(s.label for s in shades)}
        yield Issue("shades-with-states", file.name, values)
    seasonal = [s for s in _shades(model) if s.properties.energy.get("transmittance_schedule")]
    if seasonal:
        values = {"count": len(seasonal), "shades": tuple(s.label for s in seasonal)}
        yield Issue("shades-by-schedule", file.name, values)


def view_of(view: Mapping[str, Any], scale: float) -> View | None:
    """A honeybee view [m]; None where one of its fields cannot be one.

    Args: scale: metres in the model's unit of length.
    """
    sizes = [60.0 if view.get(field) is None else view[field] for field in ("h_size", "v_size")]
    up = view.get("up_vector") or (0.0, 0.0, 1.0)
    try:
        position, direction, up = (
            tuple(np.array(one, dtype=float).reshape(3).tolist())
            for one in (view.get("position"), view.get("direction"), up)
        )
        width, height = map(float, sizes)
        kind = KINDS[view.get("view_type") or "v"]
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    place = tuple(scale * x for x in position)
    try:
        return View(kind, place, direction, up, width, height)
    except ValueError:  # no direction, impossible angles
        return None


def _objects(properties: Mapping[str, Any], field: str) -> list[Mapping[str, Any]]:
    """The objects with an identifier that an extension lists."""
    listed = properties.get(field)
    listed = listed if isinstance(listed, list) else []
    return [one for one in listed if isinstance(one, dict) and one.get("identifier")]


def _shades(model: HoneybeeModel) -> Iterator[Shade | ShadeMesh]:
    yield from model.orphaned_shades or ()
    yield from model.shade_meshes or ()
    for room in model.rooms or ():
        yield from room.outdoor_shades or ()
        for face in room.faces:
            yield from face.outdoor_shades or ()
            for opening in (*(face.apertures or ()), *(face.doors or ())):
                yield from opening.outdoor_shades or ()


COLOURS = ("r", "g", "b")
UP = (0.01, 0.01, 1.0)  # up vector of a BSDF where the file states none: honeybee-schema's default
OPAQUE_FIELDS = {
    "plastic": ("specularity", "roughness"),
    "metal": ("specularity", "roughness"),
    "trans": ("specularity", "roughness", "transmitted_diff", "transmitted_spec"),
    "mirror": (),
}


class ModifierLibrary:
    """Modifiers and modifier sets of a file, read when something refers to them."""

    def __init__(self, radiance: Mapping[str, Any], file: Path) -> None:
        self.file = file
        self.objects = NamedObjects(radiance, ("modifiers",), "modifier", file)
        self._materials: dict[str, RadianceMaterial] = {}
        self._states: dict[str, ShadingState] = {}

    def material(self, name: str) -> RadianceMaterial | None:
        """The Radiance material of a modifier; None where the file has none of that name."""
        if name not in self._materials:
            modifier = self.objects.find("modifiers", name)
            if modifier is None:
                return None
            self._materials[name] = self._material(modifier)
        return self._materials[name]

    def _material(self, modifier: Mapping[str, Any]) -> RadianceMaterial:
        kind = _kind(modifier)
        numbers: list[float] = []
        under = modifier.get("modifier")
        if under is not None and under != VOID and _kind(under) != VOID:
            known = {"modifier": modifier["identifier"], "type": _kind(under) or "?"}
            self.objects.issues.append(Issue("modifier-of-modifier", self.file.name, known))
        if kind in OPAQUE_FIELDS:
            numbers = [self.objects.number(modifier, f"{c}_reflectance", 0.0) for c in COLOURS]
            numbers += [self.objects.number(modifier, field, 0.0) for field in OPAQUE_FIELDS[kind]]
        elif kind == "glass":
            numbers = [self.objects.number(modifier, f"{c}_transmissivity", 0.0) for c in COLOURS]
            index = modifier.get("refraction_index")
            numbers += [] if index is None else [self.objects.number(modifier, "refraction_index", 1.52)]
        elif kind == "BSDF":
            return RadianceMaterial(modifier["identifier"], "BSDF", bsdf=modifier["identifier"])
        name = modifier["identifier"]
        try:
            return material_of(Primitive(VOID, kind, name, (), tuple(numbers), self.file, 0))
        except DataError as error:  # which names a line; there is none
            raise DataError(error.message, file=self.file, element=name) from None

    def state(self, name: str, label: str = "") -> ShadingState | None:
        """The BSDF of a modifier as a shading state; None where it is none."""
        modifier = self.objects.find("modifiers", name) or {}
        if _kind(modifier) != "BSDF":
            return None
        if name not in self._states:
            self._states[name] = self._bsdf(modifier)
        held = self._states[name]
        return ShadingState(name=label, bands=held.bands, angular=held.angular)

    def up_vector(self, name: str) -> NDArray[np.float64] | None:
        """The up vector [3] of a modifier's BSDF, as Radiance takes it; None where it is none.

        Raises: `DataError` for one that is no vector, or that a function file gives.
        """
        modifier = self.objects.find("modifiers", name) or {}
        if _kind(modifier) != "BSDF":
            return None
        stated = modifier.get("up_orientation")
        try:
            up = np.array(UP if stated is None else stated, dtype=float)
        except (TypeError, ValueError):
            up = np.zeros(0)
        if up.shape != (3,) or not 0 < np.linalg.norm(up) < np.inf:
            message = f"expected a vector of three numbers, got {stated!r:.60}"
            raise self.objects.fault(message, modifier, "up_orientation")
        if modifier.get("function_file") not in (None, "", "."):
            message = "function files of a BSDF are not read: state its up_orientation in numbers"
            raise self.objects.fault(message, modifier, "function_file")
        transform = modifier.get("transform")
        if transform:
            try:
                up = read_xform(("xform", *str(transform).split())).copies[0][:3, :3] @ up
            except ValueError as error:
                raise self.objects.fault(str(error), modifier, "transform") from None
        return up / np.linalg.norm(up)

    def pane_state(self, name: str, label: str, values: GlazingValues) -> ShadingState | None:
        """A modifier of glass as a shading state; None where it is none.

        Its sun is the construction's, as much more or less as its light (a tint of one colour).
        """
        material = self.material(name)
        if material is None or material.kind != "glass":
            return None
        table = glass_table([(material.transmissivity, material.index)])
        bands = {"Visible": specular_matrices(table)}
        if values.solar is not None and values.visible:
            tau, rho = float(table.transmittance[0]), float(table.reflectance_front[0])
            through = min(tau * values.solar / values.visible, 1.0 - rho)
            sun = Glazing(name, through, rho, rho, values.panes or 2)
            bands["Solar"] = specular_klems(sun, KLEMS_FULL)
        return ShadingState(name=label, bands=bands, angular=table)

    def _bsdf(self, modifier: Mapping[str, Any]) -> ShadingState:
        name, data = modifier["identifier"], modifier.get("bsdf_data")
        if not isinstance(data, str):
            raise DataError("expected the text of a BSDF XML", file=self.file, element=name, field="bsdf_data")
        with scratch_folder() as folder:
            path = folder / "bsdf.xml"
            path.write_bytes(_decoded(data))
            try:
                bands = read_bsdf_xml(path).bands
            except DataError as error:
                raise DataError(error.message, file=self.file, element=name, field="bsdf_data") from None
        return ShadingState(bands=dict(bands))


def _kind(modifier: Any) -> str:
    """Radiance's name of a modifier's type, which files write with either first letter."""
    kind = str(modifier.get("type", "") if isinstance(modifier, Mapping) else modifier)
    return kind if kind.upper() == kind else kind[:1].lower() + kind[1:]


def _decoded(data: str) -> bytes:
    """The XML of a modifier: as text, or in base 64 as some writers keep it."""
    if data.lstrip().startswith("<"):
        return data.encode("utf-8")
    try:
        return base64.b64decode(data, validate=True)
    except ValueError:
        return data.encode("utf-8")


ADJACENCY = {"Outdoors": "outside", "Ground": "ground", "Surface": "space"}
FACE_KINDS = {"Wall": "wall", "Floor": "floor"}  # the others by their slope
SAME_UP = 1e-3  # difference of unit up vectors that are taken as one
PARALLEL = 1e-3  # sine of the angle between up vector and normal


def read_honeybee(path: str | PathLike[str], *, join: Sequence[str] = (), furniture: bool = False) -> Building:
    """The building of an HBJSON file, in metres.

    Read are rooms with faces, apertures, doors and shades, constructions and construction sets,
    modifiers and modifier sets, BSDF data, and the states of dynamic groups of apertures.

    Args:
        join: rooms to make one, as "Hall + Living"; air boundaries between them go.
        furniture: whether indoor shades are in the rooms' light and views.

    Raises: `DataError` that names file, object and field; what the model lacks is in the
        building's `issues`.
    """
    path = Path(path)
    model = read_model(path)
    building = drawn_building(_Reader(model, path).drawn(), join=join, furniture=furniture)
    return _used(building, model, path)


def _used(building: Building, model: HoneybeeModel, path: Path) -> Building:
    """The building with the use of its rooms, sensor grids and views."""
    library, sensors = UseLibrary(model.properties.energy, path), SensorReader(model, path)
    rooms = {room.identifier: room for room in model.rooms or ()}
    uses = {s.guid: library.use(rooms[s.guid], s) for s in building.spaces}
    known = {guid: use for guid, use in uses.items() if use is not None}
    grids, views = sensors.grids(), sensors.views()
    issues = (*building.issues, *library.issues, *sensors.issues)
    return replace(building, uses=known, grids=grids, views=views, issues=issues)


class _Reader:
    """A model with its libraries."""

    def __init__(self, model: HoneybeeModel, path: Path) -> None:
        self.model, self.path, self.scale = model, path, model.scale
        self.energy = EnergyLibrary(model.properties.energy, path)
        self.light = ModifierLibrary(model.properties.radiance, path)
        self.issues: list[Issue] = []
        self.rooms = {room.identifier for room in model.rooms or ()}
        self.groups: dict[str, list[str]] = {}  # dynamic ones, with their apertures

    def drawn(self) -> DrawnModel:
        """The model as polygons."""
        model = self.model
        rooms = tuple(self._room(room) for room in model.rooms or ())
        elements = [e for room in model.rooms or () for e in self._shades(_outdoor(room), room)]
        elements += [
            e
            for shade in (*(model.orphaned_shades or ()), *(model.shade_meshes or ()))
            for e in self._shades([shade], None)
        ]
        for face in model.orphaned_faces or ():
            elements += self._orphan(face, "IfcWall")
            elements += self._shades(_outdoor(face), None)
        furniture = {room.identifier: tuple(self._shades(_indoor(room), room)) for room in model.rooms or ()}
        for kind in ("apertures", "doors"):
            count = len(getattr(model, f"orphaned_{kind}") or ())
            if count:
                issue = Issue(f"{kind}-without-room", self.path.name, {"count": count})
                self.issues.append(issue)
        many = tuple(room.label for room in model.rooms or () if room.multiplier > 1)
        if many:
            self.issues.append(Issue("room-multipliers", self.path.name, {"rooms": many}))
        self.issues += shade_issues(model, self.path)
        self.issues += [*self.energy.objects.issues, *self.light.objects.issues]
        self._group_issues()
        return DrawnModel(self.path, model.label, rooms, tuple(elements), furniture, tuple(self.issues))

    def _room(self, room: HoneybeeRoom) -> DrawnRoom:
        faces = tuple(self._face(face, room) for face in room.faces)
        label = "" if room.label == room.identifier else room.label
        return DrawnRoom(room.identifier, label or room.identifier, faces, room.story or "")

    def _face(self, face: RoomFace, room: HoneybeeRoom) -> DrawnFace:
        condition = face.boundary_condition
        adjacency, neighbour = self._behind(face, condition)
        openings = [self._opening(one, face, room) for one in face.apertures or ()]
        openings += [self._opening(one, face, room) for one in face.doors or ()]
        part = PARTS.get(face.face_type, "")
        field = _set_field(condition, energy=True)
        own, of_room = face.properties, room.properties
        name = None
        if face.face_type != "AirBoundary":
            name = self.energy.objects.name(own.energy, of_room.energy, part, field)
        kind = FACE_KINDS.get(face.face_type, "")
        return DrawnFace(
            face.identifier,
            face.label,
            kind,
            face.geometry.rings(self.scale),
            adjacency,
            neighbour,
            self._finish(face, room, name, part),
            tuple(openings),
            face.face_type == "AirBoundary",
        )

    def _behind(self, face: RoomFace, condition: Condition) -> tuple[str, str | None]:
        adjacency = ADJACENCY.get(condition.type, "adiabatic")
        if condition.type not in (*ADJACENCY, "Adiabatic"):
            known = {"element": face.label, "condition": condition.type[:40]}
            self.issues.append(Issue("boundary-not-computed", face.identifier, known))
        if adjacency != "space":
            return adjacency, None
        others = [name for name in condition.boundary_condition_objects if name in self.rooms]
        if others:
            return adjacency, others[-1]
        self.issues.append(Issue("neighbour-missing", face.identifier, {"element": face.label}))
        return "adiabatic", None

    def _finish(
        self, one: RoomFace | HoneybeeDoor, room: HoneybeeRoom | None, construction: str | None, part: str
    ) -> SurfaceFinish:
        """What modifiers say of light and the construction of heat."""
        opaque = None if construction is None else self.energy.opaque(construction)
        field = _set_field(one.boundary_condition, energy=False)
        own, of_room = one.properties.radiance, room.properties.radiance
        modifier = self.light.objects.name(own, of_room, part, field)
        material = None if modifier is None else self.light.material(modifier)
        if material is not None and (not material.is_opaque or material.kind == "trans"):
            known = {"element": one.label, "material": material.name}
            self.issues.append(Issue("shade-taken-as-opaque", one.identifier, known))
        if material is None or not material.is_opaque:
            return _by_construction(opaque)
        solar = None if opaque is None or opaque.inner_solar is None else opaque.inner_solar
        gloss = material.gloss
        if gloss is not None and (solar or 0.0) + gloss.at_normal > 1:
            solar = 1.0 - gloss.at_normal
        return SurfaceFinish(
            None if opaque is None else opaque.construction,
            material.diffuse,
            material.diffuse if solar is None else solar,
            0.9 if opaque is None else opaque.emissivity,
            gloss,
            material.diffuse if opaque is None else opaque.outer_visible,
        )

    def _opening(self, one: HoneybeeAperture, face: RoomFace, room: HoneybeeRoom) -> DrawnOpening:
        rings = one.geometry.rings(self.scale)
        if one.boundary_condition.type not in (face.boundary_condition.type, "Outdoors"):
            behind = (repr(c.boundary_condition.type[:40]) for c in (one, face))
            reason = "{} in a face whose condition is {}".format(*behind)
            known = {"field": "boundary_condition", "reason": reason}
            self.issues.append(Issue("value-not-read", one.label, known))
        part, fields = _opening_set(one, face)
        own, of_room = one.properties, room.properties
        name = self.energy.objects.name(own.energy, of_room.energy, part, f"{fields}_construction")
        if not one.is_glass:
            finish = self._finish(one, room, name, part)
            return DrawnOpening(one.identifier, one.label, rings[0], finish, holes=rings[1:])
        height = float(np.ptp(rings[0][:, 2])) or float(np.sqrt(_area(rings[0])))
        values = None if name is None else self.energy.window(name, height)
        if name is not None and self.energy.has_shade(name):
            known = {"element": one.label, "construction": name}
            self.issues.append(Issue("construction-shade-not-read", one.identifier, known))
        for unread in [] if name is None else self.energy.unread_parts(name):
            known = {"element": one.label, "part": unread, "glazing": name}
            self.issues.append(Issue("glazing-part-not-read", one.identifier, known))
        field = f"{fields}_modifier"
        modifier = self.light.objects.name(own.radiance, of_room.radiance, part, field)
        glazing = self._by_modifier(one, values or GlazingValues(name=name or ""), modifier)
        states = self._states(one, modifier, glazing)
        up = self._up(one, modifier, rings[0]) if states else None
        return DrawnOpening(
            one.identifier,
            one.label,
            rings[0],
            glazing=glazing,
            states=states,
            holes=rings[1:],
            up=up,
            both_sides=min(one.identifier, *_other_side(one)),
        )

    def _by_modifier(self, one: HoneybeeAperture, values: GlazingValues, modifier: str | None) -> GlazingValues:
        """The values with the visible transmittance of a glass, and its law of the angle."""
        material = None if modifier is None else self.light.material(modifier)
        if material is None or material.kind == "BSDF":
            return values
        if material.kind != "glass":
            known = {"element": one.label, "modifier": modifier, "type": material.kind}
            self.issues.append(Issue("modifier-not-glass", one.identifier, known))
            return values
        glass = PlainGlass(((material.transmissivity, material.index),))
        return replace(values, visible=glass.transmittance, name=values.name or material.name, glass=glass)

    def _states(self, one: HoneybeeAperture, modifier: str | None, values: GlazingValues) -> tuple[ShadingState, ...]:
        """The optics of an aperture by state: BSDFs; of a dynamic group also its panes of glass."""
        held = _held(one)
        names = [modifier, *(s.get("modifier") for s in held[1:])]
        states, missing = [], 0
        for number, name in enumerate(names):
            label = "" if number == 0 else str(name)
            state = self.light.state(name, label) if isinstance(name, str) else None
            if state is None and isinstance(name, str) and len(names) > 1:
                state = self.light.pane_state(name, label, values)
            if state is not None:
                states.append(_with_values(state, values, shaded=number > 0))
            elif number:
                missing += 1
        group = one.properties.radiance.get("dynamic_group_identifier")
        if states and isinstance(group, str):
            self.groups.setdefault(group, []).append(one.label)
        if missing:
            known = {"element": one.label, "count": missing}
            self.issues.append(Issue("states-not-optical", one.identifier, known))
        if any(state.get("shades") for state in held):
            self.issues.append(Issue("states-with-shades", one.identifier, {"element": one.label}))
        return tuple(states) if states and states[0].name == "" else ()

    def _up(self, one: HoneybeeAperture, modifier: str | None, ring: np.ndarray) -> np.ndarray | None:
        """The up vector [3] that the BSDFs of an aperture's states share; None without a BSDF.

        Raises: `DataError` where they differ, or where it is the aperture's normal.
        """
        names = [modifier, *(state.get("modifier") for state in _held(one)[1:])]
        ups = [(name, up) for name in names if isinstance(name, str) and (up := self.light.up_vector(name)) is not None]
        if not ups:
            return None
        first, up = ups[0]
        for name, other in ups[1:]:
            if np.abs(other - up).max() > SAME_UP:
                message = f"BSDF {name} has another up_orientation than {first}: give both the same"
                raise DataError(message, file=self.path, element=one.label, field="states")
        normal = newell_normal(ring)
        if np.linalg.norm(np.cross(up, normal)) < PARALLEL * np.linalg.norm(normal):
            message = f"the up_orientation of BSDF {first} is the normal of this aperture"
            raise DataError(message, file=self.path, element=one.label, field="up_orientation")
        return up

    def _group_issues(self) -> None:
        if len(self.groups) > 1:
            known = {"count": len(self.groups), "groups": tuple(self.groups)}
            self.issues.append(Issue("dynamic-groups", self.path.name, known))

    def _orphan(self, face: RoomFace, kind: str) -> Iterator[Element]:
        rings = face.geometry.rings(self.scale)
        part = PARTS.get(face.face_type, "")
        name = self.light.objects.name(face.properties.radiance, {}, part, "exterior_modifier")
        yield from self._element(face.identifier, face.label, kind, triangles_of_rings(rings), name)

    def _shades(self, shades: Iterable[Shade | ShadeMesh], room: HoneybeeRoom | None) -> Iterator[Element]:
        room_light = {} if room is None else room.properties.radiance
        for shade in shades:
            try:
                triangles = (
                    shade.geometry.triangles(self.scale)
                    if isinstance(shade, ShadeMesh)
                    else triangles_of_rings(shade.geometry.rings(self.scale))
                )
            except ValueError:
                message = "a face has a corner that there is not"
                raise DataError(message, file=self.path, element=shade.identifier, field="geometry.faces") from None
            part, field = "shade_set", "exterior_modifier"
            if shade.is_detached and room is None:
                part, field = "", "context_modifier"
            name = self.light.objects.name(shade.properties.radiance, room_light, part, field)
            kind = "IfcBuildingElementProxy" if shade.is_detached else "IfcShadingDevice"
            yield from self._element(shade.identifier, shade.label, kind, triangles, name)

    def _element(
        self, guid: str, name: str, kind: str, triangles: np.ndarray, modifier: str | None
    ) -> Iterator[Element]:
        material = None if modifier is None else self.light.material(modifier)
        value, gloss = FACADE_REFLECTANCE, None
        if material is not None and material.kind in ("glass", "trans", "BSDF"):
            known = {"element": name, "material": material.name}
            self.issues.append(Issue("shade-taken-as-opaque", guid, known))
            value = material.diffuse
        elif material is not None:
            value, gloss = material.diffuse, material.gloss
        if len(triangles):
            yield Element(guid, name, kind, triangles, value, value, gloss=gloss)


def _held(one: HoneybeeAperture) -> list[dict]:
    """The states of an aperture of a dynamic group."""
    states = one.properties.radiance.get("states") or []
    return [s for s in states if isinstance(s, dict)] if isinstance(states, list) else []


def _by_construction(opaque: OpaqueValues | None) -> SurfaceFinish:
    if opaque is None:
        return SurfaceFinish()
    return SurfaceFinish(
        opaque.construction, opaque.inner_visible, opaque.inner_solar, opaque.emissivity, None, opaque.outer_visible
    )


def _with_values(state: ShadingState, values: GlazingValues, *, shaded: bool) -> ShadingState:
    """A state with U and g of the construction; g of a state but the first is not known."""
    if shaded:
        pane = state.angular is not None  # of glass: as much heat goes through it
        return replace(state, u_value=values.u_value, shading_position="none") if pane else state
    return replace(
        state,
        u_value=values.u_value,
        g_normal=values.g_value,
        shading_position="none" if values.g_value is not None else None,
    )


def _set_field(condition: Condition, *, energy: bool) -> str:
    """Field of a surface in its set; adiabatic ones have the interior's."""
    noun = "construction" if energy else "modifier"
    if condition.type == "Ground" and energy:
        return "ground_construction"
    return f"{'exterior' if condition.type in OUTDOORS else 'interior'}_{noun}"


def _other_side(one: HoneybeeAperture) -> list[str]:
    """The identifier of the same opening in the room beyond."""
    return one.boundary_condition.boundary_condition_objects[:1] or [one.identifier]


def _opening_set(one: HoneybeeAperture, face: RoomFace) -> tuple[str, str]:
    """The set of an opening and the first word of its field there."""
    inside = face.boundary_condition.type not in OUTDOORS
    if isinstance(one, HoneybeeDoor):
        where = "interior" if inside else "exterior"
        if one.is_glass:
            return "door_set", f"{where}_glass"
        overhead = face.face_type in ("RoofCeiling", "Floor") and not inside
        return "door_set", "overhead" if overhead else where
    if inside:
        return "aperture_set", "interior"
    return "aperture_set", "window" if face.face_type == "Wall" else "skylight"


def _outdoor(thing: HoneybeeRoom | RoomFace) -> list[Shade]:
    """The outdoor shades of a room or face and of all that it holds."""
    return [shade for one in _within(thing) for shade in one.outdoor_shades or ()]


def _indoor(thing: HoneybeeRoom | RoomFace) -> list[Shade]:
    return [shade for one in _within(thing) for shade in one.indoor_shades or ()]


def _within(thing: HoneybeeRoom | RoomFace) -> Iterator[HoneybeeRoom | RoomFace | HoneybeeAperture]:
    yield thing
    if isinstance(thing, HoneybeeRoom):
        for face in thing.faces:
            yield from _within(face)
    else:
        yield from (*(thing.apertures or ()), *(thing.doors or ()))


def _area(ring: np.ndarray) -> float:
    return float(np.linalg.norm(newell_normal(ring)))
