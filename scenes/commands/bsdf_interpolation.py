"""`cfs bsdf interpolate`: a BSDF file of what a goniophotometer measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file
from scenes.commands.bsdf_options import basis_option, cull_option, tensor_tree_option

if TYPE_CHECKING:
    from mitsuba_cfs.bsdf.measured import Pattern, ScatteringInterpolant
    from mitsuba_cfs.bsdf.measured_file import Measurement

FILE = click.Path(path_type=Path)


@click.command("interpolate")
@click.argument("files", nargs=-1, required=True, type=FILE, metavar="MEASURED.txt ...")
@click.option(
    "--normal", type=click.Choice(["room", "outside"]), default="room", show_default=True,
    help="Where the sample's normal points to.",
)  # fmt: skip
@basis_option
@tensor_tree_option
@cull_option
@click.option("--name", default="", help="Name to write into the file; the sample's without.")
@click.option("--out", type=FILE, required=True, help="XML file to write.")
def interpolate(
    files: tuple[Path, ...],
    *,
    normal: str,
    basis: str,
    tensor_tree: int | None,
    cull: float,
    name: str,
    out: Path,
) -> None:
    """Make a BSDF of goniophotometer files (pgII text), one or more an incident direction.

    Prints for each incident direction the share of light that is scattered, with the standard
    error that the noise of the values gives it, and what was taken for symmetry.  Measurements
    whose BSDF scatters more light than it receives are refused, as `cfs bsdf check` refuses it.
    """
    from mitsuba_cfs.bsdf.energy import ENERGY_LIMIT, check_energy
    from mitsuba_cfs.bsdf.measured_file import read_measurement
    from mitsuba_cfs.bsdf.xml import write_bsdf_xml

    check_file(out, inputs=files)
    measured = [read_measurement(path, normal=normal) for path in files]
    grazing = sum(one.grazing for one in measured)
    if grazing:
        click.echo(f"{grazing} values along the sample's plane are left out")
    means = _klems(basis) if tensor_tree is None else _trees(tensor_tree, cull)
    file = BsdfFile(_interpolated(measured, means))
    others = f" and {len(files) - 1} more" * (len(files) > 1)
    for band, bsdf in file.bands.items():
        for note in check_energy(bsdf, ENERGY_LIMIT, file=f"{files[0]}{others}", band=band):
            click.echo(f"note: {note}", err=True)
    write_bsdf_xml(replace(file, name=name or measured[0].name), out)
    click.echo(f"{out}: {', '.join(file.bands)}")


def _interpolated(measured: Sequence[Measurement], means: _Means) -> dict[str, Bsdf]:
    """The BSDF of each band, of the blocks that were measured."""
    from mitsuba_cfs.bsdf.measured import ScatteringInterpolant, patterns_of
    from mitsuba_cfs.bsdf.resample import BLOCKS

    bands = measured[0].bands
    for one in measured:
        if one.bands != bands:
            raise DataError(
                f"has {', '.join(one.bands)}, {measured[0].path} {', '.join(bands)}",
                file=one.path,
                field="colorimetry",
            )
    blocks: dict[str, dict[str, Any]] = {band: {} for band in bands}
    for block in BLOCKS:
        patterns = patterns_of(measured, block)
        if not patterns:
            continue
        interpolant = ScatteringInterpolant(patterns)
        click.echo(f"{block.replace('_', ' ')}: {interpolant.symmetry}")
        _print_shares(patterns, bands.index("Visible"))
        for band, values in zip(bands, means.of(interpolant), strict=True):
            blocks[band][block] = values
    return {band: means.bsdf(found) for band, found in blocks.items()}


@dataclass(frozen=True)
class _Means:
    """What an interpolant is averaged over: its values in each band, and the BSDF they make."""

    of: Callable[[ScatteringInterpolant], list[Any]]
    bsdf: Callable[[dict[str, Any]], Bsdf]


def _klems(basis: str) -> _Means:
    from mitsuba_cfs.bsdf.klems import KlemsBsdf
    from scenes.bsdf_generation import BASES

    patches = BASES[basis]
    return _Means(
        of=lambda interpolant: list(interpolant.matrix(patches)),
        bsdf=lambda blocks: KlemsBsdf(patches, patches, **blocks),
    )


def _trees(levels: int, cull: float) -> _Means:
    from mitsuba_cfs.bsdf.tensor_merge import culled_tree
    from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf

    return _Means(
        of=lambda interpolant: [culled_tree(grid, cull)[0] for grid in interpolant.grid(levels)],
        bsdf=lambda blocks: TensorTreeBsdf(**blocks),
    )


def _print_shares(patterns: Sequence[Pattern], band: int) -> None:
    import numpy as np

    click.echo("theta   share  std error  noise of a value")
    for pattern in sorted(patterns, key=lambda pattern: float(np.hypot(*pattern.incident))):
        theta = np.degrees(np.arcsin(min(1.0, float(np.hypot(*pattern.incident)))))
        relative, error = pattern.noise()
        click.echo(f"{theta:5.1f} {pattern.share[band]:7.4f} {error:10.4f} {100 * relative:8.1f} %")
