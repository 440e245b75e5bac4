"""Files that mostly still parse, but hold odd numbers, types and structures: read, or one line.

Every reader of a format that comes from others has a row.  40 mutations of each in the quick tests,
20,000 in the slow ones; a mutation is given by the row's name and its number (its seed).
"""

from __future__ import annotations

import base64
import json
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, cast

import ifcopenshell
import numpy as np
import pandas as pd
import pytest
import trimesh

from bim.building_file import read_building_file
from bim.fenestration import read_g_table
from bim.ifc.control import StoredGroup, read_control, write_control
from bim.ifc.corrections import read_corrections
from bim.radiance.cell import read_radiance_layer
from bim.surroundings.placement import read_horizon, read_surroundings
from mitsuba_cfs.bsdf.fabric_table import read_fabric_table
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER, KlemsBsdf
from mitsuba_cfs.bsdf.measured_file import read_measurement
from mitsuba_cfs.bsdf.shade_file import read_shade_file
from mitsuba_cfs.bsdf.spectral_pane import read_glazing_layers, read_pane_file
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.files import json_text as result_text
from mitsuba_cfs.files import read_json
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.hdr import read_hdr, write_hdr
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.matrices.mtx_io import read_matrix, write_matrix
from mitsuba_cfs.metrics.photometry import read_photometry
from mitsuba_cfs.sky.epw import read_epw, read_wea
from mitsuba_cfs.sky.measured import read_measured
from scenes.app.actions import computations
from scenes.app.project import Project
from scenes.app.server import AppServer, variants
from scenes.comply.uses import read_uses
from scenes.demo import OFFICE, WEATHER
from scenes.explore.case_files import case_files, read_case
from scenes.explore.folder import write_explorer
from scenes.fenestration.systems import read_system
from scenes.fenestration.thermal_file import read_angular_table, read_reflectance, read_slat_light, read_spectrum
from scenes.fit.fit_file import read_fit
from scenes.heat.measured_weather import read_measured as read_named_columns
from scenes.heat.study_file import read_study as read_heat_study
from scenes.page_options import read_page
from scenes.photovoltaics.study_file import read_pv_study
from scenes.result_folder import FolderMark, ResultFolder
from scenes.room.luminaires import lamp_spectrum
from scenes.room.operation import read_operation
from scenes.room.schedules import ScheduleTable
from scenes.room_views import parsed_views
from scenes.site.reflections import read_observers
from scenes.study.store import CaseResult, Store
from scenes.study.study_file import read_study
from scenes.user_errors import LONGEST, user_message
from tests import mutators
from tests.bim.honeybee_models import two_rooms as honeybee_rooms
from tests.bim.test_citygml import PART, RELIEF, WHOLE, model
from tests.bim.test_read_gbxml import two_rooms as gbxml_rooms
from tests.bim.test_surroundings_files import city
from tests.bsdf.test_fabric import SHEET
from tests.bsdf.test_pane_file_fuzz import LAYERS, OPTICAL, OPTICS, PRODUCT
from tests.bsdf.test_radiance_cell import CELLULAR, PERIOD
from tests.bsdf.test_shade_file import product
from tests.conftest import REPOSITORY
from tests.explore.synthetic import explored_run
from tests.metrics.test_photometry import GAMMA, ies, ldt
from tests.scenes.test_measured_weather import frame as measured_frame
from tests.scenes.test_measured_weather import table_of as measured_table
from tests.thermal.test_study import study_file as thermal_file

QUICK, SLOW = 40, 20_000
SILENT = ("mark", "case of a study", "journal")  # what is then computed again, or a line that is left out
DEMO = WEATHER.parent
ROOM = """void plastic white
0 0 5 .7 .7 .7 0 0
void glass pane
0 0 3 .8 .8 .8
white polygon floor 0 0 12 0 0 0 4 0 0 4 6 0 0 6 0
white polygon ceiling 0 0 12 0 6 3 4 6 3 4 0 3 0 0 3
white polygon east 0 0 12 4 0 0 4 0 3 4 6 3 4 6 0
white polygon west 0 0 12 0 0 0 0 6 0 0 6 3 0 0 3
white polygon north 0 0 12 0 6 0 4 6 0 4 6 3 0 6 3
white polygon south 0 0 12 0 0 0 0 0 1 4 0 1 4 0 0
pane polygon window 0 0 12 0 0 1 0 0 3 4 0 3 4 0 1
!genbox white table 1 1 .7 | xform -t 1 1 0 -a 2 -t 0 2 0
"""
GONIOMETER = "#format: theta phi BSDF\n#incident_angle 30 0\n" + "".join(
    f"{180 - theta} {phi} 0.{theta}1\n" for theta in (10, 40, 70) for phi in (0, 90, 180, 270)
)
BLOCKS = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
CORRECTIONS = """leave_out = ["a wall"]
keep = ["blind"]
join = [["R1", "R2"]]
[[reflectance]]
select = "IfcWall"
visible = 0.6
"""


RING = [[8.0, 50.0], [8.001, 50.0], [8.001, 50.001], [8.0, 50.0]]
FOOTPRINTS = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"height": 9.0, "building:levels": "3", "name": "block"},
            "geometry": {"type": "Polygon", "coordinates": [RING]},
        },
        {
            "type": "Feature",
            "properties": {"crown_radius": 3.0, "height": 8.0, "transmittance": "deciduous"},
            "geometry": {"type": "Point", "coordinates": [8.0, 50.0]},
        },
    ],
}
MESH = "o box\nv 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 5\nf 1 2 3\nf 1 3 4\nf 1 2 4\nf 2 3 4\n"
TERRAIN = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n4 5 6\n"


ANGULAR = "theta_deg,transmittance,reflectance_front\n" + "".join(
    f"{angle},{0.8 - angle / 200:g},0.1\n" for angle in range(0, 91, 10)
)
G_VALUES = "polar_deg,azimuth_deg,g\n" + "".join(
    f"{polar},{azimuth},0.{5 - polar // 20}\n" for polar in (0, 30, 60, 90) for azimuth in (0, 90)
)
CLOTH = """void BRTDfunc cloth
10 0 0 0 tau(.2*t0) tau(.3) tau(.2) 0 0 0 weave.cal
0
9 .4 .4 .4 .1 .1 .1 .02 .02 .02
cloth polygon"""
FUNCTIONS = "{ a cosine } tau(t) = if(t-.5, t*abs(Rdot), sqrt(t)^2/(1+t)); t0 : .5;\n"
PAGE = 'title = "A"\nauthor = "B"\nlanguage = "de"\n[sections]\nmodel = false\n'
USES = """dwellings = { "D1" = ["a*"] }
[rooms]
"R 1" = "office"
[[use]]
key = "office"
occupied = true
words = ["office", "studio"]
"""
INTENSITIES = 300.0 * np.cos(np.radians(GAMMA))
WAVELENGTHS = range(380, 781, 10)
SPECTRUM = "wavelength_nm,{}\n" + "".join(f"{nm},{nm / 1000:g}\n" for nm in WAVELENGTHS)
SPDX = '<IESTM2714 xmlns="iestm2714" version="1.0"><SpectralDistribution>{}</SpectralDistribution></IESTM2714>'.format(
    "".join(f'<SpectralData wavelength="{nm}">{nm / 700:.3f}</SpectralData>' for nm in WAVELENGTHS)
)
SLATS = {
    "wavelength_nm": [*WAVELENGTHS],
    "reflectance": [nm / 1000 for nm in WAVELENGTHS],
    "shares": np.full((1, 145, 145), 0.5).tolist(),
}
OBSERVERS = "name,x,y,z,sight_azimuth_deg,sight_altitude_deg\nroad,12,-30,1.2,270,0\npath,0,-20,1.7,,\n"
VIEWS = "rvu -vta -vp 2 3 1.2 -vd 0 1 0 -vu 0 0 1 -vh 180 -vv 180\nrvu -vtv -vp 1 1 1.2 -vd 0 1 0 -vh 60 -vv 40\n"
TREES = """[[tree]]
at = [10.0, 5.0]
height = 8.0
crown_radius = 3.0
crown_base = 2.0
transmittance = "deciduous"
[[tree]]
object = "crown 1"
transmittance = [0.5, 0.5, 0.4, 0.3, 0.1, 0.1, 0.1, 0.1, 0.2, 0.3, 0.5, 0.5]
"""
CLOCK = "hour,people\n" + "".join(f"{hour},{hour / 24:.2f}\n" for hour in range(24))
PARAMETER = """study = "study.toml"
measured = "measured.csv"
begin = 2017-05-02T00:00:00
average_h = 1.0
[[measurement]]
column = "air"
quantity = "air temperature"
[[parameter]]
key = "air.infiltration_ach"
mean = 0.5
deviation = 0.2
low = 0.02
[[parameter]]
keys = ["gains.persons"]
factor = true
deviation = 0.2
"""
PROJECT = """title = "A"
quick = true
operation = "operation.toml"
[[room]]
name = "office"
building = "inputs/office.ifc"
spaces = ["A"]
[[system]]
name = "blind"
bsdf = "inputs/blind.xml"
[[climate]]
name = "w"
weather = "inputs/w.epw"
[options]
seed = 3
"""
COMPARED = "space,system,sda300_50,operative_max_c,error\nOffice,blind,40.5,28.1,\nOffice,glass,60.0,31.0,\n"
JOURNAL = """{"command": ["cfs", "run", "inputs/office.ifc", "--out", "results/report-blind"], "kind": "run", \
"title": "blind", "started": 1.0, "seconds": 3.0, "state": "done", "code": 0}
"""
WANTED = {
    "title": "B",
    "spaces": ["A"],
    "furniture": True,
    "systems": [{"name": "glass", "see_through": ["specular"], "u_value": 1.1, "g_value": 0.5}],
    "quick": False,
    "loads": {"heating_c": 20.0, "cooling_c": 26.0, "equipment_w_m2": 5.0},
    "uses": {"0": "office"},
}
MESHES: dict[str, dict[str, Any]] = {"gltf": {}, "ply": {"encoding": "ascii"}, "stl_ascii": {}}
ACTIONS = {"report": True, "standards": ["en17037"], "language": "en", "compare": True}


def klems(file: Path) -> None:
    values = np.random.default_rng(1).uniform(0, 0.1, (4, 41, 41))
    blocks = dict(zip(BLOCKS, values, strict=True))
    visible = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, **blocks)
    write_bsdf_xml(BsdfFile({"Visible": visible, "Solar": visible}, name="b", thickness=0.02), file)


def tree(file: Path) -> None:
    values = np.random.default_rng(1).uniform(0, 0.1, 16)
    leaf = TensorTree(4, np.full(16, 1, dtype=np.int64), values)
    write_bsdf_xml(BsdfFile({"Visible": TensorTreeBsdf(**dict.fromkeys(BLOCKS, leaf))}), file)


def picture(file: Path) -> None:
    values = np.random.default_rng(1).uniform(1, 3000, (24, 24))
    values[4:6, 7:9] = 1e6
    write_hdr(file, values, fisheye((0, 0, 1.2), (0, 1, 0), 24), exposure=0.5)


def glare_of(file: Path) -> None:
    """What `cfs glare` does with a picture: every figure of it is a number."""
    picture = read_hdr(file)
    if picture.view is None or picture.view.kind == "parallel":
        return
    try:
        result = evaluate(picture.luminance, picture.view)
    except ValueError:  # which the command tells with the file's name
        return
    assert np.isfinite([result.dgp, result.Ev, result.dgi, result.mean_luminance, result.Lveil]).all()


def functions(file: Path) -> None:
    file.with_name("b.rad").write_text(ROOM.replace("pane polygon", CLOTH))
    file.write_text(FUNCTIONS)


def explorer(file: Path) -> None:
    write_explorer(explored_run(step=400, size=16), file.parent)


def explored(file: Path) -> None:
    list(case_files(file.parent, read_case(file.parent)))


def mark(file: Path) -> None:
    with ResultFolder(file.parent / "made", "run").replaced() as part:
        (part / "a.csv").write_text("1")
        (part / "b").mkdir()
        (part / "b" / "c.csv").write_text("1")
    file.write_bytes((file.parent / "made" / file.name).read_bytes())


def results_again(file: Path) -> None:
    """A folder with that mark, that a command would write into."""
    FolderMark.read(file.parent)
    with ResultFolder(file.parent, "run", adding=True, among=True).replaced():
        pass


def case_result(file: Path) -> None:
    arrays = {"lux": np.ones((3, 4)), "hours": np.arange(3)}
    file.write_bytes(CaseResult("key", {"sDA": 40.0, "name": "a"}, arrays).to_bytes())


def stored(file: Path) -> None:
    store = Store(file.parent / "study")
    store.open()
    (store.folder / "cases" / "key.npz").write_bytes(file.read_bytes())
    result = store.load("key")
    assert result is None or result.key == "key"


def copied(source: Path) -> Callable[[Path], object]:
    """A base with the files that it names beside it."""

    def write(file: Path) -> None:
        for other in source.parent.iterdir():
            link = file.parent / other.name
            if other.is_file() and not link.exists() and link != file:
                link.symlink_to(other)
        file.unlink(missing_ok=True)
        file.write_bytes(source.read_bytes())

    return write


def text(content: str) -> Callable[[Path], object]:
    return lambda file: file.write_text(content)


def finite(read: Callable[[Path], Any]) -> Callable[[Path], Any]:
    """A reader whose numbers are finite: NaN and infinity of a file never leave it."""

    def reads(file: Path) -> Any:
        result = read(file)
        for numbers in result if isinstance(result, tuple) else (result,):
            assert np.isfinite(numbers).all()
        return result

    return reads


def lamp(file: Path) -> tuple[np.ndarray | float, ...]:
    one = read_photometry(file)
    return one.gamma_deg, one.c_deg, one.candela, one.watts, one.lumens


def slats(file: Path) -> tuple[np.ndarray, ...]:
    light = read_slat_light(file)
    return light.reflectance, light.shares


def observers(file: Path) -> tuple[np.ndarray, ...]:
    return tuple(part for one in read_observers(file) for part in (one.point, one.sight) if part is not None)


def schedule(file: Path) -> np.ndarray:
    table = ScheduleTable(csv=file, column="people")
    return table.hourly(cast(Any, SimpleNamespace(times=range(24))), ())


def fitted(file: Path) -> None:
    thermal_file(file.parent, "[gains]\npersons = 2\n[air]\ninfiltration_ach = 0.5\n")
    (file.parent / "fit.toml").write_text(PARAMETER)
    hours = pd.date_range("2017-05-01", periods=60, freq="h", inclusive="right").strftime("%Y-%m-%dT%H:%M")
    rows = [f"{hour},{20 + number / 24:.3f}\n" for number, hour in enumerate(hours)]
    (file.parent / "measured.csv").write_text("time,air\n" + "".join(rows))


def planted(file: Path) -> tuple[np.ndarray, ...]:
    fit = read_fit(file)
    assert not np.isinf(fit.readings.to_numpy()).any()
    return fit.mean, fit.deviation


def measured_weather(file: Path) -> None:
    measured_frame(60).to_csv(file, index=False)


def named_columns(file: Path) -> tuple[np.ndarray, ...]:
    weather = read_named_columns(file, measured_table())
    return weather.direct_normal, weather.diffuse_horizontal, weather.dry_bulb_c


def folder_of_project(file: Path) -> Path:
    return file.parents[2] if file.name == "results.csv" else file.parent


def project(file: Path) -> None:
    """A project of the app: its study, journal and comparison, and the one under test among them."""
    one = Project(folder_of_project(file))
    (one.folder / "study.toml").write_text(PROJECT)
    (one.folder / "operation.toml").write_text("[loads]\nheating_c = 20.0\n[gains]\npersons = 1\n")
    (one.folder / "commands.jsonl").write_text(JOURNAL)
    results = one.folder / "results" / "comparison"
    results.mkdir(exist_ok=True)
    (results / "results.csv").write_text(COMPARED)
    (results / "study.json").write_text('{"quick": true}')
    (one.folder / "request.json").write_text(json.dumps(WANTED))
    (one.folder / "action.json").write_text(json.dumps(ACTIONS))


def shown(file: Path) -> None:
    """What the page of the app shows of a project."""
    one = Project(folder_of_project(file))
    result_text(AppServer(one, cast(Any, SimpleNamespace()))._facts())
    result_text(variants(one))


def changed(file: Path) -> None:
    """A request of the page; the project can then be shown."""
    one = Project(file.parent)
    (one.folder / "study.toml").write_text(PROJECT)
    one.change(read_json(file))
    shown(file)


def wanted_actions(file: Path) -> None:
    for action in computations(Project(file.parent), read_json(file)):
        assert action.text


def mesh_of(kind: str) -> Callable[[Path], object]:
    def write(file: Path) -> None:
        content = trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type=kind, **MESHES[kind])
        if isinstance(content, dict):  # glTF, whose buffers are beside it
            document = json.loads(content["model.gltf"])
            for buffer in document["buffers"]:
                data = base64.b64encode(content[buffer["uri"]]).decode()
                buffer["uri"] = f"data:application/octet-stream;base64,{data}"
            content = json.dumps(document)
        file.write_bytes(content if isinstance(content, bytes) else content.encode())

    return write


def stored_rules(file: Path) -> None:
    """Rules of a shading group in an IFC file."""
    windows = [one.GlobalId for one in ifcopenshell.open(OFFICE).by_type("IfcWindow")[:1]]
    rule = {"rule": "any", "hold_h": 2, "parts": [{"rule": "irradiance", "close_above": 180.0, "open_below": 90.0}]}
    write_control(OFFICE, file, [StoredGroup("group", tuple(windows), rule)])


def read_searched(file: Path) -> None:
    from scenes.design.candidates import mattering
    from scenes.design.design_file import read_design

    mattering(read_design(file), file.parent)


def weather(file: Path) -> None:
    file.write_bytes(WEATHER.read_bytes())


def heat_study(file: Path) -> None:
    source = REPOSITORY / "docs" / "tutorials" / "office_heated_slab.toml"
    file.write_text(source.read_text().replace("../../scenes/demo", str(DEMO)))


def design_study(file: Path) -> None:
    from tests.design.designs import BLIND, COOLING, ENERGY, PLAIN, RULE, SEARCH, TILT, design_file

    limit = '[[constraint]]\nrule = "en17037 glare"\n'
    design_file(file.parent, PLAIN, BLIND, TILT, RULE, COOLING, ENERGY, limit, SEARCH)


def wea(file: Path) -> None:
    head = "place X\nlatitude 42\nlongitude 88\ntime_zone 90\nsite_elevation 200\n"
    rows = (
        f"6 {day} {hour}.5 {500 if 6 < hour < 18 else 0} {100 if 5 < hour < 19 else 0}\n"
        for day in range(1, 8)
        for hour in range(24)
    )
    file.write_text(head + "weather_data_file_units 1\n" + "".join(rows))


def measured(file: Path) -> None:
    light = [max(0, 6 - abs(hour - 12)) for hour in range(24)]
    rows = (
        f"2024-06-{day:02} {hour:02}:30,{60 * light[hour]},{20 * light[hour]}\n"
        for day in range(1, 4)
        for hour in range(24)
    )
    file.write_text("time,global_horizontal,diffuse_horizontal\n" + "".join(rows))


def matrix(file: Path) -> None:
    write_matrix(file, np.ones((4, 3, 3)))


def matrix_of_text(file: Path) -> None:
    write_matrix(file, np.ones((4, 3, 3)), format="ascii")


def beside(file: Path) -> None:
    file.with_suffix(".xml").write_bytes((DEMO / "venetian_blind.xml").read_bytes())
    file.write_bytes((DEMO / "venetian_blind.toml").read_bytes())


@dataclass(frozen=True)
class Row:
    """A format: its file, how a good one is made, mutated and read."""

    name: str
    make: Callable[[Path], object]
    mutate: mutators.Mutator
    read: Callable[[Path], object]


def json_text(content: object) -> Callable[[Path], object]:
    return text(json.dumps(content))


ROWS = {
    "klems": Row("b.xml", klems, mutators.of_xml, read_bsdf_xml),
    "tensor tree": Row("b.xml", tree, mutators.of_xml, read_bsdf_xml),
    "beside a bsdf": Row("b.toml", beside, mutators.of_toml, lambda file: read_system(file.with_suffix(".xml"))),
    "goniometer": Row("m.txt", text(GONIOMETER), mutators.of_text, read_measurement),
    "epw": Row("w.epw", weather, mutators.of_weather, read_epw),
    "wea": Row("w.wea", wea, mutators.of_text, lambda file: read_wea(file, whole_year=False)),
    "measured": Row(
        "w.csv",
        measured,
        mutators.of_text,
        lambda file: read_measured(file, latitude_deg=42, longitude_deg=-88, timezone_h=-6),
    ),
    "gbxml": Row("b.gbxml", text(gbxml_rooms()), mutators.of_xml, read_building_file),
    "hbjson": Row("b.hbjson", json_text(honeybee_rooms()), mutators.of_json, read_building_file),
    "radiance": Row("b.rad", text(ROOM), mutators.of_text, read_building_file),
    "cityjson": Row("c.city.json", json_text(city({"a": ((0, 0, 0), (9, 9, 9))})), mutators.of_json, read_surroundings),
    "citygml": Row("c.gml", text(model(WHOLE, PART, RELIEF)), mutators.of_xml, read_surroundings),
    "geojson": Row("f.geojson", json_text(FOOTPRINTS), mutators.of_json, read_surroundings),
    "mesh": Row("m.obj", text(MESH), mutators.of_text, read_surroundings),
    "terrain": Row("t.asc", text(TERRAIN), mutators.of_text, read_surroundings),
    "horizon": Row("h.csv", text("A,H_hor\n-180,5\n-90,10\n0,3\n90,2\n"), mutators.of_text, read_horizon),
    "picture": Row("p.hdr", picture, mutators.of_picture, glare_of),
    "matrix": Row("m.mtx", matrix, mutators.of_picture, read_matrix),
    "matrix of text": Row("m.mtx", matrix_of_text, mutators.of_text, read_matrix),
    "study": Row("study.toml", copied(DEMO / "study.toml"), mutators.of_toml, read_study),
    "design": Row("design.toml", design_study, mutators.of_toml, read_searched),
    "operation": Row("controlled.toml", copied(DEMO / "controlled.toml"), mutators.of_toml, read_operation),
    "heat study": Row("office.toml", heat_study, mutators.of_toml, read_heat_study),
    "pv study": Row("facade_pv.toml", copied(DEMO / "facade_pv.toml"), mutators.of_toml, read_pv_study),
    "fabric table": Row("s.csv", text(SHEET), mutators.of_text, read_fabric_table),
    "blind product": Row("s.json", json_text(product("venetian")), mutators.of_json, read_shade_file),
    "pane product": Row("p.json", json_text(PRODUCT), mutators.of_json, read_pane_file),
    "pane of optics": Row("p.dat", text(OPTICS), mutators.of_text, read_pane_file),
    "optical data": Row("p.json", json_text(OPTICAL), mutators.of_json, read_pane_file),
    "glazing layers": Row("p.json", json_text(LAYERS), mutators.of_json, read_glazing_layers),
    "angular table": Row("a.csv", text(ANGULAR), mutators.of_text, read_angular_table),
    "table of g": Row("g.csv", text(G_VALUES), mutators.of_text, read_g_table),
    "radiance cell": Row("c.rad", text(CELLULAR), mutators.of_text, lambda file: read_radiance_layer(file, PERIOD)),
    "function file": Row(
        "weave.cal", functions, mutators.of_text, lambda file: read_building_file(file.with_name("b.rad"))
    ),
    "page": Row("page.toml", text(PAGE), mutators.of_toml, lambda file: read_page(file, Literal["model", "rooms"])),
    "room uses": Row("uses.toml", text(USES), mutators.of_toml, read_uses),
    "corrections": Row("c.toml", text(CORRECTIONS), mutators.of_toml, read_corrections),
    "luminaire": Row("l.ies", text(ies([0.0, 45.0, 90.0], GAMMA, [INTENSITIES] * 3)), mutators.of_text, finite(lamp)),
    "luminaire of Europe": Row("l.ldt", text(ldt(0, 4, GAMMA, [INTENSITIES] * 4)), mutators.of_text, finite(lamp)),
    "spectrum of a lamp": Row(
        "l.csv", text(SPECTRUM.format("power")), mutators.of_text, finite(lambda file: lamp_spectrum(str(file)))
    ),
    "lamp of TM-27": Row("l.spdx", text(SPDX), mutators.of_xml, finite(lambda file: lamp_spectrum(str(file)))),
    "spectrum of a system": Row(
        "s.csv", text(SPECTRUM.format("transmittance")), mutators.of_text, finite(read_spectrum)
    ),
    "spectrum of slats": Row("s.csv", text(SPECTRUM.format("reflectance")), mutators.of_text, finite(read_reflectance)),
    "light of slats": Row("s.json", json_text(SLATS), mutators.of_json, finite(slats)),
    "observers": Row("o.csv", text(OBSERVERS), mutators.of_text, finite(observers)),
    "views": Row("v.vf", text(VIEWS), mutators.of_text, lambda file: parsed_views(str(file))),
    "schedule": Row("s.csv", text(CLOCK), mutators.of_text, finite(schedule)),
    "trees": Row("t.toml", text(TREES), mutators.of_toml, read_surroundings),
    "mesh of glTF": Row("m.gltf", mesh_of("gltf"), mutators.of_json, read_surroundings),
    "mesh of PLY": Row("m.ply", mesh_of("ply"), mutators.of_text, read_surroundings),
    "mesh of STL": Row("m.stl", mesh_of("stl_ascii"), mutators.of_text, read_surroundings),
    "fit": Row("fit.toml", fitted, mutators.of_toml, finite(planted)),
    "measurements of a fit": Row(
        "measured.csv", fitted, mutators.of_text, lambda file: finite(planted)(file.with_name("fit.toml"))
    ),
    "measured weather": Row("site.csv", measured_weather, mutators.of_text, finite(named_columns)),
    "project": Row("study.toml", project, mutators.of_toml, shown),
    "journal": Row("commands.jsonl", project, mutators.of_text, shown),
    "request": Row("request.json", project, mutators.of_json, changed),
    "commands asked for": Row("action.json", project, mutators.of_json, wanted_actions),
    "comparison": Row("results/comparison/results.csv", project, mutators.of_text, shown),
    "control in IFC": Row("c.ifc", stored_rules, mutators.of_properties, read_control),
    "explorer": Row("case.js", explorer, mutators.of_script, explored),
    "mark": Row("cfs-results.json", mark, mutators.of_json, results_again),
    "case of a study": Row("case.npz", case_result, mutators.of_arrays, stored),
}

# Mutations that were no line once: row, number
REGRESSIONS: list[tuple[str, int]] = [
    ("pv study", 82),
    ("luminaire", 67),
    ("luminaire of Europe", 153),
    ("lamp of TM-27", 271),
    ("light of slats", 58),
    ("observers", 51),
    ("mesh of glTF", 294),
    ("mesh of glTF", 2515),
    ("mesh of PLY", 77),
    ("project", 48),
    ("project", 14299),
    ("request", 633),
]


@dataclass
class Outcome:
    """What became of the mutations of a file."""

    results: int = 0
    refused: int = 0  # in one line
    faults: list[str] = field(default_factory=list)  # anything else, as text


def outcome(name: str, folder: Path, numbers: Iterable[int]) -> Outcome:
    """Read the mutations with these numbers of a row's file."""
    row, result = ROWS[name], Outcome()
    file = folder / row.name
    row.make(file)
    good = file.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of NumPy; what leaves the reader is looked at
        row.read(file)
        for number in numbers:
            file.write_bytes(row.mutate(good, np.random.default_rng([0, number])))
            try:
                row.read(file)
                result.results += 1
            except (CfsError, ValueError, OSError) as error:
                message = user_message(error)
                result.refused += 1
                if message is None or len(message) > LONGEST + 40 or "\n" in message:
                    result.faults.append(f"{name} {number}: {error!r:.300}")
            except Exception as error:
                result.faults.append(f"{name} {number}: {error!r:.300}")
    return result


@pytest.mark.parametrize("name", ROWS)
def test_odd_files_are_read_or_one_line(name, tmp_path) -> None:
    regressions = [number for row, number in REGRESSIONS if row == name]
    result = outcome(name, tmp_path, [*regressions, *range(QUICK)])
    assert not result.faults
    assert result.refused or name in SILENT


@pytest.mark.parametrize("name", ["horizon", "angular table", "table of g", "fabric table"])
def test_a_cell_of_200_000_characters_is_refused_in_one_line(name, tmp_path) -> None:
    """Python's reader takes no more than 131,072."""
    row = ROWS[name]
    file = tmp_path / row.name
    row.make(file)
    file.write_text(file.read_text() + 200_000 * "9" + ",1\n")
    with pytest.raises(CfsError, match=file.name) as caught:
        row.read(file)
    assert len(str(user_message(caught.value))) < LONGEST


@pytest.mark.slow
@pytest.mark.parametrize("name", ROWS)
def test_many_odd_files_are_read_or_one_line(name, tmp_path) -> None:
    result = outcome(name, tmp_path, range(SLOW))
    assert not result.faults
    assert result.refused or name in SILENT
