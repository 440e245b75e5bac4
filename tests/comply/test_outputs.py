"""A check of rooms by rays alone, and its files: dossier, values, BCF topics, property sets."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from bim.model import Element
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from scenes.commands.comply import command
from scenes.comply.comply import blinds_words, check_rooms
from scenes.comply.files import ComplyFiles, least_altitude, read_files
from scenes.comply.findings import SeatGlare
from scenes.comply.options import ComplyOptions
from scenes.comply.outputs import (
    answers,
    dossier_html,
    glare_words,
    plans,
    shortened,
    summary,
    sun_bars,
    write_compliance,
    write_into_ifc,
)
from scenes.comply.results import ONE_STATE, GridSummary, RoomLights
from scenes.comply.rules import read_rule
from scenes.comply.tables import beside_limit, openings_table, shown
from scenes.comply.uses import read_uses
from scenes.demo import OFFICE, WEATHER
from scenes.input_files import InputFiles, read_building, read_weather
from scenes.page_options import PageOptions
from scenes.report.typography import tied
from scenes.result_folder import ResultFolder
from scenes.results import GlareMap
from scenes.surroundings import has_surroundings
from tests.devtools import Page, chromium

HEAD = """
title = "View and sun"
edition = "2026 <draft>"
source = ["mine"]
grid = {height = 0.8, margin = 0.5}
"""
VIEW = """
[[criterion]]
key = "view"
title = "View & distance"
clause = "clause 7.1"
[[criterion.level]]
name = "met"
needs = [{what = "view", angle_deg = 14, distance = 6, layers = 1, at_least = 0.75}]
"""
SUN = """
[[criterion]]
key = "sun"
title = "Sun"
clause = "clause 7.2"
occupied = true
[[criterion.level]]
name = "met"
needs = [{what = "sun_hours", at_least = 1.5}]
"""
RULE = HEAD + VIEW + SUN
STRICT = HEAD + SUN.replace("1.5", "6.0")


@pytest.fixture(scope="module")
def options(tmp_path_factory) -> ComplyOptions:
    path = tmp_path_factory.mktemp("rule") / "rays.toml"
    path.write_text(RULE)
    return ComplyOptions(None, WEATHER, standards=(str(path),))


def files_of(options: ComplyOptions, **more) -> ComplyFiles:
    rules = {"rays": read_rule(options.standards[0])}
    found = ComplyFiles(InputFiles(read_weather(WEATHER)), rules, read_uses(), None, None, 13.0, "assumed: as you like")
    return replace(found, **more)


@pytest.fixture(scope="module")
def result(options):
    """A south office that meets all, a north store, a room with a hatch, one without a window."""
    south = shoebox(name="Office south").spaces[0]
    north = shoebox(name="Store north", facing_deg=0).spaces[0]
    hatch = [WindowRectangle(1.9, 2.6, 0.2, 0.2)]
    dim = shoebox(name="Office hatch", windows=hatch, facing_deg=0).spaces[0]
    dark = shoebox(name="Meeting room", windows=[]).spaces[0]
    lost = shoebox(name="Cell", windows=[]).spaces[0]
    building = replace(shoebox(), name="<House>", spaces=(south, north, dim, dark, lost))
    return check_rooms(building, options, files_of(options))


def verdicts(result):
    return {room.space.name: {v.criterion.key: v.reached for v in room.verdicts} for room in result.rooms}


def test_the_masthead_has_the_median_of_daylight_where_a_rule_judges_daylight(result):
    assert "Median diffuse illuminance" not in dict(summary(result))
    daylight = replace(result, rules={"en17037": read_rule("en17037")})
    assert dict(summary(daylight))["Median diffuse illuminance"].endswith(" lx")


def test_rooms_are_checked(result):
    """No rays of light: a window's system is not even asked for; dark rooms count if occupied."""
    assert verdicts(result) == {
        "Office south": {"view": "met", "sun": "met"},
        "Store north": {"view": "met", "sun": "not applicable"},
        "Office hatch": {"view": "not met", "sun": "not met"},
        "Meeting room": {"view": "not met", "sun": "not met"},
    }  # a cell without a window and without a use is no occupied room
    assert [v.rooms for v in result.verdicts] == [4, 3]
    assert result.verdicts[0].values == pytest.approx([0.5])


def test_assumptions_name_what_was_assumed(result):
    text = "\n".join(result.assumptions)
    assert "for solar altitudes from 13° (assumed: as you like)" in text
    assert "Office south: office; name 'Office south' contains 'office'." in text


def test_the_dossier_says_all(result):
    html = dossier_html(result)
    for wanted in (
        "&lt;House&gt;",
        "2026 &lt;draft&gt;",
        "clause 7.1",
        "View &amp; distance",
        "≥\xa075\xa0%",
        "Meeting room",
        "mine",
        "Sunlight at the reference points of the openings",
    ):
        assert wanted in html
    assert "<script" not in html and "http:" not in html.replace("http://www.w3.org", "")


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_a_long_address_among_the_sources_does_not_widen_a_phones_page(result, tmp_path):
    rule = result.rules["rays"].model_copy(update={"source": ["example.org/" + 60 * "x"]})
    (tmp_path / "dossier.html").write_text(dossier_html(replace(result, rules={"rays": rule})), "utf-8")
    with Page(tmp_path, width=390, height=800) as page:
        size = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": False}
        page.send("Emulation.setDeviceMetricsOverride", **size)
        page.open((tmp_path / "dossier.html").as_uri(), ready="document.readyState === 'complete'")
        assert page.value("document.documentElement.scrollWidth") <= 390


def test_the_dossier_begins_with_its_answers(result):
    """One sentence for each criterion; the rooms that miss it have their names."""
    found = dict(answers(result))
    assert list(found) == ["2026 <draft>, View & distance", "2026 <draft>, Sun"]
    assert "Meeting room" in found["2026 <draft>, Sun"]
    for name, text in found.items():
        key = "view" if "View" in name else "sun"
        missed = [room for room, by_key in verdicts(result).items() if by_key[key] == "not met"]
        met = [room for room, by_key in verdicts(result).items() if by_key[key] == "met"]
        assert all((room in text) == (room in missed) for room in verdicts(result)), text
        assert f"{len(met)} of {len(met) + len(missed)} rooms {'meets' if len(met) == 1 else 'meet'} it" in text
    assert "Meeting room (0.00 h, limit ≥ 1.5 h)" in found["2026 <draft>, Sun"]
    html = dossier_html(result)
    assert html.index('class="answer"') < html.index('id="contents"') < html.index("Cell.")
    assert 'class="preview"' not in html
    assert html.count('class="answer"') == 2
    french = dossier_html(result, page=PageOptions(language="fr"))
    assert french.count("\u00a0:</b>") == 2 and ":</b>" not in french.replace("\u00a0:</b>", "")
    quick = dossier_html(result, quick=True)
    assert '<p class="preview" role="note">Quick run' in quick and quick.count("Quick run:") == 1


def test_an_answer_that_was_not_computed_says_why(result):
    rule = result.rules["rays"].model_copy(update={"weather": ("Rostock",)})
    rooms = [
        replace(
            room,
            verdicts=tuple(replace(one, values=tuple((None,) * len(v) for v in one.values)) for one in room.verdicts),
        )
        for room in result.rooms
    ]
    unknown = [replace(one, values=(None,) * len(one.values), met=(None,) * len(one.met)) for one in result.verdicts]
    lost = replace(result, rules={"rays": rule}, rooms=tuple(rooms), verdicts=tuple(unknown))
    for text in dict(answers(lost)).values():
        assert text == "Not computed. It asks for the weather of Rostock."


def test_a_criterion_has_its_own_word_for_a_miss(result):
    """As LEED's ASE: a room above the limit is no failure, its design must be explained."""
    assert next(one for one in read_rule("leed-v4.1").criterion if one.key == "ase").missed == "explanation required"
    asked = result.rules["rays"].criterion[1].model_copy(update={"missed": "explanation required"})
    rule = result.rules["rays"].model_copy(update={"criterion": (result.rules["rays"].criterion[0], asked)})
    rooms = tuple(
        replace(room, verdicts=(room.verdicts[0], replace(room.verdicts[1], criterion=asked))) for room in result.rooms
    )
    told = replace(result.verdicts[1], criterion=asked)
    changed = replace(result, rules={"rays": rule}, rooms=rooms, verdicts=(result.verdicts[0], told))
    sentence = dict(answers(changed))["2026 <draft>, Sun"]
    assert sentence.startswith("Explanation required: ") and "Meeting room (0.00 h, limit ≥ 1.5 h)" in sentence
    assert "not met" not in sentence.lower()
    html = dossier_html(changed)
    assert html.count(">explanation required</td>") == 2 * 2 + 1  # two rooms in two tables, the building once
    assert "2026 &lt;draft&gt;, Sun (clause 7.2)" in html and "rays, Sun" not in html


def test_a_dossier_with_a_title_and_without_its_rooms(result):
    options = PageOptions(title="Ours", author="A", left_out=("rooms", "sources"))
    html = dossier_html(result, page=options)
    assert "<h1>Ours</h1>" in html and "<dt>Author</dt><dd>A</dd>" in html
    assert "Sections left out by the page file: rooms, sources." in html
    assert "solar altitudes from 13°" in html  # what was assumed always stands
    for gone in ('id="room-', 'href="#room-', 'id="sources"', 'href="#sources"'):
        assert gone in dossier_html(result) and gone not in html


def test_a_room_says_what_it_misses(result):
    """The sentence of its BCF topic; rooms that miss nothing have none."""
    sections = dict(
        zip(("dark", "hatch", "north", "south"), dossier_html(result).split('<section id="room-')[1:], strict=True)
    )
    assert "Not met:" not in sections["south"] and "Not met:" not in sections["north"]
    assert "2026 &lt;draft&gt;, Sun (clause 7.2)" in sections["dark"]
    assert "0.00 h, required ≥ 1.5 h for met" in sections["dark"].replace("\xa0", " ")


def test_numbers_stay_with_their_units(result):
    """A limit that ends a line with "≥" reads as another one's; so it did in print."""
    assert tied("12\u202f490 K h, 3 K higher") == "12\u202f490\xa0K\xa0h, 3 K higher"
    assert tied("high ≥ 750 lx (≥ 100 %); 2 points: 5 h") == (
        "high ≥\xa0750\xa0lx (≥\xa0100\xa0%); 2\xa0points: 5\xa0h"
    )
    html = dossier_html(result)
    assert "≥\xa075\xa0%" in html and "≥\xa0100\xa0%" in html and "≥ " not in html


def test_rooms_are_called_rooms_and_those_left_out_are_named(result):
    """After a part's number "9. 4 Bedroom" has two numbers; a cell that no rule looks at."""
    html = dossier_html(result)
    assert html.count("Room Office south</h2>") == 1 and ">Room Office south</a>" in html
    (left,) = (text for text in result.assumptions if text.startswith("Not assessed"))
    assert left == "Not assessed (no window, not regularly occupied): Cell."


def test_a_room_says_how_glare_was_rated(result):
    """Two seats, each in two directions; one of them exceeds 0.46 in 5 % of the hours."""
    eyes = np.repeat([[1.0, 1.0, 1.2], [2.0, 1.0, 1.2]], 2, axis=0)
    dgp = np.full((4, 1000), 0.3)
    dgp[2, :60] = 0.46
    found = glare_words(SeatGlare(eyes, eyes, dgp, operated=True))
    assert found == ("2 seats, 2 directions each; DGP exceeded in 5 % of the hours: 0.46 at the worst")
    one = glare_words(SeatGlare(eyes[:1], eyes[:1], dgp[:1], operated=True))
    assert one == "1 seat; DGP exceeded in 5 % of the hours: 0.30"


def test_the_worst_view_of_a_glare_map_is_named_in_words():
    """The second view is the worst; 3 and 4 of its and the other's hours were rated by pictures."""
    eyes, ways = np.array([[1.0, 2.0, 1.2], [3.0, 2.0, 1.2]]), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    dgp = np.array([[0.3] * 20, [0.3] * 17 + [0.5] * 3])
    plan = GlareMap.of(eyes, ways, np.full((2, 2, 20), 0.3, dtype=np.float32), spacing=2.0, step_h=1.0)
    seats = SeatGlare(eyes, ways, dgp, True, plan, np.array([4, 3]))
    where = "worst view of the map: x 3.0 m, y 2.0 m, looking east; DGP exceeded in 5 % of the hours: 0.50"
    assert glare_words(seats) == f"{where}; 7 hours rated by pictures"
    assert glare_words(replace(seats, pictured=np.array([0, 0]))) == f"{where}; decided by the map"


def test_each_quantity_of_the_light_has_one_plan(result):
    """On the Grid of the rule that asks for it, not on that of every rule."""
    room = result.rooms[0]

    def grid(height: float, lux: float, closed=None) -> GridSummary:
        points = np.array([[1.0, 1.0, height], [2.0, 1.0, height]])
        half = np.full(2, lux)
        return GridSummary(points, half / 1e4, half / 1e3, np.full(2, 60.0), half, closed)

    names = ("breeam-hea01", "en17037", "lm83")
    lit = replace(result, rules={name: read_rule(name) for name in names}, calendar=result.calendar)
    grids = (grid(0.7, 111.0), grid(0.85, 222.0), grid(0.76, 333.0, np.zeros(1)))
    light = RoomLights(room.space, dict(zip(names, grids, strict=True)), {})
    found = {one.title: one for one in plans(lit, replace(room, view=None, light=light))}
    assert list(found) == [
        "Illuminance in half of the daylight hours",
        "Daylight factor",
        "Daylight autonomy",
        "Sunlit hours",
    ]
    assert "Grid of EN 17037:2018+A1:2021, 0.85 m" in found["Illuminance in half of the daylight hours"].explanation
    assert "222" in found["Illuminance in half of the daylight hours"].body
    autonomy = found["Daylight autonomy"].explanation  # of sDA before BREEAM's hours
    assert "Grid of IES LM-83-12" in autonomy and "blinds operated" in autonomy
    assert "Grid of IES LM-83-12" in found["Sunlit hours"].explanation


def test_values_have_a_row_for_each_need(result, tmp_path):
    write_compliance(result, ResultFolder(tmp_path / "out", "comply"))
    table = pd.read_csv(tmp_path / "out" / "values.csv")
    assert len(table) == 4 + 3
    row = table[(table.room == "Office south") & (table.criterion == "view")].iloc[0]
    assert (row.limit, row.unit, row.met, row.clause) == (75.0, "%", "yes", "clause 7.1")
    assert row.value == 100.0
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"dossier.html", "issues.bcf", "model.ids", "problems.csv"} <= names


def test_topics_are_of_rooms_that_miss_something(result, tmp_path):
    """BCF 2.1: a topic selects its room; numbers and limits stand in its description."""
    write_compliance(result, ResultFolder(tmp_path / "out", "comply"))
    with zipfile.ZipFile(tmp_path / "out" / "issues.bcf") as archive:
        assert ElementTree.fromstring(archive.read("bcf.version")).get("VersionId") == "2.1"
        markups = [name for name in archive.namelist() if name.endswith("markup.bcf")]
        found = {}
        for name in markups:
            topic = ElementTree.fromstring(archive.read(name)).find("Topic")
            folder = name.partition("/")[0]
            assert topic.get("Guid") == folder
            view = ElementTree.fromstring(archive.read(f"{folder}/viewpoint.bcfv"))
            guid = view.find("Components/Selection/Component").get("IfcGuid")
            found[guid] = topic.findtext("Title"), topic.findtext("Description")
    assert set(found) == {"Office hatch-guid", "Meeting room-guid"}
    title, text = found["Meeting room-guid"]
    assert title == "Meeting room: 2 criteria not met"
    assert "clause 7.2" in text and "0.00 h, required ≥ 1.5 h for met" in text


def test_no_topics_are_written_where_every_room_meets_its_criteria(result, tmp_path):
    kept = tuple(
        replace(room, verdicts=tuple(replace(one, asked=False) for one in room.verdicts)) for room in result.rooms
    )
    write_compliance(replace(result, rooms=kept), ResultFolder(tmp_path / "out", "comply"))
    assert not (tmp_path / "out" / "issues.bcf").exists()


def test_openings_stand_in_the_axes_of_the_model_file(result):
    """A model turned by a quarter: its x is the building's y."""
    turned = np.array([[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 7.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    room = next(room for room in result.rooms if room.sun is not None and room.sun.openings)
    (row, *_) = openings_table(room, replace(result.building, from_model=turned)).rows
    x, y, z = room.sun.openings[0].point
    assert [float(cell.replace("−", "-")) for cell in row[1:4]] == pytest.approx([y - 7.0, 5.0 - x, z], abs=0.006)
    assert room.sun.openings[0].guid in row[0]


def test_what_a_rule_includes_is_in_its_section_and_what_it_leaves_out_ends_the_assumptions(result):
    rule = result.rules["rays"].model_copy(update={"included": ("A and b.",)})
    html = dossier_html(replace(result, rules={"rays": rule}))
    section = html.split('<section id="rule-1"')[1].split("</section>")[0]
    assert "<h3>Included</h3>" in section and "<li>A and b.</li>" in section
    assert "A and b." not in html.split('<section id="assumptions">')[1].split("</section>")[0]


def test_windows_of_one_state_have_no_open_blinds():
    assert blinds_words(False, False, None) == ONE_STATE
    assert blinds_words(True, False, None) == "all blinds open"  # some windows have none
    assert blinds_words(True, True, None) == "blinds closed by the rule of LM-83"


def test_a_model_without_surroundings_says_so(result):
    text = "\n".join(result.assumptions)
    assert "The model has no surroundings (neighbouring buildings, trees)" in text
    tree = Element("t", "tree", "IfcBuildingElementProxy", 60.0 + np.eye(3)[None], 0.3, 0.3)
    site = replace(tree, ifc_class="IfcSite")
    assert not has_surroundings(replace(result.building, elements=(site,)))
    assert has_surroundings(replace(result.building, elements=(site, tree)))


def test_calculation_settings_stand_apart_from_the_assumptions(result):
    html = dossier_html(replace(result, settings=("Light is computed with 64 paths per sensor.",)))
    head, _, rest = html.partition('<section id="settings">')
    assert "64 paths" in rest and "64 paths" not in head and "Calculation settings" in rest
    assert "Calculation settings" not in dossier_html(result)


def found_again(bcf: Path, file: Path) -> dict[str, tuple[str, np.ndarray]]:
    """From the topics alone into the model: text and camera's way of each space that one shows.

    The camera stands within the space as ifcopenshell draws it, in the file's own axes.
    """
    import ifcopenshell
    import ifcopenshell.geom

    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    model, found = ifcopenshell.open(file), {}
    with zipfile.ZipFile(bcf) as archive:
        for name in (n for n in archive.namelist() if n.endswith("markup.bcf")):
            markup = ElementTree.fromstring(archive.read(name))
            view = markup.find("Viewpoints").findtext("Viewpoint")
            shown = ElementTree.fromstring(archive.read(f"{name.partition('/')[0]}/{view}"))
            space = model.by_guid(shown.find("Components/Selection/Component").get("IfcGuid"))
            assert space.is_a("IfcSpace")
            title = markup.find("Topic").findtext("Title")
            assert title.startswith(f"{space.Name}")
            eye, direction = (
                np.array([float(shown.find(f"PerspectiveCamera/{what}/{axis}").text) for axis in "XYZ"])
                for what in ("CameraViewPoint", "CameraDirection")
            )
            corners = ifcopenshell.geom.create_shape(settings, space).geometry.verts
            corners = np.reshape(corners, (-1, 3))
            assert np.all(corners.min(axis=0) < eye) and np.all(eye < corners.max(axis=0)), title
            assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-5)
            found[space.GlobalId] = markup.find("Topic").findtext("Description"), direction
    return found


def checked_strictly(building: Path, folder: Path) -> pd.DataFrame:
    """Values of a building against a rule that few rooms keep, by GUID; its files are in `out`."""
    rule = folder / "strict.toml"
    rule.write_text(STRICT)
    options = ComplyOptions(building, WEATHER, standards=(str(rule),))
    files = files_of(options, rules={"strict": read_rule(str(rule))})
    result = check_rooms(read_building(building), options, files)
    write_compliance(result, ResultFolder(folder / "out", "comply"))
    return pd.read_csv(folder / "out" / "values.csv").set_index("guid")


def test_a_failing_room_is_found_again_from_its_topic(tmp_path):
    """The file's true north is not its y: by the world's axes a camera would look askew."""
    table = checked_strictly(OFFICE, tmp_path)
    failing = set(table.index[table.met == "no"])
    assert 0 < len(failing) < len(table)
    found = found_again(tmp_path / "out" / "issues.bcf", OFFICE)
    assert set(found) == failing
    for guid, (text, direction) in found.items():
        assert f"{table.loc[guid].value:.2f} h, required ≥ 6 h" in text
        assert np.abs(direction).max() == pytest.approx(1.0, abs=1e-6)  # windows amid their walls


@pytest.mark.slow
@pytest.mark.parametrize("name", ["AC11-Institute-Var-2-IFC.ifc", "AC20-FZK-Haus.ifc"])
def test_failing_rooms_of_real_buildings_are_found_again(real_data, tmp_path, name):
    file = real_data / "ifc" / "buildings" / name
    table = checked_strictly(file, tmp_path)
    failing = set(table.index[table.met == "no"])
    assert failing
    assert set(found_again(tmp_path / "out" / "issues.bcf", file)) == failing


def test_levels_go_into_the_ifc(options, tmp_path):
    """A property set on each room of a real file."""
    import ifcopenshell
    import ifcopenshell.util.element

    building = read_building(OFFICE)
    found = check_rooms(building, replace(options, building=OFFICE), files_of(options))
    assert not write_into_ifc(found, tmp_path / "with.ifc")
    model = ifcopenshell.open(tmp_path / "with.ifc")
    sets = [ifcopenshell.util.element.get_psets(s) for s in model.by_type("IfcSpace")]
    levels = [one["CFS compliance"]["rays view"] for one in sets if "CFS compliance" in one]
    assert levels and set(levels) <= {"met", "not met"}
    assert {one["CFS compliance"]["use"] for one in sets if "CFS compliance" in one} == {"office"}


@pytest.mark.parametrize(
    ("site", "altitude", "source"),
    [
        ("FRANKFURT AM MAIN, DEU", 11.0, "for DEU, rule file en17037"),
        ("PRAHA, CZE", 13.0, "for CZE"),
        ("Chicago, USA", 13.0, "assumed: no rule file has a value for USA"),
    ],
)
def test_least_altitude_of_the_sun(site, altitude, source):
    weather = replace(read_weather(WEATHER), site=site)
    rules = {"en17037": read_rule("en17037")}
    options = ComplyOptions(None, None, standards=("en17037",))
    found, said = least_altitude(options, rules, weather)
    assert found == altitude and source in said
    own = replace(options, least_altitude_deg=5.0)
    assert least_altitude(own, rules, weather)[0] == 5.0


def test_a_building_without_windows_is_said(options):
    building = shoebox(windows=[])
    with pytest.raises(DataError, match="no space has a window"):
        check_rooms(building, options, files_of(options))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--standard", "en17073"], "no rule 'en17073'; there are breeam-hea01, din-ts-67600, din4108-2"),
        (["--standard", "en17037", "--day", "03-22"], "expected a day from 02-01 to 03-21"),
        (["--standard", "en17037", "--day", "02-30"], "expected a day from 02-01 to 03-21"),
        (["--standard", "en17037", "--day", "noon"], "expected a day from 02-01 to 03-21"),
        ([], "Missing option '--standard'"),
        (["--standard", "din4108-2"], "no verdict for Chicago Ohare Intl Ap, USA: it asks for that of Rostock"),
    ],
)
def test_wrong_choices_are_named_first(words, said, tmp_path):
    arguments = [str(OFFICE), "--weather", str(WEATHER), "--out", str(tmp_path / "out"), *words]
    found = CliRunner().invoke(command, arguments)
    assert found.exit_code != 0
    assert said in f"{found.output} {found.exception}"


def test_files_are_read_by_their_options(tmp_path):
    path = tmp_path / "house.toml"
    path.write_text(RULE)
    options = ComplyOptions(OFFICE, WEATHER, standards=("en17037", str(path)))
    found = read_files(options)
    assert list(found.rules) == ["en17037", "house"]
    assert found.inputs.overrides.light_only and isinstance(Path(str(path)), Path)


def test_a_dossier_prints_on_a4_with_units_as_they_are_written(result):
    """Notes and faults of a model are text of logs: "m2" there, "m²" on the page."""
    note = "U 1.2 W/(m2 K), 0.5 m3/h of air, 3 cm2; m2 of glass from room-m2.ifc and M2"
    html = dossier_html(replace(result, notes=(note,))).replace("\N{NO-BREAK SPACE}", " ")
    assert "U 1.2 W/(m² K), 0.5" in html and "m³/h of air" in html and "3 cm²; m² of" in html
    assert "room-m2.ifc and M2" in html
    (page,) = re.findall(r"@page \{[^}]*size:[^}]*\}", html)
    assert "size: A4;" in page


def test_a_value_that_misses_its_limit_does_not_print_as_if_it_met_it():
    """94.96 % of the hours for 95 %, 299.6 lx for 300 lx; no more digits where none are needed."""
    rule = read_rule("en16798-1").criterion[0].level[0].needs[0]
    assert [shown(rule, v) for v in (0.9496, 0.95, 0.9512)] == ["94.96 %", "95.0 %", "95.1 %"]
    lux = next(c for c in read_rule("en17037").criterion if c.key == "provision").level[0].needs[0]
    assert [shown(lux, v) for v in (299.6, 300.0, 299.4)] == ["299.6 lx", "300 lx", "299 lx"]
    ase = read_rule("lm83").criterion[1].level[0].needs[0]
    assert [shown(ase, v) for v in (0.10004, 0.1, 0.3)] == ["10.004 %", "10.0 %", "30.0 %"]
    assert beside_limit(99.7, 0, lambda v: v >= 100) == "99.7"  # of the floor area


def test_long_names_leave_the_bars_their_room(result):
    """Revit's names of windows took so much of it that the hours ran into one another."""
    room = result.rooms[0]
    name = "M_Single-Glass 1:0813 x 2420mm:0813 x 2420mm:171975"
    openings = tuple(replace(one, name=name) for one in room.sun.openings)
    chart = sun_bars(result, replace(room, sun=replace(room.sun, openings=openings)))
    assert chart.y_ticks[1].label == "M_Single-Glass… 2420mm:171975"
    assert [tick.label for tick in chart.x_ticks][:3] == ["4", "6", "8"]
    assert shortened("Fenster-2") == "Fenster-2"
