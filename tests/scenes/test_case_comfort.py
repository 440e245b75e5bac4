"""Chapter 5.2: north has the most comfortable hours, as in the dissertation's Figure 69."""

from __future__ import annotations

from scenes.evidence.studies import case_comfort_by_orientation as case
from scenes.evidence.studies.systems import blind_before_glazing


def test_north_is_comfortable_longest(tmp_path, variant, real_data):
    from scenes.heat.study import run_study

    weather = real_data / "epw" / "FRA_Lyon.074810_IWEC.epw"
    bsdf = blind_before_glazing(tmp_path, case.TILT_DEG)
    found = {}
    for name, facing in (("N", 0.0), ("S", 180.0)):
        (year,), _ = run_study(case.study(weather, bsdf, facing, 512), lambda label, share: None)
        assert year.floor_area == 20.0
        found[name] = case.shares(year)
    assert 18.0 < found["N"]["comfortable 90 %"] < 22.0  # dissertation: 19 to 20 %
    assert found["N"]["comfortable 90 %"] > found["S"]["comfortable 90 %"] + 2.0
    assert found["N"]["degree hours warm"] < 0.7 * found["S"]["degree hours warm"]
