"""What the tables of light by wavelength are made with: runs of Radiance in ranges, measured spectra by name."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant
from tests.validation.spectral import edges, joined, ranges
from tests.validation.spectral_skies import main


def test_runs_of_other_levels_are_one_spectrum_of_their_total() -> None:
    places, middles = ranges(), 0.5 * (edges()[1:] + edges()[:-1])
    spectrum = np.interp(middles, NANOMETRES, illuminant("D65"))
    assert places[0][0] == 0 and places[-1][1] == len(middles)
    levels = np.array([[1.0, 1.02, 0.97, 1.01], [1.1, 0.9, 1.0, 1.0]])  # of two points, four runs
    runs = [levels[:, [k]] * spectrum[first:last] for k, (first, last) in enumerate(places)]
    whole = joined(runs, places)
    assert whole == pytest.approx((whole.sum(axis=1) / spectrum.sum())[:, None] * spectrum)
    shared = [(before[1] + after[0]) // 2 for before, after in pairwise(places)]
    ends = [0, *shared, len(spectrum)]
    total = sum(levels[:, k] * spectrum[a:b].sum() for k, (a, b) in enumerate(pairwise(ends)))
    assert whole.sum(axis=1) == pytest.approx(total)
    assert joined([spectrum[None]], [(0, 80)]) == pytest.approx(spectrum[None])


def test_measured_spectra_are_found_by_their_names(tmp_path: Path) -> None:
    header = "MonthYear,Time,SkyType,CCT,GlobalIllum,GlobalIrrad\n"
    (tmp_path / "metadata.csv").write_text(
        f"{header}28May18,13:24,OS,6485,22570,193\n21Jul18,14:01,OS,6133,22688,158\n"
    )
    spectrum = pd.DataFrame({"wv": NANOMETRES, "spd": illuminant("D65")})
    spectrum.to_csv(tmp_path / "28May18-1324-OS-6485K.csv", index=False)
    [row] = [line for line in main(tmp_path / "metadata.csv", spectra=tmp_path).splitlines() if "overcast" in line]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1] == "2" and cells[6:8] == ["1", "1.000"]
    assert float(cells[8]) == pytest.approx(1.0, abs=0.003)  # an overcast sky of 6514 K
