"""What a window's manufacturer knows of it: BSDF, angular g-values and U, by shading state."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.angular import AngularTable, glass_table
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from thermal.closure import Closure


@dataclass(frozen=True, slots=True)
class AngularGValue:
    """Total solar energy transmittance by direction of incidence."""

    polar: NDArray[np.float64]  # [T] angle of incidence, rising [rad]
    azimuth: NDArray[np.float64]  # [A] rising; one entry 0 where it does not matter [rad]
    values: NDArray[np.float64]  # [T, A] g, 0 to 1

    def __post_init__(self) -> None:
        if self.values.shape != (len(self.polar), len(self.azimuth)):
            raise ValueError("g-values: expected one for each polar angle and azimuth")


@dataclass(frozen=True, slots=True)
class PlainGlass:
    """Panes of uncoated glass behind each other, as Radiance's material `glass` describes each."""

    panes: tuple[tuple[float, float], ...]  # transmissivity and index of each, the outer one first
    beside: tuple[float, ...] = ()  # share of light at `ANGLES` that meets the innermost alone

    @property
    def table(self) -> AngularTable:
        """Visible transmittance and reflectance by the angle of incidence."""
        whole = glass_table(self.panes)
        if not self.beside:
            return whole
        return whole.mixed(glass_table(self.panes[-1:]), np.asarray(self.beside))

    @property
    def transmittance(self) -> float:
        """Visible transmittance at normal incidence, with all reflections between the faces."""
        return float(self.table.transmittance[0])


def pane_transmissivity(transmittance: float, index: float = 1.52) -> float:
    """Transmissivity of an uncoated pane with that transmittance at normal incidence, at most 1.

    Inverse of T = (1 - F)^2 t / (1 - F^2 t^2), F the reflectance of a face (Fresnel).
    """
    face = ((index - 1) / (index + 1)) ** 2
    passed = (1 - face) ** 2
    root = np.sqrt(passed**2 + 4 * (face * transmittance) ** 2)
    # the smaller root without cancellation
    return min(float(2 * transmittance / (passed + root)), 1.0)


@dataclass(frozen=True, slots=True)
class ShadingState:
    """A window's optics and heat in one state of its shade."""

    name: str = ""  # "" for the only or the usual state
    bands: dict[str, Bsdf] = field(default_factory=dict)  # "Visible", "Solar" -> BSDF
    g_value: AngularGValue | None = None  # before g_by_patch, and that before g_normal
    u_value: float | None = None  # [W/(m2 K)]
    g_normal: float | None = None  # at normal incidence
    g_by_patch: NDArray[np.float64] | None = None  # [K] by incident patch of Klems full
    closure: Closure | None = None  # of the thermal model
    shading_position: str | None = None  # "none", "external", "internal", "integrated"
    file: Path | None = None  # of the BSDF, where the model names it only
    angular: AngularTable | None = None  # visible, of a specular system: exact at every angle
    layers: tuple[Path, ...] = ()  # files of the BSDF among the layers that it is computed from
    of_type: str | None = None  # name of the window type that holds it; None: the window itself

    @property
    def holds_data(self) -> bool:
        """Whether there is anything besides the name."""
        single = (self.g_value, self.u_value, self.g_normal, self.g_by_patch, self.closure)
        held = any(value is not None for value in (*single, self.shading_position))
        return bool(self.bands) or held


def read_g_table(path: str | Path) -> AngularGValue:
    """Angular g-values of a CSV file with columns polar_deg, g and, if it matters, azimuth_deg."""
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(line for line in stream if line.strip()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    if not rows or not {"polar_deg", "g"} <= set(rows[0]):
        raise DataError("expected the columns polar_deg, g (and azimuth_deg)", file=path)
    table: dict[tuple[float, float], float] = {}
    for number, row in enumerate(rows, start=2):
        try:
            key = float(row["polar_deg"]), float(row.get("azimuth_deg") or 0.0)
            table[key] = float(row["g"])
        except (TypeError, ValueError):
            raise DataError("is not a number", file=path, element=f"line {number}") from None
        if not (0 <= key[0] <= 90 and 0 <= table[key] <= 1):
            raise DataError(f"polar {key[0]:g} or g {table[key]:g} out of range", file=path, element=f"line {number}")
    polar, azimuth = (sorted({key[i] for key in table}) for i in (0, 1))
    missing = [(p, a) for p in polar for a in azimuth if (p, a) not in table]
    if missing:
        raise DataError(f"no g at polar {missing[0][0]:g}, azimuth {missing[0][1]:g}", file=path)
    values = np.array([[table[p, a] for a in azimuth] for p in polar])
    return AngularGValue(np.radians(polar), np.radians(azimuth), values)
