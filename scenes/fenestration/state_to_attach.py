"""The shading state that goes into an IFC file: a BSDF, the file beside it, and what is given."""

from __future__ import annotations

from pathlib import Path

from bim.fenestration import AngularGValue, ShadingState, read_g_table
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes.fenestration.thermal_file import ThermalFile


def state_to_attach(
    bsdf: Path | None,
    *,
    name: str = "",
    u_value: float | None = None,
    g_value: str | None = None,
    copy_bsdf: bool = True,
) -> tuple[ShadingState, tuple[str, ...]]:
    """A shading state of files and values, and a sentence for each on where it is from.

    Args:
        bsdf: its `.toml` gives U, g, closure and the place of the shade, see `ThermalFile`.
        name: of the state.
        u_value: in place of the `.toml` file's [W/(m2 K)].
        g_value: a number or the name of a CSV file, in place of all of the `.toml` file's.
        copy_bsdf: False leaves the numbers of the BSDF out.
    """
    file = None if bsdf is None else read_bsdf_xml(bsdf)
    source = Path() if bsdf is None else bsdf.with_suffix(".toml")
    beside = ThermalFile() if bsdf is None else ThermalFile.read(source)
    notes = []
    if file is not None:
        how = "copied from" if copy_bsdf else "read at every run from"
        notes.append(f"BSDF ({', '.join(file.bands)}) {how} {bsdf.name}")
    else:
        notes.append(
            "no BSDF: light is computed if the window states VisibleLightTransmittance; else give "
            "--tau or --glazing at every run"
        )
    g = _given_g(g_value)
    table = g if isinstance(g, AngularGValue) else None
    number = g if isinstance(g, float) else None
    shading_state = ShadingState(
        name,
        file.bands if file is not None and copy_bsdf else {},
        table,
        beside.u_value if u_value is None else u_value,
        beside.g_value if g is None else number,
        beside.g_value_by_patch if g is None else None,
        beside.closure,
        beside.shading_position,
    )
    notes += _origins(shading_state, beside, source.name, u_value=u_value, g_value=g_value)
    return shading_state, tuple(notes)


def _given_g(text: str | None) -> AngularGValue | float | None:
    """g at normal incidence, or by direction from a CSV file; None where nothing is given."""
    if text is None:
        return None
    try:
        number = float(text)
    except ValueError:
        if not Path(text).is_file():
            message = f"expected a number or a CSV file, got {text!r}"
            raise DataError(message, field="--g") from None
        return read_g_table(text)
    if not 0 <= number <= 1:
        raise DataError(f"expected 0 to 1, got {text}", field="--g")
    return number


def _origins(
    state: ShadingState, beside: ThermalFile, file: str, *, u_value: float | None, g_value: str | None
) -> list[str]:
    """Sources of U, g, closure and position, and the unused values of the file beside the BSDF."""
    notes = []
    if state.u_value is None:
        notes.append("no U: a typical one will be assumed and reported")
    else:
        notes.append(f"U {state.u_value:g} W/(m2 K) from {file if u_value is None else '--u'}")
    if u_value is not None and beside.u_value is not None:
        notes[-1] += f" ({beside.u_value:g} in {file} is not used)"
    if g_value is not None:
        notes.append(f"g from --g {g_value}")
        if beside.g_value is not None or beside.g_value_by_patch is not None:
            notes[-1] += f" (g in {file} is not used)"
    elif state.g_by_patch is not None or state.g_normal is not None:
        normal = "" if state.g_normal is None else f" {state.g_normal:g} at normal incidence"
        patches = "" if state.g_by_patch is None else f" for {len(state.g_by_patch)} directions"
        notes.append(f"g{' and'.join(part for part in (normal, patches) if part)} from {file}")
    else:
        notes.append("no g: a typical one will be assumed and reported")
    if state.closure is not None:
        notes.append(f"closure of the thermal model ({state.closure.u_model} U) from {file}")
    if state.shading_position is not None:
        notes.append(f"shading position {state.shading_position} from {file}")
    if beside.see_through is not None:
        notes.append(f"see_through in {file} is not attached: give --see-through at every run")
    return notes
