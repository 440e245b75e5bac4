"""EnergyPlus runs the exported room; the glTF holds what the building holds."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from bim.defaults import WINDOW_FRAME
from bim.energyplus_parts import MOST_LAYERS, at_most_layers
from bim.gbxml.building import read_gbxml
from bim.gbxml.write import write_gbxml
from bim.honeybee.building import read_honeybee
from bim.honeybee.write import write_honeybee
from bim.ifc.attach import attach
from bim.ifc.building import read_ifc
from bim.ifc.targets import Targets
from bim.model import Construction, MaterialLayer
from bim.shoebox import WindowRectangle, shoebox
from bim.to_energyplus import DEFAULT_G, DEFAULT_U, write_epjson
from bim.to_gltf import write_gltf
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_matrix
from mitsuba_cfs.sky.patches import ReinhartSky
from scenes.demo import VENETIAN_BLIND
from scenes.fenestration.state_to_attach import state_to_attach
from scenes.fenestration.systems import WindowOverrides, read_system
from scenes.fenestration_exports import known_fenestration
from tests.bim.small_ifc import box_room

WINDOWS = (WindowRectangle(0.5, 0.9, 1.4, 1.5, frame=0.06), WindowRectangle(2.2, 0.9, 1.4, 1.5, frame=0.06))


def weather_file() -> Path:
    """Chicago's weather, which comes with EnergyPlus."""
    home = Path(pytest.importorskip("pyenergyplus.api").__file__).parent
    weather = next((home / "data" / "weather").glob("*Chicago*.epw"), None)
    if weather is None:
        pytest.skip("EnergyPlus comes without a weather file here")
    return weather


def run_energyplus(path: Path, folder: Path) -> tuple[str, list[dict[str, str]]]:
    """Error file and hourly table of a run with the weather that comes with EnergyPlus."""
    weather = weather_file()
    api = pytest.importorskip("pyenergyplus.api").EnergyPlusAPI()
    state = api.state_manager.new_state()
    api.runtime.set_console_output_status(state, False)
    code = api.runtime.run_energyplus(state, ["-d", str(folder), "-r", "-w", str(weather), str(path)])
    errors = (folder / "eplusout.err").read_text()
    assert code == 0, errors[-2000:]
    with (folder / "eplusout.csv").open(newline="") as stream:
        return errors, list(csv.DictReader(stream))


@pytest.mark.peer
@pytest.mark.parametrize("source", ["shoebox", "IFC2X3", "IFC4"])
def test_energyplus_runs_the_exported_room(tmp_path, source):
    if source == "shoebox":
        building = shoebox(windows=WINDOWS, recess=0.15)
    else:
        box_room(source).write(str(tmp_path / "room.ifc"))
        building = read_ifc(tmp_path / "room.ifc")
    path = tmp_path / "room.epJSON"
    write_epjson(building, path)
    errors, rows = run_energyplus(path, tmp_path)
    assert "** Severe" not in errors and "Fatal" not in errors
    air = air_temperatures(rows)
    assert len(air) == 8760
    assert air.min() > -25 and air.max() < 60
    # Judge: the same building's heat balance in closed form, from `bim`'s data and our reading of
    # the weather.  Twice the g warms the room, in the year's mean (what is stored cancels), by the
    # additional sun over the heat loss per kelvin.
    g, home = building.windows[0].g_value or DEFAULT_G, weather_file()
    write_epjson(building, path, g_value=g / 2)
    (tmp_path / "half").mkdir()
    _, dimmer = run_energyplus(path, tmp_path / "half")
    rise = air.mean() - air_temperatures(dimmer).mean()
    expected = 0.5 * g * sun_on_glass(building, home) * share_kept(building) / heat_loss(building)
    # At the angles of a year's sun simple glazing passes 0.8 to 0.95 of its normal g, and reveals
    # and overhangs shade some of the glass; films vary with wind by some 5 % of a wall's U.
    assert 0.7 < rise / expected < 1.05, (rise, expected)


def air_temperatures(rows: list[dict[str, str]]) -> np.ndarray:
    """Hourly air temperatures of the only zone [degC]."""
    column = next(name for name in rows[0] if "Zone Mean Air Temperature" in name)
    return np.array([float(row[column]) for row in rows])


def sun_on_glass(building, epw: Path) -> float:
    """Mean solar radiation on all glass over the year [W], unshaded, by the Perez sky."""
    weather, sky = read_epw(epw), ReinhartSky(1)
    mean = sky_matrix(weather, 1, "solar").mean(axis=1)
    total = 0.0
    for window in building.windows:
        cosine = np.maximum(sky.directions[1:] @ window.normal, 0)
        above = mean[1:] @ (sky.solid_angles[1:] * cosine)
        total += window.area * (above + mean[0] * np.pi * (1 - window.normal[2]) / 2)
    return total


def share_kept(building) -> float:
    """Share of the sun on the floor, where EnergyPlus puts the beam, that goes to the room.

    The rest leaves through the floor without having warmed the air.
    """
    (floor,) = [face for face in building.spaces[0].faces if face.kind == "floor"]
    kept = floor.construction.resistance
    return kept / (kept + 0.13) if floor.adjacency == "ground" else 1.0


def heat_loss(building) -> float:
    """Heat that the room loses per kelvin [W/K]: walls, frames, glass and 0.5 air changes."""
    (space,) = building.spaces
    loss = 0.5 * space.volume * 1.2 * 1006 / 3600
    for face in space.faces:
        if face.adjacency in ("outside", "ground") and face.kind != "window frame":
            outer = 0.04 if face.adjacency == "outside" else 0.0
            loss += face.area / (face.construction.resistance + 0.13 + outer)
    for window in space.windows:
        frame = window.opening_area - window.area
        loss += window.area * (window.u_value or DEFAULT_U)
        loss += frame / (WINDOW_FRAME.resistance + 0.17)
    return loss


def test_epjson_keeps_areas_and_volume(tmp_path):
    building = shoebox(4, 6, 3, windows=WINDOWS, recess=0.15)
    path = tmp_path / "room.epJSON"
    write_epjson(building, path)
    model = json.loads(path.read_text())
    (zone,) = model["Zone"].values()
    assert zone["volume"] == pytest.approx(72 + 0.15 * 2 * 1.4 * 1.5)
    areas = {"Floor": 0.0, "Ceiling": 0.0, "Roof": 0.0, "Wall": 0.0}
    for surface in model["BuildingSurface:Detailed"].values():
        ring = np.array([list(vertex.values()) for vertex in surface["vertices"]])
        area = 0.5 * np.linalg.norm(np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0))
        areas[surface["surface_type"]] += area
    recess = 2 * 2 * (1.4 + 1.5) * 0.15
    # parents of windows are a thousandth bigger than their openings: glass has to lie inside
    assert areas["Wall"] == pytest.approx(2 * (4 + 6) * 3 + recess, rel=1e-4)
    assert areas["Floor"] == pytest.approx(24) and areas["Ceiling"] == pytest.approx(24)
    assert len(model["FenestrationSurface:Detailed"]) == 2


def test_gltf_holds_rooms_glass_and_surroundings(tmp_path):
    box_room().write(str(tmp_path / "room.ifc"))
    building = read_ifc(tmp_path / "room.ifc")
    write_gltf(building, tmp_path / "room.glb")
    scene = trimesh.load(tmp_path / "room.glb")
    names = set(scene.geometry)
    assert {f"R1 Room {kind}" for kind in ("floor", "wall", "glass", "window frame")} <= names
    assert "outdoors" in names
    assert scene.geometry["R1 Room glass"].area == pytest.approx(building.windows[0].area, rel=1e-5)
    low, high = scene.bounds
    assert high[1] - low[1] == pytest.approx(3.4, abs=1e-5)  # y is up in glTF


THIN = {
    "M": MaterialLayer("metal", 0.0015, 45.0, 7680.0, 418.0),
    "A": MaterialLayer("air", 0.1, 0.667, 1.28, 1000.0),
    "P": MaterialLayer("gypsum", 0.0127, 0.16, 800.0, 1090.0),
}


@pytest.mark.peer
def test_thin_metal_and_many_layers_run_in_energyplus(tmp_path):
    building = shoebox(windows=WINDOWS)
    (space,) = building.spaces
    rooms = []
    for name in ("MAM", "MPM", "M", "PMAPMAPMAPMAP"):
        construction = Construction(name, tuple(THIN[letter] for letter in name))
        faces = tuple(replace(face, construction=construction) if face.kind == "wall" else face for face in space.faces)
        rooms.append(replace(space, guid=name, name=name, faces=faces))
    path = tmp_path / "rooms.epJSON"
    write_epjson(replace(building, spaces=tuple(rooms)), path, ground_c=[9.0] * 12)
    errors, _ = run_energyplus(path, tmp_path)
    assert "** Severe" not in errors and "Ground found but no" not in errors


def test_merged_layers_keep_resistance_and_mass():
    layers = tuple(THIN[letter] for letter in "PMAPMAPMAPMAP")
    merged = at_most_layers(layers)
    assert len(merged) == MOST_LAYERS

    def sums(some):
        return [
            sum(x.thickness / x.conductivity for x in some),
            sum(x.thickness * x.density for x in some),
            sum(x.thickness * x.density * x.heat_capacity for x in some),
        ]

    assert sums(merged) == pytest.approx(sums(layers))


@pytest.mark.peer
def test_a_bsdf_goes_to_energyplus_as_complex_fenestration(tmp_path):
    building = read_ifc(attached(tmp_path))
    known = known_fenestration(building.spaces, tmp_path / "attached.ifc")
    glazing, _ = known.glazings()
    path = tmp_path / "room.epJSON"
    write_epjson(building, path, glazing=glazing)
    model = json.loads(path.read_text())
    assert "WindowMaterial:SimpleGlazingSystem" not in model
    assert len(model["Construction:ComplexFenestrationState"]) == 1
    errors, rows = run_energyplus(path, tmp_path)
    assert "** Severe" not in errors and len(air_temperatures(rows)) == 8760


def test_the_gaps_of_a_complex_fenestration_have_the_u_of_the_system(tmp_path):
    building = read_ifc(attached(tmp_path))
    glazing, _ = known_fenestration(building.spaces, tmp_path / "attached.ifc").glazings()
    write_epjson(building, tmp_path / "room.epJSON", glazing=glazing)
    model = json.loads((tmp_path / "room.epJSON").read_text())
    (system,) = model["Construction:ComplexFenestrationState"].values()
    gaps = [model["WindowMaterial:Gap"][system[f"gap_{k}_name"]] for k in (1, 2, 3)]
    still_air = 2.873e-3 + 7.76e-5 * (10.0 + 273.15)  # [W/(m K)], ISO 15099 annex B
    resistance = sum(gap["thickness"] for gap in gaps) / still_air
    (first, *_) = glazing.values()
    assert 1 / (resistance + 0.04 + 0.13) == pytest.approx(first.u_value, rel=1e-6)  # EN 673


def test_a_bsdf_and_its_u_g_and_tau_go_to_honeybee_and_gbxml(tmp_path):
    building = read_ifc(attached(tmp_path))
    glazing, _ = known_fenestration(building.spaces, tmp_path / "attached.ifc").glazings()
    (first, *_) = glazing.values()
    for write, name in ((write_honeybee, "a.hbjson"), (write_gbxml, "a.gbxml")):
        note, ground = write(building, tmp_path / name, glazing=glazing)
        assert "holds no BSDF: windows of" in note and "the ground at" in ground
        assert write(shoebox(4, 5, 3, windows=WINDOWS), tmp_path / f"plain {name}") == ()
    model = json.loads((tmp_path / "a.hbjson").read_text())
    (material,) = [
        m for m in model["properties"]["energy"]["materials"] if m["type"] == "EnergyWindowMaterialSimpleGlazSys"
    ]
    stated = [material[key] for key in ("u_factor", "shgc", "vt")]
    values = [first.u_value, first.g_value, first.visible_transmittance]
    assert stated == pytest.approx(values, abs=1e-5)
    window = read_honeybee(tmp_path / "a.hbjson").windows[0]
    assert first.bsdf is not None and first.bsdf.bands["Visible"] is not None
    np.testing.assert_allclose(
        window.states[0].bands["Visible"].transmission_front,
        first.bsdf.bands["Visible"].transmission_front,
        rtol=1e-5,
        atol=1e-7,
    )
    window = read_gbxml(tmp_path / "a.gbxml").windows[0]
    found = [window.u_value, window.g_value, window.visible_transmittance]
    assert found == pytest.approx(values, abs=1e-5)


def test_the_notes_name_windows_whose_further_states_are_not_written(tmp_path):
    file = attached(tmp_path)
    spaces = read_ifc(file).spaces
    assert "first shading state" not in " ".join(known_fenestration(spaces, file).notes())
    states = WindowOverrides(2 * (read_system(VENETIAN_BLIND),), light_only=True)
    assert known_fenestration(spaces, file, states).notes()[-1].endswith(": only the first shading state is written.")


def attached(folder: Path) -> Path:
    """A room whose windows hold the demo's blind."""
    box_room("IFC4").write(str(folder / "room.ifc"))
    state, _ = state_to_attach(VENETIAN_BLIND)
    path = folder / "attached.ifc"
    attach(folder / "room.ifc", path, state, Targets(every_window=True))
    return path


def test_an_epjson_names_what_energyplus_is_not_told(tmp_path):
    """The ground's temperature, slivers that it merges away, and a BSDF that lies on its side."""
    building = shoebox(4, 5, 3, windows=WINDOWS, adjacency={"floor": "ground"})
    (space,) = building.spaces
    (given,) = write_epjson(building, tmp_path / "a.epJSON", ground_c=[9.0] * 12)
    assert "the ground at 20 m2 has the given monthly temperatures" in given and "ISO 13370" in given
    (ground,) = write_epjson(building, tmp_path / "a.epJSON")
    assert "the ground at 20 m2 has no given temperature: EnergyPlus takes 18 C" in ground
    sliver = np.array([[[0, 0, 0], [4, 0, 0], [4, 0.004, 0]]], dtype=float)
    narrow = replace(space, faces=(*space.faces, replace(space.faces[0], triangles=sliver)))
    lost, _ = write_epjson(replace(building, spaces=(narrow,)), tmp_path / "b.epJSON", ground_c=[9.0] * 12)
    assert "1 surfaces of 0.008 m2 in all are left out" in lost


@pytest.mark.parametrize(("write", "model"), [(write_honeybee, "Honeybee"), (write_gbxml, "gbXML")])
def test_honeybee_and_gbxml_name_ground_and_glass_that_are_not_written(tmp_path, write, model):
    """A floor on the ground is written as such, its soil is not; glass to another room is a wall."""
    building = shoebox(4, 5, 3, windows=WINDOWS, adjacency={"floor": "ground"})
    (space,) = building.spaces
    (ground,) = write(building, tmp_path / "a")
    assert ground.startswith(f"{model}: the ground at 20 m2 is left to the program that reads the file")
    wall = next(face for face in space.faces if face.kind == "wall")
    panes = (replace(space.windows[0], name="Fanlight"), replace(space.windows[0], name="Doorway", is_open=True))
    faces = [replace(wall, name=f"inner {pane.name}", pane=pane) for pane in panes]
    inner = replace(space, faces=(*space.faces, *faces))
    glass, _ = write(replace(building, spaces=(inner,)), tmp_path / "b")
    assert glass == f"{model}: glass between rooms is written as an opaque wall: Fanlight"


def test_an_export_takes_the_ground_of_the_weather(tmp_path):
    from scenes.commands.export import ground_temperatures
    from scenes.demo import FOLDER

    weather = next(FOLDER.glob("*.epw"))
    months = ground_temperatures(weather)
    air = read_epw(weather).dry_bulb_c.reshape(365, 24).mean(axis=1)
    assert np.mean(months) == pytest.approx(air.mean(), abs=0.2)
    # at 0.5 m it is damped, and some weeks behind the air
    assert air.min() < min(months) and max(months) < air.max()
    assert months.index(max(months)) in (6, 7)
