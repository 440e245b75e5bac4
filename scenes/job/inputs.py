"""Reading the three inputs of a run, and checking that they belong together."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Problem, Space
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.resample import klems_of
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.job.thermal_file import ThermalFile
from thermal.closure import Closure

QUOTED = 3  # problems of the model that one message quotes


@dataclass(frozen=True, slots=True)
class System:
    """A fenestration system: glazing and shade as one, in both bands."""

    name: str
    visible: KlemsBsdf  # Klems full, all blocks
    solar: KlemsBsdf
    u_value: float | None = None  # [W/(m2 K)]
    g_value: float | None = None  # at normal incidence
    g_by_patch: NDArray[np.float64] | None = None  # [K] by incident patch, before g_value
    closure: Closure | None = None  # of the thermal model
    shading_position: str | None = None  # a key of thermal.gvalue.TYPICAL_SYSTEMS
    notes: tuple[str, ...] = ()
    tree: TensorTreeBsdf | None = None  # visible, where the data are a tree: for sun and pictures
    file: Path | None = None  # that it was read from
    source: str = ""  # where the system comes from, in words

    @property
    def fine(self) -> Bsdf:
        """The visible band as finely as the data have it."""
        return self.visible if self.tree is None else self.tree


States = tuple[System, ...]  # of a window: its system in each shading state, from open to closed


@dataclass(frozen=True, slots=True)
class Given:
    """What the user gives for all windows; what is not given is looked for in the IFC file."""

    states: States = ()  # by a flag or a study file
    u_value: float | None = None  # of --u, in place of the file's [W/(m2 K)]
    g_value: float | None = None  # of --g, at normal incidence
    ask: str = "--cfs FILE"  # how a system is given, for the error that none is
    light_only: bool = False  # neither U nor g is needed


def given_light(path: Path | None) -> Given:
    """What `--cfs` gives to a command that asks for the light alone."""
    states = () if path is None else (read_system(path, by="--cfs"),)
    return Given(states, light_only=True)


def read_system(
    path: str | PathLike[str],
    *,
    u_value: float | None = None,
    g_value: float | None = None,
    by: str = "",
) -> System:
    """The system of a BSDF XML file, with U and g given, or of the `.toml` file beside it.

    The `.toml` file has the name of the XML file; see `ThermalFile`.

    Args: by: what names the file, such as "--cfs"; goes before its name in the system's source.

    Raises: `DataError` for a file that cannot be used.
    """
    path = Path(path)
    file = read_bsdf_xml(path)
    beside = ThermalFile.read(path.with_suffix(".toml"))
    return system_of(
        file.bands,
        file.name or path.stem,
        path=path,
        u_value=beside.u_value if u_value is None else u_value,
        g_value=beside.g_value if g_value is None else g_value,
        g_by_patch=beside.g_value_by_patch if g_value is None else None,
        closure=beside.closure,
        shading_position=beside.shading_position,
        notes=file.notes,
        file=path,
        source=f"{by} {path.name}".strip(),
    )


def system_of(
    bands: Mapping[str, Bsdf],
    name: str,
    *,
    path: Path,
    notes: Sequence[str] = (),
    **more: float | str | Path | NDArray[np.float64] | Closure | None,
) -> System:
    """The system of BSDF data by band, Klems full or tensor trees.

    Args: path: the file that the data come from; more: fields of `System`.
    """
    notes = list(notes)
    if "Visible" not in bands and "Solar" not in bands:
        raise DataError("has neither a Visible nor a Solar band", file=path, field="WavelengthData")
    for band, other in (("Visible", "Solar"), ("Solar", "Visible")):
        if band not in bands:
            notes.append(f"{name} has no {band} band: its {other} band stands in for it.")
    visible = bands.get("Visible") or bands["Solar"]
    solar = bands.get("Solar") or bands["Visible"]
    klems = _klems(visible, path, "Visible")
    return System(
        name,
        klems,
        klems if solar is visible else _klems(solar, path, "Solar"),
        notes=tuple(notes),
        tree=visible if isinstance(visible, TensorTreeBsdf) else None,
        **more,
    )


def _klems(bsdf: Bsdf, path: Path, band: str) -> KlemsBsdf:
    """The band as Klems full matrices with all blocks."""
    if isinstance(bsdf, KlemsBsdf) and {bsdf.basis_in, bsdf.basis_out} != {KLEMS_FULL}:
        raise DataError(
            f"has {bsdf.basis_out.size}x{bsdf.basis_in.size} patches; "
            f"the run needs the Klems full basis of 145x145",
            file=path,
            field=band,
        )
    return klems_of(bsdf)


def read_weather(path: str | PathLike[str]) -> Weather:
    """Hourly weather of one year from an EPW file.

    Raises: `DataError` for a file that cannot be used.
    """
    weather = read_epw(path)
    if weather.step_h != 1.0:
        raise DataError(f"has steps of {weather.step_h:g} h; the run needs hours", file=path)
    return weather


def chosen_spaces(building: Building, names: Sequence[str], path: Path) -> list[Space]:
    """The spaces of those names or GUIDs, or every space with a window.

    Raises: `DataError` that quotes what the model's problems say about a room that is not there.
    """
    chosen = named_spaces(building, names, path)
    if names:
        for space in chosen:
            if not space.windows:
                about = [p for p in _lost(building, "window") if _says(p.what, space.name)]
                why = f": {_quoted(about)}" if about else ""
                raise DataError(f"has no window{why}", file=path, element=f"space {space.label}")
        return chosen
    chosen = [space for space in chosen if space.windows]
    if not chosen:
        why = _because(building, "window") or _because(building, "room")
        what = f"no space has a window to the outside{why}"
        raise DataError(what, file=path, element="IfcWindow")
    return chosen


def named_spaces(building: Building, names: Sequence[str], path: Path) -> list[Space]:
    """The spaces of those names or GUIDs, each once, or all spaces; with windows or without."""
    if not building.spaces:
        raise DataError(f"has no rooms (IfcSpace){_because(building, 'room')}", file=path)
    if not names:
        return list(building.spaces)
    return list(
        {space.guid: space for space in (_space(building, n, path) for n in names)}.values()
    )


def _space(building: Building, name: str, path: Path) -> Space:
    try:
        return building.space(name)
    except (KeyError, ValueError) as error:
        lost = [p for p in _lost(building, "room") if p.where == name or _says(p.what, name)]
        if isinstance(error, KeyError) and lost:
            message = f"space {name!r} was left out: {_quoted(lost)}"
        else:
            message = str(error.args[0])
        raise DataError(message, file=path, field="space") from error


def _lost(building: Building, kind: str) -> list[Problem]:
    """The problems for which a "room" or "window" is not there."""
    return [problem for problem in building.problems if problem.lost == kind]


def _says(text: str, name: str) -> bool:
    """Whether a text holds a name as whole words."""
    return re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text, re.IGNORECASE) is not None


def _because(building: Building, kind: str) -> str:
    lost = _lost(building, kind)
    return f": {_quoted(lost)}" if lost else ""


def _quoted(problems: Sequence[Problem]) -> str:
    """The first problems in one line, and how many more there are."""
    shown = "; ".join(f"{p.what} ({p.consequence})" for p in problems[:QUOTED])
    more = len(problems) - QUOTED
    return f"{shown}; and {more} more, see cfs ifc check" if more > 0 else shown


def sha256(path: Path) -> str:
    """Hash of a file's bytes."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
