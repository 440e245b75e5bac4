"""Surfaces that reflect like a mirror as the materials of other programs have them."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from mitsuba_cfs.gloss import Gloss

SMOOTHEST = 1e-3  # Ward's alpha; below it a surface is a mirror
COAT = 0.2  # reflectance at normal incidence up to which a rise with the angle is a dielectric's
GLTF_DIELECTRIC = 0.04  # reflectance at normal incidence that glTF gives what is no metal


def mitsuba_bsdf(reflectance: float, gloss: Gloss | None) -> ElementTree.Element:
    """Mitsuba's `bsdf` of a diffuse reflectance at normal incidence and a gloss.

    What rises with the angle is `plastic` of the index of refraction that reflects as much at
    normal incidence; other gloss is `conductor` that covers its share of the surface.  Both have
    the two reflectances at normal incidence, but for a rough coat's diffuse part, of which Mitsuba
    lets 3 to 4 % less out.  Ward's alpha is that of Beckmann's slopes.
    """
    if gloss is None:
        return _diffuse(reflectance)
    specular = gloss.at_normal
    if 0 < specular <= COAT and len(gloss.specular) > 1:
        return _plastic(reflectance, gloss)
    metal = _of_roughness("conductor", gloss)
    ElementTree.SubElement(metal, "string", name="material", value="none")
    if not reflectance:
        _number(metal, "spectrum", "specular_reflectance", specular)
        return metal
    blend = ElementTree.Element("bsdf", type="blendbsdf")
    _number(blend, "float", "weight", specular)
    blend.append(_diffuse(reflectance / (1.0 - specular)))
    blend.append(metal)
    return blend


def _plastic(reflectance: float, gloss: Gloss) -> ElementTree.Element:
    """A diffuse body below a coat; of its reflectance what passes the coat is seen."""
    root = np.sqrt(gloss.at_normal)
    bsdf = _of_roughness("plastic", gloss)
    _number(bsdf, "float", "int_ior", float((1 + root) / (1 - root)))
    _number(bsdf, "float", "ext_ior", 1.0)
    _number(bsdf, "spectrum", "diffuse_reflectance", reflectance / (1.0 - gloss.at_normal))
    return bsdf


def gltf_factors(reflectance: float, gloss: Gloss | None) -> tuple[float, float]:
    """glTF's metallic and roughness factors of a diffuse reflectance and a gloss.

    A surface that is metal to the share m, of base colour b, reflects 0.04 (1 - m) + b m like a
    mirror and b (1 - m) diffusely; its facets' alpha is the square of its roughness.

    Source: glTF 2.0 specification, appendix B.
    """
    if gloss is None:
        return 0.0, 1.0
    whole, least = reflectance + gloss.at_normal, GLTF_DIELECTRIC
    root = np.sqrt(max(whole**2 - 4 * least * reflectance, 0.0))
    dull = min((whole - root) / (2 * least), 1.0)
    return float(1.0 - dull), float(np.sqrt(gloss.roughness))


def _diffuse(reflectance: float) -> ElementTree.Element:
    bsdf = ElementTree.Element("bsdf", type="diffuse")
    _number(bsdf, "spectrum", "reflectance", reflectance)
    return bsdf


def _of_roughness(kind: str, gloss: Gloss) -> ElementTree.Element:
    """A smooth or rough one of Mitsuba's kinds."""
    if gloss.roughness < SMOOTHEST:
        return ElementTree.Element("bsdf", type=kind)
    bsdf = ElementTree.Element("bsdf", type=f"rough{kind}")
    ElementTree.SubElement(bsdf, "string", name="distribution", value="beckmann")
    _number(bsdf, "float", "alpha", gloss.roughness)
    return bsdf


def _number(parent: ElementTree.Element, kind: str, name: str, value: float) -> None:
    ElementTree.SubElement(parent, kind, name=name, value=f"{value:.6g}")
