"""The cell of a shade in a Radiance scene, to be traced to a BSDF: `read_radiance_layer`.

Read are all primitives, commands and modifiers of `read_radiance`. What `normal.c`, `glass.c` and
`dielectric.c` do at a surface becomes a `SlatMaterial`, grey by luminance.

Source: "The RADIANCE 5.1 Synthetic Imaging System", 3.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike

import numpy as np

from bim.radiance.layers import SMOOTH
from bim.radiance.materials import BLACK, luminance, material_of
from bim.radiance.scene import RadianceObject, read_radiance
from bim.report.issue import issue_note
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial
from mitsuba_cfs.errors import DataError

INWARDS = np.array([-1.0, 1.0, -1.0])  # from genBSDF's frame (z into the room, x left) to ours


def read_radiance_layer(
    path: str | PathLike[str], period: tuple[float, float]
) -> tuple[PeriodicLayer, tuple[str, ...]]:
    """The layer of a Radiance scene in genBSDF's frame (z into the room, y up) [m], and notes.

    Args: period: width and height of the cell [m].

    Raises: `DataError` naming file and line for what cannot be read or has no such material.
    """
    scene = read_radiance(path)
    if not scene.objects:
        raise DataError("has no surface", file=path)
    sheets: dict[SlatMaterial, int] = {}
    triangles, used = [], []
    for thing in scene.objects:
        if thing.material.kind == "mirror" and thing.material.gloss is None:
            continue  # the black sheet behind a mirror: the back of its slat is black already
        number = sheets.setdefault(slat_material(thing), len(sheets))
        triangles.append(thing.triangles * INWARDS)
        used += [number] * len(thing.triangles)
    layer = PeriodicLayer(np.concatenate(triangles), np.array(used), tuple(sheets), period)
    return layer, (*(str(issue_note(issue)) for issue in scene.issues), *_dark(scene.objects))


def slat_material(thing: RadianceObject) -> SlatMaterial:
    """Optics of a surface, in one channel.

    Raises: `DataError` naming file and line for a material that the tracer does not have.
    """
    material, primitive = thing.material, thing.definitions[-1].primitive
    kind, numbers = material.kind.removesuffix("2"), primitive.numbers
    if len(thing.definitions) > 1 and not material.is_opaque:
        raise primitive.fault(f"{material.kind} with a pattern is not traced")
    if kind in ("plastic", "metal", "trans"):
        return _sheet(thing, kind)
    black = (0.0,)
    if material.kind in BLACK:
        return SlatMaterial(material.name, black, black)
    if kind == "mirror":
        return SlatMaterial(material.name, black, black, specular=luminance(numbers), back_is_black=True)
    if kind == "glass":
        return SlatMaterial(material.name, black, black, index=material.index, pane=material.transmissivity)
    if kind == "dielectric" and min(numbers[:3]) == 1 and numbers[4] == 0:
        return SlatMaterial(material.name, black, black, index=numbers[3])
    raise primitive.fault(
        f"{material.kind} is not traced in a cell"
        + (": only clear ones are (1 1 1, no dispersion)" if kind == "dielectric" else "")
    )


def _sheet(thing: RadianceObject, kind: str) -> SlatMaterial:
    """`plastic`, `metal` or `trans`: diffuse, with a gloss, and what is passed."""
    primitive = thing.definitions[-1].primitive
    numbers = primitive.numbers
    plain = material_of(primitive).diffuse
    pattern = thing.material.diffuse / plain if plain > 0 else 1.0
    colour = luminance(numbers) * pattern
    share = numbers[3]
    roughness = numbers[4]
    if thing.material.kind.endswith("2"):
        roughness = float(np.mean(numbers[4:6]))
    passed, straight = numbers[-2:] if kind == "trans" else (0.0, 0.0)
    if passed * straight > 0 and roughness**2 > SMOOTH:
        raise primitive.fault(f"passes its beam in a lobe of roughness {roughness:g}: not traced")
    rest = (1 - share) * colour
    try:
        return SlatMaterial(
            thing.material.name,
            (rest * (1 - passed),),
            (rest * (1 - passed),),
            (rest * passed * (1 - straight),) if passed else (),
            specular=share * luminance(numbers) if kind == "metal" else share,
            roughness=roughness,
            straight=rest * passed * straight,
        )
    except ValueError as error:
        raise primitive.fault(str(error)) from None


def _dark(things: Sequence[RadianceObject]) -> tuple[str, ...]:
    names = {thing.material.name: thing for thing in things if thing.material.kind in BLACK}
    return tuple(
        f"{one.primitive.file}:{one.primitive.line}: {one.material.kind} {name} is taken as black"
        for name, one in names.items()
    )
