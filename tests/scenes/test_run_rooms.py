"""The main job on a small box: methods against each other, states, kept matrices."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.bsdf.evaluate import direct_hemispherical
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from scenes.demo import VENETIAN_BLIND
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.room.glare import worst_hours
from scenes.room.operation import check_states, read_operation
from scenes.room.room import compute_room
from scenes.room.shading import signal_of
from scenes.room.windows import in_all_windows, room_windows
from tests.scenes.small_box import BOX, HOURS, ROOM, SMALL, clear

pytestmark = pytest.mark.early


def shut(system: FenestrationSystem) -> FenestrationSystem:
    """A system that reflects as another and lets next to nothing pass."""
    klems = replace(
        system.visible,
        transmission_front=1e-9 * system.visible.transmission_front,
        transmission_back=1e-9 * system.visible.transmission_back,
    )
    return replace(system, visible=klems)


@pytest.fixture(scope="module")
def through_glass(variant, weather, skies, glass) -> np.ndarray:
    """Illuminance [hours, S] by the five-phase method."""
    return light("five-phase", glass, weather, skies)


def light(method: str, system: FenestrationSystem, weather, skies, **more) -> np.ndarray:
    """Illuminance [hours, S] by a method."""
    result = compute_room(
        BOX,
        ROOM,
        in_all_windows(ROOM, system),
        weather,
        replace(SMALL, method=method),
        skies=skies,
        pictures=False,
        **more,
    )
    print(method, result.daylight.relative_error)
    return result.daylight.illuminance[list(HOURS)]


@pytest.mark.parametrize("name", ["milk", "glass"])
def test_five_phase_is_what_paths_find(name, weather, skies, milk, glass, through_glass) -> None:
    """Systems that are even over the Klems patches; paths have 1 to 2 % noise at a sensor."""
    system = {"milk": milk, "glass": glass}[name]
    five = through_glass if name == "glass" else light("five-phase", milk, weather, skies)
    paths = light("point-in-time", system, weather, skies)
    np.testing.assert_allclose(five.mean(axis=1), paths.mean(axis=1), rtol=0.03)


def test_three_phase_blurs_the_sun_through_glass(through_glass, weather, skies, glass) -> None:
    """Sun falls on some sensors and not on others; the three-phase method spreads it."""
    five, three = through_glass, light("three-phase", glass, weather, skies)
    assert five[3].max() / five[3].min() > 3 * three[3].max() / three[3].min()  # low winter sun
    assert five.min() >= 0


def test_kept_matrices_serve_other_systems(through_glass, tmp_path, weather, skies, blind, glass) -> None:
    cache = MatrixCache(tmp_path)
    light("five-phase", blind, weather, skies, cache=cache)
    traced = {path.name for path in tmp_path.iterdir()}
    kept = light("five-phase", glass, weather, skies, cache=cache)
    added = {path.name.rsplit("-", 1)[0] for path in tmp_path.iterdir() if path.name not in traced}
    own = {"direct-sun", "absorption-matrix", "straight-view"}  # by what the system passes
    assert added <= own, "V and D do not depend on the system"
    np.testing.assert_array_equal(kept, through_glass)


def test_a_view_is_kept_as_well(tmp_path, variant, monkeypatch, weather, skies, glass) -> None:
    """The same pictures from the file; a broken file is traced anew."""
    from mitsuba_cfs.methods import phase_matrices

    options = SMALL.changed(picture_hours=("12-19 12",), sensor_samples=1024, patch_samples=1024)

    def seen(cache: MatrixCache | None) -> np.ndarray:
        systems = in_all_windows(ROOM, glass)
        found = compute_room(BOX, ROOM, systems, weather, options, skies=skies, cache=cache)
        return found.glare.pictures[0].luminance

    def not_called(*_, **__) -> None:
        raise AssertionError("the view is traced though it is kept")

    cache = MatrixCache(tmp_path)
    traced = seen(cache)
    (file,) = tmp_path.glob("view-pictures-*.npz")
    assert not list(tmp_path.glob("*.part"))
    with monkeypatch.context() as patch:
        patch.setattr(phase_matrices, "view_matrices", not_called)
        np.testing.assert_array_equal(seen(cache), traced)
    file.write_bytes(file.read_bytes()[:1000])
    np.testing.assert_array_equal(seen(cache), traced)
    assert file.stat().st_size > 1000


@pytest.mark.slow  # quick: test_bands_of_panes.py
def test_windows_with_their_own_systems(variant, weather, skies, blind, glass) -> None:
    """Two windows in one wall, one system each: the light of each alone adds up."""
    both = shoebox(3.0, 4.0, 2.8, windows=(WindowRectangle(0.2, 0.9, 1.2, 1.5), WindowRectangle(1.6, 0.9, 1.2, 1.5)))
    space = both.spaces[0]
    left, right = (window.guid for window in space.windows)
    dark = clear("dark", 1e-9)
    options = SMALL.changed(method="five-phase", sensor_samples=2048)

    def sensors(one: FenestrationSystem, other: FenestrationSystem) -> np.ndarray:
        systems = {left: (one,), right: (other,)}
        found = compute_room(both, space, systems, weather, options, skies=skies, pictures=False)
        assert len(room_windows(space, systems).groups) == 2
        far = np.linalg.norm(found.daylight.points - space.windows[0].centre, axis=1)
        return found.daylight.illuminance.astype(float).sum(axis=0)[np.argsort(far)]

    through_left = sensors(glass, dark)
    assert through_left[0] > 2 * sensors(dark, glass)[0], "the sensor next to the left window"
    # one window shut, it still reflects the room's light as its own system does
    alone = sensors(glass, shut(blind)).sum() + sensors(shut(glass), blind).sum()
    assert sensors(glass, blind).sum() == pytest.approx(alone, rel=1e-4)


OPERATION = """
[[system]]
bsdf = "open.xml"
u_value = 1.1
[[system]]
bsdf = "shut.xml"
u_value = 0.9
[control]
rule = "schedule"
schedule = [{}]
[gains]
lighting_w_m2 = 10.0
[loads]
heating_c = 20.0
cooling_c = 26.0
"""


def operation_file(folder: Path, text: str) -> Path:
    """An operation whose two states are the demo's blind under two names."""
    for name in ("open", "shut"):
        (folder / f"{name}.xml").write_bytes(VENETIAN_BLIND.read_bytes())
    path = folder / "operation.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_states_switch_light_and_heat_together(variant, tmp_path, weather, skies, blind, glass) -> None:
    """Glass in the morning, blind from noon: each hour has the light and the gains of its state."""
    day = ", ".join("0" if hour < 12 else "1" for hour in range(24))
    operation = read_operation(operation_file(tmp_path, OPERATION.format(day)))
    operation = replace(operation, systems=(glass, blind))
    options = SMALL.changed(method="five-phase", sensor_samples=2048)

    def run(*states: FenestrationSystem, operation=None):
        return compute_room(
            BOX, ROOM, in_all_windows(ROOM, *states), weather, options, operation=operation, skies=skies, pictures=False
        )

    opened, shut, switched = run(glass), run(blind), run(glass, blind, operation=operation)
    for hour in HOURS:
        one = opened if hour % 24 < 12 else shut
        np.testing.assert_allclose(switched.daylight.illuminance[hour], one.daylight.illuminance[hour], rtol=1e-5)
        gains = switched.heat.gains.iloc[hour], one.heat.gains.iloc[hour]
        assert gains[0].to_numpy() == pytest.approx(gains[1].to_numpy(), rel=1e-6)
    ran = switched.operation
    assert ran.hours["shading_state"].tolist()[:24] == [0] * 12 + [1] * 12
    air = switched.heat.temperatures["air_c"]
    assert air.min() > 19.5 and air.max() < 26.5
    assert ran.summary["heating_kwh"] > 0 and ran.summary["lighting_kwh"] > 0


BAD_OPERATION = {
    "no TOML": ("[control", "TOML"),
    "unknown table": ("[blinds]\nup = 1", "blinds"),
    "no such file": ('[[system]]\nbsdf = "none.xml"', "none.xml"),
    "crossed set points": ("[loads]\nheating_c = 25\ncooling_c = 22", "heating_c"),
    "unknown rule": ('[control]\nrule = "mood"', "control.rule"),
}


@pytest.mark.parametrize("fault", BAD_OPERATION)
def test_bad_operations_are_named(fault, tmp_path) -> None:
    text, word = BAD_OPERATION[fault]
    with pytest.raises(DataError, match=word) as caught:
        read_operation(operation_file(tmp_path, text))
    assert "operation.toml" in str(caught.value)


def test_states_that_windows_lack_are_named(tmp_path) -> None:
    for text in ("[control]\nstate = 3", '[control]\nrule = "schedule"\nschedule = [0, 1]'):
        operation = read_operation(operation_file(tmp_path, text))
        with pytest.raises(DataError, match="control"):
            check_states(operation, 2)


def test_quantities_that_rules_read(tmp_path) -> None:
    """Nothing else is computed; DGP only where a limit of it is given."""
    for rule, signal in (
        ('"irradiance"', "irradiance"),
        ('"irradiance"\nsensor = "roof"', ""),
        ('"cut-off"', "sun"),
        ('"glare"', "eye"),
        ('"glare"\nlimit_dgp = 0.4', "dgp"),
        ('"schedule"', ""),
    ):
        tables = read_operation(operation_file(tmp_path, f"[control]\nrule = {rule}")).tables
        assert signal_of(tables.control.rule_of(None)) == signal


def test_glare_of_the_year_is_that_of_the_pictures(variant, weather, skies, glass) -> None:
    options = SMALL.changed(annual_glare=True, picture_hours=("06-20 12", "12-19 12"))
    found = compute_room(BOX, ROOM, in_all_windows(ROOM, glass), weather, options, skies=skies)
    year = found.annual_glare["dgp"].to_numpy()
    assert np.flatnonzero(np.isfinite(year)).tolist() == list(HOURS)
    for picture in found.glare.pictures:
        assert year[picture.hour] == pytest.approx(picture.glare["dgp"], abs=1e-6)
    assert worst_hours(found.annual_glare, 0) == []
    assert worst_hours(found.annual_glare, 2) == np.argsort(-np.nan_to_num(year))[:2].tolist()
    with pytest.raises(ValueError, match="annual glare"):
        replace(options, method="point-in-time")


def test_a_tensor_tree_is_taken_for_its_klems_matrix(real_data) -> None:
    path = real_data / "bsdf" / "tensortree" / "pyradiance_room_blindsT3.xml"
    system = read_system(path)
    tree = read_bsdf_xml(path).band("Visible")
    assert system.fine is system.tree and system.solar is system.visible
    towards = KLEMS_FULL.incident_directions()[[0, 20, 60]]
    expected = direct_hemispherical(tree, "transmission_front", towards)
    klems = system.visible
    share = klems.direct_hemispherical(klems.transmission_front)[[0, 20, 60]]
    assert share == pytest.approx(expected, abs=0.02)  # the patch's mean against its middle
