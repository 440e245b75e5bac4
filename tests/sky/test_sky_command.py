"""`cfs sky`: what it writes is what Radiance's programs read and write themselves."""

from __future__ import annotations

import subprocess

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from weather_files import epw_rows, write_epw

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.mtx_io import read_header, read_matrix
from mitsuba_cfs.sky.epw import read_wea
from scenes.commands.sky import command


def cfs_sky(*words):
    """Run the command; its output, or the error it ends with."""
    result = CliRunner().invoke(command, [str(word) for word in words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def epw(tmp_path):
    return write_epw(tmp_path / "a.epw", epw_rows())


@pytest.mark.peer
@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        ((), ()),
        (("-m", "2", "-O", "1", "-u"), ("-m", "2", "-O1", "-u")),
        (("-d", "-r", "20"), ("-d", "-r", "20")),
        (("-s", "-g", "0.4"), ("-s", "-g", ".4", ".4", ".4")),
        (("-5", "-u"), ("-5", "0.533", "-d", "-u")),
    ],
)
def test_matrix_is_that_of_gendaymtx(epw, tmp_path, radiance, ours, theirs):
    """With gendaymtx's own colour of the sky, all three channels agree."""
    out, reference = tmp_path / "sky.smx", tmp_path / "reference.smx"
    color = () if "-5" in ours else ("-c", ".96", "1.004", "1.118")
    found = cfs_sky("matrix", epw, out, *ours, *color, "--sun-model", "radiance")
    assert found.exit_code == 0, found.output
    with open(reference, "wb") as file:
        subprocess.run([radiance / "gendaymtx", "-od", *theirs, epw], stdout=file, check=True)
    values, expected = read_matrix(out), read_matrix(reference)
    assert values.shape == expected.shape
    np.testing.assert_allclose(values, expected, rtol=1e-5, atol=1e-6 * expected.max())  # float32
    assert "patches" in found.output


@pytest.mark.peer
def test_dctimestep_takes_our_sky(epw, tmp_path, radiance):
    out = tmp_path / "sky.smx"
    cfs_sky("matrix", epw, out, "-f", "ascii")
    ones = tmp_path / "dc.mtx"
    ones.write_text("#?RADIANCE\nNROWS=1\nNCOLS=146\nNCOMP=3\nFORMAT=ascii\n\n" + "1 1 1\n" * 146)
    product = subprocess.run([radiance / "dctimestep", "-od", ones, out], capture_output=True, check=True).stdout
    (tmp_path / "e.mtx").write_bytes(product)
    expected = read_matrix(out).sum(axis=0)[:, 0]
    np.testing.assert_allclose(read_matrix(tmp_path / "e.mtx")[0, :, 0], expected, rtol=1e-5)
    with out.open("rb") as file:
        assert any("cfs" in line for line in read_header(file, out).lines)


def test_wea_and_positions(epw, tmp_path):
    cfs_sky("wea", epw, tmp_path / "a.wea")
    weather = read_wea(tmp_path / "a.wea")
    assert weather.direct_normal.max() == 700
    cfs_sky("matrix", tmp_path / "a.wea", tmp_path / "b.smx")  # WEA goes in, too
    cfs_sky("positions", epw, tmp_path / "sun.csv")
    table = pd.read_csv(tmp_path / "sun.csv")
    assert len(table) == 8760
    noon = table[table["middle"].str.endswith("06-21 12:30:00")].iloc[0]
    assert noon["altitude_deg"] == pytest.approx(90 - 48 + 23.4, abs=0.3)
    np.testing.assert_allclose(table["x"] ** 2 + table["y"] ** 2 + table["z"] ** 2, 1, atol=1e-5)


def test_measured_pyranometers(tmp_path):
    """Global and diffuse of a known beam give the beam back; at low sun there is none."""
    rows = ["time,global_horizontal,diffuse_horizontal"]
    rows += [f"2017-06-21 {hour:02d}:30,{500 - 20 * abs(12 - hour)},100" for hour in range(24)]
    table, out = tmp_path / "m.csv", tmp_path / "m.wea"
    table.write_text("\n".join(rows))
    place = ("--latitude", 48, "--longitude", 8, "--timezone", 1)
    assert cfs_sky("measured", table, out, *place).exit_code == 0
    weather = read_wea(out, whole_year=False)
    # noon altitude 65.4 degrees: (500 - 100)/0.909
    assert weather.direct_normal[12] == pytest.approx(440, rel=0.01)
    assert weather.direct_normal[0] == 0 and weather.diffuse_horizontal[0] == 260
    for spoilt, words in (
        ("12:30,x", ("line 2", "global_horizontal")),
        ("12:30,99999", ("line 2", "global_horizontal")),
        ("25:61,10", ("line 2", "time")),
    ):
        table.write_text(rows[0] + f"\n2017-06-21 {spoilt},3\n2017-06-21 13:30,4,3\n")
        with pytest.raises(DataError) as caught:
            cfs_sky("measured", table, out, *place)
        assert all(word in str(caught.value) for word in words)
    table.write_text("time,global_horizontal\n2017-06-21 12:30,4\n")
    with pytest.raises(DataError, match="diffuse_horizontal: missing"):
        cfs_sky("measured", table, out, *place)


def test_labels_of_measured_times(tmp_path):
    """The same measurements, labelled by start, middle or end of the interval."""
    found = []
    for label, first in (("start", "07:00"), ("middle", "07:15"), ("end", "07:30")):
        times = pd.date_range(f"2017-03-21 {first}", periods=20, freq="30min")
        table = pd.DataFrame({"time": times, "global_horizontal": 400.0, "diffuse_horizontal": 150.0})
        table.to_csv(tmp_path / "m.csv", index=False)
        place = ("--latitude", 48, "--longitude", 8, "--timezone", 1)
        cfs_sky("measured", tmp_path / "m.csv", tmp_path / label, *place, "--label", label)
        found.append((tmp_path / label).read_text())
    assert found[0] == found[1] == found[2]
    assert "\n3 21 7.2500 " in found[0]


def test_cie_sky(tmp_path):
    out = tmp_path / "o.smx"
    assert cfs_sky("cie", "overcast", out, "-m", "2", "--horizontal", "5000").exit_code == 0
    values = read_matrix(out)
    assert values.shape == (578, 1, 3)
    assert values[-1, 0, 0] * 179 == pytest.approx(5000 * 9 / (7 * np.pi), rel=2e-3)
    assert cfs_sky("cie", "12", out).exit_code == 0
    assert cfs_sky("cie", "16", out).exit_code != 0


def test_faults(epw, tmp_path):
    out = tmp_path / "x.smx"
    with pytest.raises(DataError, match="cannot be read"):
        cfs_sky("matrix", tmp_path / "nowhere.epw", out)
    with pytest.raises(DataError, match="no illuminance"):
        cfs_sky("matrix", epw, out, "--measured")
    with pytest.raises(DataError, match="no such folder"):
        cfs_sky("matrix", epw, tmp_path / "no" / "x.smx")
    assert cfs_sky("matrix", epw, out, "-m", "3").exit_code == 2
    assert not out.exists()
