"""The tables of a TOML file that say what a fenestration system is: its BSDF, U, g, closure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from scenes import plausible
from scenes.toml_file import Positive, Share, TomlTable
from thermal.closure import Closure
from thermal.glazing import GASES, Gap

Film = Annotated[Positive, plausible.RESISTANCE]  # [m2 K/W]


class GapTable(TomlTable):
    """The gas gap of a double glazing, for `u_model = "gap"`."""

    width: Annotated[Positive, plausible.GAP]  # [m]
    gas: dict[Literal[tuple(GASES)], Share] = Field({"argon": 0.9, "air": 0.1})
    emissivity: tuple[Share, Share] = (0.837, 0.03)  # of the two faces that bound it


class ClosureTable(TomlTable):
    """How a system's thermal model is closed: in a study, and beside a BSDF file."""

    u_model: Literal["constant", "linear", "gap"] = "constant"  # with the temperatures
    gap: GapTable | None = None
    realised_inner_resistance: Film | None = None  # [m2 K/W], see thermal.blackbox
    realised_outer_resistance: Film | None = None

    @model_validator(mode="after")
    def _has_its_gap(self) -> ClosureTable:
        if (self.u_model == "gap") != (self.gap is not None):
            raise ValueError('u_model "gap" and a [system.gap] table belong together')
        return self

    def closure(self) -> Closure | None:
        """What the table states; None where it states nothing."""
        if not self.model_fields_set & set(ClosureTable.model_fields):
            return None
        gap = self.gap
        if gap is not None:
            gap = Gap(gap.width, tuple(gap.gas.items()), gap.emissivity)
        return Closure(
            self.u_model, gap, self.realised_inner_resistance, self.realised_outer_resistance
        )


class StateTable(ClosureTable):
    """One shading state: a BSDF file and what else was measured."""

    bsdf: Path
    u_value: Annotated[float, Field(ge=0.1, le=7)] | None = None
    g_value: Share | None = None
