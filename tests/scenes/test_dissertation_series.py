"""The dissertation's classification by daylight autonomy, and its time series as pictures."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.methods import METHODS

PNG = b"\x89PNG"


@pytest.mark.usefixtures("variant")
def test_the_classification_counts_each_class_by_itself():
    from tests.validation.daylight_methods import classified

    reference = np.array([[100.0, 200, 400, 500], [350, 299, 300, 900]])
    found = np.array([[310.0, 200, 400, 200], [350, 299, 299, 900]])
    table = classified(found, reference)
    # 5 of the 8 have enough, of which 3 are found; 3 have not, of which 1 is said to have
    assert table["sensitivity [%]"] == pytest.approx(100 * 3 / 5)
    assert table["specificity [%]"] == pytest.approx(100 * 2 / 3)
    # means 225, 249.5, 350, 700 against 330, 249.5, 349.5, 550
    assert table["sensitivity of the sensors' mean [%]"] == 100
    assert table["specificity of the sensors' mean [%]"] == 50
    dark = classified(0 * reference, 0 * reference)
    assert dark["sensitivity [%]"] is None and dark["specificity [%]"] == 100


@pytest.mark.usefixtures("variant")
def test_the_series_are_drawn_with_the_measurement_in_them(tmp_path):
    from tests.validation import daylight_methods, glare_methods

    hours = [f"03-25 {hour:02d}:30" for hour in range(8, 18)]
    light = (np.arange(10) * 100.0).tolist()
    names = ("slats", "three-phase", "five-phase, Klems", "point in time, Klems", "two-phase, Klems")
    result = {"times": hours, "series": dict.fromkeys(names, light)}
    systems = dict.fromkeys(("glass", "5 degrees", "40 degrees", "70 degrees"), result)
    daylight_methods.write_series(systems, tmp_path / "light.png")
    assert (tmp_path / "light.png").read_bytes()[:4] == PNG
    dgp = np.linspace(0.2, 0.6, 10).tolist()
    keys = [f"{method} {metric}" for method in METHODS for metric in glare_methods.GLARE]
    run = {"system": "glass", "times": hours, "measured": dgp, "methods": dict.fromkeys(keys, dgp)}
    glare_methods.write_series([run, run], tmp_path / "glare")
    for method in METHODS:
        assert (tmp_path / "glare" / f"glare_{method}.png").read_bytes()[:4] == PNG


@pytest.mark.usefixtures("variant")
def test_the_measurement_has_the_sun_as_a_source_whatever_the_pixels():
    """As the methods have it; in the pixels its L^2 omega is that of a larger, darker disc."""
    from dataclasses import replace

    import mitsuba_cfs as cfs
    from tests.validation.blind_room import empty, glass_klems
    from tests.validation.glare_methods import GlareCase, measured
    from tests.validation.glare_room import glare_scene

    scenes = [glare_scene(size) for size in (40, 80)]
    towards = np.add(scenes[0].view.direction, [0, 0, 0.25])[None]
    towards /= np.linalg.norm(towards)
    sky = cfs.given_sky(towards, [5.0], [100.0], day_of_year=250)
    case = GlareCase("glass", empty(), cfs.BsdfOptics(glass_klems()), sky, ("09-07 15:30",))
    sampling = cfs.Sampling(picture_samples=4)
    apart, in_pixels = (
        [measured(scene, one, sampling)[0][0] for scene in scenes] for one in (case, replace(case, sun="pixels"))
    )
    assert 0.3 < apart[0] < 0.95
    assert abs(apart[1] - apart[0]) < 0.01
    assert max(in_pixels) < min(apart) - 0.05


@pytest.mark.slow
@pytest.mark.usefixtures("variant")
def test_the_scale_of_bars_does_not_change_their_bsdf():
    """Table 12's third series; two runs at one scale say what noise is."""
    from tests.validation.glare_theory import scale_series

    *scaled, again = scale_series()
    assert again["noise"] and [row["scale"] for row in scaled] == [1.0, 0.1, 10.0]
    for row in scaled[1:]:
        assert row["largest difference"] < 2 * again["largest difference"]
        assert row["mean"] == pytest.approx(again["mean"], rel=0.05)  # seeds: 1.4 %
