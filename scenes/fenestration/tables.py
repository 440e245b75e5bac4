"""The tables of a TOML file that say what a fenestration system is: its BSDF, U, g, closure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from scenes import plausible
from scenes.fenestration.layer_tables import GlazingLayerTable, glazing_unit
from scenes.toml_file import Positive, Share, TomlTable
from thermal.closure import U_MODELS, Closure
from thermal.glazing import GASES, Gap
from thermal.gvalue import TYPICAL_SYSTEMS

Film = Annotated[Positive, plausible.RESISTANCE]  # [m2 K/W]
PATCHES = KLEMS_FULL.size
ByPatch = Annotated[tuple[float, ...], Field(min_length=PATCHES, max_length=PATCHES)]
Table = TypeVar("Table", bound="ClosureTable")
# the model of U that a key belongs to
OF_MODEL = {"gap": "gap", "surface": "surface", "layers": "layers", "u_slope": "linear"}


class GapTable(TomlTable):
    """The gas gap of a double glazing, for `u_model = "gap"`."""

    width: Annotated[Positive, plausible.GAP]  # [m]
    gas: dict[Literal[tuple(GASES)], Share] = Field({"argon": 0.9, "air": 0.1})
    emissivity: tuple[Share, Share] = (0.837, 0.03)  # of the two faces that bound it


class ClosureTable(TomlTable):
    """How a system's thermal model is closed: in a study, and beside a BSDF file."""

    u_model: Literal[U_MODELS] | None = None  # None: what the other keys are of, else "constant"
    gap: GapTable | None = None
    u_slope: Annotated[float, Field(ge=-0.05, le=0.05)] | None = None  # of U for "linear" [1/K]
    # 1/R = c0 + c1 x + c2 d + c3 d2 + c4 x d + c5 x2, see thermal.blackbox.LayerResistance
    surface: Annotated[tuple[float, ...], Field(min_length=6, max_length=6)] | None = None
    layers: tuple[GlazingLayerTable, ...] = ()  # outermost first: ISO 15099
    glazing_height: Annotated[Positive, plausible.LENGTH] = 1.5  # [m] of the layers
    glazing_tilt_deg: Annotated[float, Field(ge=0, le=180)] = 90.0  # from horizontal
    realised_inner_resistance: Film | None = None  # [m2 K/W], see thermal.blackbox
    realised_outer_resistance: Film | None = None

    @model_validator(mode="after")
    def _fits_its_model(self) -> ClosureTable:
        stated = [key for key in OF_MODEL if getattr(self, key)]
        models = {OF_MODEL[key] for key in stated}
        if len(models) > 1:
            raise ValueError(f"{stated[0]} and {stated[1]} exclude each other")
        model = self.u_model
        if model in ("gap", "surface", "layers") and model not in models:
            raise ValueError(f'u_model "{model}" and {model} belong together')
        if model is not None and models and models != {model}:
            raise ValueError(f'{stated[0]}: belongs to u_model "{OF_MODEL[stated[0]]}"')
        films = (self.realised_inner_resistance, self.realised_outer_resistance)
        if "layers" in models and films != (None, None):
            raise ValueError("layers: give the realised films, which are not to be stated too")
        return self

    def placed(self: Table, folder: Path) -> Table:
        """The table with the files of its panes in a folder."""
        layers = tuple(
            one if one.pane is None else one.model_copy(update={"pane": folder / one.pane})
            for one in self.layers
        )
        return self.model_copy(update={"layers": layers})

    def closure(self) -> Closure | None:
        """What the table states; None where it states nothing."""
        if not self.model_fields_set & set(ClosureTable.model_fields):
            return None
        gap, unit = self.gap, None
        if gap is not None:
            gap = Gap(gap.width, tuple(gap.gas.items()), gap.emissivity)
        if self.layers:
            unit = glazing_unit(self.layers, self.glazing_height, self.glazing_tilt_deg)
        stated = [OF_MODEL[key] for key in OF_MODEL if getattr(self, key)]
        more = {} if self.u_slope is None else {"slope": self.u_slope}
        return Closure(
            self.u_model or (stated or ["constant"])[0], gap, self.realised_inner_resistance,
            self.realised_outer_resistance, surface=self.surface, unit=unit, **more,
        )  # fmt: skip


class WindowHeatTable(ClosureTable):
    """What else is known of a system: in a study, and beside a BSDF file."""

    u_value: Annotated[float, Field(ge=0.1, le=7)] | None = None  # [W/(m2 K)]
    g_value: Share | None = None  # at normal incidence
    g_value_by_angle: tuple[tuple[float, Share], ...] = ()  # angle of incidence [degrees] and g
    g_value_by_patch: ByPatch | None = None  # for each incident patch of the Klems full basis
    shading_position: Literal[tuple(TYPICAL_SYSTEMS)] | None = None  # of the shade

    @model_validator(mode="after")
    def _has_one_g(self) -> WindowHeatTable:
        keys = ("g_value_by_angle", "g_value_by_patch")
        if all(getattr(self, key) for key in keys):
            raise ValueError(f"{keys[0]} and {keys[1]} exclude each other")
        angles = [angle for angle, _ in self.g_value_by_angle]
        if angles and (angles != sorted(set(angles)) or angles[0] < 0 or angles[-1] > 90):
            raise ValueError("g_value_by_angle: expected rising angles from 0 to 90 degrees")
        return self

    def g_by_patch(self) -> NDArray[np.float64] | None:
        """g [K] of the Klems full patches where it is stated by patch or by angle."""
        if self.g_value_by_patch is not None:
            return np.array(self.g_value_by_patch)
        if not self.g_value_by_angle:
            return None
        angles, values = np.array(self.g_value_by_angle, dtype=float).T
        return np.interp(KLEMS_FULL.centres()[0], np.radians(angles), values)


class StateTable(WindowHeatTable):
    """One shading state: a BSDF file, or `layers` of panes alone, and what else was measured."""

    bsdf: Path | None = None

    @model_validator(mode="after")
    def _has_optics(self) -> StateTable:
        if self.bsdf is None and not self.layers:
            raise ValueError("bsdf: is missing; only panes, as `layers`, go without one")
        for number, layer in enumerate(self.layers if self.bsdf is None else ()):
            if layer.is_shade:
                raise ValueError(f"layers.{number}: a shade's light needs a `bsdf` of the system")
            if layer.pane is None and layer.solar is None:
                message = "its transmittance and reflectances are missing, and there is no `bsdf`"
                raise ValueError(f"layers.{number}.solar: {message}")
        return self
