"""Typical layers: their U is the one that is stated."""

from __future__ import annotations

import pytest

from thermal.glazing import Gap
from thermal.gvalue import TYPICAL_SYSTEMS
from thermal.iso15099 import U_STATE_C, iso15099_data, iso15099_u_value, prescribed
from thermal.window_model import likely_units, typical_unit

STATE = prescribed(*U_STATE_C)


@pytest.mark.parametrize("position", list(TYPICAL_SYSTEMS))
@pytest.mark.parametrize("u_value", [0.4, 0.7, 1.0, 1.3, 1.9, 2.6, 3.0])
def test_every_position_and_u_has_layers_with_this_u(position, u_value):
    unit = typical_unit(position, u_value)
    assert unit is not None and unit.shade_place in (position, "internal")
    for one in (unit, *likely_units(position, u_value)):
        data = iso15099_data(one, u_value)
        assert data.u_value == u_value
        assert float(data.resistance.at(10.0, 15.0)) > 0
    if 1.3 <= u_value <= 1.9 and position != "integrated":  # where a coating gives it
        assert iso15099_u_value(unit, STATE) == pytest.approx(u_value, abs=1e-4)


def test_panes_follow_from_u():
    counts = {u: len(typical_unit("none", u).layers) for u in (0.6, 1.0, 1.2, 2.7, 5.0)}
    assert counts == {0.6: 3, 1.0: 2, 1.2: 2, 2.7: 2, 5.0: 1}
    assert typical_unit("none", 5.9) is None  # no layers let more through


def test_a_stated_gap_is_taken():
    gap = Gap(0.012, (("krypton", 1.0),), (0.837, 0.03))
    unit = typical_unit("external", 1.0, gap)
    assert [one.width for one in unit.gaps] == [0.1, 0.012]
    assert unit.gaps[1].gas == gap.gas and unit.layers[2].emissivity[0] == 0.03
    triple = typical_unit("none", 0.5, Gap(0.012, (("krypton", 1.0),), (0.837, 0.03)))
    assert [one.width for one in triple.gaps] == [0.012, 0.012]
