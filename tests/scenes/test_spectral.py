"""A run by wavelength: files, spectra of systems, what is said of systems without a spectrum."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from bim.shoebox import shoebox
from mitsuba_cfs.bsdf.spectral_factor import SlatLight, SpectralFactor
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.methods.light import eye_illuminance, illuminance
from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.detectors import NANOMETRES, colour_temperature, daylight_efficacy_ratio, detected, illuminant
from scenes.cli import cfs
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.thermal_file import SpectralTable, StateTable, read_spectrum, write_slat_light
from scenes.fenestration.tilts import tilt_states
from scenes.input_files import read_weather
from scenes.report.spectral_figures import melanopic_against_glare
from scenes.room.light import room_light, turned_eyes
from scenes.room.luminaires import lamp_spectrum, placed_spectrum
from scenes.room.operation import read_operation, read_state
from scenes.room.options import RoomOptions
from scenes.room.room import inputs_of_room
from scenes.room.spectral import _factors, room_spectral
from scenes.room.surface_spectra import SurfaceTable, ground_reflectance, materials, room_reflectance
from scenes.room.windows import in_all_windows
from tests.scenes.test_tilts import family

FEW = {
    "method": "three-phase",
    "sensor_samples": 64,
    "patch_samples": 64,
    "sky_subdivision": 1,
    "sensor_spacing": 2.0,
    "picture_size": 32,
    "picture_count": 1,
    "picture_samples": 1,
}


def amber(path: Path) -> Path:
    """The spectrum of an amber fabric: nothing below 500 nm."""
    path.write_text("wavelength_nm,transmittance\n380,0\n500,0\n520,0.2\n780,0.2\n", "utf-8")
    return path


@pytest.fixture
def blind(tmp_path):
    """The demo's blind, with an amber spectrum in the file beside it."""
    system = tmp_path / "blind.xml"
    system.write_bytes(VENETIAN_BLIND.read_bytes())
    beside = VENETIAN_BLIND.with_suffix(".toml").read_text("utf-8")
    amber(tmp_path / "amber.csv")
    text = f'{beside}\n[spectral]\nshade = "amber.csv"\n'
    system.with_suffix(".toml").write_text(text, "utf-8")
    return system


def test_amber_light_is_hardly_melanopic(blind) -> None:
    building = shoebox()
    space, options = building.spaces[0], RoomOptions.of(spectral=True, channels=9, **FEW)
    systems = in_all_windows(space, read_system(blind))
    room = inputs_of_room(building, space, systems, read_weather(WEATHER), options)
    light, state = room_light(room), np.zeros((8760, 1), dtype=np.int64)
    year = room_spectral(room, light, state, SimpleNamespace(points=light.scene.points))
    # D65 through the fabric; bands of 25 to 35 nm at its edge
    fabric = np.interp(NANOMETRES, [380, 500, 520, 780], [0.0, 0.0, 0.2, 0.2])
    expected = daylight_efficacy_ratio(illuminant("D65") * fabric)
    assert year.summary["melanopic_der"] == pytest.approx(expected, rel=0.1)
    assert year.summary["outdoor_melanopic_der"] == pytest.approx(0.97, abs=0.02)
    assert not year.notes
    lit = year.eye["photopic_lx"] > 10
    temperature, _ = colour_temperature(detected(illuminant("D65") * fabric)[-3:])
    assert year.eye["cct_k"][lit].median() == pytest.approx(float(temperature), rel=0.1)
    assert year.eye["cct_k"][year.eye["photopic_lx"] == 0].isna().all()
    assert year.spectrum.shape == (8760, 9)
    assert year.melanopic.shape == (8760, len(year.sensor_metrics))


@pytest.mark.slow
def test_run_writes_tables_and_names_systems_without_a_spectrum(tmp_path) -> None:
    settings = [f"--set={name}={value}" for name, value in FEW.items() if name != "method"]
    inputs = ["--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND), "--space", "A"]
    options = ["--spectral", "--channels", "3", "--method", "three-phase", "--no-cache"]
    out = ["--no-colour", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(cfs, ["run", str(OFFICE), *inputs, *options, *out, *settings])
    assert result.exit_code == 0, result.output
    table = pd.read_csv(tmp_path / "out" / "melanopic.csv", index_col="time")
    assert len(table) == 8760
    lit = table["photopic_lx"] > 0
    ratio = table["melanopic_edi_lx"] / table["photopic_lx"]
    assert ratio[lit].to_numpy() == pytest.approx(table["melanopic_der"][lit].to_numpy(), rel=1e-4)
    sensors = pd.read_csv(tmp_path / "out" / "melanopic_sensors.csv")
    assert {"x", "y", "z", "melanopic_der", "melanopic_250_percent"} <= set(sensors)
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "its spectrum is not known" in page and "Melanopic light through the year" in page


def test_spectrum_of_panes_and_shade(blind) -> None:
    factor = read_system(blind).spectrum
    assert isinstance(factor, SpectralFactor)
    blue, _, red = factor.of_patches(channels_of(3)).straight[:, 0]
    assert blue == 0 and red > 1
    assert read_system(VENETIAN_BLIND).spectrum is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wavelength_nm,transmittance\n400,0.1\n780,0.2\n", "from 380 to 780 nm"),
        ("wavelength_nm,transmittance\n780,0.1\n380,0.2\n", "rising wavelengths"),
        ("wavelength_nm,transmittance\n380,0\n780,0\n", "not 0"),
        ("nm,t\n380,0\n780,0\n", "expected the columns wavelength_nm, transmittance"),
        ("wavelength_nm,transmittance\n380,a\n", "'a' is not a number"),
    ],
)
def test_faults_of_a_spectrum(tmp_path, text: str, message: str) -> None:
    path = tmp_path / "shade.csv"
    path.write_text(text, "utf-8")
    with pytest.raises(DataError, match=message):
        read_spectrum(path)


def test_a_file_of_coloured_slats_is_read_as_it_was_written_and_faults_are_named(tmp_path) -> None:
    shares = np.linspace(0.0, 0.5, 2 * 145**2).reshape(2, 145, 145)
    light = SlatLight(np.interp(NANOMETRES, [380, 780], [0.1, 0.5]), shares)
    path = tmp_path / "slats.json"
    write_slat_light(light, path)
    found = SpectralTable(slats=path).factor()
    assert found.slats.shares == pytest.approx(shares, abs=1e-4)
    assert found.slats.reflectance == pytest.approx(light.reflectance, abs=1e-5) and found.mirrored is None
    text = path.read_text("utf-8")
    for fault, message in (
        (text.replace("380.0", "381.0", 1), "every 10 nm from 380 to 780"),
        (text.replace('"reflectance":[0.1', '"reflectance":[-0.1', 1), "from 0 to 1"),
        (json.dumps({**json.loads(text), "shares": shares[:, :, :3].tolist()}), "expected 145 x 145 patches"),
        ("{}", "expected numbers of wavelength_nm, reflectance, shares"),
        ("patch,straight", "is not JSON"),
    ):
        path.write_text(fault, "utf-8")
        with pytest.raises(DataError, match=message):
            SpectralTable(slats=path).factor()
    with pytest.raises(ValueError, match="expected shade or slats, got both"):
        SpectralTable(slats=path, shade=path)


def test_path_tracing_has_no_spectrum() -> None:
    with pytest.raises(ValueError, match="spectral needs the three-phase or the five-phase"):
        RoomOptions.of(spectral=True, method="point-in-time")
    with pytest.raises(ValueError, match="channels: expected one of"):
        RoomOptions.of(channels=4)


def test_a_spectrum_that_is_no_number_is_refused(tmp_path) -> None:
    file = tmp_path / "shade.csv"
    file.write_text("wavelength_nm,transmittance\n380,0.1\n500,nan\n780,0.2\n", "utf-8")
    with pytest.raises(DataError, match=r"line 3.*transmittance: 'nan' is not a number"):
        read_spectrum(file)


def test_tilts_between_systems_are_not_noted_beside_these() -> None:
    states = tilt_states(family(), 10.0)
    room = SimpleNamespace(windows=SimpleNamespace(systems=[states]))
    light = SimpleNamespace(light=SimpleNamespace(systems=[states]), inner=None)
    factors, notes = _factors(room, light)
    assert len(factors[0]) == len(states) == 8
    assert [note.split(":")[0] for note in notes] == ["milk 0", "milk 40", "milk 70"]


def test_panes_without_visible_data_are_refused(tmp_path) -> None:
    pane = tmp_path / "sun.txt"
    rows = "".join(f"{nm} 0.8 0.1 0.1\n" for nm in (800.0, 1500.0, 2500.0))
    pane.write_text("{ Units, Wavelength Units } Nanometers\n{ Thickness } 4\n" + rows, "utf-8")
    with pytest.raises(DataError, match=r"of 800 to 2500 nm, expected 400 to 760"):
        SpectralTable(panes=(pane,)).factor()


def pane_file(path: Path, wavelengths: tuple[float, ...]) -> Path:
    """A pane in Optics' format that passes more light of longer wavelengths."""
    head = "{ Units, Wavelength Units } Nanometers\n{ Thickness } 4\n"
    rows = "".join(f"{nm:g} {min(0.2 + nm / 5000, 0.8):g} 0.1 0.1\n" for nm in wavelengths)
    path.write_text(head + rows, "utf-8")
    return path


EVERY_20 = tuple(float(nm) for nm in range(300, 2501, 20))


def test_panes_with_a_gap_in_the_visible_have_no_spectrum(tmp_path) -> None:
    gap = pane_file(tmp_path / "gap.txt", (300.0, *EVERY_20[40:]))
    with pytest.raises(DataError, match=r"nothing between 300 and 1100 nm"):
        SpectralTable(panes=(gap,)).factor()
    layers = [{"pane": gap, "solar": (0.5, 0.1, 0.1)}]
    assert StateTable(bsdf=VENETIAN_BLIND, layers=layers).spectrum() is None  # neutral, and named so


def state_of(path: Path, *layers: dict[str, object]) -> FenestrationSystem:
    return read_state(StateTable(bsdf=path, layers=layers), path)


def test_layers_without_a_spectrum_are_named_and_a_stated_spectrum_goes_before(blind, tmp_path) -> None:
    pane = {"pane": pane_file(tmp_path / "pane.txt", EVERY_20), "thickness": 0.004}
    plain = {"thickness": 0.004, "solar": (0.8, 0.07, 0.07)}
    gap = {"gap": {"width": 0.016}}
    partial = state_of(VENETIAN_BLIND, pane | gap, plain)
    whole = state_of(VENETIAN_BLIND, pane | gap, pane)
    # the amber fabric beside the blind's file is not lost by layers that do not know it
    beside = state_of(blind, pane | gap, plain)
    assert beside.spectrum is not None and beside.spectrum.of_angles(channels_of(3))[0, 0, 0] == 0
    for states, count in (((partial,), 1), ((whole, beside), 0)):
        room = SimpleNamespace(windows=SimpleNamespace(systems=[states]))
        light = SimpleNamespace(light=SimpleNamespace(systems=[states]), inner=None)
        notes = _factors(room, light)[1]
        assert len(notes) == count
        assert all("other layers transmit all wavelengths equally" in note for note in notes)


def test_hours_of_states_are_hours_in_weather_of_half_hours() -> None:
    times = pd.date_range("2025-06-01 08:15", periods=10, freq="30min")
    eye = pd.DataFrame({"melanopic_edi_lx": 300.0}, index=times)
    heat = SimpleNamespace(comfort=eye, temperatures=eye)
    room = SimpleNamespace(heat=heat, operation=None)
    chart = melanopic_against_glare(room, SimpleNamespace(eye=eye), np.full(10, 0.2))
    assert chart.classes[0][1].endswith(": 5 h")


def operation_file(folder: Path, text: str) -> Path:
    """An operation file with some tables."""
    path = folder / "operation.toml"
    path.write_text(text, "utf-8")
    return path


def test_colours_of_surfaces_are_those_stated_then_those_of_the_model(tmp_path) -> None:
    space = shoebox().spaces[0]
    wood = tmp_path / "oak.csv"
    wood.write_text("wavelength_nm,reflectance\n380,0.1\n780,0.5\n", "utf-8")
    text = '[[surface]]\nselect = "floor"\nspectrum = "oak.csv"\n[[surface]]\nselect = "LEFT*"\ncolour = "#c08070"\n'
    tables = read_operation(operation_file(tmp_path, text)).tables.surface
    red = replace(space.faces[0], hue=(3.0, 0.5, 0.1))
    space = replace(space, faces=(red, *space.faces[1:]))
    found, notes = room_reflectance(space, tables)
    assert found is not None and found.shape == (len(space.faces), len(NANOMETRES))
    weight = illuminant("D65") * detected(np.eye(len(NANOMETRES)))[:, 0]
    visible = [face.reflectance("visible") for face in space.faces]
    assert found @ weight / weight.sum() == pytest.approx(visible, rel=1e-3)
    kinds = [face.kind for face in space.faces]
    floor, left = found[kinds.index("floor")], found[[face.name for face in space.faces].index("left")]
    assert floor[-1] / floor[0] == pytest.approx(5.0)
    assert left[250] > 1.5 * left[60] and found[0, 250] > 1.5 * found[0, 60]
    assert len(notes) == 1 and "with a colour in the model (1)" in notes[0]
    assert room_reflectance(shoebox().spaces[0]) == (None, [])
    other = room_reflectance(shoebox().spaces[0], (*tables[1:], SurfaceTable(select="no such", colour="#ff0000")))
    assert [note for note in other[1] if "no such" in note]
    lawn = SurfaceTable(select="ground", colour="#407030")
    assert room_reflectance(shoebox().spaces[0], (lawn,)) == (None, [])  # outdoors
    assert ground_reflectance((*tables, lawn)) == pytest.approx(lawn.shape()) and ground_reflectance(tables) is None


def test_materials_have_their_measured_spectra() -> None:
    """Shapes that other libraries show too: green at 550 nm, red edge of leaves beyond 700 nm, red clay."""
    at = {name: np.interp([450.0, 550.0, 650.0, 750.0], NANOMETRES, rho) for name, rho in materials().items()}
    assert len(at) == 8 and all(0 < values.min() and values.max() < 0.6 for values in at.values())
    blue, green, red, edge = at["vegetation"]
    assert green > 2 * max(blue, red) and edge > 4 * green
    assert at["clay tile"][2] > 3 * at["clay tile"][0] and at["asphalt"][2] < 1.5 * at["asphalt"][0]
    table = SurfaceTable(select="ground", material="sand")
    assert ground_reflectance((table,)) == pytest.approx(materials()["sand"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[surface]]\nselect = "floor"\n', "expected spectrum, colour or material"),
        ('[[surface]]\nselect = "ground"\nmaterial = "grass"\n', "expected one of asphalt, concrete, .*, got 'grass'"),
        ('[[surface]]\nselect = "floor"\ncolour = "red"\n', "expected #rrggbb"),
        ('[[surface]]\nselect = "floor"\nspectrum = "none.csv"\n', "no such file: none.csv"),
        ('[[surface]]\nselect = "floor"\nspectrum = "bad.csv"\n', "from 380 to 780 nm"),
    ],
)
def test_faults_of_a_surface(tmp_path, text: str, message: str) -> None:
    (tmp_path / "bad.csv").write_text("wavelength_nm,reflectance\n400,0.1\n780,0.5\n", "utf-8")
    with pytest.raises(DataError, match=message):
        read_operation(operation_file(tmp_path, text))


def test_spectra_of_lamps(tmp_path) -> None:
    nm = np.arange(400.0, 701.0, 10.0)
    rows = "".join(f'<SpectralData wavelength="{w:g}">{v:g}</SpectralData>' for w, v in zip(nm, nm / 700, strict=True))
    (tmp_path / "lamp.spdx").write_text(
        f'<IESTM2714 xmlns="iestm2714" version="1.0"><SpectralDistribution>{rows}</SpectralDistribution></IESTM2714>'
    )
    table = "".join(f"{w:g},{v:g}\n" for w, v in zip(nm, nm / 700, strict=True))
    (tmp_path / "lamp.csv").write_text("wavelength_nm,power\n" + table)
    (tmp_path / "bad.spdx").write_text("<IESTM2714><SpectralData>1</SpectralData></IESTM2714>")
    led, spdx, table = (lamp_spectrum(placed_spectrum(name, tmp_path)) for name in ("LED-B3", "lamp.spdx", "lamp.csv"))
    assert spdx == pytest.approx(table)
    assert detected(led)[0] == pytest.approx(1.0)
    assert daylight_efficacy_ratio(led) == pytest.approx(0.6326, abs=1e-4)  # CIE S 026's toolbox
    for name, message in (("none.csv", "no such file, nor an illuminant"), ("bad.spdx", "is no spectrum of IES TM-27")):
        with pytest.raises(DataError, match=message):
            placed_spectrum(name, tmp_path)


def test_light_by_wavelength_does_not_change_the_photopic_light() -> None:
    building = shoebox()
    space = building.spaces[0]
    systems, weather = in_all_windows(space, read_system(VENETIAN_BLIND)), read_weather(WEATHER)
    both = [
        room_light(inputs_of_room(building, space, systems, weather, RoomOptions.of(spectral=spectral, **FEW)))
        for spectral in (False, True)
    ]
    plain, spectral = (illuminance(one.light) for one in both)
    assert np.array_equal(plain, spectral)
    turned = turned_eyes(both[1])
    assert len(turned.scene.points) == 3
    # to the back of the room, and to its sides, less light than towards the window
    towards, around = eye_illuminance(turned.light).mean(), illuminance(turned.light).mean(axis=1)
    assert towards > around.max() > 0
    assert towards == pytest.approx(both[1].eye(np.zeros((8760, 1), dtype=np.int64)).mean(), rel=0.3)  # 64 paths
