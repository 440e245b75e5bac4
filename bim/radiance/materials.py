"""Radiance's materials as numbers: what they reflect and pass, and how much is left out.

Source: "The RADIANCE 5.1 Synthetic Imaging System", 3.2; luminance from red, green and blue by its
weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bim.radiance.primitives import VOID, Primitive
from mitsuba_cfs.gloss import ROUGHEST, STEPS, Gloss, radiance_gloss

LUMINANCE = (0.265, 0.670, 0.065)  # of red, green, blue [1]
MIXTURE = "mixfunc"
OPAQUE = ("plastic", "metal", "plastic2", "metal2", "trans", "trans2")
CLEAR = ("glass", "dielectric", "interface")
SYSTEMS = ("BSDF", "aBSDF")
BLACK = ("light", "glow", "illum", "spotlight")
MATERIALS = (*OPAQUE, *CLEAR, *SYSTEMS, *BLACK, "mirror", "BRTDfunc")
PATTERNS = (
    "colorfunc",
    "brightfunc",
    "colordata",
    "brightdata",
    "colorpict",
    "colortext",
    "brighttext",
    "texfunc",
    "texdata",
    "spectrum",
    "specfile",
    "specfunc",
    "specdata",
    "specpict",
)
GLASS_INDEX = 1.52  # where a glass states none
NUMBERS = {
    "plastic": 5,
    "metal": 5,
    "trans": 7,
    "mirror": 3,
    "glass": 3,
    "dielectric": 5,
    "plastic2": 6,
    "metal2": 6,
    "trans2": 8,
}


@dataclass(frozen=True, slots=True)
class RadianceMaterial:
    """A material of a scene file."""

    name: str
    kind: str
    diffuse: float = 0.0  # diffuse reflectance at normal incidence [1]
    gloss: Gloss | None = None  # the mirrored part; of a pane as one before something dark
    transmitted: float = 0.0  # of `trans`: passed diffusely [1]
    straight: float = 0.0  # of `trans`: passed without scattering [1]
    transmissivity: float = 1.0  # of glass: of one way through it, straight on [1]
    index: float = GLASS_INDEX  # of glass: refractive index [1]
    bsdf: str = ""  # file of a BSDF

    @property
    def is_translucent(self) -> bool:
        """Whether it is a `trans` or a mixture that transmits light."""
        return self.transmitted + self.straight > 0

    @property
    def is_opaque(self) -> bool:
        """Whether it obstructs light, as the tracer takes it."""
        return self.kind in (*OPAQUE, *BLACK, "mirror", MIXTURE)


def material_of(primitive: Primitive) -> RadianceMaterial:
    """The material that a primitive defines.

    Raises: `DataError` naming file and line for wrong arguments.
    """
    kind, numbers = primitive.kind, primitive.numbers
    if len(numbers) < NUMBERS.get(kind, 0):
        raise primitive.fault(f"expected {NUMBERS[kind]} numbers, got {len(numbers)}")
    if kind in (*OPAQUE, "mirror", "glass") and min(numbers) < 0:
        raise primitive.fault("a number is negative")
    name = primitive.name
    if kind == "mirror" and primitive.strings and primitive.strings[0] != VOID:
        raise primitive.fault(f"its other material {primitive.strings[0]} is not computed")
    if kind in SYSTEMS:
        place = 1 if kind == "BSDF" else 0  # behind the thickness
        if len(primitive.strings) <= place:
            raise primitive.fault("names no BSDF file")
        return RadianceMaterial(name, kind, bsdf=primitive.strings[place])
    if kind in ("glass", "dielectric", "mirror"):
        grey = [*3 * [luminance(numbers)], *numbers[3:]]
        if (len(grey) > 3 and not grey[3] >= 1) or not grey[0] <= 1:
            raise primitive.fault("has a refractive index below 1 or passes more than it gets")
        index = GLASS_INDEX if len(grey) < 4 else grey[3]
        gloss = radiance_gloss(kind, grey)[1]
        return RadianceMaterial(name, kind, gloss=gloss, transmissivity=grey[0], index=index)
    if kind in OPAQUE:
        return _opaque(primitive)
    return RadianceMaterial(name, kind)


def mixed_material(
    name: str, share: float, foreground: RadianceMaterial, background: RadianceMaterial
) -> RadianceMaterial:
    """A mixture with a share of its foreground: means of what both reflect and transmit.

    Its gloss has the roughness of the stronger one.
    """
    parts = ((share, foreground), (1.0 - share, background))
    shiny = [(s, one.gloss) for s, one in parts if one.gloss is not None and s > 0]
    gloss = None
    if shiny:
        cosine = np.linspace(0.0, 1.0, STEPS)
        specular = np.clip(sum(s * one.reflectance(cosine) for s, one in shiny), 0, 1)
        strongest = max(shiny, key=lambda pair: pair[0] * pair[1].at_normal)[1]
        gloss = Gloss(tuple(specular.tolist()), strongest.roughness)
    return RadianceMaterial(
        name,
        MIXTURE,
        diffuse=sum(s * one.diffuse for s, one in parts),
        gloss=gloss,
        transmitted=sum(s * one.transmitted for s, one in parts),
        straight=sum(s * (one.straight if one.is_opaque else 1.0) for s, one in parts),
    )


def _opaque(primitive: Primitive) -> RadianceMaterial:
    kind, numbers = primitive.kind.removesuffix("2"), primitive.numbers
    colour, share = luminance(numbers), numbers[3]
    roughness = float(np.mean(numbers[4:6])) if primitive.kind.endswith("2") else numbers[4]
    passed, straight = numbers[-2:] if kind == "trans" else (0.0, 0.0)
    if not (colour <= 1 and share <= 1 and passed <= 1 and straight <= 1):
        raise primitive.fault("reflects or passes more than it gets")
    coat = "metal" if kind == "metal" else "plastic"
    if roughness > ROUGHEST:  # no mirror at all any more
        diffuse, gloss = colour if coat == "metal" else colour * (1 - share) + share, None
    else:
        diffuse, gloss = radiance_gloss(coat, [colour, colour, colour, share, roughness])
    return RadianceMaterial(
        primitive.name,
        primitive.kind,
        diffuse=diffuse * (1 - passed),
        gloss=gloss,
        transmitted=diffuse * passed * (1 - straight),
        straight=diffuse * passed * straight,
    )


def luminance(numbers: tuple[float, ...]) -> float:
    """Luminance of red, green and blue [1]."""
    return float(np.dot(numbers[:3], LUMINANCE))
