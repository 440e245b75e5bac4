"""`cfs bsdf`: what it prints for good files, and its errors for bad ones."""

from __future__ import annotations

from dataclasses import replace

import bsdf_radiance as radiance
import numpy as np
import pytest
from click.testing import CliRunner

from bim.radiance.cell import read_radiance_layer
from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER, KlemsBsdf
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.spectra.detectors import NANOMETRES, visible_mean
from scenes.commands.bsdf import command
from scenes.fenestration.thermal_file import SpectralTable
from tests.bsdf.radiance_cells import write_radiance
from tests.conftest import OWN_BLIND

POLYGON = " a polygon p 0 0 9 0 0 0 1 0 0 0 1 0"


def run(*arguments: object, text: str | None = None):
    """Result of `cfs bsdf ...`; errors come through."""
    return CliRunner().invoke(command, [str(a) for a in arguments], input=text, catch_exceptions=False)


@pytest.fixture
def blind(bsdf_file):
    return bsdf_file(OWN_BLIND)


@pytest.fixture
def dummy_back(tmp_path):
    flat = np.full((41, 41), 0.4 / np.pi)
    system = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, flat, 0 * flat, flat, 2 * flat)
    path = tmp_path / "dummy.xml"
    write_bsdf_xml(BsdfFile({"Visible": system}), path)
    return path


@pytest.mark.peer
def test_eval_answers_in_the_frame_of_radiance(blind):
    incident, outgoing = radiance.random_directions(200, seed=11)
    angles = np.concatenate([radiance.angles_deg(incident), radiance.angles_deg(outgoing)], -1)
    lines = [" ".join(f"{angle:.6f}" for angle in row) for row in angles]
    answer = run("eval", blind, "-", text="\n".join(lines) + "\n").stdout.splitlines()
    assert [line.rsplit(" ", 1)[0] for line in answer] == lines
    ours = np.array([float(line.rsplit(" ", 1)[1]) for line in answer])
    theirs = radiance.query(blind, incident, outgoing)
    np.testing.assert_allclose(ours, theirs, rtol=radiance.LARGEST_FACTOR)
    options = ["--incident", *angles[0, :2], "--outgoing", *angles[0, 2:]]
    assert float(run("eval", blind, *options).stdout) == pytest.approx(ours[0], rel=1e-6)


def test_eval_of_nothing_and_of_nonsense(blind):
    assert run("eval", blind, "-", text="").stdout.strip() == ""
    with pytest.raises(DataError, match="line 2: expected four angles"):
        run("eval", blind, "-", text="1 2 3 4\n1 2 x 4\n")
    with pytest.raises(DataError, match="no Solar band"):
        run("eval", blind, "--band", "Solar", "--incident", 1, 2, "--outgoing", 3, 4)
    assert run("eval", blind).exit_code == 2


def test_info_lists_bands_and_angles(real_data):
    path = real_data / "bsdf/klems_full/blinds_20deg_noGlazing_Klems.xml"
    text = run("info", path).stdout
    assert "LBNL/Klems Full, 145 x 145" in text and "thickness: 65.7 mm" in text
    normal = next(line for line in text.splitlines() if "normal" in line).split()
    assert normal[2:] == ["0.6477", "0.1225", "0.6623", "0.0980"]  # the file inventory's figures


def test_info_of_an_even_sheet(shade):
    """Rows of normal incidence: tau and rho of the front, then of the back."""
    text = run("info", shade).stdout
    normal = next(line for line in text.splitlines() if "normal" in line).split()
    assert normal[2:] == ["0.1000", "0.5000", "0.1000", "0.5000"]
    # as from all directions of an angle: one row for it, and one for diffuse light
    assert text.count("  all  ") == 8 * text.count("direct-hemispherical")
    diffuse = next(line for line in text.splitlines() if "diffuse" in line).split()
    assert diffuse[1:] == ["0.1000", "0.5000", "0.1000", "0.5000"]


def test_info_parts_the_directions_of_a_blind(blind):
    """A venetian blind transmits light from the sky and from the ground unlike."""
    rows = [line.split()[:2] for line in run("info", blind).stdout.splitlines()]
    assert ["40", "sky"] in rows and ["40", "ground"] in rows and ["40", "all"] not in rows


def test_a_combination_says_what_its_layers_lack(tmp_path, shade):
    """A layer without a Solar band takes it from the system; one without reflection is black."""
    bands = {"Visible": read_bsdf_xml(shade).band("Visible")}
    dark = BsdfFile({"Visible": replace(bands["Visible"], reflection_front=None)}, name="dark")
    both = BsdfFile({"Visible": bands["Visible"], "Solar": bands["Visible"]}, name="both")
    for file in (dark, both):
        write_bsdf_xml(file, tmp_path / f"{file.name}.xml")
    text = run("combine", tmp_path / "both.xml", tmp_path / "dark.xml", "--out", tmp_path / "system.xml").stdout
    assert "warning: dark.xml: no Solar band, so the system has none" in text
    assert "warning: dark.xml: Visible reflection front is absent" in text
    assert "state u_value, g_value and shading_position in system.toml" in text
    sound = run("combine", tmp_path / "both.xml", tmp_path / "both.xml", "--out", tmp_path / "two.xml").stdout
    assert "warning" not in sound


def test_a_missing_band_is_stated_wherever_its_values_are_printed(tmp_path, dummy_back):
    """tau_e and g_tot of a file with a Visible band alone are those of light."""
    assert "no Solar band -> results use the Visible band instead" in run("info", dummy_back).stdout
    flat = np.full((145, 145), 0.3 / np.pi)
    shade = tmp_path / "shade.xml"
    write_bsdf_xml(BsdfFile({"Visible": KlemsBsdf(KLEMS_FULL, KLEMS_FULL, *4 * [flat])}), shade)
    alone = run("thermal", shade, "--place", "external", "--glazing", "C").stdout
    shade.with_suffix(".toml").write_text("u_value = 1.3\ng_value = 0.4\n")
    for text in (alone, run("thermal", shade).stdout):
        assert "tau_e" in text and "shade has no Solar band; its Visible band is used" in text


def test_check_finds_what_is_planted(dummy_back):
    text = run("check", dummy_back)  # the back reflects 0.8 and, reversed, transmits 0.4
    assert "transmission back: transmits nothing" in text.stdout
    assert "no Solar band" in text.stdout
    assert "the sun's 0.533 degree disc" in text.stdout


def test_check_forbids_a_file_that_gains_energy(real_data):
    with pytest.raises(DataError, match="forbid"):
        run("check", real_data / "bsdf/tensortree/radiance_testBSDF.xml")


def test_check_sees_front_and_back_that_do_not_fit(real_data):
    text = run("check", real_data / "bsdf/klems_full/SquareSlat_genBSDF.xml").stdout
    assert "differs from transmission back reversed by 70 %" in text


@pytest.mark.parametrize("name", [OWN_BLIND, "tensortree/blinds_20deg_t45.xml"])
def test_plot_writes_a_picture(bsdf_file, tmp_path, name):
    out = tmp_path / "plot.png"
    run("plot", bsdf_file(name), "--incident", 140, 90, "--out", out)
    assert out.read_bytes().startswith(b"\x89PNG") and out.stat().st_size > 20_000


def test_a_picture_of_no_known_kind_is_refused(dummy_back, tmp_path):
    answer = run("plot", dummy_back, "--incident", 140, 90, "--out", tmp_path / "plot.xyz")
    assert answer.exit_code == 2 and "expected a file name that ends in .png" in answer.output


@pytest.mark.parametrize(
    "options, message",
    [
        ("--depth-mm -80 --spacing-mm 72 --visible 0.5", "--depth-mm"),
        ("--depth-mm 80 --spacing-mm 72 --visible 1.5", "--visible"),
        ("--depth-mm 80 --spacing-mm 72 --visible 0.5 --tilt-deg nan", "finite"),
        ("--depth-mm 80 --spacing-mm 72 --visible 0.5 --paths 0", "--paths"),
        ("--depth-mm 80 --spacing-mm 72 --visible 0.5 --cull 1", "--cull"),
        ("--depth-mm 80 --spacing-mm 72 --visible 0.5 --radius-mm 30", "at least half the depth"),
        ("--shape perforated --spacing-mm 5 --visible 0.5 --openness 0.9", "pi / 4"),
        ("--shape woven --spacing-mm 5 --visible 0.5 --openness 1", "below 1"),
        ("--shape prism --spacing-mm 5 --index 0.5", "--index"),
        ("--shape venetian --spacing-mm 72 --visible 0.5", "needs --depth-mm"),
    ],
)
def test_generate_refuses_what_cannot_be(tmp_path, options, message):
    answer = run("generate", *options.split(), "--out", tmp_path / "x.xml")
    assert answer.exit_code == 2 and message in answer.output
    assert "Traceback" not in answer.output and not (tmp_path / "x.xml").exists()


def test_generate_wants_a_folder_to_write_to(tmp_path):
    options = "--depth-mm 80 --spacing-mm 72 --visible 0.5".split()
    with pytest.raises(DataError, match="no such folder"):
        run("generate", *options, "--out", tmp_path / "no" / "x.xml")


def test_generate_writes_a_file_that_reads(variant, tmp_path):
    out = tmp_path / "blind.xml"
    options = "--depth-mm 80 --spacing-mm 72 --tilt-deg 30 --visible 0.6 --solar 0.5".split()
    text = run("generate", *options, "--basis", "quarter", "--paths", 512, "--out", out).output
    assert "standard error" in text
    file = read_bsdf_xml(out)
    visible, solar = (
        file.band(band).direct_hemispherical(file.band(band).reflection_front) for band in ("Visible", "Solar")
    )
    assert (visible > solar).all()
    assert file.thickness == pytest.approx(0.08 * np.cos(np.radians(30)))


def test_coloured_slats_pass_in_each_band_what_slats_of_that_reflectance_pass(variant, tmp_path):
    options = "--depth-mm 80 --spacing-mm 72 --tilt-deg 45 --paths 1024".split()
    (tmp_path / "paint.csv").write_text("wavelength_nm,reflectance\n380,0.1\n560,0.1\n620,0.7\n780,0.7\n")
    out = tmp_path / "red.xml"
    text = run("generate", *options, "--spectrum", tmp_path / "paint.csv", "--out", out).output
    assert 'slats = "red_slats.json"' in text
    slats = SpectralTable(slats=tmp_path / "red_slats.json").factor().slats
    area, grey = KLEMS_FULL.projected_solid_angles(), tmp_path / "grey.xml"
    visible = read_bsdf_xml(out).band("Visible").transmission_front
    powers = slats.reflectance ** (1 + np.arange(len(slats.shares)))[:, None]
    powers /= visible_mean(powers)[:, None]
    for nm, reflectance in ((450, 0.1), (700, 0.7)):
        run("generate", *options, "--visible", reflectance, "--out", grey)
        passed = read_bsdf_xml(grey).band("Visible").transmission_front
        own = visible * (1 + np.tensordot(powers[:, nm - 380] - 1, slats.shares, 1))
        # the same paths: rounding of the file, and the polynomial; by direction, and all of them
        np.testing.assert_allclose(own, passed, atol=2e-3 * passed.max())
        np.testing.assert_allclose(area @ own, area @ passed, rtol=2e-3, atol=1e-3)
    # all of them in visible light: more than at the mean reflectance, as light that is reflected twice
    passed = area @ visible
    mean = float(visible_mean(np.interp(NANOMETRES, [560, 620], [0.1, 0.7])))
    run("generate", *options, "--visible", mean, "--out", grey)
    at_mean = area @ read_bsdf_xml(grey).band("Visible").transmission_front
    assert 1.01 < passed.mean() / at_mean.mean() < 1.03
    # what passes between the slats goes straight on
    between = visible * (1 - slats.shares.sum(axis=0))
    assert np.abs(between - np.diag(np.diag(between))).max() < 2e-3 * between.max()
    assert (np.diag(between) * area).max() > 0.3


@pytest.mark.parametrize(
    "options, message",
    [
        ("--sheet-colour red", "expected #rrggbb"),
        ("--sheet-colour #aa3311 --basis quarter", "need --shape"),
        ("--sheet-colour #aa3311 --tensor-tree 3", "need --shape"),
        ("--sheet-colour #aa3311 --shape prism", "need --shape"),
        ("--sheet-colour #aa3311 --spectrum paint.csv", "exclude each other"),
    ],
)
def test_colours_that_cannot_be_are_refused(tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paint.csv").write_text("wavelength_nm,reflectance\n380,0.1\n780,0.7\n")
    answer = run("generate", *"--depth-mm 80 --spacing-mm 72".split(), *options.split(), "--out", "x.xml")
    assert answer.exit_code == 2 and message in answer.output
    assert not (tmp_path / "x.xml").exists()


@pytest.mark.parametrize(
    "options",
    [
        "--shape louvre --depth-mm 80 --spacing-mm 72 --visible 0.5",
        "--shape perforated --openness 0.1 --spacing-mm 5 --thickness-mm 1 --visible 0.5",
        "--shape woven --openness 0.03 --spacing-mm 1 --thickness-mm 0.4 --visible 0.5",
        "--shape prism --index 1.5 --spacing-mm 10 --tilt-deg 30 --thickness-mm 3",
        "--shape pleated --depth-mm 20 --spacing-mm 25 --visible 0.5",
        "--depth-mm 80 --spacing-mm 72 --visible 0.5 --tensor-tree 2",
        "--depth-mm 80 --spacing-mm 72 --visible 0.5 --tensor-tree 2 --isotropic",
    ],
)
def test_every_shape_can_be_generated(variant, tmp_path, options):
    out = tmp_path / "layer.xml"
    run("generate", *options.split(), "--basis", "quarter", "--paths", 256, "--out", out)
    assert set(read_bsdf_xml(out).bands) == {"Visible", "Solar"}
    assert run("check", out).exit_code == 0


def test_a_radiance_scene_is_traced_as_the_same_slats(variant, tmp_path):
    layer = venetian_blind(plastic("grey", 0.5, 0.5), depth=0.08, spacing=0.06, tilt=0.6)
    write_radiance(layer, tmp_path / "cell.rad", 1, 1)
    options = ["--shape", "radiance", "--geometry", tmp_path / "cell.rad", "--period-mm", 80, 60]
    out = tmp_path / "layer.xml"
    run("generate", *options, "--basis", "quarter", "--paths", 8192, "--out", out)
    theirs = read_bsdf_xml(out).band("Visible")
    ours = generate_klems(layer, KLEMS_QUARTER, samples=8192).bsdf[0]
    for name, block in ours.blocks().items():
        share = ours.direct_hemispherical(block)
        found = theirs.direct_hemispherical(getattr(theirs, name))
        np.testing.assert_allclose(found, share, atol=0.012)  # 3 sigma of either


@pytest.mark.parametrize(
    "text, message",
    [
        ("void plastic a 0 0 5 .5 .5 .5 0 0", "has no surface"),
        ("a polygon p 0 0 9 0 0 0 1 0 0 0 1 0", "rad:1: polygon p: its modifier a is not"),
        ("void plastic a 0 0 5 .5 .5 .5 0", "rad:1: .*its numbers"),
        ("void plastic a 0 0 5 2 2 2 0 0" + POLYGON, "rad:1: .*more than it gets"),
        ("void trans a 0 0 7 .5 .5 .5 0 .1 .5 .5" + POLYGON, "rad:1: .*lobe of roughness 0.1"),
        ("void dielectric a 0 0 5 .9 .9 .9 1.5 0" + POLYGON, "rad:1: .*only clear ones"),
        ("void BSDF a 6 0 x.xml 0 0 1 . 0 0" + POLYGON, "rad:1: .*BSDF is not traced"),
        ("!gensky 6 21 12", "rad:1: .*gensky"),
        ("void", "rad:1: no Radiance scene"),
    ],
)
def test_radiance_scenes_that_do_not_fit_give_one_line(tmp_path, text, message):
    (tmp_path / "cell.rad").write_text(text + "\n")
    with pytest.raises(DataError, match=message):
        read_radiance_layer(tmp_path / "cell.rad", (1.0, 1.0))


def test_generate_says_what_it_needs():
    result = CliRunner().invoke(command, ["generate", "--shape", "woven", "--out", "x.xml"])
    assert result.exit_code == 2 and "--spacing-mm" in result.output
