"""Checks of a BSDF file: findings with their consequences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.energy import ENERGY_LIMIT, ENERGY_SLACK, excess, gains_energy
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf

KNOWN_BANDS = ("Visible", "Solar", "CIE-X", "CIE-Y", "CIE-Z")
BLOCK_NAMES = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
SUN_DEG = 0.533
RECIPROCITY_SLACK = 0.05  # relative difference that traced or measured data may show


@dataclass(frozen=True)
class Finding:
    """One finding about a file and its consequence."""

    severity: str  # "error", "warning" or "note"
    where: str
    what: str
    consequence: str


def check_bsdf(file: BsdfFile) -> list[Finding]:
    """Findings about a BSDF file."""
    findings = [
        Finding("warning", "file", note, "the values used differ from those in the file") for note in file.notes
    ]
    findings += _check_bands(file)
    for band, bsdf in file.bands.items():
        if band not in KNOWN_BANDS:
            what = f"{', '.join(bsdf.blocks())}: a band that nothing here uses"
            findings.append(Finding("note", band, what, "these blocks are unused"))
            continue
        findings += _check_blocks(band, bsdf)
        if band in ("Visible", "Solar"):
            findings += _check_energy(band, bsdf) + _check_reciprocity(band, bsdf)
        findings.append(_resolution(band, bsdf))
    return findings


def missing_data(file: BsdfFile) -> list[Finding]:
    """Findings about bands and blocks that a file lacks, and what is used instead."""
    bands = {band: bsdf for band, bsdf in file.bands.items() if band in KNOWN_BANDS}
    return _check_bands(file) + [one for band, bsdf in bands.items() for one in _check_blocks(band, bsdf)]


def _check_bands(file: BsdfFile) -> list[Finding]:
    findings = []
    if "Visible" not in file.bands:
        findings.append(Finding("error", "file", "no Visible band", "daylight cannot be computed with it"))
    if "Solar" not in file.bands:
        findings.append(Finding("warning", "file", "no Solar band", "results use the Visible band instead"))
    colour = [band for band in ("CIE-X", "CIE-Z") if band in file.bands]
    if len(colour) == 1:
        findings.append(Finding("warning", "file", f"{colour[0]} alone", "colour is left out"))
    return findings


def _check_blocks(band: str, bsdf: Bsdf) -> list[Finding]:
    findings = []
    for name in BLOCK_NAMES:
        block, label = getattr(bsdf, name), f"{band} {name.replace('_', ' ')}"
        if name.startswith("reflection"):
            if block is None:
                findings.append(
                    Finding("warning", label, "is absent", "no light is reflected from this side, as in Radiance")
                )
            continue
        other = "transmission_" + ("back" if name.endswith("front") else "front")
        if bsdf.is_dummy(block):
            what = "is absent" if block is None else "transmits nothing (a placeholder)"
            if bsdf.is_dummy(getattr(bsdf, other)):
                findings.append(Finding("note", label, what, "the system is opaque"))
            else:
                text = f"transmission {other.split('_')[1]} is used, reversed by reciprocity, as in Radiance"
                findings.append(Finding("warning", label, what, text))
    return findings


def _check_energy(band: str, bsdf: Bsdf) -> list[Finding]:
    findings = []
    for side in ("front", "back"):
        share = bsdf.scattered(side)
        if share.max() > 1 + ENERGY_SLACK:
            severity = "error" if gains_energy(bsdf, share, ENERGY_LIMIT) else "warning"
            what, text = excess(share, ENERGY_SLACK), "rooms come out too bright"
            findings.append(Finding(severity, f"{band} {side}", what, text))
    return findings


def _check_reciprocity(band: str, bsdf: Bsdf) -> list[Finding]:
    findings = []
    for there, back in (
        ("transmission_front", "transmission_back"),
        ("reflection_front", "reflection_front"),
        ("reflection_back", "reflection_back"),
    ):
        error = reciprocity_error(bsdf, there, back)
        if error is not None and error > RECIPROCITY_SLACK:
            what = f"differs from {back.replace('_', ' ')} reversed by {100 * error:.0f} %"
            text = "front and back may be swapped, or the data are noisy; results depend on the side of the light"
            where = f"{band} {there.replace('_', ' ')}"
            findings.append(Finding("warning", where, what, text))
    return findings


def reciprocity_error(bsdf: Bsdf, there: str, back: str) -> float | None:
    """Mean absolute difference of f(i -> o) and f(o -> i) as a share of the mean.

    Weighted by projected solid angles; None if it cannot be computed.
    """
    forth, reverse = getattr(bsdf, there), getattr(bsdf, back)
    if bsdf.is_dummy(forth) or bsdf.is_dummy(reverse):
        return None
    if isinstance(bsdf, TensorTreeBsdf):
        return _tree_reciprocity(forth, reverse) if forth.rank == 4 else None
    if bsdf.basis_in != bsdf.basis_out or any(n % 2 for n in bsdf.basis_in.phi_counts if n > 1):
        return None
    turn, area = bsdf.basis_in.opposite(), bsdf.basis_in.projected_solid_angles()
    weight = area[:, None] * area
    turned = reverse.T[np.ix_(turn, turn)]
    return float((weight * abs(forth - turned)).sum() / (weight * (forth + turned) / 2).sum())


def _tree_reciprocity(forth: TensorTree, reverse: TensorTree) -> float:
    """The same for trees, at 200 000 positions of the hypercube."""
    position = np.random.default_rng(0).uniform(size=(200_000, 4))
    reverse = reverse.reversed()
    a, b = (tree.values[tree.leaf(position)] for tree in (forth, reverse))
    return float(abs(a - b).sum() / ((a + b) / 2).sum())


def _resolution(band: str, bsdf: Bsdf) -> Finding:
    """How far a direction is spread, against the sun's disc."""
    if isinstance(bsdf, KlemsBsdf):
        area = bsdf.basis_in.projected_solid_angles()
        what = f"{bsdf.basis_in.name}, {len(area)} x {bsdf.basis_out.size} patches"
        smallest = area.min()
    else:
        tree = max(bsdf.blocks().values(), key=lambda block: block.depth)
        cells = 4**tree.depth
        leaves = sum(len(block.values) for block in bsdf.blocks().values())
        what = f"tensor tree of rank {tree.rank}, up to {cells} cells a hemisphere, {leaves} leaves"
        smallest = np.pi / cells
    width = np.degrees(2 * np.sqrt(smallest / np.pi))
    sun = np.pi * np.radians(SUN_DEG / 2) ** 2
    return Finding(
        "note",
        band,
        f"{what}; the finest is {width:.1f} degrees wide",
        f"the sun's {SUN_DEG} degree disc is spread over {smallest / sun:.0f} times its size",
    )
