"""Fenestration data of a window as an export writes them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from bim.energyplus_windows import WindowOptics
from bim.model import Space, Window
from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.evaluate import klems_of


@dataclass(frozen=True, slots=True)
class ExportedGlazing:
    """Fenestration data of a window in its first shading state, None where not known."""

    u_value: float | None = None  # [W/(m2 K)]
    g_value: float | None = None  # at normal incidence
    visible_transmittance: float | None = None  # at normal incidence, to the hemisphere
    solar_transmittance: float | None = None
    bsdf: BsdfFile | None = None  # by band; a tensor tree where the data are one
    optics: WindowOptics | None = None  # matrices and layers for EnergyPlus


LEFT_TO_READER = "is left to the program that reads the file"  # the ground of `left_out`
Glazings = Mapping[str, ExportedGlazing]  # by window GUID


def glazing_of(window: Window, glazings: Glazings) -> ExportedGlazing:
    """Data of a window: those given by GUID, else those that its file states or holds."""
    if window.guid in glazings:
        return glazings[window.guid]
    state = next(iter(window.states), None)
    bands = {} if state is None else state.bands
    visible, solar = window.visible_transmittance, window.solar_transmittance
    if "Visible" in bands:
        visible = normal_transmittance(bands["Visible"]) if visible is None else visible
    if "Solar" in bands:
        solar = normal_transmittance(bands["Solar"]) if solar is None else solar
    return ExportedGlazing(window.u_value, window.g_value, visible, solar, BsdfFile(bands) if bands else None)


def without_bsdf(windows: Iterable[Window], glazings: Glazings, model: str) -> tuple[str, ...]:
    """A sentence on windows whose BSDF a format, or a part of it, cannot hold; none without."""
    scattering = {w.guid: w.area for w in windows if glazing_of(w, glazings).bsdf is not None}
    if not scattering:
        return ()
    return (
        f"{model} holds no BSDF: windows of {sum(scattering.values()):.1f} m2 have U, g and "
        "transmittance at normal incidence there",
    )


def left_out(spaces: Iterable[Space], model: str, ground: str) -> Iterator[str]:
    """Sentences on glass between rooms, by name, and on the ground, which a format's file lacks.

    Args: ground: what the file has of it, in place of the soil of ISO 13370.
    """
    faces = [face for space in spaces for face in space.faces]
    panes = {face.pane.guid: face.pane for face in faces if face.pane is not None and not face.pane.is_open}
    if panes:
        names = ", ".join(sorted({pane.name or guid for guid, pane in panes.items()}))
        yield f"{model}: glass between rooms is written as an opaque wall: {names}"
    area = sum(face.area for face in faces if face.adjacency == "ground")
    if area:
        yield (
            f"{model}: the ground at {area:.0f} m2 {ground}; soil by ISO 13370 with the building's area and "
            "perimeter, as in the heat balance here, is not written"
        )


def normal_transmittance(bsdf: Bsdf) -> float:
    """Direct-hemispherical transmittance from outdoors at normal incidence."""
    klems = klems_of(bsdf)
    return min(float(klems.direct_hemispherical(klems.transmission_front)[0]), 1.0)
