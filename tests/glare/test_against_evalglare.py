"""Glare of varied pictures against evalglare 3, figure by figure and source by source.

Both start from the same file.  evalglare prints six decimals and sums in another order, in parts
with four-byte numbers (1e-7): 2e-5 relative leaves room for that and for nothing else.
"""

from __future__ import annotations

import numpy as np
import pytest
from glare_pictures import CASES, PICTURES, VIEWS

from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult, Task, evaluate
from mitsuba_cfs.images.hdr import read_hdr, write_hdr

pytestmark = [pytest.mark.early, pytest.mark.peer]
RELATIVE, DECIMALS = 2e-5, 2e-6

OPTIONS = {
    "defaults": ((), {}),
    "-b 5": (("-b", 5), {"threshold": 5.0}),
    "-b 900": (("-b", 900), {"threshold": 900.0}),
    "-t": (("-t", 110, 70, 0.6), {"task": Task(110, 70, 0.6)}),
    "-T -b 3": (("-T", 90, 60, 0.4, "-b", 3), {"task": Task(90, 60, 0.4), "threshold": 3.0}),
    "-r 0.05": (("-r", 0.05), {"search_radius": 0.05}),
    "-r 0.5": (("-r", 0.5), {"search_radius": 0.5}),
    "-x": (("-x",), {"peak": None}),
    "-Y 8000": (("-Y", 8000), {"peak": 8000.0}),
    "-s": (("-s",), {"smoothing": True}),
    "-G 1": (("-G", 1), {"field_of_view": "total"}),
    "-G 2": (("-G", 2), {"field_of_view": "both eyes"}),
    "-q 1": (("-q", 1), {"background": "average"}),
    "-q 2": (("-q", 2), {"background": "illuminance"}),
    "-P 1": (("-P", 1), {"position_model": "kim"}),
    "-i 700": (("-i", 700), {"illuminance": 700.0}),
    "-C l+": (("-C", "l+"), {"low_light": True}),
    "-i 150 -C l+": (("-i", 150, "-C", "l+"), {"illuminance": 150.0, "low_light": True}),
}


def figures(result: GlareResult) -> dict[str, float]:
    """Our figures by the names that evalglare prints."""
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
        "dgr": result.dgr,
        "ugp": result.ugp,
    }


def assert_agree(result: GlareResult, verdict) -> None:
    """The figures and the sources of both."""
    assert result.count == len(verdict.sources)
    for name, ours in figures(result).items():
        theirs = verdict.figures[name]
        assert ours == pytest.approx(theirs, rel=RELATIVE, abs=DECIMALS), name
    if not result.count:
        return
    found = result.sources
    height = result.geometry.view.height
    ours = np.stack([found.pixels, found.x, height - found.y, found.luminance, found.solid_angle], 1)
    theirs = verdict.sources
    assert np.allclose(ours[:, :4], theirs[:, 1:5], rtol=RELATIVE, atol=DECIMALS)
    assert np.allclose(ours[:, 4], theirs[:, 5], rtol=RELATIVE, atol=2e-10)
    assert np.allclose(result.position, theirs[:, 6], rtol=RELATIVE, atol=DECIMALS)
    # the illuminance of a source: for small ones the six decimals of the print count
    assert np.allclose(found.illuminance, theirs[:, 16], rtol=RELATIVE, atol=DECIMALS)
    assert result.task_luminance == pytest.approx(theirs[0, 8], rel=RELATIVE, abs=DECIMALS)


@pytest.mark.parametrize(("picture", "view"), CASES)
def test_pictures(picture, view, evalglare, tmp_path):
    path = tmp_path / "a.hdr"
    write_hdr(path, np.clip(PICTURES[picture](VIEWS[view]), 0, None), VIEWS[view])
    read = read_hdr(path)
    assert_agree(evaluate(read.luminance, read.view), evalglare(path))


@pytest.mark.parametrize("option", OPTIONS)
@pytest.mark.parametrize("picture", ["sun through blinds", "scattered", "noisy"])
def test_options(option, picture, evalglare, tmp_path):
    flags, changes = OPTIONS[option]
    path = tmp_path / "a.hdr"
    write_hdr(path, PICTURES[picture](VIEWS["askew"]), VIEWS["askew"])
    read = read_hdr(path)
    result = evaluate(read.luminance, read.view, options=GlareOptions(**changes))
    assert_agree(result, evalglare(path, *flags))


def test_real_pictures(evalglare, real_data):
    for path in sorted((real_data / "hdr").glob("*.hdr")):
        read = read_hdr(path)
        assert_agree(evaluate(read.luminance, read.view), evalglare(path))
