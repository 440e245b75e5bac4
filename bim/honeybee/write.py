"""A building as a honeybee model: `write_honeybee`.

A window's glass is an aperture of the face that it lies in: its frame, else the wall around it,
else a face of its own that is a thousandth wider.  Reveals are walls with an adiabatic condition.
Open doorways are air boundaries: the way through the wall belongs to the first of the two rooms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from bim.doorways import Key, touching
from bim.energyplus_parts import at_most_layers
from bim.exported_glazing import LEFT_TO_READER, ExportedGlazing, Glazings, glazing_of, left_out, without_bsdf
from bim.fenestration import pane_transmissivity
from bim.hosted_windows import HostedPolygon, hosted_polygons
from bim.model import Building, Construction, Element, Face, Space, Window
from bim.planes import Plane, rings_of
from bim.to_radiance import identifier
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import bsdf_xml
from mitsuba_cfs.directions import default_up
from mitsuba_cfs.files import json_text, write_text

TYPES = {"floor": "Floor", "ceiling": "RoofCeiling", "roof": "RoofCeiling"}
LEAST_CAPACITY = 100.0  # [J/(kg K)] that honeybee takes
TOLERANCE = 1e-3  # of the model [m], where no face is smaller than that [m2]
GLASS_INDEX = 1.52  # refractive index of a pane


def write_honeybee(
    building: Building, path: str | PathLike[str], *, glazing: Glazings | None = None
) -> tuple[str, ...]:
    """Write rooms, windows, constructions, reflectances and obstructions as HBJSON.

    A window with U and g gets a construction (its visible transmittance is that of the BSDF where
    none is stated); its modifier is its BSDF, or one pane of glass with its transmittance. Not
    written: further shading states, gloss, furniture. What is not known is honeybee's default.

    Args: glazing: of windows by GUID, in place of what the building states.

    Returns: sentences on windows whose BSDF only the light has, on inner glass and on the ground.
    """
    library = _Library(glazing or {})
    names = _Names()
    guids = {space.guid: names.of(space.label) for space in building.spaces}
    building, sides = touching(building)
    air = _air_boundaries(building, sides, guids, names)
    parts = {space.guid: hosted_polygons(space) for space in building.spaces}
    rooms = [_room(space, parts[space.guid], guids, names, library=library, air=air) for space in building.spaces]
    windows = {window.guid for window in building.windows}
    meshes = [_mesh(e, names, library) for e in building.elements if e.guid not in windows]
    model = {
        "type": "Model",
        "identifier": names.of(building.name or "building"),
        "display_name": building.name,
        "units": "Meters",
        "tolerance": _tolerance([one.polygon.area for some in parts.values() for one in some]),
        "angle_tolerance": 1.0,
        "rooms": rooms,
        "shade_meshes": meshes,
        "properties": {"type": "ModelProperties", "energy": library.energy(), "radiance": library.radiance()},
    }
    write_text(Path(path), json_text(model, indent=1) + "\n")
    lost = left_out(building.spaces, "Honeybee", LEFT_TO_READER)
    return (*without_bsdf(building.windows, glazing or {}, "Honeybee's energy model"), *lost)


class _Names:
    """Identifiers as honeybee takes them, each once."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def of(self, name: str) -> str:
        """The name in letters that honeybee takes, with a number where it is taken."""
        base = identifier(name)[:80]
        unique, number = base, 1
        while unique in self._taken:
            number += 1
            unique = f"{base}_{number}"
        self._taken.add(unique)
        return unique


class _Library:
    """Constructions and modifiers that have been asked for."""

    def __init__(self, glazing: Glazings) -> None:
        self._glazing = glazing
        self._keys: dict[tuple, str] = {}
        self._materials: dict[str, dict] = {}
        self._constructions: dict[str, dict] = {}
        self._modifiers: dict[str, dict] = {}
        self._bsdfs: dict[tuple, str] = {}  # modifier by BSDF and up vector

    def construction(self, one: Construction, solar: float, visible: float) -> str:
        """Name of layers whose room side reflects so much."""
        layers = at_most_layers(one.layers)
        content = (layers, solar, visible)
        known = content in self._keys
        key = self._keys.setdefault(content, f"{identifier(one.name)[:50]}_{len(self._keys)}")
        if not known:
            names = []
            for number, layer in enumerate(layers):
                inner = number == len(layers) - 1
                absorbed = (1 - solar, 1 - visible) if inner else (0.7, 0.7)
                name = f"{key}_{number}"
                names.append(name)
                self._materials[name] = {
                    "type": "EnergyMaterial",
                    "identifier": name,
                    "display_name": layer.name,
                    "thickness": layer.thickness,
                    "conductivity": layer.conductivity,
                    "density": layer.density,
                    "specific_heat": max(layer.heat_capacity, LEAST_CAPACITY),
                    "roughness": "MediumRough",
                    "thermal_absorptance": 0.9,
                    "solar_absorptance": absorbed[0],
                    "visible_absorptance": absorbed[1],
                }
            self._constructions[key] = {
                "type": "OpaqueConstructionAbridged",
                "identifier": key,
                "materials": names,
                "display_name": one.name,
            }
        return key

    def glazing(self, window: Window) -> str | None:
        """Name of a simple glazing with the window's U, g and transmittance; None without U or g.

        A visible transmittance that is not known is left to honeybee's default.
        """
        known = glazing_of(window, self._glazing)
        if known.u_value is None or known.g_value is None:
            return None
        values = {"u_factor": known.u_value, "shgc": known.g_value}
        if known.visible_transmittance:
            values["vt"] = known.visible_transmittance
        fields = {name: round(float(value), 6) for name, value in values.items()}
        key = "glazing_" + "_".join(f"{value:.6g}" for value in fields.values())
        material = f"{key}_system"
        self._materials[material] = {"type": "EnergyWindowMaterialSimpleGlazSys", "identifier": material, **fields}
        self._constructions[key] = {"type": "WindowConstructionAbridged", "identifier": key, "materials": [material]}
        return key

    def optics(self, window: Window) -> str | None:
        """Name of the modifier with the window's visible BSDF, or of glass that passes as much.

        None where neither is known.
        """
        known = glazing_of(window, self._glazing)
        file = known.bsdf
        visible = None if file is None else file.bands.get("Visible") or file.bands.get("Solar")
        if file is None or visible is None:
            return None if known.visible_transmittance is None else self._glass(window, known)
        up = default_up(window.normal) if window.up is None else window.up
        key = (id(visible), *np.round(up, 6).tolist())
        if key not in self._bsdfs:
            name = f"bsdf_{len(self._bsdfs)}_{identifier(file.name)[:50]}"
            self._bsdfs[key] = name
            self._modifiers[name] = {
                "type": "BSDF",
                "identifier": name,
                "display_name": file.name or name,
                "modifier": None,
                "dependencies": [],
                "up_orientation": list(key[1:]),
                "thickness": 0.0,
                "function_file": ".",
                "transform": None,
                "bsdf_data": bsdf_xml(BsdfFile({"Visible": visible}, file.name)),
            }
        return self._bsdfs[key]

    def _glass(self, window: Window, known: ExportedGlazing) -> str:
        """Name of one pane of glass with the visible transmittance of the window."""
        panes = () if window.glass is None else window.glass.panes
        index = panes[0][1] if len(panes) == 1 else GLASS_INDEX
        passed = pane_transmissivity(float(known.visible_transmittance or 0.0), index)
        name = f"glass_{passed:.6f}_{index:g}".replace(".", "_")
        self._modifiers[name] = {
            "type": "Glass",
            "identifier": name,
            "modifier": None,
            "dependencies": [],
            "refraction_index": index,
            **{f"{c}_transmissivity": round(passed, 9) for c in "rgb"},
        }
        return name

    def modifier(self, reflectance: float) -> str:
        """Name of a grey diffuse plastic."""
        name = f"grey_{reflectance:.4f}"
        colours = {f"{c}_reflectance": round(float(reflectance), 4) for c in "rgb"}
        self._modifiers[name] = {
            "type": "Plastic",
            "identifier": name,
            "modifier": None,
            "dependencies": [],
            "specularity": 0.0,
            "roughness": 0.0,
            **colours,
        }
        return name

    def energy(self) -> dict[str, Any]:
        """The extension of energy."""
        return {
            "type": "ModelEnergyProperties",
            "materials": list(self._materials.values()),
            "constructions": list(self._constructions.values()),
        }

    def radiance(self) -> dict[str, Any]:
        """The extension of light."""
        return {"type": "ModelRadianceProperties", "modifiers": list(self._modifiers.values())}


def _air_boundaries(
    building: Building, sides: Mapping[Key, Key], guids: Mapping[str, str], names: _Names
) -> dict[Key, dict]:
    """Identifier and condition of each face of air, by room and face."""
    labels = {key: names.of(f"{guids[key[0]]}_{key[1]}") for key in sides}
    return {
        key: {
            "identifier": labels[key],
            "face_type": "AirBoundary",
            "boundary_condition": {"type": "Surface", "boundary_condition_objects": [labels[other], guids[other[0]]]},
            "properties": _properties("Face"),
        }
        for key, other in sides.items()
    }


def _tolerance(areas: Sequence[float]) -> float:
    """Tolerance of the model [m]: a smaller area [m2] is no face for honeybee."""
    return min(TOLERANCE, 10.0 ** np.floor(np.log10(min(areas, default=1.0))))


def _room(
    space: Space,
    parts: Sequence[HostedPolygon],
    guids: Mapping[str, str],
    names: _Names,
    *,
    library: _Library,
    air: Mapping[Key, dict],
) -> dict:
    own = guids[space.guid]
    faces = []
    for part in parts:
        if part.face is None:
            faces.append(_own_face(part, own, names, library))
            continue
        boundary = air.get((space.guid, part.face.name))
        faces.append(
            _face(part, part.face, own=own, names=names, library=library)
            if boundary is None
            else {
                "type": "Face",
                "display_name": part.face.name,
                **boundary,
                "geometry": _geometry(part.plane, part.polygon),
            }
        )
    return {
        "type": "Room",
        "identifier": own,
        "display_name": space.label,
        "faces": faces,
        "story": space.storey or None,
        "properties": _properties("Room"),
    }


def _own_face(part: HostedPolygon, own: str, names: _Names, library: _Library) -> dict:
    """A face for glass that lies in none."""
    ((window, pane),) = part.panes
    return {
        "type": "Face",
        "identifier": names.of(f"{own}_{window.name or 'window'}_wall"),
        "face_type": "Wall",
        "geometry": _geometry(part.plane, part.polygon),
        "boundary_condition": {"type": "Outdoors"},
        "apertures": [_aperture(window, part.plane, pane, names, library)],
        "properties": _properties("Face"),
    }


def _face(part: HostedPolygon, face: Face, *, own: str, names: _Names, library: _Library) -> dict:
    plane, windows = part.plane, part.panes
    conditions = {"outside": "Outdoors", "ground": "Ground"}
    # two faces of a wall do not lie in one place here: honeybee's "Surface" cannot say that
    condition = "Outdoors" if windows else conditions.get(face.adjacency, "Adiabatic")
    construction = library.construction(
        face.construction, face.total_reflectance("solar"), face.total_reflectance("visible")
    )
    slope = "RoofCeiling" if plane.normal[2] > 0.7 else "Wall"
    return {
        "type": "Face",
        "identifier": names.of(f"{own}_{face.name}"),
        "display_name": face.name,
        "face_type": TYPES.get(face.kind, slope),
        "geometry": _geometry(plane, part.polygon),
        "boundary_condition": {"type": condition},
        "apertures": [_aperture(w, plane, pane, names, library) for w, pane in windows],
        "properties": _properties("Face", construction, library.modifier(face.total_reflectance("visible"))),
    }


def _aperture(window: Window, plane: Plane, pane: shapely.Polygon, names: _Names, library: _Library) -> dict:
    return {
        "type": "Aperture",
        "identifier": names.of(window.name or window.guid),
        "display_name": window.name or window.guid,
        "geometry": _geometry(plane, pane),
        "is_operable": False,
        "boundary_condition": {"type": "Outdoors"},
        "properties": _properties("Aperture", library.glazing(window), library.optics(window)),
    }


def _mesh(element: Element, names: _Names, library: _Library) -> dict:
    corners, index = np.unique(element.triangles.reshape(-1, 3).round(6), axis=0, return_inverse=True)
    return {
        "type": "ShadeMesh",
        "identifier": names.of(element.name or element.guid),
        "display_name": element.name,
        "is_detached": True,
        "geometry": {"type": "Mesh3D", "vertices": corners.tolist(), "faces": index.reshape(-1, 3).tolist()},
        "properties": _properties("ShadeMesh", None, library.modifier(element.reflectance_visible)),
    }


def _geometry(plane: Plane, polygon: shapely.Polygon) -> dict:
    outline, *holes = (plane.to_world(ring).round(6).tolist() for ring in rings_of(polygon))
    return {"type": "Face3D", "boundary": outline, **({"holes": holes} if holes else {})}


def _properties(kind: str, construction: str | None = None, modifier: str | None = None) -> dict:
    energy: dict[str, Any] = {"type": f"{kind}EnergyPropertiesAbridged"}
    radiance: dict[str, Any] = {"type": f"{kind}RadiancePropertiesAbridged"}
    if construction is not None:
        energy["construction"] = construction
    if modifier is not None:
        radiance["modifier"] = modifier
    return {"type": f"{kind}PropertiesAbridged", "energy": energy, "radiance": radiance}
