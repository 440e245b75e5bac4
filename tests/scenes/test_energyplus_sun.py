"""The studies that EnergyPlus computes too, and our rooms with EnergyPlus' sun."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from scenes.heat.study_file import read_study
from scenes.room.zone import RoomZone
from tests.benchmarks.coupled_zones import row_of_zones
from tests.conftest import REPOSITORY
from tests.validation.energyplus_twin import (
    ABSORBED,
    CONVECTED,
    INCIDENT,
    INSIDE_FACE,
    LAYER,
    OUTSIDE_FACE,
    RADIATED,
    SUN,
    sky_seen,
    with_their_sun,
)
from thermal.climate import Solar

STUDIES = sorted((REPOSITORY / "docs" / "tutorials" / "energyplus_twin").glob("*.toml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_the_studies_read(path, real_data):
    study = read_study(path)
    assert study.loads.heating_c == 20 and len(study.system[0].layers) == 2


def test_a_room_has_their_sun_in_layers_and_surfaces():
    """Two hours and one in the dark; what the inner layer takes is by the balance of its face."""
    (zone,) = row_of_zones(1)
    walls = len(zone.surfaces)
    ours = np.ones((3, 1))
    solar = Solar(ours, ours, np.ones((3, walls)), np.ones((3, walls)), window_inside=ours)
    room = RoomZone(None, SimpleNamespace(zone=zone), solar, {"incident_w": ours[:, 0]}, None, None, None, None, None)
    outdoor = [k for k, s in enumerate(zone.surfaces) if s.outside == "outdoor"]
    window, area = zone.windows[0], zone.windows[0].area
    resistance = window.states[0].layer_resistance.at([25.0, 27.5, 10.0], [10.0, 5.0, 10.0])
    theirs = pd.DataFrame(
        {
            f"Z0 W0:{INCIDENT}": np.array([60.0, 100.0, 0.0]) / area,
            f"Z0 W0:{SUN}": [30.0, 50.0, 0.0],
            f"Z0 W0:{LAYER.format(1)}": [6.0, 10.0, 0.0],
            f"Z0 W0:{LAYER.format(2)}": [2.0, 4.0, 0.0],
            f"Z0 W0:{INSIDE_FACE}": [30.0, 30.0, 15.0],
            f"Z0 W0:{OUTSIDE_FACE}": [20.0, 25.0, 5.0],
            f"Z0 W0:{CONVECTED}": [-5.0, -5.0, 9.0],
            f"Z0 W0:{RADIATED}": [-3.0, -1.0, 9.0],
            f"Z0 S0:{ABSORBED}": [7.0, 8.0, 4.0],
            f"Z0 S{outdoor[0]}.0:{INCIDENT}": [10.0, 20.0, 0.0],
            f"Z0 S{outdoor[0]}.1:{INCIDENT}": [30.0, 40.0, 0.0],
            f"Z01 S0:{ABSORBED}": [1e6, 1e6, 1e6],  # another room's
        }
    )
    found = with_their_sun("Z0", room, theirs)
    got = found.solar
    np.testing.assert_allclose(got.absorbed_outer[:, 0], np.array([6.0, 10.0, 0.0]) / area)
    # 8 and 6 W to the room, and what 10 and 5 K drive outwards
    taken = np.array([8.0, 6.0]) / area + np.array([10.0, 5.0]) / resistance[:2]
    np.testing.assert_allclose(got.absorbed_inner[:, 0], [*taken, 0.0])
    np.testing.assert_array_equal(got.window_inside, 0.0)
    np.testing.assert_allclose(got.inside[:, 0], [7.0, 8.0, 4.0])
    np.testing.assert_allclose(got.inside[:, 1:], 1.0)
    np.testing.assert_allclose(got.facade[:, outdoor[0]], [20.0, 30.0, 0.0])
    others = [k for k in range(walls) if k != outdoor[0]]
    np.testing.assert_allclose(got.facade[:, others], 1.0)
    assert found.gains["incident_w"] == pytest.approx([60.0, 100.0, 0.0])


def test_their_share_of_the_sky_is_the_mean_of_a_surface_s_parts():
    (zone,) = row_of_zones(1)
    room = RoomZone(None, SimpleNamespace(zone=zone), None, {}, None, None, None, None, None)
    (at,) = [k for k, s in enumerate(zone.surfaces) if s.outside == "outdoor"][:1]
    half = 0.5 * (1.0 + zone.surfaces[at].normal[2])
    listed = (
        "! <HeatTransfer Surface>,Surface Name,Area (Net) {m2},ViewFactorToSky-IR\n"
        f"HeatTransfer Surface,Z0 S{at}.0,3.0,{0.2 * half}\n"
        f"HeatTransfer Surface,Z0 S{at}.1,1.0,{1.0 * half}\n"
        "HeatTransfer Surface,Z0 W0,4.5,0.25\nHeatTransfer Surface,Z0 W0 FRAME,1.0,0.1\n"
        f"HeatTransfer Surface,Z01 S{at},9.0,0.0\n"
    )
    found = sky_seen("Z0", room, listed)
    assert list(found["sky seen E+"]) == pytest.approx([0.4, 0.5])
    assert list(found["sky seen"]) == [1.0, 1.0]
