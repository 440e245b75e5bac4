"""Colour of clear skies and of the sun against Radiance's `gensdaymtx`."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import pvlib
from numpy.typing import NDArray

from mitsuba_cfs.methods.spectral_light import sky_spectra
from mitsuba_cfs.sky.annual import given_sky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.detectors import colour_temperature, detected, equivalent_daylight
from tests.radiance import run

LATITUDE, LONGITUDE, ZONE_H = 41.98, -87.92, -6
AEROSOL = 0.1  # optical depth of the peer's
# time, direct normal and diffuse horizontal irradiance [W/m2], cover of the sky
HOURS: tuple[tuple[str, float, float, float], ...] = (
    ("2023-06-21 12:30", 760.0, 100.0, 0.0),
    ("2023-06-21 07:00", 570.0, 75.0, 0.0),
    ("2023-12-21 09:30", 300.0, 55.0, 0.0),
    ("2023-06-21 05:30", 300.0, 45.0, 0.0),
    ("2023-03-01 12:30", 0.0, 170.0, 1.0),
)
BANDS = channels_of(20)  # the peer's


def main() -> str:
    """The table of docs/spectral.md: DER and CCT of a horizontal plane by sky and sun apart."""
    times = pd.DatetimeIndex([hour[0] for hour in HOURS]).tz_localize(f"Etc/GMT{-ZONE_H:+d}")
    position = pvlib.solarposition.get_solarposition(times, LATITUDE, LONGITUDE)
    height, azimuth = (np.radians(position[name].to_numpy()) for name in ("elevation", "azimuth"))
    towards = np.stack([np.sin(azimuth) * np.cos(height), np.cos(azimuth) * np.cos(height), np.sin(height)], axis=1)
    direct, diffuse = [hour[1] for hour in HOURS], [hour[2] for hour in HOURS]
    sky = given_sky(towards, direct, diffuse, 1, day_of_year=times.day_of_year.to_numpy())
    peer_sky, peer_sun = (_of(BANDS.detection @ part.T) for part in _peer())
    columns = {}
    for clear in ("cie", "spectrl2"):
        spectra = sky_spectra(sky, clear=clear)
        beam = (sky.illuminance * np.sin(height))[:, None] * spectra.sun
        columns[clear], sun = (_of(detected(part).T) for part in (spectra.horizontal - beam, beam))
    rows = [
        "| sun [degrees] | sky: DER, `gensdaymtx` | `cie` | `spectrl2` | CCT [K] | `cie` | `spectrl2` "
        "| sun: DER, `gensdaymtx` | SPECTRL2 | CCT [K] | SPECTRL2 |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for i, altitude in enumerate(np.degrees(height)):
        skies = [peer_sky, columns["cie"], columns["spectrl2"]]
        cells = [f"{altitude:.0f}{', overcast' * bool(HOURS[i][3])}"]
        for parts in (skies, [peer_sun, sun]):
            lit = direct[i] > 0 or parts is skies
            cells += [f"{ratio[i]:.3f}" if lit else "" for ratio, _ in parts]
            cells += [f"{kelvin[i]:.0f}" if lit else "" for _, kelvin in parts]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def _of(received: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """DER and CCT [K] of what detectors receive [9, L]."""
    ratio = equivalent_daylight(received[5]) / np.maximum(received[0], 1e-12)
    return ratio, colour_temperature(received[-3:].T)[0]


def _peer() -> list[NDArray[np.float64]]:
    """Relative power of sky and of sun on a horizontal plane in `BANDS` [L, C]."""
    head = (
        f"place peer\nlatitude {LATITUDE}\nlongitude {-LONGITUDE}\ntime_zone {-15 * ZONE_H}\nsite_elevation 200\n"
        "weather_data_file_units 3\n"
    )
    lines = []
    for text, direct, diffuse, cover in HOURS:
        at = pd.Timestamp(text)
        lines.append(
            f"{at.month} {at.day} {at.hour + at.minute / 60} {100 * direct:g} {120 * diffuse:g} {AEROSOL} {cover:g}\n"
        )
    weights = ReinhartSky.of_size(146).horizontal_weights
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "peer.wea").write_text(head + "".join(lines), "utf-8")
        found = []
        for part in ("-s", "-d"):
            text = run(f"gensdaymtx -m 1 -p {folder} {part} peer.wea", folder).decode()
            body = text[text.index("FORMAT=ascii") :].partition("\n")[2]
            values = np.array(body.split(), dtype=float).reshape(len(weights), len(HOURS), BANDS.count)[..., ::-1]
            found.append(np.einsum("p,plc->lc", np.where(np.arange(len(weights)) > 0, weights, 0.0), values))
    return found
