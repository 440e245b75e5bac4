"""Reflectance, gloss and transparency of surfaces: measured values first, then screen colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import ifcopenshell

from bim.colours import GREY, Colour, hue_of, linear_of_display, luminance
from bim.defaults import HIGHEST_REFLECTANCE, LOWEST_REFLECTANCE
from mitsuba_cfs.gloss import ROUGHEST, Gloss, dielectric, mirror, pane

CLEAR = 0.25  # transparency from which a surface is glass
SATIN = 0.1  # alpha of metal and plastic whose style states no highlight
GLASS_INDEX = 1.52


@dataclass(frozen=True, slots=True)
class SurfaceStyle:
    """Reflectance, gloss and transparency of a surface style."""

    name: str
    reflectance: float  # diffuse, visible
    transparency: float  # 0 opaque to 1 clear
    stated: float | None = None  # reflectance that the file states, where it is out of bounds
    solar: float | None = None  # diffuse, solar; None: as visible
    gloss: Gloss | None = None  # what it reflects like a mirror besides
    hue: Colour = GREY  # of the diffuse part: linear sRGB of luminance 1

    @property
    def reflectances(self) -> tuple[float, float]:
        """Visible and solar reflectance."""
        return self.reflectance, self.reflectance if self.solar is None else self.solar

    @property
    def is_glass(self) -> bool:
        """Whether the style is transparent."""
        return self.transparency > CLEAR


def surface_style(model: ifcopenshell.file, name: str, colour: Sequence[float], transparency: float) -> SurfaceStyle:
    """The surface style that the geometry engine names "<class>-<STEP id>".

    In this order: IfcSurfaceStyleLighting.DiffuseReflectionColour and a DiffuseColour given as a
    colour are coefficients of reflection as the schema defines them; else the surface colour is
    what a screen shows (sRGB), times the diffuse factor where there is one.

    Args: colour, transparency: the engine's own reading, for styles that cannot be found.
    """
    shading = _shading(model, name)
    label = name
    linear = linear_of_display(_bounded(colour))
    if shading is not None and shading.is_a("IfcSurfaceStyleShading"):
        style = _style_of(model, shading)
        label = (style.Name if style is not None else None) or name
        linear = _reflected(shading, style)
        stated = getattr(shading, "Transparency", None)
        transparency = transparency if stated is None else float(stated)
    value = luminance(linear)
    bounded = min(max(value, LOWEST_REFLECTANCE), HIGHEST_REFLECTANCE)
    stated = None if bounded == value else value
    transparency = min(max(float(transparency), 0.0), 1.0)
    diffuse, gloss = _gloss(shading, bounded, transparency > CLEAR)
    return SurfaceStyle(label, diffuse, transparency, stated, None, gloss, hue_of(linear))


def _shading(model: ifcopenshell.file, name: str) -> ifcopenshell.entity_instance | None:
    """The entity of a style's name; None for names of other kinds, or ids that do not exist."""
    step_id = name.rpartition("-")[2]
    if "-" not in name or not step_id.isdecimal():
        return None
    try:
        return model.by_id(int(step_id))
    except RuntimeError:
        return None


def _gloss(shading, reflectance: float, clear: bool) -> tuple[float, Gloss | None]:
    """Diffuse reflectance and gloss of a shading that reflects so much in all.

    ReflectanceMethod says what it is: a MIRROR or METAL has no diffuse part, GLASS and PLASTIC have
    Fresnel's above it.  The other methods are ways to draw a highlight on a screen, which authoring
    tools write for brick and plaster too: no gloss.
    """
    method = getattr(shading, "ReflectanceMethod", None)
    if method not in ("MIRROR", "METAL", "GLASS", "PLASTIC"):
        return reflectance, None
    if method == "GLASS" and clear:
        return reflectance, pane()
    alpha = _roughness(shading, 0.0 if method in ("MIRROR", "GLASS") else SATIN)
    if method in ("MIRROR", "METAL"):
        specular = getattr(shading, "SpecularColour", None)
        if specular is not None and specular.is_a("IfcColourRgb"):
            reflectance = luminance(_rgb(specular))
        return 0.0, mirror(min(reflectance, 1.0), alpha)
    gloss = dielectric(GLASS_INDEX, alpha)
    return reflectance * (1 - gloss.at_normal), gloss


def _roughness(shading: ifcopenshell.entity_instance, missing: float) -> float:
    """Ward's alpha of a SpecularHighlight: a roughness as it is, an exponent n as (2 n)^-0.5.

    Phong's cos^n about the mirror's direction falls as Ward's lobe does about the normal where
    alpha^2 = 1 / (2 n).
    """
    highlight = getattr(shading, "SpecularHighlight", None)
    if highlight is None:
        return missing
    value = float(highlight.wrappedValue)
    if highlight.is_a("IfcSpecularExponent"):
        value = (2 * value) ** -0.5 if value > 0 else missing
    return min(max(value, 0.0), ROUGHEST)


def _style_of(model: ifcopenshell.file, shading: ifcopenshell.entity_instance):
    for parent in model.get_inverse(shading):
        if parent.is_a("IfcSurfaceStyle"):
            return parent
    return None


def _reflected(shading: ifcopenshell.entity_instance, style) -> Colour:
    """Diffuse reflectance of a shading in linear sRGB, from the most physical of its entries."""
    for other in style.Styles if style is not None else ():
        if other.is_a("IfcSurfaceStyleLighting"):
            return _rgb(other.DiffuseReflectionColour)
    diffuse = getattr(shading, "DiffuseColour", None)
    if diffuse is not None and diffuse.is_a("IfcColourRgb"):
        return _rgb(diffuse)
    factor = 1.0 if diffuse is None else float(diffuse.wrappedValue)
    red, green, blue = linear_of_display(_rgb(shading.SurfaceColour))
    return factor * red, factor * green, factor * blue


def _rgb(colour: ifcopenshell.entity_instance) -> Colour:
    return _bounded((colour.Red, colour.Green, colour.Blue))


def _bounded(values: Sequence[float]) -> Colour:
    red, green, blue = (min(max(float(v), 0.0), 1.0) if v == v else 0.0 for v in values)
    return red, green, blue
