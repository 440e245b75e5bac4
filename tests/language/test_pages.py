"""Every kind of page in German and French: no English word is left outside names and sources."""

from __future__ import annotations

import re
import string
from dataclasses import replace
from html import unescape

import pytest

from bim.account import Account, StoreyAccount
from bim.report.issue import Issue, Phrase, catalogue, phrases
from bim.shoebox import shoebox
from mitsuba_cfs.notes import Note
from scenes.comply.comply import check_rooms
from scenes.comply.files import ComplyFiles
from scenes.comply.options import ComplyOptions
from scenes.comply.outputs import dossier_html
from scenes.comply.rules import read_rule, rule_names
from scenes.comply.tables import limit_of
from scenes.comply.uses import read_uses
from scenes.demo import WEATHER
from scenes.explore.folder import write_page as write_explorer_page
from scenes.input_files import InputFiles, read_weather
from scenes.language.catalogue import TRANSLATED, gettext, in_language, translated
from scenes.page_options import PageOptions
from scenes.report.page import report_html
from scenes.study_report.page import study_report_html
from tests.report.synthetic import run_result
from tests.report.test_glare_page import write_glare_page
from tests.report.test_study_report import study

# Function words of English that are no words of German or French, and nouns of every page
ENGLISH = re.compile(
    r"\b(the|of|and|with|from|are|not|for|by|that|which|has|have|its|it|were|between|above|below"
    r"|rooms?|windows?|glass|hours?|daylight|glare|this|these|they|each|every|their|used)\b",
    re.IGNORECASE,
)
# Names of the made-up runs, of rules and methods, and what programs are called
NAMES = re.compile(
    r"window \d \((?:Office south|Store north)-window-\d\)|Open-plan office south|Meeting room west & archive"
    r"|Demo office|Office south|Store north"
    r"|<House>|101 <Open> office|\d{3} <corner>|Blinds & shades|broken\.xml: has <no> band"
    r"|The venetian blind stays at 45° all year; it is not moved\.|A note & more\."
    r"|[„«]\s?Office south\s?[“»]|[„«]\s?office\s?[“»]|Daylight simulation|EQ credit Daylight"
    r"|LEED v4\.1 BD\+C|WELL v2, Light|Light exposure|BREEAM UK New Construction"
    r"|(?:WELL Building Standard|IES) [\w.-]+|--[\w-]+|cfs \w+|inner_glass=True|join=\S+"
    r"|reflexion GLASS|GLASS|window \d|\[\[\w+\]\]|'A \+ B'|Glazing \w+|glazing, \S+.*|IfcSpace"
)


def shown(page: str) -> list[str]:
    """Text that a reader sees or hears: of elements, labels, titles and alternatives."""
    page = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    page = re.sub(r'<dl class="sources" lang="en">.*?</dl>', "", page, flags=re.DOTALL)
    texts = re.findall(r"""\b(?:aria-label|title|alt)="([^"]*)\"""", page)
    texts += re.findall(r">([^<]+)<", page)
    return [unescape(text).strip() for text in texts if text.strip()]


def english(page: str) -> list[str]:
    """Texts of a page with an English word."""
    return [text for text in shown(page) if ENGLISH.search(NAMES.sub("", text))]


def every_issue() -> tuple[Issue, ...]:
    """Issues of each code and with each phrase as a value, for one of a thing and for two."""
    issues = []
    for count in (1, 2):
        for code, template in catalogue().items():
            issues.append(Issue(code, f"W{count}", values_of(count, *template[1:5])))
        for key, text in phrases().items():
            repair = Phrase(key, values_of(count, text))
            issues.append(Issue("space-repaired", f"S{count}", {"room": "R1", "repair": repair}))
    return tuple(issues)


def values_of(count: int, *templates: str) -> dict[str, int | float | str]:
    """A value of each field."""
    values = {name: 1.5 if spec else "X1" for name, spec in fields(*templates)}
    return values | ({"count": count} if "count" in values else {})


def fields(*templates: str) -> set[tuple[str, str]]:
    """Names and formats of the fields of templates."""
    parts = [part for text in templates for part in string.Formatter().parse(text)]
    return {(name, spec) for _, name, spec, _ in parts if name}


@pytest.fixture(scope="module")
def run():
    """A run with an account, notes, and every issue that there is."""
    result = run_result(picture_size=48, pictures=2)
    account = Account(
        (StoreyAccount("EG", 3, 5, 20.0, 15.5), StoreyAccount("", 0, 0, 2.5, 0.0)),
        9,
        7,
        glass_assumed=4.2,
        glass_low=1.5,
        glass_missing=0.5,
        phantom=3.1,
        closed=1.1,
        overlapping=("1.01 / 1.02",),
        low=("1.03",),
        missing=("1.04", "1.05"),
        leaking=("1.06",),
        raised=("1.07",),
        shut_in=0.6,
    )
    return replace(result, building=replace(result.building, account=account), issues=every_issue())


def dossier(language: str) -> str:
    """View and sunlight by EN 17037, and every other rule with what it has in words."""
    rule = read_rule("en17037")
    keys = ("view_out", "sunlight_dwellings", "sunlight_wards", "sunlight")
    rule = rule.model_copy(update={"criterion": tuple(one for one in rule.criterion if one.key in keys)})
    options = ComplyOptions(None, WEATHER, standards=("en17037",))
    files = ComplyFiles(
        InputFiles(read_weather(WEATHER)),
        {"en17037": rule},
        read_uses(),
        None,
        None,
        13.0,
        Note("given by --sun-altitude"),
    )
    south, north = shoebox(name="Office south"), shoebox(name="Store north", facing_deg=0)
    building = replace(south, name="<House>", spaces=(*south.spaces, *north.spaces))
    result = replace(check_rooms(building, options, files), issues=every_issue())
    return dossier_html(result, quick=True, page=PageOptions(language=language, author="A"))


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_report_with_every_issue(run, language) -> None:
    page = report_html(run, PageOptions(language=language))
    assert f'<html lang="{language}">' in page
    assert english(page) == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_dossier_with_every_issue(language) -> None:
    page = dossier(language)
    assert f'<html lang="{language}">' in page
    assert english(page) == []


@pytest.mark.parametrize("language", TRANSLATED)
@pytest.mark.parametrize("name", rule_names())
def test_rules_in_words(language, name) -> None:
    rule = read_rule(name)
    with in_language(language):
        texts = [gettext(rule.title)]
        for one in rule.criterion:
            texts += [gettext(one.title), gettext(one.clause)]
            texts += [gettext(level.name) for level in one.level]
            texts += [text for need in one.needs for text in (need.words, limit_of(need))]
    wrong = [text for text in texts if ENGLISH.search(NAMES.sub("", text))]
    assert not wrong


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_study(language) -> None:
    assert english(study_report_html(study(), PageOptions(language=language))) == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_glare_page(language, tmp_path) -> None:
    write_glare_page(tmp_path / "report.html", PageOptions(language=language))
    assert english((tmp_path / "report.html").read_text("utf-8")) == []


@pytest.mark.parametrize("language", TRANSLATED)
def test_an_explorer(language, tmp_path) -> None:
    with in_language(language):
        write_explorer_page(tmp_path, ())
    page = (tmp_path / "index.html").read_text("utf-8")
    assert f'<html lang="{language}">' in page and english(page) == []
    words = re.search(r'id="words">(.*?)</script>', page, re.DOTALL)[1]
    for script in tmp_path.glob("*.js"):
        for message in re.findall(r'gettext\(\s*"([^"]+)"', script.read_text("utf-8")):
            assert (
                f'"{message.replace("<", chr(92) + "u003c")}"'
                in page.encode().decode("unicode_escape", errors="ignore")
                or message.encode("unicode_escape").decode() in words
            ), message


def test_a_note_in_another_language_keeps_what_is_a_name() -> None:
    note = Note(
        "{windows}: {system}, from {source}.",
        windows=Note("Window {names}", names="A"),
        system="the blind",
        source="--cfs blind.xml",
    )
    assert note == "Window A: the blind, from --cfs blind.xml."
    with in_language("de"):
        assert translated(note) == "Fenster A: the blind, aus --cfs blind.xml."
        assert translated("Nobody has translated this.") == "Nobody has translated this."
