"""Goniophotometer files: values, symmetry and patches against what they were made of; Radiance."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER
from mitsuba_cfs.bsdf.measured_file import read_measurement
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf, square_to_disk
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes import cli
from tests.bim.bim_fuzz import mutations
from tests.validation.goniophotometer import (
    by_radiance,
    cosine_power,
    even,
    gaussian,
    interpolant,
    measured_files,
    misplaced,
    patch_means,
    unit_vectors,
)

WIDTH = 0.15  # of `gaussian`, on the disk of direction cosines
INNER = np.radians(60)  # lobes of patches farther out reach behind the sample's plane


def linear_loss(step_deg):
    """Share of the light that linear values between steps misplace of a Gaussian lobe.

    Between points a step h apart the mean error is h^2 / 12 of the second derivative; the integral
    of the size of the lobe's Laplacian is 8 / (e width^2) of its light, which is half of all.
    """
    return 0.5 * np.radians(step_deg) ** 2 / 12 * 8 / (np.e * WIDTH**2)


@pytest.mark.parametrize("form", ["BSDF", "DSF"])
def test_the_lobe_comes_back_between_the_measured_directions(tmp_path, form):
    system = interpolant(measured_files(tmp_path, gaussian, form=form))
    assert system.symmetry == "isotropic"
    incident = unit_vectors(np.array([25.0, 130.0]))
    angles = np.array([[25.0, 310.0], [32.0, 310.0], [25.0, 290.0], [60.0, 80.0]])
    outgoing = unit_vectors(angles)
    # in the tree's square: incident (x, -y), outgoing (-x, y)
    found = sum(
        weight * pattern.at((outgoing[:, :2] + incident[:2] - turn @ pattern.incident) @ turn)[0]
        for pattern, weight, turn in system._neighbours(incident[:2])
    )
    np.testing.assert_allclose(found, gaussian(incident, outgoing), rtol=0.06)


@pytest.mark.parametrize(
    ("azimuths", "symmetry"),
    [
        ((0, 90), "quadrilateral"),
        ((0, 90, 180), "bilateral, up and down"),
        ((270, 0, 90), "bilateral, left and right"),
        ((0, 90, 180, 270), "anisotropic"),
    ],
)
def test_the_azimuths_say_the_symmetry_and_shares_lie_linearly_between(tmp_path, azimuths, symmetry):
    # brighter for light from above and below, so that an exchange of axes is seen
    def upright(incident, outgoing):
        return even(incident, outgoing) * (1 + incident[..., 1] ** 2)

    steps = {"incident_step_deg": 20, "outgoing_step_deg": 8}
    paths = measured_files(tmp_path, upright, azimuths_deg=azimuths, **steps)
    system = interpolant(paths)
    assert system.symmetry == symmetry
    shares = np.pi * system.grid(3, points=64)[0].mean(axis=(2, 3))
    rings = np.sin(np.radians(np.arange(0, 81, 20)))
    corner = (np.indices((2, 2)).reshape(2, -1).T + 0.5) / 2
    for square in np.ndindex(8, 8):
        x, y = (square_to_disk((np.array(square) + corner) / 8) * [1, -1]).T
        up = np.arctan2(np.abs(y), np.abs(x)) / (np.pi / 2)  # from 0 at the side to 1 above
        squared = np.interp(np.hypot(x, y), rings, rings**2)
        expected = 0.7 * (1 + up * squared).mean()
        # across a quadrangle of azimuth and radius a triangle is off by a quarter of what the
        # gap of one radius differs from the other's
        assert shares[square] == pytest.approx(expected, abs=0.7 * np.diff(rings**2).max() / 4)


@pytest.mark.parametrize(
    ("basis", "block", "points"),
    [
        (KLEMS_QUARTER, "transmission", 1200),
        pytest.param(KLEMS_QUARTER, "reflection", 1200, marks=pytest.mark.slow),
        pytest.param(KLEMS_FULL, "transmission", 2400, marks=pytest.mark.slow),
    ],
    ids=["quarter", "mirror", "full"],
)
def test_patches_are_means_of_the_lobe_and_half_the_step_is_a_quarter_of_the_error(tmp_path, basis, block, points):
    exact, found = patch_means(gaussian, basis, points=(6, 12)), []
    for step in (8, 4):
        paths = measured_files(tmp_path, gaussian, outgoing_step_deg=step)
        if block == "reflection":  # a mirror's lobe: the same on the disk, on the light's side
            for path in paths:
                mirrored = [_mirrored(line) for line in path.read_text().splitlines()]
                path.write_text("\n".join(mirrored))
        matrix = interpolant(paths, f"{block}_back").matrix(basis, points=points)[0]
        inner = basis.centres()[0] < INNER
        found.append(misplaced(matrix, exact, basis)[inner].max())
        assert found[-1] < linear_loss(step)
    assert found[1] < found[0] / 3


def _mirrored(line):
    """A row of transmission as one of reflection."""
    words = line.split()
    if line.startswith("#") or len(words) != 3:
        return line
    return f"{180 - float(words[0])} {words[1]} {words[2]}"


@pytest.mark.slow
@pytest.mark.parametrize("lobe", [gaussian, cosine_power])
def test_half_the_step_of_incidence_is_a_third_of_the_error(tmp_path, lobe):
    """Or less: a quarter of the interpolation's, beside what the outgoing steps leave."""
    exact, inner = patch_means(lobe, KLEMS_QUARTER), KLEMS_QUARTER.centres()[0] < INNER
    found = []
    for step in (20, 10):
        folder = tmp_path / str(step)
        folder.mkdir()
        paths = measured_files(folder, lobe, outgoing_step_deg=2, incident_step_deg=step)
        matrix = interpolant(paths).matrix(KLEMS_QUARTER)[0]
        found.append(misplaced(matrix, exact, KLEMS_QUARTER)[inner].max())
    assert found[1] < found[0] / 3
    assert found[1] < 0.01


def test_a_tree_has_the_means_of_its_cells(tmp_path):
    cells, step = 8, 4
    paths = measured_files(tmp_path, gaussian, outgoing_step_deg=step)
    grid = interpolant(paths).grid(3, points=600)[0]
    corners = np.indices((cells, cells)).reshape(2, -1).T[:, None]

    def points(count):
        square = (np.indices((count, count)).reshape(2, -1).T + 0.5) / count
        return square_to_disk((corners + square) / cells)

    exact = np.empty((cells**2, cells**2))
    for number, inside in enumerate(points(5)):
        squares = ((points(9)[:, :, None] - inside) ** 2).sum(-1)
        lobe = 0.2 + 0.5 / WIDTH**2 * np.exp(-squares / WIDTH**2)
        exact[number] = lobe.mean(axis=(1, 2)) / np.pi
    off = np.abs(grid.reshape(exact.shape) - exact).sum(axis=1) * np.pi / cells**2
    assert off.max() < linear_loss(step)


def test_the_normal_and_up_place_the_sample_on_the_building(tmp_path):
    path = tmp_path / "one.txt"
    path.write_text("#format: theta phi BSDF\n#incident_angle 30 0\n#upphi 0\n150 90 1\n")
    room, outside = (read_measurement(path, normal=n) for n in ("room", "outside"))
    # the light comes from where up is: from above; on the room's side by the default
    np.testing.assert_allclose(room.incident, [0, 0.5, -np.sqrt(0.75)], atol=1e-12)
    np.testing.assert_allclose(outside.incident, [0, 0.5, np.sqrt(0.75)], atol=1e-12)
    # with up ahead and the normal outdoors, azimuth 90 degrees of the sample is its left
    np.testing.assert_allclose(outside.outgoing[0], [-0.5, 0, -np.sqrt(0.75)], atol=1e-12)


@pytest.mark.parametrize("noise", [0.01, 0.1])
def test_the_noise_is_found(tmp_path, noise):
    system = interpolant(measured_files(tmp_path, even, incident_step_deg=40, noise=noise))
    for pattern in system.patterns:
        relative, error = pattern.noise()
        assert relative == pytest.approx(noise, rel=0.25)
        assert abs(pattern.share[0] - 0.7) < 4 * error + 1e-3 * 0.7


HEAD = "#format: theta phi BSDF\n#incident_angle 30 0\n"


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("150 90 1\n", "format"),
        ("#format: theta phi radiance\n#incident_angle 30 0\n150 90 1\n", "format"),
        ("#format: theta phi BSDF\n150 90 1\n", "intheta"),
        ("#format: theta phi BSDF\n#incident_angle 30\n150 90 1\n", "incident_angle"),
        ("#format: theta phi BSDF\n#incident_angle 190 0\n150 90 1\n", "incident_angle"),
        ("#format: theta phi BSDF\n#incident_angle 90 0\n150 90 1\n", "incident_angle"),
        (HEAD, "rows"),
        (HEAD + "150 90\n", "line 3"),
        (HEAD + "150 90 nan\n", "line 3"),
        (HEAD + "150 90 1\n200 90 1\n", "line 4"),
        (HEAD + "90 0 1\n", "plane"),
        (HEAD + "#upphi north\n150 90 1\n", "upphi"),
        (HEAD + "#colorimetry: CIE-XYZ\n150 90 1\n", "line 4"),
        (HEAD + "150 90 1\n", "one line"),
    ],
)
def test_a_bad_file_is_one_line(tmp_path, capsys, text, where):
    path = tmp_path / "bad.txt"
    path.write_text(text)
    out = tmp_path / "out.xml"
    assert cli.run(["bsdf", "interpolate", str(path), "--out", str(out)]) != 0
    error = capsys.readouterr().err.strip()
    assert where in error and len(error.splitlines()) == 1 and not out.exists()


def test_files_that_are_no_sample_together_are_one_line(tmp_path, capsys):
    rows = "".join(f"{180 - t} {p} 1\n" for t in (10, 40, 70) for p in (0, 90, 180, 270))
    texts = {"y.txt": HEAD + rows, "gone.txt": None}
    texts["xyz.txt"] = HEAD + "#colorimetry: CIE-XYZ\n" + rows.replace(" 1\n", " 1 1 1\n")
    texts["line.txt"] = HEAD.replace("30 0", "30 180") + rows
    for name, text in texts.items():
        if text is not None:
            (tmp_path / name).write_text(text)
    for names, where in (("y xyz", "colorimetry"), ("y line", "azimuths"), ("gone", "gone.txt")):
        paths = [str(tmp_path / f"{name}.txt") for name in names.split()]
        assert cli.run(["bsdf", "interpolate", *paths, "--out", str(tmp_path / "out.xml")]) != 0
        error = capsys.readouterr().err.strip()
        assert where in error and len(error.splitlines()) == 1


def test_a_spoilt_file_is_read_or_refused(tmp_path):
    path, read, refused = tmp_path / "any.txt", 0, 0
    text = HEAD + '#sample_name "any"\n#upphi 90\n150 90 1\n140 80 0.5\n30 0 0.1\n' * 3
    for spoilt in mutations(text.encode(), 300):
        path.write_bytes(spoilt)
        try:
            assert np.isfinite(read_measurement(path).values).all()
            read += 1
        except DataError as error:
            refused += 1
            assert "any.txt" in str(error) and "\n" not in str(error)
    assert read > 20 and refused > 20


def test_the_command_writes_a_tree_and_colours(tmp_path, capsys):
    rows = [f"{180 - t} {p} 0.2 0.25 0.3" for t in range(0, 90, 10) for p in range(0, 360, 30)]
    path = tmp_path / "colours.txt"
    path.write_text(HEAD + "#colorimetry: CIE-XYZ\n" + "\n".join(rows) + "\n")
    out = tmp_path / "tree.xml"
    words = ["bsdf", "interpolate", str(path), "--tensor-tree", "2", "--out", str(out)]
    assert cli.run(words) == 0
    said = capsys.readouterr().out
    assert "transmission back: isotropic" in said and "0.785" in said
    bands = read_bsdf_xml(out).bands
    assert set(bands) == {"CIE-X", "Visible", "CIE-Z"}
    for band, value in zip(("CIE-X", "Visible", "CIE-Z"), (0.2, 0.25, 0.3), strict=True):
        tree = bands[band]
        assert isinstance(tree, TensorTreeBsdf)
        np.testing.assert_allclose(tree.transmission_back.values, value, rtol=1e-4)


def test_a_bsdf_of_more_light_than_it_receives_is_refused(tmp_path, capsys):
    """A measurement in another unit gave a file that scatters 120 %, without a word."""
    out, texts = tmp_path / "out.xml", {}
    for value in (1.2 / np.pi, 1.02 / np.pi):
        rows = [f"{180 - t} {p} {value}\n" for t in range(0, 90, 10) for p in range(0, 360, 30)]
        texts[value] = HEAD + "".join(rows)
    path = tmp_path / "measured.txt"
    for text in texts.values():
        path.write_text(text)
        assert cli.run(["bsdf", "interpolate", str(path), "--out", str(out)]) == 1
        error = capsys.readouterr().err
        assert "measured.txt: Visible: transmission" in error and "of its light" in error
        assert not out.exists()


@pytest.mark.slow
def test_the_commands_patches_are_nearer_to_the_lobe_than_radiances(tmp_path):
    """Of noisy values (5 %).  Judges: the lobe's closed form; pabopto2bsdf with bsdf2klems."""
    paths = measured_files(tmp_path, gaussian, outgoing_step_deg=2, noise=0.05)
    ours = tmp_path / "ours.xml"
    words = ["bsdf", "interpolate", *map(str, paths), "--basis", "quarter", "--out", str(ours)]
    assert cli.run(words) == 0
    exact, omega = patch_means(gaussian, KLEMS_QUARTER), KLEMS_QUARTER.projected_solid_angles()
    inner = KLEMS_QUARTER.centres()[0] < INNER
    matrix = read_bsdf_xml(ours).band("Visible").transmission_back
    theirs = by_radiance(paths, tmp_path)
    off, peer = (misplaced(m, exact, KLEMS_QUARTER)[inner].max() for m in (matrix, theirs))
    share, peers = (np.abs(omega @ m - omega @ exact)[inner].max() for m in (matrix, theirs))
    # an interpolation by steps of 10 degrees of incidence takes 0.009 (the table of the
    # documentation); 5 % on each of about a hundred values of a patch is 0.5 % of its light
    assert off < 0.009 + 0.005 and share < 0.7 * 0.01
    assert off < peer and share < peers
