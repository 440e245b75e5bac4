"""Colour and melanopic ratio of daylight outdoors: the models of sky and sun against measurements."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
from numpy.typing import NDArray

from mitsuba_cfs.methods.spectral_light import sky_spectra
from mitsuba_cfs.sky.annual import AnnualSky, given_sky
from mitsuba_cfs.spectra.detectors import (
    NANOMETRES,
    colour_temperature,
    daylight_efficacy_ratio,
    detected,
    equivalent_daylight,
)

SINGAPORE = pvlib.location.Location(1.34, 103.96, "Asia/Singapore", 15.0)
WATER_CM = 5.0  # of the atmosphere there, the year's mean
LOWEST_DEG = 5.0  # altitude of the sun below which measurements are left out


def main(measured: Path, *, clear: str = "cie", spectra: Path | None = None) -> str:
    """The tables of docs/spectral.md.

    Args:
        measured: metadata.csv of github.com/prijibalakrishnan/equatorialskies.
        clear: spectrum of a clear sky, one of `SKY_SPECTRA`.
        spectra: its folder of measured spectra, for the melanopic DER; those that are missing are left out.
    """
    table = pd.read_csv(measured).dropna(subset=["GlobalIrrad"])
    moments = pd.to_datetime(table["MonthYear"] + " " + table["Time"], format="%d%b%y %H:%M")
    times = pd.DatetimeIndex(moments).tz_localize("Asia/Singapore")
    position = SINGAPORE.get_solarposition(times)
    high = position["elevation"].to_numpy() >= LOWEST_DEG
    table, times, position = table[high], times[high], position[high]
    split = pvlib.irradiance.erbs(
        table["GlobalIrrad"].to_numpy(), position["zenith"].to_numpy(), times.day_of_year.to_numpy()
    )
    sky = _sky(position, split, times)
    own = detected(sky_spectra(sky, WATER_CM, clear).horizontal)
    kelvin, true = colour_temperature(own[:, -3:])[0], table["CCT"].to_numpy(dtype=float)
    ratio = equivalent_daylight(own[:, 5]) / own[:, 0]
    true_ratio = np.array([_measured_ratio(spectra, row) for _, row in table.iterrows()])
    lines = [
        "| sky | measurements | CCT measured, median [K] | model | difference, mean [1/MK] | rms "
        "| spectra | DER measured, mean | model | difference, mean % | rms |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    kinds = {"clear": ["CS"], "intermediate": ["IS"], "overcast": ["OS"]}
    known = [kind for names in kinds.values() for kind in names]
    kinds["morning and evening"] = sorted(set(table["SkyType"]) - set(known))
    for label, names in kinds.items():
        some = table["SkyType"].isin(names).to_numpy()
        if not some.any():
            continue
        mired = 1e6 / kelvin[some] - 1e6 / true[some]
        lines.append(
            f"| {label} | {np.count_nonzero(some)} | {np.median(true[some]):.0f} | "
            f"{np.median(kelvin[some]):.0f} | {mired.mean():+.1f} | "
            f"{np.sqrt(np.mean(mired**2)):.1f} | {_ratios(ratio[some], true_ratio[some])} |"
        )
    return "\n".join(lines)


def _measured_ratio(spectra: Path | None, row: pd.Series) -> float:
    """Melanopic DER of a measurement's spectrum; NaN without its file, whose name is its day, time, sky and CCT."""
    name = f"{row['MonthYear']}-{row['Time'].replace(':', '')}-{row['SkyType']}-{row['CCT']}K.csv"
    if spectra is None or not (spectra / name).exists():
        return float("nan")
    file = pd.read_csv(spectra / name)
    return float(daylight_efficacy_ratio(np.interp(NANOMETRES, file["wv"], file["spd"])))


def _ratios(own: NDArray[np.float64], measured: NDArray[np.float64]) -> str:
    """Cells of the melanopic DER of the measurements that have a spectrum."""
    known = np.isfinite(measured)
    if not known.any():
        return "0 | | | |"
    percent = 100 * (own[known] / measured[known] - 1)
    return (
        f"{np.count_nonzero(known)} | {measured[known].mean():.3f} | {own[known].mean():.3f} | "
        f"{percent.mean():+.1f} | {np.sqrt(np.mean(percent**2)):.1f}"
    )


def _sky(position: pd.DataFrame, split: Mapping[str, NDArray[np.float64]], times: pd.DatetimeIndex) -> AnnualSky:
    azimuth, height = (np.radians(position[name]) for name in ("azimuth", "elevation"))
    towards = np.stack([np.sin(azimuth) * np.cos(height), np.cos(azimuth) * np.cos(height), np.sin(height)], axis=1)
    return given_sky(
        towards,
        np.asarray(split["dni"]),
        np.asarray(split["dhi"]),
        1,
        day_of_year=times.day_of_year.to_numpy(),
        dew_point_c=24.0,
    )
