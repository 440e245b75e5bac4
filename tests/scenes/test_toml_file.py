"""Study files: the one line that a wrong key or value gives."""

from __future__ import annotations

import pytest

from mitsuba_cfs.errors import DataError
from scenes.heat.study_file import StudyFile
from scenes.toml_file import read_table, validated

GOOD = {"weather": "a.epw", "building": "a.ifc", "system": [{"bsdf": "a.xml"}]}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"contol": {}}, "s.toml: contol: no such key; did you mean control?"),
        ({"gains": {"person": 1}}, "s.toml: gains.person: no such key; did you mean persons?"),
        (
            {"system": [{"bsdf": "a", "gvalue": 1}]},
            "s.toml: system.0.gvalue: no such key; did you mean g_value?",
        ),
        (
            {"system": [{"bsdf": "a", "u_model": "gap", "gap": {"width": 1, "gases": {}}}]},
            "s.toml: system.0.gap.gases: no such key; did you mean gas?",
        ),
        ({"loads": {"xyz": 1}}, "s.toml: loads.xyz: no such key; there are heating_c, cooling_c"),
        ({"couple": 7}, "s.toml: couple: Input should be a valid boolean"),
        ({"system": [{}]}, "s.toml: system.0.bsdf: is missing"),
        ({"air": {"night": [22, 6]}}, "s.toml: air.night: expected two hours of one day"),
    ],
)
def test_a_wrong_key_is_named_with_the_nearest(tmp_path, more, words) -> None:
    with pytest.raises(DataError) as error:
        validated(StudyFile, GOOD | more, tmp_path / "s.toml")
    assert str(error.value).startswith(str(tmp_path / words))


def test_how_many_more_faults_there_are_is_said(tmp_path) -> None:
    with pytest.raises(DataError, match=r"\(and 1 more\)$"):
        validated(StudyFile, GOOD | {"a": 1, "b": 2}, tmp_path / "s.toml")


@pytest.mark.parametrize("content", [b"[[", b"\xff\xfe"])
def test_what_is_no_toml_is_said(tmp_path, content: bytes) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(content)
    with pytest.raises(DataError, match="is not TOML"):
        read_table(path)
