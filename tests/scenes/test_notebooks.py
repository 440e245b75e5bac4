"""The tutorials' notebooks: of the format, with the outputs of a run, and run from end to end."""

from __future__ import annotations

import importlib.util
import json
import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))
# What each shows inline: words of its HTML outputs
SHOWN = {
    "room": ("Spatial daylight autonomy", "operative_c", "room_results/report.html"),
    "study": ("Blind down", "straight_view_percent"),
    "light": (),
    "control": ("By use", "straight_view_percent"),
}
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?")
MOST_CHARACTERS = 200_000
WITH_CLIENT = pytest.mark.skipif(
    importlib.util.find_spec("nbclient") is None or importlib.util.find_spec("ipykernel") is None, reason="no nbclient"
)


def test_each_is_known() -> None:
    assert [path.stem for path in NOTEBOOKS] == sorted(SHOWN)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_kept_and_small(path) -> None:
    """A reader sees results without a run; no path of the machine that made them, no error."""
    text = path.read_text(encoding="utf-8")
    found = json.loads(text)
    assert found["nbformat"] == 4 and len(text) < MOST_CHARACTERS
    code = [cell for cell in found["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in code for output in cell["outputs"]]
    assert outputs and all(one["output_type"] != "error" and one.get("name") != "stderr" for one in outputs)
    assert not re.search(r"/(home|root|tmp|work)/", text)
    for cell in code:
        compile("".join(cell["source"]), path.name, "exec")


def shown(cells) -> list[str]:
    """Each output that is text, HTML where there is some, without tables of computing times."""
    outputs = [output for cell in cells for output in cell.get("outputs", ())]
    texts = (one.get("data", {}).get("text/html") or one.get("data", {}).get("text/plain", "") for one in outputs)
    return [text for text in map("".join, texts) if "seconds</th>" not in text]  # computing times differ


def test_a_stale_output_is_found() -> None:
    cells = json.loads(NOTEBOOKS[0].read_text(encoding="utf-8"))["cells"]
    changed = json.loads(json.dumps(cells).replace("1735.0", "1835.0"))
    assert cells != changed
    same_results(shown(cells), shown(cells))
    with pytest.raises(AssertionError):
        same_results(shown(changed), shown(cells))


def same_results(fresh: list[str], kept: list[str]) -> None:
    """The words are the same; the numbers within 1 %: the seeds are fixed, processors round differently."""
    assert [NUMBER.sub("#", text) for text in fresh] == [NUMBER.sub("#", text) for text in kept]
    numbers = [[float(number) for text in texts for number in NUMBER.findall(text)] for texts in (fresh, kept)]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.01, abs=0.01)


@pytest.mark.slow
@WITH_CLIENT
@pytest.mark.filterwarnings("default")  # of Jupyter's own
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_its_results(path, tmp_path, monkeypatch) -> None:
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    client = NotebookClient(notebook, timeout=1800, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    outputs = [o for cell in notebook.cells for o in cell.get("outputs", ())]
    assert not [o for o in outputs if o.output_type == "error"]
    html = " ".join(str(o.get("data", {}).get("text/html", "")) for o in outputs)
    for words in SHOWN[path.stem]:
        assert re.search(re.escape(words), html), words
    same_results(shown(notebook.cells), shown(json.loads(path.read_text(encoding="utf-8"))["cells"]))
