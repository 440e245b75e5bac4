"""The Mitsuba plugin `klems_bsdf`: Klems matrices as a BSDF that samples itself exactly.

    {"type": "klems_bsdf", "filename": "blind.xml", "band": "Visible", "up": [0, 0, 1],
     "peak": False}

The value is constant on each pair of patches; a patch is drawn in proportion to value x projected
solid angle and then a point of it evenly in cos(theta) d_omega.  A file may differ between light
that goes one way and the other: each transport mode has its own tables (see `plugin_base`).
With `peak`, what the matrices send straight on beyond what surrounds it passes undisturbed.
In variants of colour a file's CIE-X and CIE-Z bands tint its Visible one.

`mi.traverse` shows `matrices` [4, outgoing, incident patch], those of `BLOCKS`, as a differentiable
parameter: of the grey value, without the beam that `peak` separates.

Importing this module registers the plugin, again for every Mitsuba variant that is set later.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.colour import relative_rgb
from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.bsdf.klems import KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.plugin_base import window_bsdf
from mitsuba_cfs.bsdf.plugin_data import PREFIXES, read_band

PLUGIN = "klems_bsdf"


def klems_plugin(
    klems: KlemsBsdf,
    *,
    colour: tuple[KlemsBsdf, KlemsBsdf] | None = None,
    up: tuple[float, float, float] | None = None,
    peak: bool = False,
    angular: AngularTable | None = None,
) -> dict:
    """The `load_dict` entry of a system's BSDF, for the active Mitsuba variant.

    Args:
        colour: its CIE-X and CIE-Z bands, for variants of colour.
        up: [3] world vector of the system's up.
        peak: transmit the direct part undisturbed.
        angular: direct transmittance of a specular system by angle, instead of the data's patches.
    """
    variants.activate(vectorised=False)
    import mitsuba as mi

    if klems.basis_in != klems.basis_out:
        raise ValueError("klems_bsdf needs the same basis for incident and outgoing light")
    basis = klems.basis_in
    entry = {
        "type": PLUGIN,
        "peak": peak,
        "theta_bounds": mi.TensorXf(np.array(basis.theta_bounds, dtype=np.float32)),
        "phi_counts": mi.TensorXf(np.array(basis.phi_counts, dtype=np.float32)),
    }
    bands = dict(zip(PREFIXES, (klems, *(colour or ())), strict=False))
    for prefix, band in bands.items():
        for name, block in band.filled().blocks().items():
            entry[prefix + name] = mi.TensorXf(np.ascontiguousarray(block, dtype=np.float32))
    if up is not None:
        entry["up"] = list(map(float, up))
    if klems.see_through is not None:
        entry["see_through"] = klems.see_through
    if angular is not None:
        table = mi.TensorXf(angular.by_cosine().astype(np.float32))
        entry |= {"peak": True, "angular": table, "see_through": 1.0}
    return entry


# The matrices in the order of the parameter `matrices` of the plugin
BLOCKS = ("reflection_front", "transmission_front", "reflection_back", "transmission_back")


def stored_matrices(klems: KlemsBsdf) -> NDArray[np.float64]:
    """The matrices of `BLOCKS` [4, outgoing patch, incident patch] [1/sr]."""
    full = klems.filled().blocks()
    return np.stack([full[name] for name in BLOCKS])


def scattering_tables(matrices: NDArray) -> NDArray:
    """BSDF by [side of the light, incident patch, same or other side, outgoing patch] [1/sr].

    Args: matrices: `stored_matrices`, or the numbers of their entries.
    """
    turned = matrices.transpose(0, 2, 1)
    front, back = (np.stack([turned[i], turned[i + 1]], axis=1) for i in (0, 2))
    return np.stack([front, back])


def reversed_tables(tables: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same by [side the light leaves to, outgoing patch, same or other, incident patch]."""
    reflection = tables[:, :, 0].transpose(0, 2, 1)
    transmission = tables[::-1, :, 1].transpose(0, 2, 1)
    return np.stack([reflection, transmission], axis=2)


def cumulative_tables(
    tables: NDArray[np.float64], solid_angles: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cumulative shares [.., K] of each row (the last 1), and all that it scatters [..]."""
    cumulative = np.cumsum(tables * solid_angles, axis=-1)
    amount = cumulative[..., -1].copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(amount[..., None] > 0, cumulative / amount[..., None], 1.0)
    return share, amount


def without_peak(klems: KlemsBsdf) -> tuple[KlemsBsdf, NDArray[np.float64]]:
    """The system without its through beams, and their transmittances [front and back, K]."""
    full = klems.filled()
    peaks = [
        through_peak(block, klems.basis_in, klems.see_through)
        for block in (full.transmission_front, full.transmission_back)
    ]
    rest = replace(full, transmission_front=peaks[0].scattered, transmission_back=peaks[1].scattered)
    return rest, np.stack([peak.transmittance for peak in peaks])


def _read(props) -> tuple[KlemsBsdf, tuple[KlemsBsdf, KlemsBsdf] | None]:
    """The matrices that the plugin's properties name (a file) or hold (tensors), and their X, Z."""
    if "filename" in props:
        return read_band(props, KlemsBsdf)
    bounds, counts = (np.array(props[name]).ravel() for name in ("theta_bounds", "phi_counts"))
    bounds = tuple(np.clip(np.float64(bounds), 0, np.pi / 2).tolist())
    basis = KlemsBasis("plugin", bounds, tuple(int(count) for count in counts))
    names = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
    bands = []
    for prefix in PREFIXES:
        blocks = {n: np.float64(props[prefix + n]) for n in names if prefix + n in props}
        share = float(props["see_through"]) if "see_through" in props else None
        bands.append(KlemsBsdf(basis, basis, **blocks, see_through=share))
    return bands[0], tuple(bands[1:]) if bands[1].blocks() else None


def entry_colours(klems: KlemsBsdf, colour: tuple[KlemsBsdf, KlemsBsdf]) -> NDArray[np.float64]:
    """Linear sRGB over the grey value [mode, side, K, same or other side, K, 3] of each entry."""
    if any((b.basis_in, b.basis_out) != (klems.basis_in, klems.basis_out) for b in colour):
        raise ValueError("the CIE-X and CIE-Z bands are on another angle basis than the Visible one")
    bands = [scattering_tables(stored_matrices(band)) for band in (colour[0], klems, colour[1])]
    return relative_rgb(*(np.stack([reversed_tables(t), t]) for t in bands))


def _register(variant: str) -> None:
    """Define the plugin on the types of `variant` and make Mitsuba know it."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin_data import TableParameter, TracedColour, sees_colour
    from mitsuba_cfs.bsdf.traced_klems import TracedBasis, gather, table

    class KlemsBsdfPlugin(window_bsdf()):
        def __init__(self, props):
            super().__init__(props)
            klems, colour = _read(props)
            if klems.basis_in != klems.basis_out:
                raise ValueError("klems_bsdf needs the same basis for incident and outgoing light")
            self.size, self.basis = klems.basis_in.size, TracedBasis(klems.basis_in)
            if colour is not None and sees_colour():
                self.colour = TracedColour(entry_colours(klems, colour).reshape(-1, 3))
            if self.peak:
                klems, straight = without_peak(klems)
                self.straight = table(straight)  # [side that the light comes from, K]
            matrices = stored_matrices(klems)
            tables = scattering_tables(matrices)
            both = (reversed_tables(tables), tables)  # known: where the light goes, or comes from
            areas = klems.basis_in.projected_solid_angles()
            parts = [cumulative_tables(each, areas) for each in both]
            self.matrix = table(np.stack(both))  # [mode, side, K, same or other side, K]
            self.cumulative = table(np.stack([share for share, _ in parts]))
            self.amounts = table(np.stack([amount for _, amount in parts]))
            numbers = scattering_tables(np.arange(matrices.size).reshape(matrices.shape))
            self.parameter = TableParameter(matrices, np.stack([reversed_tables(numbers), numbers]))

        def traverse(self, callback):
            super().traverse(callback)
            self.parameter.traverse(callback, "matrices")

        def parameters_changed(self, keys=()):
            self.parameter.changed()

        def value(self, entry, active):
            """f of an entry, and the density that it is drawn with: that of the data as read."""
            density = gather(self.matrix, entry, active)
            return self.parameter.value(entry, density, active), density

        def row(self, ctx, known):
            """Number of the table's row (mode, side, patch) for the direction that is known."""
            incident = ctx.mode == mi.TransportMode.Importance
            side = dr.select(known.z > 0, mi.UInt32(0), mi.UInt32(1))
            row = side * self.size + self.patch(known, incident)
            return row + 2 * self.size if incident else row

        def patch(self, v, incident: bool):
            """Patch of a direction; azimuths as in `mitsuba_cfs.directions`."""
            return self.basis.patch(v.x if incident else -v.x, -v.y if incident else v.y, v.z)

        def values(self, ctx, known, other, active):
            through = known.z * other.z < 0
            column = self.patch(other, ctx.mode != mi.TransportMode.Importance)
            row = 2 * self.row(ctx, known) + dr.select(through, mi.UInt32(1), mi.UInt32(0))
            entry = row * self.size + column
            return *self.value(entry, active), entry

        def totals(self, ctx, known, active):
            row = 2 * self.row(ctx, known)
            return gather(self.amounts, row, active), gather(self.amounts, row + 1, active)

        def through(self, ctx, known, active):
            """The beam keeps its patch, on whichever side it is looked at."""
            incident = ctx.mode == mi.TransportMode.Importance
            from_front = (known.z > 0) if incident else (known.z < 0)
            side = dr.select(from_front, mi.UInt32(0), mi.UInt32(1))
            return gather(self.straight, side * self.size + self.patch(known, incident), active)

        def through_entry(self, ctx, known, active):
            """Of the beam's colour: the patch straight on, of the table for transmission."""
            patch = self.patch(known, ctx.mode == mi.TransportMode.Importance)
            return (2 * self.row(ctx, known) + 1) * self.size + patch

        def draw(self, ctx, known, through, u, point, active):
            row = 2 * self.row(ctx, known) + dr.select(through, mi.UInt32(1), mi.UInt32(0))
            patch = self.search(row * self.size, u)
            incident = ctx.mode != mi.TransportMode.Importance  # so is the drawn direction
            x, y, z = self.basis.direction(patch, point.x, point.y)
            z = dr.select((known.z > 0) ^ through, z, -z)
            other = mi.Vector3f(x, -y, z) if incident else mi.Vector3f(-x, y, z)
            entry = row * self.size + patch
            return other, *self.value(entry, active), entry

        def search(self, offset, target):
            """First entry of a row whose cumulative share exceeds `target`."""
            low, high = mi.UInt32(0), mi.UInt32(self.size - 1)
            for _ in range(int(np.ceil(np.log2(self.size))) + 1):
                middle = (low + high) // 2
                above = gather(self.cumulative, offset + middle) > target
                searching = low < high
                high = dr.select(searching & above, middle, high)
                low = dr.select(searching, dr.select(above, low, middle + 1), low)
            return low

        def to_string(self):
            return f"KlemsBsdf[{self.size} patches]"

    mi.register_bsdf(PLUGIN, KlemsBsdfPlugin)


variants.register(_register)
