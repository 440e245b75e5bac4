"""Pages in German and French: every string shown has its translation, numbers their comma."""

from __future__ import annotations

import re
from dataclasses import replace
from gettext import NullTranslations
from html import unescape
from itertools import pairwise

import pytest

from bim.account import Account, StoreyAccount
from mitsuba_cfs.errors import DataError
from scenes.language import catalogue
from scenes.language.catalogue import TRANSLATED, in_language
from scenes.page_options import PageOptions, RunSection, read_page
from scenes.report.page import report_html, summary
from tests.report.browser import chromium, inspect
from tests.report.building_page import building
from tests.report.synthetic import run_result

LANGUAGES = TRANSLATED
EVERYTHING = Account(  # that can be said of a model which is usable with care
    (StoreyAccount("EG", 3, 5, 20.0, 15.5), StoreyAccount("OG", 0, 0, 2.5, 0.0)),
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
ENGLISH = re.compile(r"\b(of|that|none|the|rooms?|glass|windows?|spaces|usable|with|used|pairs|closed)\b")
BLIND = Account((StoreyAccount("EG", 0, 2, 0.0, 0.0),), 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, cut_off=True)
MARK = re.compile(r"‹[^‹›]*›")
# What a page shows that is no text of its own: names of the run's rooms, files, systems and states,
# symbols and units, and what the program notes in English
DATA = (
    r"Demo office|Open-plan office south|Meeting room west & archive|102 <corner>|\d{3}|Storey \d"
    r"|Venetian blind <45>|open|slats|closed <70°>|view matrix|daylight matrix|annual product"
    r"|pictures|mitsuba-cfs|mitsuba|drjit|llvm_ad_mono|variant|seed"
    r"|[\w.]+\.(?:ifc|epw|xml)|[0-9a-f]{64}"
    r"|SHA-256|(?:J|F|M|A|S|O|N|D)?(?:an|eb|ar|pr|ay|un|ul|ug|ept|ct|ov|ec)"  # months, by Babel
    r"|°C|W/\(m²K\)|cd/m²|m²|m³|kWh|lx|DGP|Ev|UDI|EN 17037|LM-83"
    r"|\b[hmsxyzNESW]\b"
)


class _Marked(NullTranslations):
    """A language that puts every text between marks."""

    def gettext(self, message: str) -> str:
        return f"‹{message}›"

    def ngettext(self, msgid1: str, msgid2: str, n: int) -> str:
        return f"‹{msgid1 if n == 1 else msgid2}›"


@pytest.fixture(scope="module")
def result():
    """Two rooms, one with all there can be, on two storeys; nothing of the English notes."""
    run = run_result(picture_size=48, pictures=2)
    spaces = tuple(replace(room, space=replace(room.space, storey=f"Storey {i}")) for i, room in enumerate(run.spaces))
    manifest = {k: v for k, v in run.manifest.items() if k != "options"}
    manifest |= {"quick": True, "options": {"seed": 3}}
    return replace(
        run, spaces=spaces, notes=(), manifest=manifest, building=replace(run.building, issues=()), issues=()
    )


@pytest.fixture(scope="module")
def marked(result):
    """Pages in the marked language."""
    patch = pytest.MonkeyPatch()
    patch.setattr(catalogue, "translations", lambda language: _Marked())
    pages = [
        report_html(one, PageOptions(language="xx", author="A", left_out=left_out))
        for one, left_out in (
            (result, ()),
            (replace(result, method="three-phase", spaces=result.spaces[:1]), ("glossary",)),
            (replace(result, method="point-in-time"), ("verdict",)),
            (building(12, picture_size=300, pictures=1), ()),
        )
    ]
    patch.undo()
    return pages


def shown(page: str) -> list[str]:
    """Text that a reader sees or hears: of elements, labels, titles and alternatives."""
    page = page.replace("\N{NO-BREAK SPACE}", " ")  # between what stays on one line
    page = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    page = re.sub(r"""<span class="option">([^<]*)</span>""", r"\1", page)  # kept on one line
    said = re.findall(r"""\b(?:aria-label|title|alt)="([^"]*)\"""", page)
    said += re.findall(r">([^<]+)<", page)
    return [unescape(text).strip() for text in said if text.strip()]


def test_every_string_of_the_page_is_asked_of_the_catalogue(marked) -> None:
    missing = set()
    for text in shown(marked[0]):
        rest = text
        while MARK.search(rest):
            rest = MARK.sub("", rest)
        rest = re.sub(DATA, "", rest)
        if re.search(r"[A-Za-z]{2}", rest):
            missing.add(rest.strip())
    assert not missing, "; ".join(sorted(missing))


@pytest.mark.parametrize(
    ("language", "words"),
    [
        ("de", ("Tageslichtautonomie", "Blendung", "Nutzebene", "Sonnenschutz", "Leuchtdichte")),
        ("fr", ("Autonomie lumineuse", "Éblouissement", "plan utile", "Luminance")),
    ],
)
def test_the_page_is_in_the_fields_words_with_a_comma(result, language, words) -> None:
    page = report_html(result, PageOptions(language=language))
    assert f'<html lang="{language}">' in page
    text = " ".join(shown(page))
    for word in words:
        assert word in text
    assert not re.search(r"\b(?:of the|occupied hours|daylight autonomy|glare)\b", text)
    # points are left in names of files and versions, and nowhere between digits of a figure
    rest = re.sub(r"[\w.]+\.(?:ifc|epw|xml)|\d+\.\d+\.\d+", "", text)
    assert not re.findall(r"\d\.\d", rest)
    levels = [int(level) for level in re.findall(r"<h([1-6])", page)]
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_english_is_as_it_was(result) -> None:
    assert report_html(result, PageOptions()) == report_html(result)


def test_another_language_is_one_line(tmp_path) -> None:
    path = tmp_path / "page.toml"
    path.write_text("language = 'it'", encoding="utf-8")
    with pytest.raises(DataError) as error:
        read_page(path, RunSection)
    words = "language: expected 'en', 'de' or 'fr', got 'it'"
    assert str(error.value).startswith(f"{path}: {words}")
    path.write_text("language = 'de'", encoding="utf-8")
    assert read_page(path, RunSection).language == "de"
    assert read_page(path, RunSection, "fr").language == "fr"
    assert read_page(None, RunSection, "fr").language == "fr"


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("width", [1400, 375], ids=["wide", "phone"])
def test_longer_words_fit(result, tmp_path, language, width) -> None:
    page = report_html(result, PageOptions(language=language))
    found = inspect(page, tmp_path, width=width, use="")
    assert found["faults"] == [] and found["overlaps"] == [] and found["clipped"] == []
    assert found["scroll"] <= found["width"], "the page scrolls sideways"


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(
    "account",
    [EVERYTHING, BLIND, replace(EVERYTHING, from_geometry=True), replace(BLIND, storeys=(), from_geometry=True)],
    ids=["all", "none", "found", "nothing"],
)
def test_the_account_of_the_model_is_in_the_pages_language(result, language, account) -> None:
    """Every part of the lines that `bim.account` writes has its translation, whatever it says."""
    run = replace(result, building=replace(result.building, account=account))
    with in_language(language):
        facts = dict(summary(run))
    shown = [facts[catalogue.translations(language).gettext(title)] for title, _ in account.facts]
    assert len(shown) >= 3
    for text in shown:
        assert not ENGLISH.search(text), text
    assert dict(summary(run))["Rooms read"] == dict(account.facts)["Rooms read"]


def test_french_marks_stand_behind_a_narrow_space():
    """Colon, semicolon, exclamation and question mark, percent: behind a space that does not break."""
    texts = [text for text in catalogue.messages("fr") if text.id]
    strings = [one for text in texts for one in (text.string if isinstance(text.string, tuple) else (text.string,))]
    wrong = re.compile(r"[ \w)»}][;!?](?=\s|$)| [:%]|[a-zé)»}]:(?=\s|$)")
    assert not [one for one in strings if wrong.search(one)]
    assert wrong.search("un mot : faux") and wrong.search("un mot: faux") and wrong.search("5 %")
