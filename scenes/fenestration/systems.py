"""A fenestration system from its BSDF file, and the user's data for windows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.angular import AngularTable, check_specular, spectral_tables, specular_matrices, stack_table
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import klems_of
from mitsuba_cfs.bsdf.glazing import Pane
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.spectral_factor import SpectralFactor
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, spectral_glazing
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.fenestration.thermal_file import ClosureTable, GlazingLayerTable, ThermalFile, spectral_panes
from thermal.closure import Closure

Panes = tuple[SpectralPane, ...]


@dataclass(frozen=True, slots=True, eq=False)
class FenestrationSystem:
    """A fenestration system: glazing and shade as one, in both bands; equal to itself alone."""

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
    layers: tuple[Path, ...] = ()  # files of the BSDF among its layers, where it is computed
    source: str = ""  # where the system comes from, in words
    angular: AngularTable | None = None  # visible, of a specular system: exact at every angle
    panes: Panes = ()  # all its layers, where each is known by wavelength
    spectrum: SpectralFactor | None = None  # of its panes and shade; None: not known
    from_values: bool = False  # modelled from U, g and transmittances, without a BSDF
    tilt_deg: float | None = None  # of its slats; None: not stated, or none
    between: NeighbourTilts | None = None  # that it is interpolated from
    recipe: ClosureTable | None = None  # whose layers give its BSDF; None: not known

    @property
    def names(self) -> tuple[str, ...]:
        """File names by which the user can mean it, its own first; its name without a file."""
        files = self.layers if self.file is None else (self.file,)
        return tuple(file.name for file in files) or (self.name,)

    @property
    def fine(self) -> Bsdf:
        """The visible band as finely as the data have it."""
        return self.visible if self.tree is None else self.tree


@dataclass(frozen=True, slots=True, eq=False)
class NeighbourTilts:
    """Two systems of a family between whose tilts another is interpolated."""

    low: FenestrationSystem
    high: FenestrationSystem
    share: float  # of `high`, 0 to 1


# of a window: its system in each shading state, from open to closed
States = tuple[FenestrationSystem, ...]


@dataclass(frozen=True, slots=True)
class WindowOverrides:
    """Fenestration data of the user, which go before those of the building's file."""

    states: States = ()  # by a flag or a study file
    u_value: float | None = None  # of --u, in place of the file's [W/(m2 K)]
    g_value: float | None = None  # of --g, at normal incidence
    visible: float | None = None  # of --tau: visible transmittance of windows without a BSDF
    glazing: str | None = None  # of --glazing, for what the file does not state: a generic one
    ask: str = "--cfs FILE, --glazing or --tau"  # how a system is given, for the error that none is
    light_only: bool = False  # neither U nor g is needed
    named: tuple[tuple[tuple[str, ...], States], ...] = ()  # states of windows by name or GUID
    # of --see-through: share of the peak that passes straight on, by name of file or system
    see_through: tuple[tuple[str, float], ...] = ()


def read_system(
    path: str | PathLike[str],
    *,
    u_value: float | None = None,
    g_value: float | None = None,
    see_through: float | None = None,
    by: str = "",
) -> FenestrationSystem:
    """The system of a BSDF XML file, with U and g given, or of the `.toml` file beside it.

    The `.toml` file has the name of the XML file; see `ThermalFile`.

    Args:
        see_through: as of `with_see_through`; None: by the `.toml` file, or by the data.
        by: what names the file, such as "--cfs"; goes before its name in the system's source.

    Raises: `DataError` for a file that cannot be used.
    """
    path = Path(path)
    file = read_bsdf_xml(path)
    beside = ThermalFile.read(path.with_suffix(".toml"))
    system = system_of(
        file.bands,
        file.name or path.stem,
        path=path,
        u_value=beside.u_value if u_value is None else u_value,
        g_value=beside.g_value if g_value is None else g_value,
        g_by_patch=beside.g_value_by_patch if g_value is None else None,
        closure=beside.closure,
        shading_position=beside.shading_position,
        angular=beside.angular,
        panes=beside.panes,
        spectrum=beside.spectrum,
        recipe=beside.recipe,
        notes=file.notes,
        file=path,
        source=f"{by} {path.name}".strip(),
    )
    see_through = beside.see_through if see_through is None else see_through
    return system if see_through is None else with_see_through(system, see_through)


def with_see_through(system: FenestrationSystem, share: float) -> FenestrationSystem:
    """The system with the share of its transmission peak that passes straight on.

    Args: share: 1: the peak is specular; 0: it is a lobe, as wide as the data resolve it.

    Raises: `DataError` for a system of panes or with an angular function: its beam is known.
    """
    if not 0 <= share <= 1:
        raise DataError(f"expected 0 to 1, got {share:g}", file=system.file, field="see_through")
    if system.angular is not None:
        message = f"{system.name} has an angular function: it is specular"
        raise DataError(message, file=system.file, field="see_through")
    if system.tree is None:
        visible = replace(system.visible, see_through=share)
        return replace(system, visible=visible)
    tree = replace(system.tree, see_through=share)
    return replace(system, tree=tree, visible=klems_of(tree))


def system_of(
    bands: Mapping[str, Bsdf],
    name: str,
    *,
    path: Path,
    notes: Sequence[str] = (),
    **more: float
    | str
    | Path
    | NDArray[np.float64]
    | Closure
    | AngularTable
    | Panes
    | SpectralFactor
    | ClosureTable
    | None,
) -> FenestrationSystem:
    """The system of BSDF data by band, Klems full or tensor trees.

    Args: path: the file that the data come from; more: fields of `FenestrationSystem`.
    """
    notes = list(notes)
    if "Visible" not in bands and "Solar" not in bands:
        raise DataError("has neither a Visible nor a Solar band", file=path, field="WavelengthData")
    for band, other in (("Visible", "Solar"), ("Solar", "Visible")):
        if band not in bands:
            notes.append(
                Note(
                    "{system} has no {band} band; its {other} band is used instead.",
                    system=name,
                    band=band,
                    other=other,
                )
            )
    visible = bands.get("Visible") or bands["Solar"]
    solar = bands.get("Solar") or bands["Visible"]
    klems = _klems(visible, path, "Visible")
    check_specular(klems, more.get("angular"), path)
    return FenestrationSystem(
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
            f"has {bsdf.basis_out.size}x{bsdf.basis_in.size} patches; the run needs the Klems full basis of 145x145",
            file=path,
            field=band,
        )
    return klems_of(bsdf)


BANDS = ("Visible", "Solar")


def system_of_panes(layers: Sequence[GlazingLayerTable]) -> FenestrationSystem:
    """The system of panes from outside to inside, light of both bands by its angle of incidence.

    Panes that all come from files are computed wavelength by wavelength, others band by band: an
    uncoated one by Fresnel's equations, one whose sides differ as coated
    (`mitsuba_cfs.bsdf.angular.stack_table`).
    """
    name = "panes " + ", ".join(_named(layer) for layer in layers)
    panes = spectral_panes(layers)
    if panes:
        notes, tables = [], spectral_tables(panes)
    else:
        notes = [
            Note(
                "{system}: layer {number} has no visible values; its solar values are used.", system=name, number=number
            )
            for number, layer in enumerate(layers, start=1)
            if layer.pane is None and layer.visible is None
        ]
        tables = {band: stack_table([_pane(one, band) for one in layers]) for band in BANDS}
    visible, solar = (specular_matrices(tables[band]) for band in BANDS)
    return FenestrationSystem(
        name,
        visible,
        solar,
        shading_position="none",
        notes=tuple(notes),
        angular=tables["Visible"],
        panes=panes,
        spectrum=SpectralFactor.of_panes(panes) if panes else None,
    )


def _pane(layer: GlazingLayerTable, band: str) -> Pane:
    """The pane in a band, by the values at normal incidence that its table or its file states."""
    values = layer.solar
    if band == "Visible" and layer.visible is not None:
        values = layer.visible
    elif layer.pane is not None and (band == "Visible" or values is None):
        one = spectral_glazing([layer.spectral()])[band]
        values = tuple(float(value[0]) for value in (one.transmittance, one.reflectance_front, one.reflectance_back))
    tau, front, back = values
    return Pane(_named(layer), tau, front, back, coated=front != back)


def _named(layer: GlazingLayerTable) -> str:
    return f"{1e3 * layer.thickness:g} mm" if layer.pane is None else layer.pane.stem
