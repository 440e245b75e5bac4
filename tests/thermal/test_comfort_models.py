"""PMV and SET without the other models of the package that computes them."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import sys
from thermal.comfort import pmv_ppd, standard_effective_temperature
pmv, _ = pmv_ppd(22.0, 22.0, metabolic_rate=1.2, clothing=0.5, air_speed=0.1, humidity=60.0)
print(float(pmv), float(standard_effective_temperature(25.0, 25.0, air_speed=0.15)))
print("pythermalcomfort.models.utci" in sys.modules, "pythermalcomfort.models" in sys.modules)
from pythermalcomfort.models import pmv_ppd_iso, utci
print(utci(tdb=25, tr=25, v=1.0, rh=50).utci, round(float(pmv_ppd_iso(
    tdb=22, tr=22, vr=0.1, rh=60, met=1.2, clo=0.5, round_output=False).pmv), 6))
"""


def test_only_two_models_are_loaded_and_the_package_still_can_be() -> None:
    """ISO 7730's first row: PMV -0.75; the package of models, read later, is whole."""
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True
    )  # fmt: skip
    (pmv, warm), loaded, (hot, again) = (line.split() for line in done.stdout.splitlines())
    assert round(float(pmv), 2) == -0.75 and round(float(pmv), 6) == float(again)
    assert 23.0 < float(warm) < 25.0 and 20.0 < float(hot) < 30.0
    assert loaded == ["False", "False"]
