"""`cfs run` says what of the model came through before anything is traced."""

from __future__ import annotations

from types import SimpleNamespace

import scenes.run.notes
import scenes.run.run
from bim.ifc.building import read_ifc
from scenes.commands.run import _print_account
from tests.bim.small_ifc import DEPTH, WIDTH, box_model


def test_run_begins_with_the_account_and_notes_a_model_that_will_not_do(
    tmp_path, monkeypatch, capsys
):
    path = tmp_path / "model.ifc"
    small, _ = box_model(space_height=1.2)
    small.box("IfcCovering", "ceiling", (0.0, 0.0, 1.2), (WIDTH, DEPTH, 0.05))
    small.model.write(str(path))
    building = read_ifc(path)
    said: list[str] = []

    def traced(*_inputs, **_options):
        said.append(capsys.readouterr().out)

    monkeypatch.setattr(
        scenes.run.run, "read_inputs", lambda *_: SimpleNamespace(building=building)
    )
    monkeypatch.setattr(scenes.run.run, "run_inputs", traced)
    scenes.run.run.run_job(None, on_building=_print_account)
    # the glass reaches from 1.0 to 2.3 m, the room to 1.2 m
    verdict = "Model: not usable: only 15 % of the glass that looks out is used"
    assert said[0].splitlines()[0].startswith(verdict)
    assert "Rooms read: 1 of 1 spaces" in said[0] and "Glass: " in said[0]
    (note,) = scenes.run.notes._account_notes(building)
    assert note.startswith(verdict)
