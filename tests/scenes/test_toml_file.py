"""Study files: the one line that a wrong key or value gives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, get_args, get_origin

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from mitsuba_cfs.errors import DataError
from scenes import toml_file
from scenes.fenestration.thermal_file import ThermalFile, ThermalTable
from scenes.heat.study_file import StudyFile
from scenes.photovoltaics.study_file import PvStudy
from scenes.room.operation_tables import OperationTables
from scenes.study.study_file import Study
from scenes.toml_file import keys_of, read_table, tables_of, validated

GOOD = {"weather": "a.epw", "building": "a.ifc", "system": [{"bsdf": "a.xml"}]}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"contol": {}}, "s.toml: contol: no such key; did you mean control?"),
        ({"gains": {"person": 1}}, "s.toml: gains.person: no such key; did you mean persons?"),
        ({"system": [{"bsdf": "a", "gvalue": 1}]}, "s.toml: system.0.gvalue: no such key; did you mean g_value?"),
        (
            {"system": [{"bsdf": "a", "u_model": "gap", "gap": {"width": 1, "gases": {}}}]},
            "s.toml: system.0.gap.gases: no such key; did you mean gas?",
        ),
        ({"loads": {"xyz": 1}}, "s.toml: loads.xyz: no such key; there are heating_c, cooling_c"),
        ({"couple": 7}, "s.toml: couple: expected true or false, got 7"),
        ({"system": [{}]}, "s.toml: system.0: bsdf: is missing"),
        ({"air": {"night": [6, 6]}}, "s.toml: air.night: expected two different hours"),
        ({"air": {"night": [24, 6]}}, "s.toml: air.night: expected two different hours"),
    ],
)
def test_a_wrong_key_is_named_with_the_nearest(tmp_path, more, words) -> None:
    with pytest.raises(DataError) as error:
        validated(StudyFile, GOOD | more, tmp_path / "s.toml")
    assert str(error.value).startswith(str(tmp_path / words))


BOX = {"width": 3, "depth": 4, "height": 3, "window": []}
BOXED = {"weather": "a.epw", "box": BOX, "system": [{"bsdf": "a.xml"}]}
LAYER = {"thickness": 0.1, "conductivity": 1, "density": 1000, "heat_capacity": 1000}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (
            {"box": BOX | {"construction": {"facade": [LAYER]}}},
            "box.construction.facade: no such key; there are front, right, back, left, floor, ",
        ),
        (
            {"box": BOX | {"construction": {"wall": [LAYER | {"thicknes": 1}]}}},
            "box.construction.wall.0.thicknes: no such key; did you mean thickness?",
        ),
        ({"box": BOX | {"reflectance": {"wals": 0.9}}}, "box.reflectance.wals: no such key; did you mean wall?"),
        ({"box": BOX | {"adjacency": {"facade": "adiabatic"}}}, "box.adjacency.facade: no such"),
        (
            {"box": BOX | {"adjacency": {"wall": "adiabatik"}}},
            "box.adjacency.wall: expected 'outside', 'ground', 'space' or 'adiabatic', got "
            "'adiabatik'; did you mean 'adiabatic'?",
        ),
        ({"spaces": ["a"]}, "spaces: belongs to a `building`; a box is one room"),
        ({"couple": True}, "couple: belongs to a `building`"),
        ({"system": {"bsdf": "a"}}, "system: expected a list of tables, [[system]], got a table"),
        ({"gains": 3}, "gains: expected a table, got 3"),
        ({"gains": {"persons": "two"}}, "gains.persons: no schedule 'two'; there are none"),
        ({"gains": {"persons": -1}}, "gains.persons: expected 0 to 10000 persons"),
        ({"box": BOX | {"facing_deg": float("nan")}}, "box.facing_deg: expected a finite number"),
        ({"gains": {"occupied": [8]}}, "gains.occupied: expected two hours or the name of"),
        ({"air": {"night": [8]}}, "air.night.1: expected 2 values"),
        ({"gains": {"person_w": "two"}}, "gains.person_w: expected a number, got 'two'"),
        ({"spaces": "A"}, "spaces: expected a list, got 'A'"),
        ({"weather": 3}, "weather: expected the path of a file, got 3"),
    ],
)
def test_what_is_wrong_is_said_in_our_words(tmp_path, more, words) -> None:
    with pytest.raises(DataError) as error:
        validated(StudyFile, BOXED | more, tmp_path / "s.toml")
    assert str(error.value).startswith(str(tmp_path / f"s.toml: {words}"))
    assert "Input" not in str(error.value) and "\n" not in str(error.value)


KINDS_OF_FILE = (StudyFile, OperationTables, Study, PvStudy, ThermalTable)
Place = tuple[str | int, ...]


def places(annotation: Any, place: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Every table inside a type with its place: models, and tables whose keys are free or few."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield place, annotation
        for name, field in annotation.model_fields.items():
            if name not in place or name != "parts":  # rules that combine rules: one level of them
                yield from places(field.annotation, (*place, name))
    elif get_origin(annotation) is dict:
        keys = keys_of(annotation)
        yield place, annotation
        yield from places(get_args(annotation)[1], (*place, keys[0] if keys else "any"))
    else:
        deeper = (0,) if get_origin(annotation) in (tuple, list) else ()
        for inner in get_args(annotation):
            yield from places(inner, (*place, *deeper))


def planted(place: Place) -> Any:
    """A document that holds nothing but an unknown key at a place."""
    if not place:
        return {"no_such_thing": 1}
    inner = planted(place[1:])
    return [inner] if place[0] == 0 else {place[0]: inner}


EVERY_TABLE = [
    pytest.param(model, place, id=f"{model.__name__}:{'.'.join(map(str, place))}")
    for model in KINDS_OF_FILE
    for place, table in places(model)
    if isinstance(table, type) or keys_of(table)
]


@pytest.mark.parametrize(("model", "place"), EVERY_TABLE)
def test_every_table_at_every_depth_refuses_an_unknown_key(tmp_path, model, place) -> None:
    with pytest.raises(DataError) as error:
        validated(model, planted(place), tmp_path / "s.toml")
    field = ".".join(map(str, (*place, "no_such_thing")))
    assert error.value.field == field and "no such key; " in str(error.value)


def test_no_table_takes_keys_that_nobody_knows() -> None:
    """Free keys only where they name tables of the user's own."""
    assert len(EVERY_TABLE) > 30
    for model in KINDS_OF_FILE:
        for place, table in places(model):
            if get_origin(table) is dict and keys_of(table) is None:
                assert any(tables_of(get_args(table)[1])), place


def test_the_file_beside_a_bsdf_is_checked_as_well(tmp_path) -> None:
    path = tmp_path / "blind.toml"
    path.write_text("u_valeu = 1.1\n")
    with pytest.raises(DataError, match=r"blind.toml: u_valeu: no such key; did you mean u_value"):
        ThermalFile.read(path)


SLIPS = [
    ({"loads": {"heating_c": 293.15}}, "loads.heating_c: expected -30 to 60 C ", "K would be 20 C"),
    ({"loads": {"cooling_c": 78}}, "loads.cooling_c: expected -30 to 60 C ", "78 F would be 25.6"),
    ({"loads": {"heating_c": -40}}, "loads.heating_c: expected -30 to 60 C ", "got -40"),
    ({"air": {"infiltration_ach": 50_000}}, "air.infiltration_ach: expected 0 to 200 1/h", "50000"),
    ({"air": {"door_m3_s": 300}}, "air.door_m3_s: expected 0 to 50 m3/s", "m3/h would be 0.0833"),
    ({"gains": {"equipment_w_m2": 8000}}, "gains.equipment_w_m2: expected 0 to 3000 W/m2", "8000"),
    ({"gains": {"lighting_w_m2": 800}}, "gains.lighting_w_m2: expected 0 to 500 W/m2", "got 800"),
    ({"box": BOX | {"width": 4000}}, "box.width: expected 0 to 500 m", "4000 mm would be 4 m"),
    (
        {"box": BOX | {"construction": {"wall": [LAYER | {"thickness": 140}]}}},
        "box.construction.wall.0.thickness: expected 0 to 5 m ",
        "140 mm would be 0.14 m",
    ),
    (
        {"box": BOX | {"construction": {"wall": [LAYER | {"conductivity": 5000}]}}},
        "box.construction.wall.0.conductivity: expected 0.001 to 500 W/(m K)",
        "got 5000",
    ),
    (
        {"box": BOX | {"construction": {"wall": [LAYER | {"density": 1e6}]}}},
        "box.construction.wall.0.density: expected 0 to 20000 kg/m3",
        "got 1e+06",
    ),
    (
        {"box": BOX | {"construction": {"wall": [LAYER | {"heat_capacity": 1.0}]}}},
        "box.construction.wall.0.heat_capacity: expected 50 to 10000 J/(kg K)",
        "no kJ), got 1",
    ),
]


@pytest.mark.parametrize(("more", "start", "words"), SLIPS)
def test_a_slip_of_unit_or_digit_is_named_with_the_unit(tmp_path, more, start, words) -> None:
    with pytest.raises(DataError) as error:
        validated(StudyFile, BOXED | more, tmp_path / "s.toml")
    assert str(error.value).startswith(str(tmp_path / f"s.toml: {start}"))
    assert words in str(error.value)


def test_hours_may_pass_midnight(tmp_path) -> None:
    tables = {"air": {"night": [22, 6]}, "gains": {"occupied": [18, 8]}}
    study = validated(StudyFile, BOXED | tables, tmp_path / "s.toml")
    assert study.air.night == (22, 6) and study.gains.occupied == (18, 8)


def test_how_many_more_faults_there_are_is_said(tmp_path) -> None:
    with pytest.raises(DataError, match=r"\(and 1 more\)$"):
        validated(StudyFile, GOOD | {"a": 1, "b": 2}, tmp_path / "s.toml")


@pytest.mark.parametrize("content", [b"[[", b"\xff\xfe"])
def test_what_is_no_toml_is_said(tmp_path, content: bytes) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(content)
    with pytest.raises(DataError, match="is not TOML"):
        read_table(path)


@pytest.mark.parametrize(
    ("albedo", "good"),
    [
        (0, True),
        (1.0, True),
        ([0.2] * 12, True),
        ("snow", True),
        (-0.1, False),
        (1.01, False),
        ([0.2] * 11, False),
        ([0.2] * 13, False),
        ([1.5] * 12, False),
        ("ice", False),
    ],
)
def test_the_albedo_is_a_share_twelve_of_them_or_a_word(tmp_path, albedo, good) -> None:
    if good:
        table = validated(toml_file.OutdoorTable, {"albedo": albedo}, tmp_path / "s.toml")
        assert table.albedo == (tuple(albedo) if isinstance(albedo, list) else albedo)
    else:
        with pytest.raises(DataError, match=r"s.toml: albedo"):
            validated(toml_file.OutdoorTable, {"albedo": albedo}, tmp_path / "s.toml")


def test_a_type_that_is_no_table_has_no_keys() -> None:
    for annotation in (float, tuple[int, ...], list[str], dict[str, float], str | None):
        assert keys_of(annotation) is None
    assert keys_of(dict[Literal["a", "b"], float] | None) == ("a", "b")
    assert keys_of(tuple[float, float] | toml_file.OutdoorTable) == ("surroundings", "surroundings_offset", "albedo")


def test_reading_options_are_the_keys_that_a_table_has() -> None:
    room = toml_file.ReadTable(join=("A + B",), furniture=True)
    assert toml_file.read_options(room) == {"join": ("A + B",), "furniture": True, "apertures": (), "facade_panes": ()}
    both = toml_file.read_options(toml_file.ReadTable(), toml_file.OutdoorTable(albedo="file"))
    assert both["albedo"] == "file" and both["furniture"] is False and len(both) == 7


def test_the_type_within_a_list_that_may_be_a_number_is_found() -> None:
    found = toml_file._at(float | tuple[toml_file.OutdoorTable, ...], (0,))
    assert keys_of(found) == keys_of(toml_file.OutdoorTable)
    assert toml_file._at(float | dict[str, int], ("x",)) is int
    assert toml_file._at(float, (0,)) is None


def test_what_annotates_a_table_is_passed_over() -> None:
    assert keys_of(Annotated[toml_file.OutdoorTable, "of a study"]) == keys_of(toml_file.OutdoorTable)


def test_a_positive_number_is_above_zero() -> None:
    positive = TypeAdapter(toml_file.Positive)
    assert positive.validate_python(0.001) == 0.001
    with pytest.raises(ValidationError):
        positive.validate_python(0.0)


@pytest.mark.parametrize(
    ("path", "made", "result"),
    [
        ("a.b", False, {"a": {"b": 9}, "rows": [{"x": 1}, {"x": 2}], "pair": (1, 2), "none": None}),
        ("rows.x", False, {"a": {"b": 1}, "rows": [{"x": 9}, {"x": 9}], "pair": (1, 2), "none": None}),
        ("rows.1.x", False, {"a": {"b": 1}, "rows": [{"x": 1}, {"x": 9}], "pair": (1, 2), "none": None}),
        ("rows.1", False, {"a": {"b": 1}, "rows": [{"x": 1}, 9], "pair": (1, 2), "none": None}),
        ("pair.0", False, {"a": {"b": 1}, "rows": [{"x": 1}, {"x": 2}], "pair": [9, 2], "none": None}),
        ("none.y", True, {"a": {"b": 1}, "rows": [{"x": 1}, {"x": 2}], "pair": (1, 2), "none": {"y": 9}}),
        ("none.y", False, "no such key; there are a, rows, pair"),
        ("rows.2.x", False, "there is no entry 2: there are 2"),
        ("a.b.c", False, "there is no table to set 'c' in, but 1"),
    ],
)
def test_a_key_is_set_down_a_path(path, made, result) -> None:
    table: dict[str, Any] = {"a": {"b": 1}, "rows": [{"x": 1}, {"x": 2}], "pair": (1, 2), "none": None}
    if isinstance(result, str):
        with pytest.raises(DataError) as caught:
            toml_file.set_key(table, path.split("."), 9, made=made)
        assert result in str(caught.value)
    else:
        toml_file.set_key(table, path.split("."), 9, made=made)
        assert table == result


def test_a_key_of_an_empty_list_cannot_be_set() -> None:
    with pytest.raises(DataError, match="there is no entry to set 'x' in"):
        toml_file.set_key({"empty": []}, ["empty", "x"], 9, made=True)


def test_texts_that_name_files_of_the_folder_become_their_paths(tmp_path) -> None:
    (tmp_path / "a.epw").touch()
    table = {"weather": "a.epw", "rows": [{"bsdf": "b.xml"}, "a.epw"], "title": "", "number": 3}
    path = str(tmp_path / "a.epw")
    found = toml_file.with_absolute_files(table, tmp_path)
    assert found == {"weather": path, "rows": [{"bsdf": "b.xml"}, path], "title": "", "number": 3}
