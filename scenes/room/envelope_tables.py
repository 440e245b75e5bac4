"""The tables of a TOML file for what lies beyond a room: ground, neighbours, bridges, frames."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from scenes import plausible
from scenes.room.schedules import OrSchedule
from scenes.toml_file import Positive, Share, TomlTable
from thermal.ground import SHIELDS, SOILS
from thermal.zone import OUTSIDE_ABSORPTANCE, ROUGHNESS

KINDS = ("slab", "suspended", "basement", "unheated basement")


class BridgeTable(TomlTable):
    """A thermal bridge to outdoors, along a line or at a point."""

    name: str = ""
    psi: Annotated[float, plausible.PSI] | None = None  # [W/(m K)]
    length: Annotated[Positive, plausible.LENGTH] | None = None  # [m]
    chi: Annotated[float, plausible.CHI] | None = None  # [W/K]
    number: Annotated[int, Field(ge=1)] = 1

    @model_validator(mode="after")
    def _line_or_point(self) -> BridgeTable:
        if (self.psi is None) == (self.chi is None) or (self.psi is None) != (self.length is None):
            raise ValueError("give either `psi` with its `length`, or `chi`")
        return self

    @property
    def conductance(self) -> float:
        """Its heat flow per kelvin [W/K]."""
        each = self.chi if self.psi is None else self.psi * self.length
        return self.number * each


class GroundTable(TomlTable):
    """The ground below a room by ISO 13370, of the whole building that it belongs to."""

    kind: Literal[KINDS] = "slab"
    area: Annotated[Positive, plausible.AREA] | None = None  # of the building's floor [m2]
    perimeter: Annotated[Positive, plausible.PERIMETER]  # of it, exposed [m]
    wall_thickness: Annotated[float, plausible.LAYER] = 0.3  # of the walls above [m]
    soil: Literal[tuple(SOILS)] = "sand"  # ISO 13370: where nothing is known
    conductivity: Annotated[Positive, plausible.CONDUCTIVITY] | None = None  # [W/(m K)]
    heat_capacity: Annotated[Positive, plausible.SOIL_CAPACITY] | None = None  # [J/(m3 K)]
    indoor_c: Annotated[float, plausible.TEMPERATURE] = 20.0  # the year's mean inside
    # insulation at the edge of a slab: depth or width [m], resistance [m2 K/W]
    edge: tuple[Positive, Annotated[float, plausible.RESISTANCE]] | None = None
    edge_lies: Literal["vertical", "horizontal"] = "vertical"
    depth: Annotated[Positive, plausible.DEPTH] | None = None  # of a basement's floor [m]
    # above the ground outside: of the floor over a crawl space, of a cellar's walls [m]
    height: Annotated[float, Field(ge=0), plausible.LENGTH] = 0.5
    wall_u: Annotated[Positive, plausible.U_VALUE] = 1.0  # of those walls [W/(m2 K)]
    vents: Annotated[float, Field(ge=0, le=0.5)] = 0.0015  # of a crawl space [m2/m]
    shield: Literal[tuple(SHIELDS)] = "average"
    # of what lies on the ground below a crawl space or cellar, and of a cellar's walls [m2 K/W]
    below_resistance: Annotated[float, plausible.RESISTANCE] = 0.0
    wall_resistance: Annotated[float, plausible.RESISTANCE] = 0.0

    @model_validator(mode="after")
    def _has_its_depth(self) -> GroundTable:
        if (self.depth is not None) != self.kind.endswith("basement"):
            raise ValueError("depth: goes with a basement, and a basement with it")
        if self.edge is not None and self.kind != "slab":
            raise ValueError("edge: belongs to a slab")
        return self


class NeighbourTable(TomlTable):
    """What lies behind some of a room's faces, at a known temperature."""

    faces: tuple[str, ...] = ()  # sides of the box, or kinds of faces: "wall", "floor", "ceiling"
    spaces: tuple[str, ...] = ()  # rooms of the model, by name or GUID
    temperature_c: Annotated[float | str, OrSchedule(plausible.TEMPERATURE)]
    film: Annotated[float, plausible.RESISTANCE] = 0.13  # at the far side [m2 K/W]; 0: its face

    @model_validator(mode="after")
    def _names_some(self) -> NeighbourTable:
        if not self.faces and not self.spaces:
            raise ValueError("name `faces` or `spaces`")
        return self


class EnvelopeTable(TomlTable):
    """What a model of rooms leaves open at their outside."""

    ground: GroundTable | None = None  # without: undisturbed soil half a metre down
    neighbour: tuple[NeighbourTable, ...] = ()
    bridge: tuple[BridgeTable, ...] = ()
    # of all that faces outdoors, frames apart
    outside_absorptance: Share = OUTSIDE_ABSORPTANCE  # solar
    outside_roughness: Literal[tuple(ROUGHNESS)] = "medium rough"  # DOE-2, for the outside film
    frame_u: Annotated[Positive, plausible.FRAME_U] | None = None  # with films 0.13 and 0.04
    frame_psi: Annotated[float, plausible.PSI] = 0.0  # along the edges of the glass [W/(m K)]
