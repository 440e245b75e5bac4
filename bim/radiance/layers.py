"""Optics of the panes, fabrics and translucent panels in a Radiance window, as one system.

Each layer has a specular part by the angle of incidence and a diffuse one. The specular parts
are combined exactly, with all reflections between the layers and by polarisation; the diffuse
ones by Klems matrices. A pattern counts by its mean over the surface. A rough translucent panel
is a tensor tree with its lobe; behind or in front of other layers its lobe is that of its patches.

Source: "The RADIANCE 5.1 Synthetic Imaging System", 3.2 and 3.3; `normal.c`, `glass.c`,
`m_brdf.c` of Radiance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.fenestration import ShadingState
from bim.radiance.functions import find_functions
from bim.radiance.materials import LUMINANCE, SYSTEMS, luminance
from bim.radiance.patterns import COMPUTED_PATTERNS, EVEN, TURNS, evaluated, functions_of, pattern_values, ray_variables
from bim.radiance.primitives import VOID
from bim.radiance.scene import RadianceObject
from bim.report.issue import Issue
from mitsuba_cfs.bsdf.angular import ANGLES, AngularTable
from mitsuba_cfs.bsdf.evaluate import klems_of
from mitsuba_cfs.bsdf.glazing import PaneOptics, stack
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.lobe import NARROWEST, lobe_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.gloss import lacquer, polarised_shares

SMOOTH = 1e-6  # squared roughness up to which Radiance takes a beam as sharp
PARALLEL = 1e-3  # sine of the angle between up vector and normal
APART = 0.02  # spread over azimuths from which a function depends on them, of its greatest value


@dataclass(frozen=True, slots=True)
class WindowLayer:
    """A layer's shares of light by angle of incidence, front outdoors."""

    specular: PaneOptics  # [2, N] by polarisation at `ANGLES`
    scattered: NDArray[np.float64]  # [N] transmitted diffusely, from either side
    reflected_front: NDArray[np.float64]  # [N] reflected diffusely
    reflected_back: NDArray[np.float64]  # [N]

    @property
    def klems(self) -> KlemsBsdf:
        """The layer as Klems matrices."""
        omega = KLEMS_FULL.projected_solid_angles()
        blocks = []
        for share, diffuse in (
            (self.specular.tau, self.scattered),
            (self.specular.rho_front, self.reflected_front),
            (self.specular.rho_back, self.reflected_back),
        ):
            beam, even = (_patch_means(values) for values in (share.mean(axis=0), diffuse))
            blocks.append(np.diag(beam / omega) + np.tile(even / np.pi, (KLEMS_FULL.size, 1)))
        return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, blocks[0], blocks[0], blocks[1], blocks[2])


@dataclass(frozen=True, slots=True)
class LayeredWindow:
    """A system of a window's layers."""

    state: ShadingState
    up: NDArray[np.float64] | None = None  # [3] of its BSDF
    issues: tuple[Issue, ...] = ()


def layered_window(
    things: Sequence[RadianceObject],
    outwards: Sequence[bool],
    beside: NDArray[np.float64] | None = None,
    facing: NDArray[np.float64] | None = None,
) -> LayeredWindow:
    """The system of a window's layers, the outer one first.

    Args:
        outwards: whether the front of each layer is outdoors.
        beside: [N] share of light at `ANGLES` that meets the innermost alone.
        facing: [N] share of the light that it reflects outwards that meets the others, where the
            rest meets walls; None without walls.

    Raises: `DataError` naming file and line for a layer that cannot be computed.
    """
    files = [issue for thing in things for issue in (*moved_files(thing), *_thickness(thing))]
    issues = list(dict.fromkeys(files))
    if len(things) == 1 and things[0].material.kind in SYSTEMS:
        thing = things[0]
        path, shares = _bsdf_file(thing), _added_shares(thing, outwards[0])
        bands = dict(read_bsdf_xml(path).bands)
        if outwards[0]:  # the front of its data is on the side that the normal leaves
            bands = {name: band.turned_round() for name, band in bands.items()}
        if not any(shares):
            return LayeredWindow(ShadingState(bands=bands, file=path), up_vector(thing), tuple(issues))
        if any(isinstance(band, TensorTreeBsdf) for band in bands.values()):
            raise thing.definitions[-1].primitive.fault(
                "adds diffuse shares to a tensor tree, which is not computed: "
                "add them to the file, or use its Klems matrix"
            )
        bands = {name: _with_shares(klems_of(band), shares) for name, band in bands.items()}
        state = ShadingState(bands=bands, layers=(path,))
        return LayeredWindow(state, up_vector(thing), tuple(issues))
    layers = [
        _bsdf_layer(thing, outward) if thing.material.kind in SYSTEMS else _layer(thing, outward, issues)
        for thing, outward in zip(things, outwards, strict=True)
    ]
    rough = [layer for layer in layers if isinstance(layer, TensorTreeBsdf)]
    if rough and len(layers) == 1:
        return LayeredWindow(ShadingState(bands={"Visible": rough[0]}), issues=tuple(issues))
    ups = [up for thing in things if (up := up_vector(thing)) is not None]
    if any(ups[0] @ other < 0.9999 for other in ups[1:]):
        raise things[-1].primitive.fault("two BSDF in series have different up vectors")
    angular = None
    plain = [layer for layer in layers if isinstance(layer, WindowLayer)]
    if len(plain) == len(layers):
        angular, alone = _beam_table(plain), _beam_table(plain[-1:])
        if facing is not None:
            angular = replace(angular, reflectance_front=alone.reflectance_front)
        if beside is not None:
            angular = angular.mixed(alone, beside)
    klems = [layer.klems if isinstance(layer, WindowLayer) else klems_of(layer) for layer in layers]
    system = _in_series(klems, None if facing is None else _patch_means(facing))
    if beside is not None:
        system = _mixed(system, klems[-1], _patch_means(beside))
    system = replace(system, see_through=0.0) if rough else system
    files = tuple(_bsdf_file(thing) for thing in things if thing.material.kind in SYSTEMS)
    state = ShadingState(bands={"Visible": system}, angular=angular, layers=files)
    return LayeredWindow(state, ups[0] if ups else None, tuple(issues))


def front_reflectance(thing: RadianceObject, outward: bool) -> float:
    """Reflectance of a layer's outdoor side for diffuse light.

    Args: outward: whether its front is outdoors.
    """
    is_system = thing.material.kind in SYSTEMS
    layer = _bsdf_layer(thing, outward) if is_system else _layer(thing, outward, [])
    klems = layer.klems if isinstance(layer, WindowLayer) else klems_of(layer)
    block = klems.filled().reflection_front
    omega = klems.basis_in.projected_solid_angles()
    return 0.0 if block is None else float(omega @ klems.direct_hemispherical(block) / omega.sum())


def _beam_table(layers: Sequence[WindowLayer]) -> AngularTable:
    whole = stack([layer.specular for layer in layers])
    values = (whole.tau, whole.rho_front, whole.rho_back)
    return AngularTable(ANGLES, *(np.clip(one.mean(axis=0), 0, 1) for one in values))


def _in_series(layers: Sequence[KlemsBsdf], facing: NDArray[np.float64] | None) -> KlemsBsdf:
    """Layers as one system, where a share [K] of what the last reflects outwards meets the others.

    The rest meets the walls between them, which see the last layer alone: what the others mirror
    is outdoors.
    """
    if len(layers) == 1:
        return layers[0]
    if facing is None:
        return combine_layers(list(layers)).bsdf
    *outer, inner = (layer.filled() for layer in layers)
    before = outer[0] if len(outer) == 1 else combine_layers(outer).bsdf
    before = replace(before, reflection_back=facing * before.reflection_back)
    whole = combine_layers([before, inner]).bsdf
    return replace(whole, reflection_front=inner.reflection_front)


def _mixed(system: KlemsBsdf, inner: KlemsBsdf, share: NDArray[np.float64]) -> KlemsBsdf:
    """A system with a share [K] of the light from outdoors that meets its innermost layer alone."""
    blocks = {"transmission_front": share, "transmission_back": share[:, None], "reflection_front": share}
    mixed = {}
    for name, part in blocks.items():
        whole, other = getattr(system, name), getattr(inner, name)
        if whole is not None and other is not None:
            mixed[name] = (1 - part) * whole + part * other
    return replace(system, **mixed)


def up_vector(thing: RadianceObject) -> NDArray[np.float64] | None:
    """The up vector [3] of a surface's BSDF; None for other materials."""
    definition = thing.definitions[-1] if thing.definitions else None
    if thing.material.kind not in SYSTEMS or definition is None:
        return None
    primitive = definition.primitive
    start = 2 if thing.material.kind == "BSDF" else 1
    if len(primitive.strings) < start + 4:
        return None
    functions, frame = functions_of(definition, primitive.strings[start + 3 :])
    up = np.array([float(evaluated(definition, functions, text, {})) for text in primitive.strings[start : start + 3]])
    up = frame[:3, :3] @ up
    if not np.linalg.norm(up) > 0:
        raise primitive.fault("its up vector is zero")
    if np.linalg.norm(np.cross(up, thing.normal)) < PARALLEL * np.linalg.norm(up):
        raise primitive.fault(f"its up vector is the normal of {thing.name}")
    return up / np.linalg.norm(up)


def moved_files(thing: RadianceObject) -> list[Issue]:
    """Function files of a surface's modifiers that were not where their names say."""
    issues = []
    for one in thing.definitions:
        for name in one.primitive.strings:
            if not name.endswith(".cal"):
                continue
            path = find_functions(name, one.primitive.file)
            if path is not None and not _is_stated(path, name, one.primitive.file.parent):
                where = f"{one.primitive.file}:{one.primitive.line}"
                values = {"name": name, "used": str(path)}
                issues.append(Issue("function-file-elsewhere", where, values))
    return issues


def _is_stated(path: Path, name: str, folder: Path) -> bool:
    """Whether a file is where its name says, from the working directory or the scene's folder."""
    return any(place.is_file() and place.samefile(path) for place in (Path(name), folder / name))


def _bsdf_file(thing: RadianceObject) -> Path:
    return thing.primitive.file.parent / thing.material.bsdf


def _bsdf_layer(thing: RadianceObject, outward: bool) -> KlemsBsdf:
    file = read_bsdf_xml(_bsdf_file(thing))
    bsdf = klems_of(file.bands.get("Visible") or file.bands["Solar"]).filled()
    side = bsdf.turned_round() if outward else bsdf
    return _with_shares(side, _added_shares(thing, outward))


def _added_shares(thing: RadianceObject, outward: bool) -> tuple[float, float, float]:
    """Shares that a `BSDF` adds to its file: reflected outdoors and indoors, transmitted."""
    numbers = (*thing.definitions[-1].primitive.numbers, *9 * [0.0])
    front, back, passed = (luminance(numbers[i : i + 3]) for i in (0, 3, 6))
    return (front, back, passed) if outward else (back, front, passed)


def _with_shares(bsdf: KlemsBsdf, shares: tuple[float, float, float]) -> KlemsBsdf:
    """A BSDF and shares that it scatters evenly besides: of its front, its back, through it."""
    front, back, passed = (share / np.pi for share in shares)
    full = bsdf.filled()
    return replace(
        bsdf,
        transmission_front=full.transmission_front + passed,
        transmission_back=full.transmission_back + passed,
        reflection_front=full.reflection_front + front,
        reflection_back=full.reflection_back + back,
    )


def _thickness(thing: RadianceObject) -> list[Issue]:
    """The thickness of a `BSDF`, which shows the geometry behind it in Radiance."""
    if thing.material.kind != "BSDF":
        return []
    definition = thing.definitions[-1]
    functions, _ = functions_of(definition, definition.primitive.strings[5:])
    thickness = float(evaluated(definition, functions, definition.primitive.strings[0], {}))
    if not thickness:
        return []
    where = f"{thing.primitive.file}:{thing.primitive.line}"
    return [Issue("bsdf-thickness", where, {"surface": thing.name, "thickness": thickness})]


def _layer(thing: RadianceObject, outward: bool, issues: list[Issue]) -> WindowLayer | TensorTreeBsdf:
    material, zero = thing.material, np.zeros(len(ANGLES))
    if thing.parts:
        return _mixed_layer(thing, outward, issues)
    if material.is_opaque and not material.is_translucent:  # of a mixture
        gloss = zero if material.gloss is None else material.gloss.reflectance(np.cos(ANGLES))
        mirrored = np.stack([gloss, gloss])
        diffuse = zero + material.diffuse
        return WindowLayer(PaneOptics(0 * mirrored, mirrored, mirrored), zero, diffuse, diffuse)
    if material.kind == VOID:
        one = np.ones((2, len(ANGLES)))
        return WindowLayer(PaneOptics(one, 0 * one, 0 * one), zero, zero, zero)
    patterns = thing.definitions[:-1]
    for one in patterns:
        if one.primitive.kind not in COMPUTED_PATTERNS:
            raise one.primitive.fault(
                f"on window {thing.name}: patterns of this type are not computed; "
                "give the window's mean transmissivity without it"
            )
    scale = np.ones((len(ANGLES), 1))
    if patterns:
        scale = pattern_values(thing.triangles, thing.normal, patterns, ANGLES)
    if np.ptp(scale, axis=1).max() > EVEN:
        first = patterns[0].primitive
        values = {
            "pattern": first.name,
            "surface": thing.name,
            "mean": float(scale.mean()),
            "least": float(scale.min()),
            "greatest": float(scale.max()),
        }
        issues.append(Issue("glass-pattern-averaged", f"{first.file}:{first.line}", values))
    if material.kind == "glass":
        passed = np.full(len(ANGLES), material.transmissivity)
        tau, rho = polarised_shares(np.cos(ANGLES), material.index, passed)
        tau = np.minimum(tau * scale.mean(axis=1), 1 - rho)  # `glass.c`: not the transmissivity
        return WindowLayer(PaneOptics(tau, rho, rho), zero, zero, zero)
    colour = np.minimum(scale, 1.0).mean(axis=1)
    if material.kind.startswith("trans"):
        return _trans_layer(thing, colour)
    if material.kind == "BRTDfunc":
        return _function_layer(thing, outward, colour)
    raise thing.primitive.fault(f"{material.kind} is not computed as a layer of a window")


def _mixed_layer(thing: RadianceObject, outward: bool, issues: list[Issue]) -> WindowLayer:
    """A `mixfunc`: what its two materials pass and reflect, by the mean share of the first."""
    definition = thing.definitions[-1]
    values = pattern_values(thing.triangles, thing.normal, [definition], ANGLES)
    share = np.clip(values, 0.0, 1.0)
    layers = [_layer(part, outward, issues) for part in thing.parts]
    smooth = [layer for layer in layers if isinstance(layer, WindowLayer)]
    if len(smooth) < len(layers):
        raise definition.primitive.fault("mixes a rough trans, which is not computed")
    if np.ptp(share, axis=1).max() > EVEN:
        where = f"{definition.primitive.file}:{definition.primitive.line}"
        foreground, background = (part.material.name for part in thing.parts)
        of_pane = {
            "surface": thing.name,
            "mixture": definition.primitive.name,
            "foreground": foreground,
            "background": background,
            "mean": 100 * float(share.mean()),
            "least": 100 * float(share.min()),
            "greatest": 100 * float(share.max()),
        }
        issues.append(Issue("glass-mixture-averaged", where, of_pane))
    mean = share.mean(axis=1)

    def mixed(name: str) -> NDArray[np.float64]:
        one, other = (attrgetter(name)(layer) for layer in smooth)
        return mean * one + (1.0 - mean) * other

    specular = PaneOptics(*(mixed(f"specular.{name}") for name in ("tau", "rho_front", "rho_back")))
    return WindowLayer(specular, *(mixed(name) for name in ("scattered", "reflected_front", "reflected_back")))


def _trans_layer(thing: RadianceObject, colour: NDArray[np.float64]) -> WindowLayer | TensorTreeBsdf:
    """A `trans`: diffuse and straight transmission; a rough one scatters both beams in lobes."""
    numbers = thing.definitions[-1].primitive.numbers
    specular, roughness, passed, straight = numbers[3], numbers[4], *numbers[-2:]
    is_rough = passed * straight > 0 and roughness**2 > SMOOTH
    if is_rough and roughness < NARROWEST:
        raise thing.definitions[-1].primitive.fault(
            f"scatters its beam in a lobe of roughness {roughness:g}: computed are 0 and {NARROWEST:.3f} or more"
        )
    mirrored = lacquer(specular, roughness).reflectance(np.cos(ANGLES))
    rest = colour * luminance(numbers) * (1 - mirrored)
    beam, mirror = (np.stack([v, v]) for v in (rest * passed * straight, mirrored))
    diffuse = rest * (1 - passed)
    scattered = rest * passed * (1 - straight)
    if not is_rough:
        return WindowLayer(PaneOptics(beam, mirror, mirror), scattered, diffuse, diffuse)
    through, back = (
        lobe_tree(roughness, *(partial(np.interp, xp=ANGLES, fp=values) for values in pair))
        for pair in ((beam[0], scattered), (mirrored, diffuse))
    )
    return TensorTreeBsdf(through, through, back, back, see_through=0.0)


def _function_layer(thing: RadianceObject, outward: bool, colour: NDArray[np.float64]) -> WindowLayer:
    """A `BRTDfunc` with specular functions of the angle of incidence and diffuse shares."""
    definition = thing.definitions[-1]
    primitive = definition.primitive
    if len(primitive.strings) < 10 or len(primitive.numbers) < 9:
        raise primitive.fault("expected 10 strings and 9 numbers")
    functions, frame = functions_of(definition, primitive.strings[9:])
    normal, shares = thing.normal, []
    points = np.tile(thing.triangles.mean(axis=(0, 1)), (TURNS, 1))
    for side in (1, -1):
        names = ray_variables(points, frame, side * normal, normal, ANGLES)
        texts = primitive.strings[:9]
        each = [
            np.maximum(evaluated(definition, functions, text, names), 0.0) + np.zeros((len(ANGLES), TURNS))
            for text in texts
        ]
        if any(values.max() > 0 for values in each[6:]):
            raise primitive.fault("its functions of two directions (brtd) are not computed: give a BSDF")
        grey = [np.tensordot(LUMINANCE, np.stack(each[i : i + 3]), axes=1) for i in (0, 3)]
        for values in grey:
            if not values.max() <= 1 + 1e-6:
                raise primitive.fault(f"a function is {values.max():g}: expected 1 at the most")
            if np.ptp(values, axis=1).max() > APART * max(values.max(), 1e-9):
                raise primitive.fault("depends on the azimuth of the light: make its BSDF by genBSDF")
        shares.append([np.clip(values.mean(axis=1), 0, 1) for values in grey])
    front, back, passed = (luminance(primitive.numbers[i : i + 3]) for i in (0, 3, 6))
    if not outward:
        shares, front, back = shares[::-1], back, front
    tau = np.stack([shares[0][1]] * 2)
    rho_front, rho_back = (np.stack([one[0]] * 2) for one in shares)
    return WindowLayer(
        PaneOptics(tau * colour, rho_front * colour, rho_back * colour), passed * colour, front * colour, back * colour
    )


def _patch_means(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return AngularTable(ANGLES, np.clip(values, 0, 1)).patch_means(KLEMS_FULL)
