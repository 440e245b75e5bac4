"""`cfs run` says what of the model came through before anything is traced."""

from __future__ import annotations

from bim.ifc.building import read_ifc
from scenes.commands.room_options import PrintedHead
from scenes.head import head_of
from tests.bim.small_ifc import DEPTH, WIDTH, box_model


def test_a_head_begins_with_the_account_of_a_model_that_will_not_do(tmp_path, capsys):
    path = tmp_path / "model.ifc"
    small, _ = box_model(space_height=1.2)
    small.box("IfcCovering", "ceiling", (0.0, 0.0, 1.2), (WIDTH, DEPTH, 0.05))
    small.model.write(str(path))
    head = head_of(read_ifc(path))
    PrintedHead()(head)
    printed = capsys.readouterr().out
    # the glass reaches from 1.0 to 2.3 m, the room to 1.2 m
    verdict = "Model: not usable: only 15 % of the exterior glass is used"
    assert printed.splitlines()[0].startswith(verdict)
    assert "Rooms read: 1 of 1 space " in printed and "Glass: " in printed
    assert head.notes[0].startswith(verdict)
