"""The lines that `evalglare` prints, and `evalglare -d`, for a result of ours."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mitsuba_cfs.glare import areas, indices
from mitsuba_cfs.glare.evaluation import GlareResult
from mitsuba_cfs.glare.position_index import position_index

HEADINGS = (
    "No pixels x-pos y-pos L_s Omega_s Posindx L_b L_t E_v Edir Max_Lum Sigma xdir ydir zdir "
    "Eglare Lveil_cie teta glare_zone r_contrast r_dgp"
)


def short_line(result: GlareResult) -> str:
    """The one line without -d."""
    values = (result.dgp, result.dgi, result.ugr, result.vcp, result.cgi, result.Lveil)
    return "dgp,dgi,ugr,vcp,cgi,Lveil: " + _six(values) + "  "


def brief_line(result: GlareResult) -> str:
    """The one line of -D."""
    external = result.dgp if result.options.illuminance is not None else 0.0
    inside = indices.daylight_glare_probability(result.Ev, result.contrast)
    first = (inside, result.dgi, result.ugr, result.vcp, result.cgi, external)
    values = (*first, result.Ev, result.largest_luminance, result.Lveil)
    return "dgp,dgi,ugr,vcp,cgi,dgp_ext,Ev_calc,abs_max,Lveil: " + _six(values) + " "


def detailed_lines(result: GlareResult) -> list[str]:
    """The lines of -d: a heading, one line for each source, and all figures of the picture."""
    rows = source_lines(result) or [_no_source(result)]
    figures = detailed_figures(result)
    last = ",".join(figures) + ": " + _six(figures.values())
    return [f"{result.count} {HEADINGS}", *rows, last]


def source_lines(result: GlareResult) -> list[str]:
    """One line for each source."""
    sources, height = result.sources, result.geometry.view.height
    contrasts, shares = _contributions(result)
    veils = indices.cie_veiling_luminance(sources.illuminance, result.sigma)
    lines = []
    for i in range(result.count):
        place = (sources.pixels[i], sources.x[i], height - sources.y[i], sources.luminance[i])
        sigma = np.degrees(result.sigma[i])
        after = (*result.direction[i], sources.illuminance[i], veils[i], sigma)
        lines.append(
            f"{i + 1} {_six(place)} {sources.solid_angle[i]:.10f} "
            f"{_six((result.position[i], *_of_picture(result), sigma, *after))} "
            f"{result.zones[i]} {_six((contrasts[i], shares[i]))} "
        )
    return lines


def _of_picture(result: GlareResult) -> tuple[float, ...]:
    """Quantities of the whole picture, one per output line."""
    return (result.background_luminance, result.task_luminance, result.Ev, result.Ev_direct, result.largest_luminance)


def _no_source(result: GlareResult) -> str:
    return f"0 {_six([0.0] * 4)} {0:.10f} {_six((0.0, *_of_picture(result), *[0.0] * 10))}"


def detailed_figures(result: GlareResult) -> dict[str, float]:
    """All figures of the last line of -d, by evalglare's names."""
    sources, geometry = result.sources, result.geometry
    L, w, P = sources.luminance, sources.solid_angle, result.position
    indirect = (result.Ev - result.Ev_direct) / np.pi
    weighted, medians = _weighted_by_position(result)
    veils = indices.cie_veiling_luminance(sources.illuminance, result.sigma)
    return {
        "dgp": result.dgp,
        "av_lum": result.mean_luminance,
        "E_v": result.Ev,
        "lum_backg": result.background_luminance,
        "E_v_dir": result.Ev_direct,
        "dgi": result.dgi,
        "ugr": result.ugr,
        "vcp": result.vcp,
        "cgi": result.cgi,
        "lum_sources": float(L @ w / w.sum()) if len(L) else 0.0,
        "omega_sources": float(w.sum()),
        "Lveil": result.Lveil,
        "Lveil_cie": float(veils.sum()),
        "dgr": result.dgr,
        "ugp": result.ugp,
        "ugr_exp": indices.experimental_ugr(L, w, P, indirect, result.Ev),
        "dgi_mod": indices.modified_dgi(L, w, P, result.Ev),
        "av_lum_pos": weighted[0],
        # evalglare divides this one by the solid angle of the view twice
        "av_lum_pos2": weighted[1] / geometry.total_solid_angle,
        "med_lum": medians[0],
        "med_lum_pos": medians[1],
        "med_lum_pos2": medians[2],
        "ugp2": indices.logistic_ugp(result.contrast, result.background_luminance),
    }


def _weighted_by_position(result: GlareResult) -> tuple[list[float], list[float]]:
    """Averages of L/P and L/P^2, and medians of L, L/P and L/P^2, over the whole picture."""
    geometry = result.geometry
    picture = result.whole_luminance
    if result.options.position_model == "guth":
        index = geometry.guth
    else:
        index = position_index(geometry.directions, geometry.view, model=result.options.position_model)
    values = picture[geometry.valid]
    divisor = index[geometry.valid].astype(np.float32).astype(np.float64)
    omega = geometry.solid_angle[geometry.valid]
    averages, medians = [], [float(np.median(values))]
    for _ in range(2):
        values = values / divisor
        averages.append(float(values @ omega) / geometry.total_solid_angle)
        medians.append(float(np.median(values)))
    return averages, medians


def _contributions(result: GlareResult) -> tuple[np.ndarray, np.ndarray]:
    """Each source's own DGP contrast term, over that of all [n], and over DGP [n]."""
    sources, Ev = result.sources, result.Ev
    if not result.count:
        return np.zeros(0), np.zeros(0)
    each = sources.luminance**2 * sources.solid_angle / result.position**2
    alone = 0.092 * np.log10(1 + each / Ev**1.87)
    together = 0.092 * np.log10(1 + result.contrast / Ev**1.87)
    return alone / together, alone / indices.daylight_glare_probability(Ev, result.contrast)


def area_line(name: str, area: areas.AreaStatistics) -> str:
    """The line of a zone: `name` is z1 or z2."""
    names = ("omega", "av_lum", "median_lum", "std_lum", "perc_75", "perc_95", "lum_min", "lum_max")
    keys = ",".join(f"{name}_{key}" for key in names)
    values = _six((*_luminances(area), area.illuminance))
    return f"zoning:{keys},E{name},i_{name}: {values} {area.pixels}"


def band_line(area: areas.AreaStatistics) -> str:
    """The line of -B."""
    keys = "band_omega,band_av_lum,band_median_lum,band_std_lum,band_perc_75,band_perc_95,band_lum_min,band_lum_max"
    return f"band:{keys}: {_six(_luminances(area))}"


def mask_line(area: areas.AreaStatistics, result: GlareResult) -> str:
    """The line of -A, with PGSV for a mask that is the window (-99 without a task area)."""
    keys = "no_pixels,omega,av_lum,median_lum,std_lum,perc_75,perc_95,lum_min,lum_max,pgsv_con,pgsv_sat,pgsv,Ev_mask"
    task = result.task_luminance if result.options.task is not None else 0.0
    whole = areas.pgsv(area, result.mean_luminance, result.Ev, task) if task > 0 else -99.0
    values = (
        *_luminances(area),
        areas.pgsv_contrast(area, result.mean_luminance),
        areas.pgsv_saturation(result.Ev),
        whole,
        area.illuminance,
    )
    return f"masking:{keys}: {area.pixels} {_six(values)}"


def _luminances(area: areas.AreaStatistics) -> tuple[float, ...]:
    return (
        area.solid_angle,
        area.average,
        area.median,
        area.deviation,
        area.percentile_75,
        area.percentile_95,
        area.smallest,
        area.largest,
    )


def _six(values: Iterable[float]) -> str:
    return " ".join(f"{value:f}" for value in values)
