"""The EnergyPlus model of a study has the shading states of every hour, by running it."""

from __future__ import annotations

import pytest

from tests.validation.exported_states import compare


@pytest.mark.slow
def test_energyplus_has_the_states_of_every_hour() -> None:
    pytest.importorskip("pyenergyplus")
    table = compare().set_index("window")
    assert table["differ h"].tolist() == [0, 0]
    assert table["moves"].min() > 300 and table["constructions"].tolist() == [3, 2]
    # the blind passes less than the glass, which shows that the constructions are not exchanged
    assert (table["passed 0"] > 1.5 * table["passed 1"]).all()
