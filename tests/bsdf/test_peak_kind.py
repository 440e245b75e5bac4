"""Whether a transmission peak passes straight on: by the data, by the user, and the error of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bim.building_file import read_building_file
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.evaluate import (
    HIDDEN,
    SPILL,
    UNRESOLVED,
    bsdf_values,
    direct_hemispherical,
    peak_spill,
    through_peak,
    tree_peak,
)
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.lobe import NARROWEST, lobe_tree
from mitsuba_cfs.bsdf.tensor_merge import merged_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf, disk_to_square
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.indices import contrast_term, daylight_glare_probability
from mitsuba_cfs.glare.sun_disc import spread_sun_dgp
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from scenes.fenestration.peaks import lobe_effect, lobe_effect_on_sensors, lobe_notes, peak_note
from scenes.fenestration.resolver import fill_windows
from scenes.fenestration.systems import FenestrationSystem, WindowOverrides, read_system, system_of, with_see_through
from scenes.head import system_notes
from scenes.input_files import overrides_of, peak_share
from scenes.input_options import InputOptions
from scenes.room.operation import read_operation

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorials" / "office.rad"
OMEGA = KLEMS_FULL.projected_solid_angles()
PASSED = 0.3


def lobe(width: float, samples: int = 400) -> np.ndarray:
    """Klems block [K, K] of a Gaussian lobe about the directions at the patches' middles."""
    sides = np.sqrt((np.arange(samples) + 0.5) / samples)
    r, turn = np.meshgrid(np.sqrt(-np.log(1 - sides**2 * (1 - 1e-6))), np.arange(48), indexing="ij")
    r, azimuth = (width * r).ravel(), (2 * np.pi * turn / 48).ravel()
    block = np.zeros((KLEMS_FULL.size, KLEMS_FULL.size))
    for k, way in enumerate(KLEMS_FULL.outgoing_directions()):
        side = np.cross(way, [0, 1, 0] if abs(way[1]) < 0.9 else [1, 0, 0])
        side /= np.linalg.norm(side)
        out = way + r[:, None] * (np.cos(azimuth)[:, None] * side + np.sin(azimuth)[:, None] * np.cross(way, side))
        out = out[out[:, 2] * way[2] > 0]
        out /= np.linalg.norm(out, axis=1)[:, None]
        nearest = np.argmax(out @ KLEMS_FULL.outgoing_directions().T, axis=1)
        block[:, k] = np.bincount(nearest, minlength=KLEMS_FULL.size) * PASSED / len(r) / OMEGA
    return block


def system(block: np.ndarray, tmp_path, name: str = "shade"):
    bsdf = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block)
    path = tmp_path / f"{name}.xml"
    return system_of({"Visible": bsdf, "Solar": bsdf}, name, path=path, file=path)


def test_a_lobe_spills_into_its_neighbours_and_a_beam_does_not():
    beam = np.diag(PASSED / OMEGA) + 0.02
    assert peak_spill(beam, KLEMS_FULL) == pytest.approx(0, abs=1e-12)
    assert through_peak(beam, KLEMS_FULL).transmittance[0] == pytest.approx(PASSED, rel=1e-9)
    narrow, wide = (lobe(width) + 0.02 for width in (0.02, 0.1))
    assert peak_spill(narrow, KLEMS_FULL) < SPILL < peak_spill(wide, KLEMS_FULL)
    assert not through_peak(wide, KLEMS_FULL).transmittance.any()
    forced = through_peak(wide, KLEMS_FULL, 1.0)
    assert forced.transmittance[0] > 0.1
    half = through_peak(wide, KLEMS_FULL, 0.5)
    np.testing.assert_allclose(half.transmittance, forced.transmittance / 2)
    np.testing.assert_allclose(np.diag(half.transmittance / OMEGA) + half.scattered, wide)


@pytest.mark.parametrize("width", [0.02, HIDDEN, 0.1])
def test_the_sun_behind_a_lobe_lowers_dgp_by_no_more_than_stated(width):
    passed, Ev = 0.05 * 80e3, 4200.0
    glare = [
        daylight_glare_probability(Ev, contrast_term(passed / omega, omega, 1.0))
        for omega in (SUN_SOLID_ANGLE, 2 * np.pi * width**2)
    ]
    assert 0 < glare[0] - glare[1] < -spread_sun_dgp(width) < glare[0] - glare[1] + 0.03
    assert spread_sun_dgp(0.0) == 0


@pytest.mark.parametrize("width", [NARROWEST, 0.1, 0.12, 0.2])
def test_a_lobe_of_a_tree_is_no_beam_and_follows_its_formula(width):
    """`trans` of Radiance, integrated by its tree: the flux, and the lobe at 40 degrees."""
    tree = lobe_tree(width, lambda t: 0.3 * np.cos(t), lambda t: 0.1 + 0 * t)
    bsdf = TensorTreeBsdf(tree, tree)
    assert not tree_peak(tree, 0.0)[1].any()
    leaf = np.sqrt(np.pi) / (1 << tree.depth)
    assert width < UNRESOLVED * leaf or not tree_peak(tree)[1][-3:].any()  # near normal incidence
    theta = np.radians(40.0)
    incident = np.array([[np.sin(theta), 0.0, np.cos(theta)]])
    flux = direct_hemispherical(bsdf, "transmission_front", incident)
    assert flux[0] == pytest.approx(0.3 * np.cos(theta) + 0.1, rel=0.02)
    for turn, within in ((0.0, 0.2), (0.7 * width, 0.4)):
        out = -np.array([[np.sin(theta + turn), 0.0, np.cos(theta + turn)]])
        lobe = np.exp(-(2 - 2 * np.cos(turn)) / width**2) / (np.pi * width**2)
        known = 0.3 * np.cos(theta) * lobe / np.sqrt(np.cos(theta) * np.cos(theta + turn))
        assert bsdf_values(bsdf, incident, out)[0] == pytest.approx(known + 0.1 / np.pi, rel=within)
    with pytest.raises(ValueError, match="at least"):
        lobe_tree(NARROWEST / 2, np.cos, np.cos)


def test_a_tree_whose_peak_the_user_calls_a_lobe_has_no_beam(tmp_path):
    grid = np.full((16, 16, 16), 0.1)
    for i in range(8):
        sine = 1 - 2 * (i + 0.5) / 16
        at = (disk_to_square(np.array([[sine, 1e-6]]))[0] * 16).astype(int)
        grid[i, at[0], at[1]] += 20.0
    tree = merged_tree(grid)
    bsdf = TensorTreeBsdf(tree, tree)
    path = tmp_path / "tree.xml"
    shade = system_of({"Visible": bsdf, "Solar": bsdf}, "tree", path=path, file=path)
    notes = " ".join(system_notes([shade], light_only=True))
    assert tree_peak(tree)[1].any() and "lobe of less than" in notes
    changed = with_see_through(shade, 0.0)
    assert not tree_peak(tree, changed.tree.see_through)[1].any()
    assert changed.visible.see_through == 0.0
    whole = [s.visible.direct_hemispherical(s.visible.transmission_front) for s in (shade, changed)]
    np.testing.assert_allclose(*whole, rtol=0.02)


def test_the_user_says_what_a_peak_is(tmp_path):
    beam = system(np.diag(PASSED / OMEGA) + 0.05, tmp_path)
    (note,) = system_notes([beam], light_only=True)
    assert "do not show" in note and "--see-through shade.xml=lobe" in note and "0.22" in note
    for text, share in (("a/shade.xml=lobe", 0.0), ("shade=0.25", 0.25)):
        windows = [type("W", (), {"guid": "w", "name": "w"})()]
        overrides = overrides_of(InputOptions(None, None, see_through=(text,)), beam)
        ((changed,),) = fill_windows(windows, overrides, None).values()
        assert changed.visible.see_through == share
        (note,) = system_notes([changed], light_only=True)
        assert f"{100 * share:.0f} % of the transmission peak" in note
    with pytest.raises(DataError, match=r"no system is .other\.xml.; there are shade\.xml"):
        fill_windows(windows, WindowOverrides((beam,), see_through=(("other.xml", 1.0),)), None)


@pytest.mark.parametrize(("text", "share"), [('"lobe"', 0.0), ('"specular"', 1.0), ("0.25", 0.25)])
def test_a_table_or_the_file_beside_a_bsdf_says_what_a_peak_is(tmp_path, text, share):
    path = tmp_path / "shade.xml"
    bsdf = system(np.diag(PASSED / OMEGA) + 0.05, tmp_path).visible
    write_bsdf_xml(BsdfFile({"Visible": bsdf, "Solar": bsdf}), path)
    (tmp_path / "study.toml").write_text(f'[[system]]\nbsdf = "shade.xml"\nsee_through = {text}\n')
    (state,) = read_operation(tmp_path / "study.toml").systems
    assert state.visible.see_through == share
    path.with_suffix(".toml").write_text(f"see_through = {text}\n")
    assert read_system(path).visible.see_through == share
    assert read_system(path, see_through=0.5).visible.see_through == 0.5


@pytest.mark.parametrize("text", ["shade.xml", "=lobe", "shade.xml=sharp", "shade.xml=1.5"])
def test_another_word_for_a_peak_is_refused(text):
    with pytest.raises(DataError, match="--see-through: expected FILE=specular"):
        peak_share(text)


def test_the_head_names_glass_and_lobes(tmp_path):
    (note,) = system_notes([system(np.diag(PASSED / OMEGA), tmp_path)], light_only=True)
    assert "is specular" in note
    (note,) = system_notes([system(lobe(0.1) + 0.02, tmp_path)], light_only=True)
    assert "is a lobe" in note and "--see-through shade.xml=specular" in note


def test_the_user_says_what_the_peak_of_a_bsdf_between_panes_is(tmp_path):
    """By the name of its file, by the name of the system, or in the file's table."""
    write_bsdf_xml(
        BsdfFile({"Visible": KlemsBsdf(KLEMS_FULL, KLEMS_FULL, np.diag(PASSED / OMEGA) + 0.05)}), tmp_path / "shade.xml"
    )
    scene = tmp_path / "scene.rad"
    shade = "void BSDF shade\n6 0 shade.xml 0 0 1 .\n0\n0\n\nshade polygon sheet\n0\n0\n12 "
    corners = "0.5 -0.1 0.8  3.5 -0.1 0.8  3.5 -0.1 2.6  0.5 -0.1 2.6\n"
    scene.write_text(TUTORIAL.read_text() + shade + corners)
    building = read_building_file(scene)

    def filled(*see_through: tuple[str, float]) -> FenestrationSystem:
        overrides = WindowOverrides(see_through=see_through, light_only=True)
        ((system,),) = fill_windows(building.windows, overrides, scene).values()
        return system

    (note,) = peak_note(filled())
    assert "do not show" in note and "--see-through shade.xml=lobe" in note
    for name in ("shade.xml", "glazing"):
        changed = filled((name, 0.0))
        assert changed.visible.see_through == 0.0 and "0 % of the" in peak_note(changed)[0]
    (tmp_path / "shade.toml").write_text('see_through = "lobe"\n')
    assert filled().visible.see_through == 0.0
    assert filled(("shade.xml", 0.5)).visible.see_through == 0.5
    assert filled(("shade.xml", 0.4), ("glazing", 0.5)).visible.see_through == 0.5  # of the whole
    with pytest.raises(DataError, match=r"no system is .other\.xml.; there are shade\.xml"):
        filled(("other.xml", 1.0))


def test_effects_that_cannot_be_told_apart_are_not_stated_as_two_equal_figures() -> None:
    dgp, light = np.array([0.995, 0.31]), np.array([900.0, 400.0])
    same = lobe_effect((dgp, light), (dgp + 4e-4, light * 1.0004)) | lobe_effect_on_sensors(light[None], light[None])
    glare, sensors = lobe_notes([same])
    assert "DGP differs by less than 0.001, the illuminance at the eye by less than 0.1 %" in glare
    assert "by less than 0.1 %" in sensors
    glare, sensors = lobe_notes([same, lobe_effect((dgp, light), (dgp - 0.01, light * 0.9))])
    assert "DGP is 0.985 instead of 0.995" in glare and "-10.0 to -10.0 %" in glare
    (sensors,) = lobe_notes([lobe_effect_on_sensors(light[None], light[None] * 1.02)])
    assert "+2.0 to +2.0 %" in sensors
