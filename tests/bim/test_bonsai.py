"""The add-on for Bonsai apart from Blender: its command, results, colours, and its zip."""

from __future__ import annotations

import json
import tomllib
import zipfile
from types import SimpleNamespace

import pytest

from bim.bonsai import addon
from bim.bonsai.package import write_add_on


@pytest.fixture
def results(tmp_path):
    """Two rooms as `cfs run` writes them: 40 and 90 % sDA; two pictures each."""
    places = {"guid-a": "A", "guid-b": "B"}
    (tmp_path / "run.json").write_text(json.dumps({"folders": places}))
    for name, sda, worst in (("A", 40, 0.3), ("B", 90, 0.5)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "room_metrics.csv").write_text(f"sda300_50,da300\n{sda},\n")
        (tmp_path / name / "dgp.csv").write_text(f"time,dgp\nx,0.25\ny,{worst}\n")
    return str(tmp_path)


def test_rooms_have_the_values_of_their_own_folders(results):
    assert addon.room_values(results, "SDA") == {"guid-a": 40.0, "guid-b": 90.0}
    assert addon.room_values(results, "DGP") == {"guid-a": 0.3, "guid-b": 0.5}  # the worst
    assert addon.room_values(results, "DA") == {}
    lines = addon.legend(addon.room_values(results, "SDA"), "SDA")
    assert lines == ["2 room(s): 40 to 90", "scale 0 to 100"]


@pytest.mark.parametrize("fault", ["no folder", "no json", "no table", "no column", "no number"])
def test_a_folder_without_a_run_is_one_line(results, tmp_path, fault):
    run, table = tmp_path / "run.json", tmp_path / "A" / "room_metrics.csv"
    {
        "no folder": lambda: run.unlink(),
        "no json": lambda: run.write_text("[1]"),
        "no table": lambda: table.unlink(),
        "no column": lambda: table.write_text("other\n1\n"),
        "no number": lambda: table.write_text("sda300_50\nmuch\n"),
    }[fault]()
    with pytest.raises(ValueError, match="holds no results of cfs run") as caught:
        addon.room_values(results, "SDA")
    assert "\n" not in str(caught.value)


def test_colours_go_from_the_lower_to_the_upper_end_of_the_scale():
    assert addon.colour(-5, 0, 100)[:3] == addon.STOPS[0]
    assert addon.colour(500, 0, 100)[:3] == addon.STOPS[-1]
    assert addon.colour(50, 0, 100)[:3] == pytest.approx(addon.STOPS[2])
    quarter = [(a + b) / 2 for a, b in zip(addon.STOPS[0], addon.STOPS[1], strict=True)]
    assert addon.colour(12.5, 0, 100)[:3] == pytest.approx(quarter)


def test_the_command_is_that_of_the_open_file(tmp_path):
    house, city = tmp_path / "a house.ifc", tmp_path / "city.epw"
    for file in (house, city):
        file.touch()
    words = addon.run_command("python -m scenes.cli", str(house), str(city), "out")
    assert words == ["python", "-m", "scenes.cli", "run", str(house), "--weather", str(city), "--out", "out", "--quick"]
    more = addon.run_command("cfs", str(house), str(city), "out", quick=False, system="b.xml")
    assert more[-2:] == ["--cfs", "b.xml"]
    with pytest.raises(ValueError, match="save it first"):
        addon.run_command("cfs", "", str(city), "out")


def test_rooms_of_another_file_are_passed_over(results):
    """Bonsai's door raises `RuntimeError` for a GUID that there is not."""
    shown = SimpleNamespace(hidden=None)
    shown.hide_set = lambda hidden: setattr(shown, "hidden", hidden)

    def by_guid(guid):
        if guid == "guid-a":
            raise RuntimeError(guid)
        return guid

    ifc = SimpleNamespace(get=lambda: SimpleNamespace(by_guid=by_guid), get_object=lambda _: shown)
    colours = addon.coloured(addon.room_values(results, "SDA"), "SDA")
    assert addon.paint(addon.room_objects(ifc, colours)) == 1
    assert shown.hidden is False and shown.color == addon.colour(90, 0, 100)


def test_a_strangers_results_lead_out_of_no_folder(results, tmp_path):
    (tmp_path / "run.json").write_text(json.dumps({"folders": {"guid-a": "../victim"}}))
    with pytest.raises(ValueError, match="is no name of a room's folder"):
        addon.room_values(results, "SDA")


def test_the_program_is_no_setting_of_a_scene(tmp_path, monkeypatch):
    """A scene comes with its file: a stranger's would name the program to run."""
    kinds = dict.fromkeys(("PropertyGroup", "AddonPreferences", "Operator", "Panel"), object)
    prop = {f"{kind}Property": dict for kind in ("String", "Bool", "Enum")}
    blender = SimpleNamespace(
        types=SimpleNamespace(**kinds), props=SimpleNamespace(**prop), path=SimpleNamespace(abspath=str)
    )
    settings, preferences, run, *_ = addon.add_on_classes(blender)
    assert "program" not in settings.__annotations__ and "program" in preferences.__annotations__
    for name in ("model.ifc", "weather.epw"):
        (tmp_path / name).write_text("")
    monkeypatch.setattr(addon, "_ifc", lambda: SimpleNamespace(get_path=lambda: str(tmp_path / "model.ifc")))
    started = []
    monkeypatch.setattr(addon.subprocess, "Popen", lambda words, **_: started.append(words))
    scene = SimpleNamespace(program="evil", weather=str(tmp_path / "weather.epw"), system="", results="out", quick=True)
    own = SimpleNamespace(preferences=SimpleNamespace(program="cfs"))
    manager = SimpleNamespace(event_timer_add=lambda *_, **__: 0, modal_handler_add=lambda _: None)
    context = SimpleNamespace(
        scene=SimpleNamespace(cfs=scene),
        window=None,
        window_manager=manager,
        preferences=SimpleNamespace(addons={preferences.bl_idname: own}),
    )
    job = run()
    job.execute(context)
    job.log.close()
    assert started[0][:2] == ["cfs", "run"]


def test_the_zip_is_an_extension_of_blender(tmp_path):
    path = tmp_path / "addon.zip"
    write_add_on(path)
    first = path.read_bytes()
    write_add_on(path)
    assert path.read_bytes() == first
    with zipfile.ZipFile(path) as archive:
        assert set(archive.namelist()) == {"__init__.py", "blender_manifest.toml"}
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        source = archive.read("__init__.py").decode()
    required = {
        "schema_version",
        "id",
        "version",
        "name",
        "tagline",
        "maintainer",
        "type",
        "blender_version_min",
        "license",
    }
    assert required <= set(manifest) and manifest["type"] == "add-on"
    assert len(manifest["tagline"]) <= 64 and not manifest["tagline"].endswith(".")
    compile(source, "__init__.py", "exec")
    assert "\nfrom bim" not in source and "\nimport bpy" not in source


def test_a_run_names_the_folder_of_each_room(tmp_path):
    """Both of two rooms, and the folder itself for one alone."""
    from dataclasses import replace

    from scenes.result_folder import ResultFolder
    from scenes.run.outputs import write_results
    from tests.report.synthetic import run_result

    two = run_result(picture_size=16, pictures=1)
    for run in (two, replace(two, spaces=two.spaces[:1])):
        place = tmp_path / str(len(run.spaces))
        write_results(run, ResultFolder(place, "run"))
        values = addon.room_values(str(place), "SDA")
        assert values == pytest.approx({room.space.guid: room.daylight.sda for room in run.spaces}, rel=1e-5)
