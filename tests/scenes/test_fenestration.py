"""What fills each window, rung by rung, and the same one for every command and export."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bim.building_file import read_building_file
from bim.exported_glazing import normal_transmittance
from bim.fenestration import PlainGlass
from bim.ifc.building import read_ifc
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.glazing import solar_transmittance
from mitsuba_cfs.bsdf.xml import read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import write_text
from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.generic_glazing import GENERIC_GLAZINGS
from scenes.fenestration.resolver import fill_windows, windows_named
from scenes.fenestration.systems import FenestrationSystem, WindowOverrides, read_system
from scenes.fenestration.thermal_system import checked_system, thermal_system
from tests.bim.honeybee_models import two_rooms, write
from tests.bim.small_ifc import box_room
from tests.conftest import REPOSITORY
from tests.images.exr_reader import read_exr
from tests.scenes.fenestration_models import COMMON, GLAZING, STATED, grey, once, room, with_attached
from thermal.ratings import REFERENCE_GLAZINGS

pytestmark = pytest.mark.early

TINY = ["--quick", "--size", "64", "--picture", "06-21 12", "--spacing", "2", "--method", "three-phase"]
YEAR = ["--quick", "--size", "64", "--metric", "sDGP", "--method", "three-phase"]


def filled(path: Path, given: WindowOverrides | None = None) -> FenestrationSystem:
    """What fills the only window of a model, in its first state."""
    (states,) = fill_windows(read_ifc(path).windows, given or WindowOverrides(), path).values()
    return states[0]


def normal(system: FenestrationSystem) -> tuple[float, float]:
    """Visible and solar transmittance at normal incidence."""
    return tuple(
        float(band.direct_hemispherical(band.transmission_front)[0]) for band in (system.visible, system.solar)
    )


# each schema and each holder once; all pairs with the slow tests
@pytest.mark.parametrize(
    ("schema", "typed"),
    [
        pytest.param("IFC2X3", False, id="IFC2X3-window"),
        pytest.param("IFC4", True, id="IFC4-type"),
        pytest.param("IFC2X3", True, id="IFC2X3-type", marks=pytest.mark.slow),
        pytest.param("IFC4", False, id="IFC4-window", marks=pytest.mark.slow),
    ],
)
def test_each_rung_goes_before_the_next(tmp_path, schema, typed) -> None:
    path = room(tmp_path / "room.ifc", STATED, schema=schema, typed=typed)
    stated = filled(path)
    # the cap of the Klems basis reaches to 5 degrees, where Roos' factor is 1 - 1e-4
    assert normal(stated) == pytest.approx((0.7, 0.42), rel=2e-4)
    heat = thermal_system(stated)
    assert heat.fenestration.u_value == 1.2
    assert heat.g_value[0] == pytest.approx(0.5, abs=2e-4)
    assert not heat.notes  # nothing was assumed
    assert "stated in room.ifc" in stated.source
    assert any("Roos" in note for note in stated.notes)
    with_attached(path, 0.3, by_type=typed, u_value=0.9)
    attached = filled(path)
    assert normal(attached) == pytest.approx((0.3, 0.3))
    holder = "window type fixed pane" if typed else "the window itself"
    assert attached.source == f"what is attached to {holder} in room.ifc"
    blind = read_system(VENETIAN_BLIND, by="--cfs")
    assert filled(path, WindowOverrides((blind,))) is blind
    assert blind.source == "--cfs venetian_blind.xml"


def test_u_and_g_of_the_flags_go_before_those_of_the_file(tmp_path) -> None:
    path = room(tmp_path / "room.ifc", STATED)
    system = filled(path, WindowOverrides(u_value=0.8, g_value=0.45))
    assert (system.u_value, system.g_value) == (0.8, 0.45)
    with_attached(path, 0.3, u_value=0.9, g_normal=0.4)
    system = filled(path, WindowOverrides(u_value=1.5))
    assert (system.u_value, system.g_value) == (1.5, 0.4)
    assert system.source.endswith("room.ifc, U of --u")


def test_attached_u_and_g_without_a_bsdf_go_before_the_stated_ones(tmp_path) -> None:
    path = room(tmp_path / "room.ifc", STATED)
    assert run(["ifc", "attach", str(path), "--all", "--u", "0.7", "--g", "0.48", "-o", str(path)]) == 0
    system = filled(path)
    assert (system.u_value, system.g_value) == (0.7, 0.48)
    assert normal(system) == pytest.approx((0.7, 0.42), rel=2e-4)


def test_solar_transmittance_that_is_not_stated_follows_from_u_and_g(tmp_path) -> None:
    glazing = {k: v for k, v in STATED[GLAZING].items() if k != "SolarTransmittance"}
    system = filled(room(tmp_path / "room.ifc", STATED | {GLAZING: glazing}))
    # 0.085775 g2 + 0.963954 g - 0.084958 for U below 3.4 (LBNL-2804E)
    assert normal(system)[1] == pytest.approx(0.4185, rel=5e-4)
    assert any("Arasteh" in note for note in system.notes)
    assert thermal_system(system).g_value[0] == pytest.approx(0.5, abs=2e-4)


NOTHING = {
    "nothing": ({}, "no visible transmittance and no g"),
    "U alone": ({COMMON: {"ThermalTransmittance": 1.2}}, "no visible transmittance and no g"),
    "no g": ({GLAZING: {"VisibleLightTransmittance": 0.7}}, "state no g:"),
    "percent": (
        {GLAZING: {"VisibleLightTransmittance": 70.0, "SolarHeatGainTransmittance": 0.5}},
        "states 70 as its visible transmittance: expected more than 0, at most 1",
    ),
}


@pytest.mark.parametrize(("stated", "words"), NOTHING.values(), ids=NOTHING.keys())
def test_too_little_is_refused_by_name(tmp_path, stated, words) -> None:
    with pytest.raises(DataError, match="window W1") as fault:
        filled(room(tmp_path / "room.ifc", stated))
    assert words in str(fault.value)


def test_a_shade_without_a_bsdf_is_no_clear_glazing(tmp_path) -> None:
    from bim.fenestration import ShadingState
    from bim.ifc.attach import attach
    from bim.ifc.targets import Targets

    path = room(tmp_path / "room.ifc", STATED)
    attach(path, path, ShadingState(shading_position="external"), Targets(every_window=True))
    with pytest.raises(DataError, match="no BSDF attached for its shade"):
        filled(path)


def test_the_light_alone_needs_no_g(tmp_path) -> None:
    path = room(tmp_path / "room.ifc", NOTHING["no g"][0])
    assert normal(filled(path, WindowOverrides(light_only=True)))[0] == pytest.approx(0.7, rel=2e-4)


def words_of(command: str, path: Path, folder: Path) -> list[str]:
    """A command on a building of one's own, with weather and without a system."""
    out = ["--out", folder / command]
    if command == "picture":
        out = ["--out", folder / "a.hdr", "--at", "06-21 12:00", "--size", "32", "--samples", "4"]
    if command in ("run", "dgp", "picture"):
        more = {"run": TINY, "dgp": YEAR, "picture": []}[command]
        return [str(word) for word in (command, path, "--weather", WEATHER, *out, *more)]
    file = folder / f"{command}.toml"
    room_table, weather = f'building = "{path}"\n', f'weather = "{WEATHER}"\n'
    if command == "study":
        options = "[options]\npicture_size = 64\nsensor_spacing = 2\n"
        head = 'methods = ["three-phase"]\nglare = "sDGP"\n'
        file.write_text(f"{head}[[room]]\n{room_table}[[climate]]\n{weather}{options}")
    else:
        file.write_text(weather + room_table)
    return [command, str(file), "--quick", *map(str, out)]


COMMANDS = ("run", "dgp", "picture", "thermal", "study")
RECORDS = {"run": "run.json", "dgp": "glare_year.json", "thermal": "run.json"}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_without_a_system_says_what_to_give(tmp_path, capsys, command) -> None:
    path = room(tmp_path / "room.ifc")
    assert run(words_of(command, path, tmp_path)) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "window W1" in said and "has no BSDF attached" in said
    assert ("a [[system]]" if command in ("thermal", "study") else "--cfs FILE") in said


# `fill_windows` finds the rung for all: each command with the one, and one with the other
@pytest.mark.parametrize(
    ("rung", "command"),
    [("attached", command) for command in COMMANDS]
    + [pytest.param("stated", command, marks=() if command == "thermal" else pytest.mark.slow) for command in COMMANDS],
)
def test_a_command_takes_what_the_model_holds_and_says_so(tmp_path, capsys, command, rung) -> None:
    path = room(tmp_path / "room.ifc", STATED)
    if rung == "attached":
        with_attached(path, 0.3, u_value=1.1, g_normal=0.4)
    assert run(words_of(command, path, tmp_path)) == 0
    expected = {
        "attached": "what is attached to the window itself in room.ifc",
        "stated": "the values stated in room.ifc",
    }[rung]
    said = capsys.readouterr().out
    if command != "study":
        assert expected in " ".join(said.split())
    if command in RECORDS:
        assert expected in (tmp_path / command / RECORDS[command]).read_text()
    if command == "run":
        assert expected in (tmp_path / command / "report.html").read_text()
    if command == "study":
        table = pd.read_csv(tmp_path / command / "results.csv")
        assert expected in table["fenestration"].iloc[0]
        record = json.loads((tmp_path / command / "study.json").read_text())
        assert list(record["fenestration"].values()) == ["held by the building's file"]


@pytest.mark.slow  # quick: a room whose windows differ, below
def test_run_and_study_on_the_same_attached_data_agree(tmp_path) -> None:
    path = with_attached(room(tmp_path / "room.ifc", STATED), 0.3, u_value=1.1, g_normal=0.4)
    assert run(words_of("run", path, tmp_path)) == 0
    assert run(words_of("study", path, tmp_path)) == 0
    one = pd.read_csv(tmp_path / "run" / "room_metrics.csv").iloc[0]
    other = pd.read_csv(tmp_path / "study" / "results.csv").iloc[0]
    assert other["da300"] == pytest.approx(one["da300"], rel=1e-5)


def test_a_demo_file_is_taken_only_without_a_building_and_is_said(tmp_path, capsys) -> None:
    call = ["picture", "--at", "06-21 12:00", "--size", "16", "--samples", "1"]
    assert run([*call, "--out", str(tmp_path / "a.hdr")]) == 0
    assert "no BUILDING given: the demo's office, weather, venetian blind" in capsys.readouterr().out
    assert run([*call, str(OFFICE), "--out", str(tmp_path / "b.hdr")]) == 2
    said = capsys.readouterr().err.strip()
    assert "--weather is required" in said and "\n" not in said
    assert not (tmp_path / "b.hdr").exists()


@pytest.fixture
def two_systems(tmp_path) -> Path:
    """A room with a bright diffuser in one window and a dark one in the other."""
    path, shares = tmp_path / "two.ifc", (0.6, 0.05)
    for number, share in enumerate(shares):
        bands = {"Visible": grey(share), "Solar": grey(share)}
        write_bsdf_xml(BsdfFile(bands, str(share)), tmp_path / f"{number}.xml")

    def make() -> None:
        box_room(places=[(0.4, 0.9, 1.4, 1.5), (2.2, 0.9, 1.4, 1.5)]).write(str(path))
        for number, window in enumerate(read_ifc(path).windows):
            words = ["--window", window.guid, "--bsdf", tmp_path / f"{number}.xml", "--u", "1.1"]
            assert run([str(word) for word in ("ifc", "attach", path, *words, "-o", path)]) == 0

    return once(path, ("two systems",), make)


def test_windows_of_one_room_may_have_different_systems(two_systems, tmp_path, capsys) -> None:
    """The eye's illuminance lies between those of either system in all windows."""
    means = {}
    for name, more in {
        "two": [],
        "bright": ["--cfs", tmp_path / "0.xml"],
        "dark": ["--cfs", tmp_path / "1.xml"],
    }.items():
        out = tmp_path / name
        words = ["dgp", two_systems, "--weather", WEATHER, "--out", out, *more]
        assert run([str(word) for word in (*words, *YEAR)]) == 0
        means[name] = pd.read_parquet(out / "eye001_1.parquet")["Ev"].mean()
    # each window gives its part; the eye looks at one of them, so the parts are not quite halves
    part = (means["two"] - means["dark"]) / (means["bright"] - means["dark"])
    assert 0.25 < part < 0.75
    record = json.loads((tmp_path / "two" / "glare_year.json").read_text())
    assert sorted(one["windows"] for one in record["fenestration"]) == [["W1"], ["W2"]]


def test_a_picture_shows_each_windows_own_system(two_systems, tmp_path) -> None:
    out = tmp_path / "a.exr"
    view = "-vtv -vp 2 5 1.6 -vd 0 -1 0 -vh 50 -vv 30"
    words = [
        "picture",
        two_systems,
        "--weather",
        WEATHER,
        "--at",
        "06-21 12:00",
        "--size",
        "64",
        "--samples",
        "16",
        "--view",
        view,
        "--out",
        out,
    ]
    assert run([str(word) for word in words]) == 0
    luminance, _ = read_exr(out)
    middle = luminance[luminance.shape[0] // 2]
    halves = sorted(float(half.max()) for half in (middle[:32], middle[32:]))
    # diffusers under one sky: 0.6 to 0.05, and a little that the room throws back
    assert 6 < halves[1] / halves[0] < 14


def test_a_study_takes_each_windows_own_system_as_a_run_does(two_systems, tmp_path) -> None:
    assert run(words_of("run", two_systems, tmp_path)) == 0
    assert run(words_of("study", two_systems, tmp_path)) == 0
    one = pd.read_csv(tmp_path / "run" / "temperatures.csv")["operative_c"]
    other = pd.read_csv(tmp_path / "study" / "results.csv").iloc[0]
    used = one[
        [8 <= hour < 18 for hour in pd.to_datetime(pd.read_csv(tmp_path / "run" / "temperatures.csv")["time"]).dt.hour]
    ]
    assert other["operative_max_c"] == pytest.approx(used.max(), rel=1e-5)
    da = pd.read_csv(tmp_path / "run" / "room_metrics.csv")["da300"].iloc[0]
    assert other["da300"] == pytest.approx(da, rel=1e-5)
    assert "Window W1: W1" in other["fenestration"] and "Window W2: W2" in other["fenestration"]


def test_a_change_of_a_file_that_the_model_names_changes_the_years_key(tmp_path) -> None:
    from scenes.year_of_glare.options import YearOptions
    from scenes.year_of_glare.year import read_year

    file, path = tmp_path / "pane.xml", tmp_path / "room.ifc"
    keys = []
    for share in (0.3, 0.4):
        write_bsdf_xml(BsdfFile({"Visible": grey(share)}, "pane"), file)
        if not path.exists():
            words = ["ifc", "attach", room(path), "--all", "--bsdf", file, "--reference", "-o", path]
            assert run([str(word) for word in words]) == 0
        keys.append(read_year(YearOptions(path, WEATHER)).digest)
    assert keys[0] != keys[1]


def test_exports_write_what_is_known(tmp_path, capsys) -> None:
    path = room(tmp_path / "room.ifc", STATED)
    out = {option: tmp_path / option for option in ("radiance", "mitsuba", "epjson")}
    words = ["export", str(path)]
    for option, place in out.items():
        words += [f"--{option}", str(place)]
    assert run(words) == 0
    assert "from the values stated in room.ifc" in " ".join(capsys.readouterr().out.split())
    with_attached(path, 0.3, u_value=1.1, g_normal=0.4)
    assert run(words) == 0
    model = json.loads(out["epjson"].read_text())
    assert "WindowMaterial:SimpleGlazingSystem" not in model
    (glazing,) = model["Construction:ComplexFenestrationState"].values()
    name = glazing["visible_optical_complex_front_transmittance_matrix_name"]
    values = [entry["value"] for entry in model["Matrix:TwoDimension"][name]["values"]]
    np.testing.assert_allclose(values, grey(0.3).transmission_front.ravel(), rtol=1e-6)
    (matrix,) = out["radiance"].rglob("windows_*.xml")
    passed = read_bsdf_xml(matrix).band("Visible").transmission_front
    np.testing.assert_allclose(passed, grey(0.3).transmission_front, rtol=1e-6)
    (scene,) = out["mitsuba"].rglob("scene.xml")
    assert 'type="klems_bsdf"' in scene.read_text()


def test_the_mitsuba_scene_is_lit_through_its_bsdf(tmp_path, variant) -> None:
    import mitsuba as mi

    import mitsuba_cfs.bsdf.plugin  # noqa: F401

    means = []
    for number, share in enumerate((0.2, 0.4)):
        path = with_attached(room(tmp_path / f"{number}.ifc"), share)
        out = tmp_path / str(number)
        assert run(["export", str(path), "--mitsuba", str(out)]) == 0
        (scene,) = out.rglob("scene.xml")
        means.append(float(np.array(mi.render(mi.load_file(str(scene)), spp=1)).mean()))
    # twice the transmittance, a little more for what the window throws back: 512^2 paths
    assert means[1] == pytest.approx(2 * means[0], rel=0.05)


def test_exports_say_what_is_not_known(tmp_path, capsys) -> None:
    path = room(tmp_path / "room.ifc")
    out = tmp_path / "a.epJSON"
    assert run(["export", str(path), "--epjson", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Window W1: no U is known, 1.3 is written" in said
    assert "Window W1: no g is known, 0.6 is written" in said
    write_text(out, "")
    assert run(["ifc", "attach", str(path), "--all", "--u", "0.9", "-o", str(path)]) == 0
    assert run(["export", str(path), "--epjson", str(out)]) == 0
    (values,) = json.loads(out.read_text())["WindowMaterial:SimpleGlazingSystem"].values()
    assert values["u_factor"] == 0.9


def test_windows_of_one_name_are_counted():
    """Five times "Fenster-002" in a row says nothing; what is left counts windows, not names."""
    assert windows_named(["a"]) == "Window a"
    assert windows_named(["window A", "Window B"]) == "Window A, Window B"
    assert windows_named(["a", "b", "a", "a"]) == "Windows a (3), b"
    names = ["n", "n", *"abcdefghij", "i", "j"]
    assert windows_named(names).startswith("Windows n (2), a, b")
    listed = windows_named(names).partition(" and ")
    shown = len(listed[0].split(", ")) + 1  # "n" stands for two
    assert listed[2] == f"{len(names) - shown} more"


def tinted_honeybee(folder: Path) -> Path:
    """The two rooms with a tinted pane in the office, U 1.1 and g 0.5 by its construction."""
    model = two_rooms()
    model["properties"]["radiance"]["modifiers"].append(
        {"type": "Glass", "identifier": "tinted", **{f"{c}_transmissivity": 0.1745 for c in "rgb"}}
    )
    window = model["rooms"][0]["faces"][0]["apertures"][0]
    window["properties"]["radiance"] = {"modifier": "tinted"}
    return write(model, folder)


def test_a_tinted_pane_of_a_honeybee_model_falls_with_the_angle_as_fresnel_says(tmp_path) -> None:
    """By hand: through tinted glass the way is longer askew; Radiance's `glass`, n = 1.52."""
    path = tinted_honeybee(tmp_path)
    windows = read_building_file(path).space("Office").windows
    (system,) = {id(s[0]): s[0] for s in fill_windows(windows, WindowOverrides(), path).values()}.values()
    assert (system.u_value, system.g_value) == (1.1, 0.5)
    for degrees in (0.0, 40.0, 60.0, 75.0):
        theta = np.radians(degrees)
        inner = np.arcsin(np.sin(theta) / 1.52)
        inside = 0.1745 ** (1 / np.cos(inner))
        rs = (np.sin(theta - inner) / np.sin(theta + inner)) ** 2 if degrees else (0.52 / 2.52) ** 2
        rp = (np.tan(theta - inner) / np.tan(theta + inner)) ** 2 if degrees else rs
        passed = np.mean([(1 - r) ** 2 * inside / (1 - (r * inside) ** 2) for r in (rs, rp)])
        assert system.angular.transmitted(theta) == pytest.approx(passed, rel=0.01)


def test_u_and_g_given_for_a_radiance_scene_make_its_solar_transmittance(tmp_path) -> None:
    """As for every stated glazing; g may lie below the visible transmittance (coated glass)."""
    scene = REPOSITORY / "docs/tutorials/office.rad"
    windows = read_building_file(scene).spaces[0].windows
    given = WindowOverrides(u_value=1.1, g_value=0.4)
    (system,) = {id(s[0]): s[0] for s in fill_windows(windows, given, scene).values()}.values()
    light = system.visible.direct_hemispherical(system.visible.transmission_front)[0]
    sun = system.solar.direct_hemispherical(system.solar.transmission_front)[0]
    assert sun == pytest.approx(solar_transmittance(1.1, 0.4), rel=1e-3) and sun < 0.4 < light
    assert system.name == "glazing, U 1.1, g 0.4, visible transmittance 0.799"
    twin = replace(windows[0], guid="twin", glass=PlainGlass(((0.8701, 1.52),)), visible_transmittance=0.79868)
    names = [one[0].name for one in fill_windows([windows[0], twin], given, scene).values()]
    assert len(set(names)) == 2  # values that differ beyond three digits
    alone = fill_windows(windows, WindowOverrides(), scene)[windows[0].guid][0]
    assert alone.solar is alone.visible and any("Solar band" in note for note in alone.notes)


@pytest.mark.parametrize("name", list(GENERIC_GLAZINGS))
def test_a_generic_glazing_fills_windows_whose_file_states_nothing(tmp_path, name) -> None:
    path = tmp_path / "room.ifc"
    box_room("IFC4").write(str(path))
    windows = read_ifc(path).windows
    with pytest.raises(DataError, match="--glazing"):
        fill_windows(windows, WindowOverrides(), path)
    states = fill_windows(windows, WindowOverrides(glazing=name), path)
    (system,) = next(iter(states.values()))
    generic = GENERIC_GLAZINGS[name]
    assert (system.u_value, system.g_value) == (generic.u_value, generic.g_value)
    assert normal_transmittance(system.visible) == pytest.approx(generic.visible, abs=2e-3)
    heat = checked_system(system, path)  # U, g and transmittance go together
    assert float(heat.g_value[0]) == pytest.approx(generic.g_value, abs=1e-6)
    assert any(name in str(note) for note in system.notes)
    assert system.source == f"the values of {name}, as room.ifc states none"


def test_a_file_that_states_one_value_and_the_reference_glazing_are_both_named(tmp_path) -> None:
    path = room(tmp_path / "room.ifc", {GLAZING: {"VisibleLightTransmittance": 0.7}})
    overrides = WindowOverrides(glazing="double low-e")
    (system,) = next(iter(fill_windows(read_ifc(path).windows, overrides, path).values()))
    assert normal_transmittance(system.visible) == pytest.approx(0.7, abs=2e-3) and system.u_value == 1.2
    assumed = "double low-e, assumed where the file states no value"
    assert system.source == f"room.ifc (visible transmittance) and {assumed} (U, g, solar transmittance)"
    given = replace(overrides, u_value=1.5)
    (system,) = next(iter(fill_windows(read_ifc(path).windows, given, path).values()))
    assert (
        system.source
        == f"the given values (U), room.ifc (visible transmittance) and {assumed} (g, solar transmittance)"
    )


def test_a_visible_transmittance_of_the_user_fills_windows_of_a_light_only_command(tmp_path) -> None:
    path = tmp_path / "room.ifc"
    box_room("IFC4").write(str(path))
    overrides = WindowOverrides(visible=0.55, light_only=True)
    (system,) = next(iter(fill_windows(read_ifc(path).windows, overrides, path).values()))
    assert normal_transmittance(system.visible) == pytest.approx(0.55, abs=2e-3)


def test_an_hbjson_without_glazing_has_the_default_pane_of_honeybee(tmp_path) -> None:
    model = two_rooms()
    model["properties"].pop("energy", None)
    model["properties"].pop("radiance", None)
    for one in model["rooms"]:
        for face in one["faces"]:
            for aperture in face.get("apertures", ()):
                aperture["properties"] = {"type": "AperturePropertiesAbridged"}
    path = write(model, tmp_path)
    (system, *_) = {
        id(s): s for (s,) in fill_windows(read_building_file(path).windows, WindowOverrides(), path).values()
    }.values()
    assert normal_transmittance(system.visible) == pytest.approx(0.64, abs=2e-3)
    assert any("honeybee's default pane" in str(note) for note in system.notes)
    assert system.source.startswith("the values of honeybee's default pane, as ")


def test_the_generic_glazings_are_the_reference_glazings_of_en_14501() -> None:
    generic = [(g.u_value, g.g_value, g.solar) for g in GENERIC_GLAZINGS.values()]
    reference = [(g.u_value, g.g_value, g.transmittance) for g in REFERENCE_GLAZINGS.values()]
    assert generic[:3] == reference[1:]
