"""The rooms of a study as EnergyPlus computes them: the whole model, zone by zone.

Coupled zones, the space behind every face, both faces' absorptances, gains, air and set points of
every hour, the ground's temperatures, windows by their BSDF, and obstructions outside.  The sun
and what becomes of it indoors are EnergyPlus' own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bim.defaults import TREE_LAYER
from bim.energyplus_parts import (
    LEAST_SURFACE,
    NEAR,
    FaceFinish,
    Model,
    Ring,
    flat_outlines,
    model_frame,
    object_name,
    opaque_construction,
    opaque_surface,
    outlines,
    rectangle,
    vertices,
    window_rectangles,
    write_window,
)
from bim.energyplus_windows import WindowOptics, complex_state, shading_control
from bim.model import Building, Element, Face, Space
from bim.outer_faces import OFF_THE_WALL, OuterFaces, outer_faces
from bim.planes import Facet, planar_facets, triangulated
from bim.rays import hemisphere, ray_mesh
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, write_text
from thermal.climate import Climate
from thermal.emitters import IdealLoads
from thermal.ventilation import AirTransfer
from thermal.zone import Gains, OpaqueSurface, Zone

FILE = "schedules.csv"  # beside the epJSON
HOURS = 8760
OFF_C = -60.0, 90.0  # set points that are never reached [degC]
AIR_HEAT = 1.2 * 1006.0  # [J/(m3 K)] for what is a heat flow here and an air flow there
ZONE = "zone_or_zonelist_or_space_or_spacelist_name"
IDEAL = "ZoneHVAC:IdealLoadsAirSystem"


class Schedules:
    """The schedules of a model: constants, and columns of hours in one file."""

    def __init__(self, model: Model) -> None:
        """Of a model that has the schedule types' limits."""
        self.model = model
        self.columns: dict[str, NDArray[np.float64]] = {}

    def name(self, label: str, values: ArrayLike) -> str:
        """Name of the schedule of a number or of hourly values [H], by what the values are.

        Values of shorter steps become the means of their hours.
        """
        array = np.atleast_1d(np.asarray(values, dtype=float))
        if np.ptp(array) == 0:
            return self._constant(float(array[0]))
        hours = array.reshape(HOURS, -1).mean(axis=1)
        for known, other in self.columns.items():
            if np.array_equal(other, hours):
                return known
        self.columns[label] = hours
        self.model.setdefault("Schedule:File", {})[label] = {
            "schedule_type_limits_name": "any",
            "file_name": FILE,
            "column_number": len(self.columns),
            "rows_to_skip_at_top": 1,
            "number_of_hours_of_data": HOURS,
            "column_separator": "Comma",
            "interpolate_to_timestep": "No",
        }
        return label

    def _constant(self, value: float) -> str:
        name = f"always {value:g}"
        self.model["Schedule:Constant"][name] = {"hourly_value": value, "schedule_type_limits_name": "any"}
        return name

    def csv(self) -> str:
        """The file of the columns."""
        if not self.columns:
            return ""
        table = np.stack(list(self.columns.values()), axis=1)
        head = ",".join(name.replace(",", " ") for name in self.columns)
        return "\n".join([head, *(",".join(f"{v:.6g}" for v in row) for row in table)]) + "\n"


def internal_heat(model: Model, zone: str, gains: Gains, schedules: Schedules) -> None:
    """The convective and the radiant heat of all gains, each as equipment of 1 W."""
    for kind, power in (("convective", gains.convective), ("radiant", gains.radiant)):
        if not np.any(power):
            continue
        model.setdefault("OtherEquipment", {})[f"{zone} {kind}"] = {
            "fuel_type": "None",
            ZONE: zone,
            "schedule_name": schedules.name(f"{zone} {kind} W", power),
            "design_level_calculation_method": "EquipmentLevel",
            "design_level": 1.0,
            "fraction_latent": 0.0,
            "fraction_radiant": float(kind == "radiant"),
            "fraction_lost": 0.0,
        }


def outdoor_air(model: Model, zone: str, one: Zone, schedules: Schedules) -> tuple[str, ...]:
    """The outdoor air of a zone; what EnergyPlus is not told of it, in sentences."""
    leak, flows = one.leakage, {}
    factors = dict(
        zip(("constant_term", "temperature_term", "velocity_term", "velocity_squared_term"), leak.factors, strict=True)
    )
    flows["leaks"] = one.infiltration_ach, factors
    flows["other air"] = one.other_air_ach, {"constant_term": 1.0}
    notes = []
    supply = one.supply
    if supply is not None:
        flows["supply"] = supply.ach, {"constant_term": 1.0}
        if supply.temperature_c is not None or supply.recovery or np.isfinite(supply.least_c):
            notes.append("supply air is outdoor air there, without recovery or its own temperature")
    if one.bridges:
        ach = one.bridges / AIR_HEAT / one.volume * 3600.0
        flows["thermal bridges"] = ach, {"constant_term": 1.0}
        notes.append("thermal bridges are an air flow of as much heat per kelvin")
    for label, (ach, terms) in flows.items():
        if not np.any(ach):
            continue
        model["ZoneInfiltration:DesignFlowRate"][f"{zone} {label}"] = {
            ZONE: zone,
            "schedule_name": schedules.name(f"{zone} {label} 1/h", ach),
            "design_flow_rate_calculation_method": "AirChanges/Hour",
            "air_changes_per_hour": 1.0,
            **{f"{term}_coefficient": value for term, value in terms.items()},
        }
    notes += _leakage_area(model, zone, one)
    if one.airing is not None:
        notes.append("opened windows are left out")
    if one.beside:
        notes.append("air exchanged with neighbours of known temperature is left out")
    if one.slab is not None:
        notes.append("its heated slab is left out")
    return tuple(f"{one.name}: {note}" for note in notes)


def _leakage_area(model: Model, zone: str, one: Zone) -> list[str]:
    """Sherman and Grimsrud's flow, of 1000 cm2; a sentence where the exponents are others."""
    leak = one.leakage
    if not leak.stack and not leak.wind:
        return []
    if (leak.stack_exponent, leak.wind_exponent) != (0.5, 1.0):
        return ["the leakage of a pressure test is left out"]
    model.setdefault("ZoneInfiltration:EffectiveLeakageArea", {})[f"{zone} leakage"] = {
        "zone_or_space_name": zone,
        "schedule_name": "always",
        "effective_air_leakage_area": 1000.0,
        "stack_coefficient": leak.stack**2,
        "wind_coefficient": leak.wind**2,
    }
    return []


def ideal_plant(model: Model, zone: str, loads: IdealLoads, schedules: Schedules) -> tuple[str, ...]:
    """Two set points and an ideal plant that holds them; what EnergyPlus is not told of it."""
    heats, cools = np.any(np.isfinite(loads.heating_c)), np.any(np.isfinite(loads.cooling_c))
    if not heats and not cools:
        return ()
    low = np.maximum(loads.heating_c, OFF_C[0])
    high = np.minimum(loads.cooling_c, OFF_C[1])
    name = f"{zone} plant"
    plant: dict[str, Any] = {
        "zone_supply_air_node_name": f"{zone} supply",
        "dehumidification_control_type": "None",
        "humidification_control_type": "None",
    }
    for kind, limit in (("heating", loads.heating_limit), ("cooling", loads.cooling_limit)):
        if np.isfinite(limit):
            key = "sensible" if kind == "heating" else "total"
            plant[f"{kind}_limit"] = "LimitCapacity"
            plant[f"maximum_{key}_{kind}_capacity"] = float(limit)
    objects = {
        "ZoneControl:Thermostat": {
            "zone_or_zonelist_name": zone,
            "control_type_schedule_name": schedules.name("", 4.0),
            "control_1_object_type": "ThermostatSetpoint:DualSetpoint",
            "control_1_name": name,
        },
        "ThermostatSetpoint:DualSetpoint": {
            "heating_setpoint_temperature_schedule_name": schedules.name(f"{zone} heating C", low),
            "cooling_setpoint_temperature_schedule_name": schedules.name(f"{zone} cooling C", high),
        },
        IDEAL: plant,
        "ZoneHVAC:EquipmentList": {
            "equipment": [
                {
                    "zone_equipment_object_type": IDEAL,
                    "zone_equipment_name": name,
                    "zone_equipment_cooling_sequence": 1,
                    "zone_equipment_heating_or_no_load_sequence": 1,
                }
            ]
        },
        "ZoneHVAC:EquipmentConnections": {
            "zone_name": zone,
            "zone_conditioning_equipment_list_name": name,
            "zone_air_inlet_node_or_nodelist_name": f"{zone} supply",
            "zone_air_node_name": f"{zone} air node",
            "zone_return_air_node_or_nodelist_name": f"{zone} return",
        },
    }
    for kind, entry in objects.items():
        model.setdefault(kind, {})[name] = entry
    radiant = max(loads.heating_radiant * heats, loads.cooling_radiant * cools)
    return (f"{zone}: heating and cooling go wholly to the air there",) if radiant else ()


LEAST_SHADE = 0.05  # [m2] smaller plane parts of the surroundings shade nothing
LOOKOUTS = 8  # of so many places before an outer wall one is looked from
RAYS = 400  # from each point, to what may shade it
TERRAINS = {"suburbs": "Suburbs", "country": "Country", "city": "City"}
OUTPUTS = (
    "Zone Mean Air Temperature",
    "Zone Ideal Loads Zone Sensible Heating Rate",
    "Zone Ideal Loads Zone Sensible Cooling Rate",
    "Surface Window Transmitted Solar Radiation Rate",
    "Surface Outside Face Incident Solar Radiation Rate per Area",
    "Surface Inside Face Solar Radiation Heat Gain Rate",
)


@dataclass(frozen=True, slots=True)
class TwinRoom:
    """A room as it was balanced, with what its windows are."""

    space: Space
    room: ThermalRoom
    optics: Mapping[str, Sequence[WindowOptics]]  # by window GUID, in each shading state
    state: NDArray[np.int64]  # [H, W] shading state of each window

    @property
    def zone(self) -> Zone:
        """The zone of the room."""
        return self.room.zone


@dataclass(frozen=True, slots=True)
class TwinAir:
    """Air that passes between rooms."""

    links: NDArray[np.float64] | None = None  # [Z, Z] each way [m3/s]
    transfers: Sequence[AirTransfer] = ()  # one way


class EnergyPlusTwin:
    """A model of rooms, and what it leaves out of ours."""

    def __init__(
        self,
        building: Building,
        rooms: Sequence[TwinRoom],
        climate: Climate,
        *,
        air: TwinAir | None = None,
        terrain: str = "suburbs",
        steps: int = 6,
    ) -> None:
        """See the module; steps: of an hour.

        Raises: `DataError` for a part of a year.
        """
        if climate.hours != HOURS:
            raise DataError(f"EnergyPlus takes a year of hours, got {climate.hours} rows")
        self.model = _whole_year(building.name, terrain, steps)
        self.schedules = Schedules(self.model)
        self.climate, self.rooms = climate, rooms
        self.notes: dict[str, None] = {}
        self._states: dict[tuple[int, bool], str] = {}
        self.zones = [f"Z{k} {object_name(r.zone.name)}" for k, r in enumerate(rooms)]
        outer = [outer_faces(building, room.space, room.room) for room in rooms]
        for zone, room, faces in zip(self.zones, rooms, outer, strict=True):
            self._zone(zone, room, dict(zip(faces.surfaces.tolist(), faces.depth, strict=True)))
        self._air_between(air or TwinAir())
        own = {window.guid for room in rooms for window in room.space.windows}
        others = [element for element in building.elements if element.guid not in own]
        if any(element.layer == TREE_LAYER for element in others):
            self.notes["EnergyPlus has no trees"] = None
            others = [element for element in others if element.layer != TREE_LAYER]
        shades(self.model, others, *_lookouts(rooms, outer))
        if others:
            self.notes["the surroundings shade, but reflect nothing"] = None

    def write(self, folder: Path) -> tuple[Path, ...]:
        """Write the model and its schedules into a folder; the files."""
        model = folder / "model.epJSON"
        write_text(model, json_text(self.model, indent=1))
        table = self.schedules.csv()
        if not table:
            return (model,)
        write_text(folder / FILE, table)
        return model, folder / FILE

    def _zone(self, zone: str, room: TwinRoom, depth: Mapping[int, float]) -> None:
        """A room; depth: of the outer face behind that in the room, by surface [m]."""
        one, model = room.zone, self.model
        model["Zone"][zone] = {"volume": one.volume, "floor_area": max(room.space.floor_area, 0.01)}
        if one.air_capacity_factor != 1.0:
            self.notes[f"{one.name}: the air's capacity factor is left out"] = None
        for index, surface in enumerate(one.surfaces):
            at = room.room.surface_of_face == index
            faces = [face for face, here in zip(room.space.faces, at, strict=True) if here]
            if faces[0].kind != "window frame":
                out = depth.get(index, 0.0) + OFF_THE_WALL
                self._surface(zone, f"{zone} S{index}", surface, faces, out)
        for index in range(len(one.windows)):
            self._window(zone, room, index)
        internal_heat(model, zone, one.gains, self.schedules)
        notes = outdoor_air(model, zone, one, self.schedules)
        notes += ideal_plant(model, zone, one.loads, self.schedules)
        self.notes |= dict.fromkeys(notes)

    def _surface(self, zone: str, name: str, surface: OpaqueSurface, faces: Sequence[Face], out: float) -> None:
        """A surface of the balance: its faces, or a rectangle of its area where rooms share it.

        Args: out: how far it is moved where it faces outdoors [m].
        """
        kind = _kind(surface)
        construction, outside, extra = self._construction(name, surface)
        biggest = max(faces, key=lambda face: face.area)
        if surface.partner or biggest.kind == "reveal":
            rings = [rectangle(biggest.triangles, surface.normal, surface.area)]
        else:
            rings = [ring for face in faces for ring in outlines(face, gap=NEAR, convex=True)]
        if outside == "Outdoors":
            rings = [ring + surface.normal * out for ring in rings]
        written = self.model["BuildingSurface:Detailed"]
        rings = [ring for ring in rings if _area(ring) > LEAST_SURFACE]
        for part, ring in enumerate(rings):
            label = name if len(rings) == 1 else f"{name}.{part}"
            written[label] = opaque_surface(kind, construction, zone, outside, ring) | extra

    def _construction(self, name: str, surface: OpaqueSurface) -> tuple[str, str, dict[str, str]]:
        """Construction and boundary condition of a surface, and what belongs to it."""
        layers, outside, extra = list(surface.layers), "Adiabatic", {}
        outer = FaceFinish(surface.absorptance_out, surface.emissivity_out, surface.roughness.title().replace(" ", ""))
        inner = FaceFinish(surface.absorptance_in, surface.emissivity_in)
        if surface.outside == "outdoor":
            outside = "Outdoors"
        elif surface.outside in ("ground", "known"):
            outside = "OtherSideCoefficients"
            ground = surface.outside == "ground"
            beyond = self.climate.ground_c if ground else surface.beyond_c
            label = "ground C" if ground else f"{name} beyond C"
            extra = {"outside_boundary_condition_object": self._known_face(label, beyond)}
        elif surface.partner:
            outside = "Surface"
            number = next(k for k, r in enumerate(self.rooms) if r.zone.name == surface.outside)
            beside = self.rooms[number].zone
            index = beside.index_of(surface.partner)
            other = beside.surfaces[index]
            extra = {"outside_boundary_condition_object": f"{self.zones[number]} S{index}"}
            outer = FaceFinish(other.absorptance_in, other.emissivity_in)
            if extra["outside_boundary_condition_object"] in self._surfaces_so_far():
                layers = list(other.layers[::-1])  # those of the earlier room, as in the balance
        elif surface.outside == "adiabatic":
            layers = [*layers[::-1], *layers]  # alike on both sides: no heat passes the middle
            outer = inner
        else:
            outer = inner
        construction = opaque_construction(self.model, layers, outer, inner, surface.name)
        return construction, outside, extra

    def _surfaces_so_far(self) -> Mapping[str, object]:
        return self.model["BuildingSurface:Detailed"]

    def _known_face(self, label: str, beyond) -> str:
        """Name of the condition that an outer face has a known temperature."""
        schedule = self.schedules.name(label, beyond)
        self.model.setdefault("SurfaceProperty:OtherSideCoefficients", {})[schedule] = {
            "combined_convective_radiative_film_coefficient": 0.0,
            "constant_temperature_coefficient": 1.0,
            "constant_temperature_schedule_name": schedule,
        }
        return schedule

    def _window(self, zone: str, room: TwinRoom, index: int) -> None:
        """A window in its frame, with its constructions."""
        window, name = room.space.windows[index], f"{zone} W{index}"
        frame, _, _ = self._construction(f"{name} frame", _frame_surface(room, window.normal))
        known = room.optics[window.guid]
        states = [self._state(optics, panes=len(known) == 1) for optics in known]
        write_window(self.model, name, zone, window, frame=frame, glazing=states[0])
        held = np.minimum(room.state[:, index], len(states) - 1)
        if np.any(held):
            schedule = self.schedules.name(f"{name} state", held)
            number = len(self.model.get("EnergyManagementSystem:Sensor", {}))
            shading_control(self.model, name, schedule, states, number)

    def _state(self, optics: WindowOptics, *, panes: bool) -> str:
        """Name of the construction of a system in a state, written once; see `complex_state`."""
        key = id(optics), panes
        if key not in self._states:
            name = f"System {len(self._states)}"
            complex_state(self.model, name, optics, panes=panes)
            self._states[key] = name
            self.notes |= dict.fromkeys(optics.simplified(panes=panes))
        return self._states[key]

    def _air_between(self, air: TwinAir) -> None:
        """The air that passes between the zones."""
        links = np.zeros((len(self.zones),) * 2) if air.links is None else air.links
        flows = [(a, b, links[a, b]) for a, b in np.argwhere(links > 0)]
        names = [room.zone.name for room in self.rooms]
        flows += [(names.index(t.source), names.index(t.target), t.flow) for t in air.transfers]
        for number, (source, target, flow) in enumerate(flows):
            self.model.setdefault("ZoneMixing", {})[f"air {number}"] = {
                "zone_or_space_name": self.zones[target],
                "source_zone_or_space_name": self.zones[source],
                "schedule_name": self.schedules.name(f"air {number} m3/s", flow),
                "design_flow_rate_calculation_method": "Flow/Zone",
                "design_flow_rate": 1.0,
            }


def shades(model: Model, elements: Sequence[Element], points: Ring, normals: Ring) -> None:
    """What is seen of the elements outdoors, in plane parts that reflect nothing.

    Args: points, normals: [N, 3] just outside the windows and the outer walls.
    """
    facets = [
        (number, facet)
        for number, element in enumerate(elements)
        for facet in planar_facets(element.triangles)
        if facet.polygon.area > LEAST_SHADE
    ]
    shading = model.setdefault("Shading:Building:Detailed", {})
    for index in _seen([facet for _, facet in facets], points, normals):
        number, facet = facets[index]
        rings = flat_outlines(facet.polygon, NEAR, convex=True)
        for part, ring in enumerate(rings):
            corners = vertices(facet.plane.to_world(ring))
            shading[f"E{number}.{index}.{part}"] = {"vertices": corners}


def _seen(facets: Sequence[Facet], points: Ring, normals: Ring) -> list[int]:
    """The facets that rays from points into the half space of their normals meet first."""
    pieces = [f.plane.to_world(triangulated(f.polygon).reshape(-1, 2)) for f in facets]
    if not pieces or not len(points):
        return []
    mesh = ray_mesh(np.concatenate(pieces).reshape(-1, 3, 3))
    owner = np.repeat(np.arange(len(pieces)), [len(piece) // 3 for piece in pieces])
    seen: set[int] = set()
    for point, normal in zip(points, normals, strict=True):
        rays = hemisphere(normal, RAYS)
        _, hit = mesh.first_hits(np.tile(point, (len(rays), 1)), rays)
        seen |= set(owner[hit[hit >= 0]].tolist())
    return sorted(seen)


def _lookouts(rooms: Sequence[TwinRoom], outer: Sequence[OuterFaces]) -> tuple[Ring, Ring]:
    """Points [N, 3] before the corners and middles of windows and before the outer walls."""
    points, normals = [], []
    for room, walls in zip(rooms, outer, strict=True):
        for window in room.space.windows:
            glass, _ = window_rectangles(window)
            spread = [window.centre + 0.9 * (corner - window.centre) for corner in glass]
            points += [p + 0.01 * window.normal for p in (window.centre, *spread)]
            normals += [window.normal] * (1 + len(glass))
        some = walls.points[:, ::LOOKOUTS]
        points += list(some.reshape(-1, 3))
        normals += list(np.repeat(walls.normals, some.shape[1], axis=0))
    return np.array(points).reshape(-1, 3), np.array(normals).reshape(-1, 3)


def _whole_year(name: str, terrain: str, steps: int) -> Model:
    """The frame of a model that is to be compared hour by hour."""
    model = model_frame(name)
    building = next(iter(model["Building"].values()))
    building |= {
        "terrain": TERRAINS[terrain],
        "loads_convergence_tolerance_value": 0.01,
        "temperature_convergence_tolerance_value": 0.01,
        "maximum_number_of_warmup_days": 200,
        "minimum_number_of_warmup_days": 6,
    }
    year = model["RunPeriod"]["year"]
    year |= {
        f"use_weather_file_{what}": "No"
        for what in ("daylight_saving_period", "holidays_and_special_days", "rain_indicators", "snow_indicators")
    }
    return model | {
        "Timestep": {"steps": {"number_of_timesteps_per_hour": steps}},
        "SurfaceConvectionAlgorithm:Inside": {"one": {"algorithm": "TARP"}},
        "SurfaceConvectionAlgorithm:Outside": {"one": {"algorithm": "DOE-2"}},
        "OutputControl:Files": {"one": {"output_csv": "Yes"}},
        "Output:Variable": {
            f"out {k}": {"key_value": "*", "variable_name": what, "reporting_frequency": "Hourly"}
            for k, what in enumerate(OUTPUTS)
        },
    }


def _kind(surface: OpaqueSurface) -> str:
    """EnergyPlus' type of a surface, by its normal."""
    up = surface.normal[2]
    if up < -0.7:
        return "Floor"
    if up > 0.5:
        return "Roof" if surface.outside == "outdoor" else "Ceiling"
    return "Wall"


def _frame_surface(room: TwinRoom, normal: NDArray[np.float64]) -> OpaqueSurface:
    """The surface of the balance that the frame of a window belongs to.

    Raises: `DataError` where nothing of the room faces outdoors that way.
    """
    kinds = [
        room.space.faces[int(np.argmax(room.room.surface_of_face == i))].kind for i in range(len(room.zone.surfaces))
    ]
    fits = [
        (kind != "window frame", -float(one.normal @ normal), i)
        for i, (kind, one) in enumerate(zip(kinds, room.zone.surfaces, strict=True))
        if one.outside == "outdoor"
    ]
    if not fits:
        raise DataError("has a window and nothing else outdoors", element=room.space.label)
    return room.zone.surfaces[min(fits)[2]]


def _area(ring: NDArray[np.float64]) -> float:
    return 0.5 * float(np.linalg.norm(np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)))
