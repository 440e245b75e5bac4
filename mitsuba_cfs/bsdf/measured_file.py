"""Files of a goniophotometer (pab advanced technologies' pgII): one incident direction each.

Header lines begin with `#`; read are `sample_name "..."`, `colorimetry: CIE-Y` or `CIE-XYZ`,
`format: theta phi BSDF` (BRDF, BTDF, or DSF, which is the BSDF times the cosine of the outgoing
polar angle), `incident_angle THETA PHI` or `intheta THETA` and `inphi PHI`, and `upphi PHI`, the
azimuth of the sample's up.  Then one outgoing direction a line: polar angle and azimuth [degrees]
and one value, or X, Y and Z.  Directions point away from the sample, polar angles are from its
normal, and beyond 90 degrees they are behind it.

Source: the format as Radiance's `pabopto2bsdf` reads it (manual page and source).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError

FloatArray = NDArray[np.float64]
LARGEST_BYTES = 256 << 20
GRAZING_DEG = 0.5  # nearer than this to the sample's plane a value over its cosine says nothing
BANDS = {"cie-y": ("Visible",), "cie-xyz": ("CIE-X", "Visible", "CIE-Z")}
FORMATS = ("bsdf", "brdf", "btdf", "dsf")
HEADER = re.compile(r"#\s*(sample_name|colorimetry|format|incident_angle|intheta|inphi|upphi)\b:?\s*(.*)")


@dataclass(frozen=True, slots=True)
class Measurement:
    """Measurement for the light from one direction, in the window frame."""

    path: Path
    name: str
    incident: FloatArray  # [3] unit vector towards the light
    outgoing: FloatArray  # [N, 3] unit vectors that light leaves along
    values: FloatArray  # [N, bands] BSDF [1/sr]
    bands: tuple[str, ...]  # "Visible", or "CIE-X", "Visible", "CIE-Z"
    grazing: int  # rows within GRAZING_DEG of the sample's plane, left out


def read_measurement(path: str | PathLike[str], *, normal: str = "room") -> Measurement:
    """The measurement of a file; `DataError` with the line and field that cannot be used.

    Args: normal: where the sample's normal points to on the building, "room" or "outside".
    """
    path = Path(path)
    if path.stat().st_size > LARGEST_BYTES:
        raise DataError(f"has more than {LARGEST_BYTES >> 20} MiB", file=path)
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    result = [match.groups() for line in lines if (match := HEADER.match(line))]
    header = {key: text.strip() for key, text in result}
    bands = BANDS.get(header.get("colorimetry", "").casefold(), ("Visible",))
    kind = header.get("format", "").casefold().split()
    if kind[:2] != ["theta", "phi"] or len(kind) < 3 or kind[2] not in FORMATS:
        raise DataError("expected theta phi BSDF or DSF", file=path, field="format")
    up = _numbers(header.get("upphi", "0"), 1, path, "upphi")
    incident = _frame(_incident(header, path)[None], up[0], normal)[0]
    if abs(incident[2]) < np.sin(np.radians(GRAZING_DEG)):
        raise DataError("light along the sample's plane", file=path, field="incident_angle")
    rows = _rows(lines, 2 + len(bands), path)
    cosine = np.abs(np.cos(np.radians(rows[:, 0])))
    kept = cosine >= np.sin(np.radians(GRAZING_DEG))
    if not kept.any():
        raise DataError("no row off the sample's plane", file=path)
    values = rows[:, 2:] / cosine[:, None] if kind[2] == "dsf" else rows[:, 2:]
    return Measurement(
        path=path,
        name=header.get("sample_name", "").strip('"'),
        incident=incident,
        outgoing=_frame(rows[kept, :2], up[0], normal),
        values=values[kept],
        bands=bands,
        grazing=int((~kept).sum()),
    )


def _incident(header: dict[str, str], path: Path) -> FloatArray:
    """Polar angle and azimuth [2] [degrees] of the light."""
    if "incident_angle" in header:
        angles = _numbers(header["incident_angle"], 2, path, "incident_angle")
    else:
        keys = ("intheta", "inphi")
        angles = np.concatenate([_numbers(header.get(key, ""), 1, path, key) for key in keys])
    if not 0 <= angles[0] <= 180:
        raise DataError(f"polar angle {angles[0]:g}: expected 0 to 180", file=path, field="incident_angle")
    return angles


def _numbers(text: str, count: int, path: Path, field: str) -> FloatArray:
    """The first finite numbers [count] of a header's field."""
    try:
        values = np.array([float(word) for word in text.split()[:count]])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        what = "a number" if count == 1 else f"{count} numbers"
        raise DataError(f"expected {what}, got {text[:40]!r}", file=path, field=field)
    return values


def _rows(lines: list[str], columns: int, path: Path) -> FloatArray:
    """The numbers [N, columns] of the lines that are not headers."""
    rows = []
    for number, line in enumerate(lines, 1):
        if line.startswith("#") or not line.strip():
            continue
        try:
            row = [float(word) for word in line.split()]
        except ValueError:
            row = []
        if len(row) != columns or not np.isfinite(row).all() or not 0 <= row[0] <= 180:
            raise DataError(
                f"expected theta (0 to 180), phi and {columns - 2} value(s), got {line[:40]!r}",
                file=path,
                element=f"line {number}",
            )
        rows.append(row)
    if not rows:
        raise DataError("has no rows of theta, phi and value", file=path)
    return np.array(rows)


def _frame(angles_deg: FloatArray, up_deg: float, normal: str) -> FloatArray:
    """Unit vectors [N, 3] in the window frame of polar angles and azimuths [N, 2] [degrees].

    Azimuths are turned so that up is y; a normal that points to the room turns x and z round.
    """
    theta, phi = np.radians(angles_deg + np.array([0.0, 90.0 - up_deg])).T
    vectors = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 1)
    return vectors if normal == "outside" else vectors * [-1.0, 1.0, -1.0]
