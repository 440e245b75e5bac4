"""Catalogues of the pages: complete, nothing obsolete, fields and spacing of each translation."""

from __future__ import annotations

import ast
import re
import string
from pathlib import Path

import pytest
from babel.messages.pofile import read_po

from mitsuba_cfs.notes import Note
from scenes.language import catalogue
from scenes.language.catalogue import TRANSLATED, decimal, gettext, in_language, messages, ngettext, translated
from scenes.language.extraction import ARGUMENTS, PACKAGES, extracted, write
from scenes.language.numbers import colon, day_and_month, month_name, rounded, short_month
from tests.modules import MODULES

# A French text has a narrow space before ; ! ? and a space that does not break before a colon,
# unless it is part of a time, an address or an option
TIGHT = re.compile(r"[^\s;!?:\u00a0\u202f](?:[;!?](?=\s|$)|:(?=\s|$))|[ ][;!?:](?=\s|$)")


# A number before the noun that it counts; in "1 of 3" and "1 more" no noun follows
COUNTED = re.compile(r"\{count\} (?!of|more|computed|found)[a-z]")
SEVERAL = (  # beginnings of messages that one of a thing never has
    "The GlobalId is used {count} times",
    "{count} times: ",
    "{count} small elements are too many",
    "The heat of the {count} rooms",
    "The file has {count} second-level space boundaries",
)


@pytest.fixture(scope="module")
def program():
    """Every message of the program."""
    return extracted()


def keys(catalog) -> set[str]:
    """Messages of a catalogue, of those with a plural the singular."""
    return {one.id if isinstance(one.id, str) else one.id[0] for one in catalog if one.id}


def pairs(language: str):
    """Messages with their translations, each form by itself."""
    for one in messages(language):
        if one.pluralizable:
            yield from zip((one.id[0], one.id[1]), one.string, strict=True)
        elif one.id:
            yield one.id, one.string


def fields(text: str) -> set[str]:
    """Names of a text's fields."""
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_message_is_translated_and_no_other(program, language) -> None:
    assert keys(messages(language)) == keys(program), "run `make catalogues` and translate"
    assert not [text for text, translated in pairs(language) if not translated.strip()]


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_translation_has_the_fields_of_its_message(language) -> None:
    for one in messages(language):
        if one.pluralizable:  # one of a thing may say it without the number
            assert fields(one.id[1]) == fields(one.string[1]), one.id
            assert fields(one.string[0]) <= fields(one.id[0]) | fields(one.id[1]), one.id
        elif one.id:
            assert fields(one.id) == fields(one.string), one.id


def test_french_has_its_spaces() -> None:
    wrong = [translated for _, translated in pairs("fr") if TIGHT.search(translated)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("language", TRANSLATED)
def test_numbers_in_a_translation_have_a_comma(language) -> None:
    """Clauses of standards and versions keep their points."""
    for text, translation in pairs(language):
        for number in re.findall(r"(?<![\d.])0\.\d+", translation):
            assert number not in text, translation


def test_messages_are_literal() -> None:
    """What is put together at run time cannot be translated; a table marks its texts with N_."""
    wrong = []
    for path in MODULES:
        if not set(PACKAGES) & set(Path(path).resolve().parents):
            continue
        tree = ast.parse(Path(path).read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ARGUMENTS:
                if any(isinstance(one, ast.JoinedStr | ast.BinOp | ast.IfExp) for one in node.args):
                    wrong.append(f"{path}:{node.lineno}")
    assert not wrong, wrong


@pytest.mark.parametrize("language", TRANSLATED)
def test_a_catalogue_is_written_as_it_was_read(program, language, tmp_path) -> None:
    path = Path(catalogue.__file__).with_name(f"{language}.po")
    with path.open("rb") as file:
        read = read_po(file, locale=language)
    read.update(program, no_fuzzy_matching=True, update_creation_date=False)
    write(read, tmp_path / path.name)
    assert (tmp_path / path.name).read_text("utf-8") == path.read_text("utf-8")


def test_numbers_dates_and_plurals_follow_the_language() -> None:
    def shown() -> tuple[str, ...]:
        return (
            rounded(1234.5, 1),
            decimal("0.5"),
            short_month(3),
            month_name(3),
            ngettext("{count} room", "{count} rooms", 1),
            ngettext("{count} room", "{count} rooms", 1200),
            colon("a", "b"),
            gettext("UDI below {limit} lx", limit=0.5),
        )

    assert shown() == ("1\u202f234.5", "0.5", "Mar", "March", "1 room", "1\u202f200 rooms", "a: b", "UDI below 0.5 lx")
    with in_language("de"):
        assert shown() == (
            "1\u202f234,5",
            "0,5",
            "Mär",
            "März",
            "1 Raum",
            "1\u202f200 Räume",
            "a: b",
            "UDI unter 0,5 lx",
        )
        with pytest.raises(KeyError):
            gettext("{axis}: lower limit", other=1)
    with in_language("fr"):
        assert shown() == (
            "1\u202f234,5",
            "0,5",
            "mars",
            "mars",
            "1 local",
            "1\u202f200 locaux",
            "a\u00a0: b",
            "UDI sous 0,5 lx",
        )
        assert ngettext("{count} room", "{count} rooms", 0) == "0 local"  # French has one for none
    assert gettext("Glare") == "Glare"


@pytest.mark.parametrize(("language", "words"), [("en", "21 March"), ("de", "21. März"), ("fr", "21 mars")])
def test_a_date_has_the_order_of_its_language(language, words) -> None:
    import pandas as pd

    with in_language(language):
        assert day_and_month(pd.Timestamp(2023, 3, 21)) == words


def test_what_counts_a_noun_has_a_singular(program) -> None:
    plain = [one.id for one in program if isinstance(one.id, str) and COUNTED.search(one.id)]
    assert [text for text in plain if not text.startswith(SEVERAL)] == []
    assert all(any(text.startswith(start) for text in plain) for start in SEVERAL)


@pytest.mark.parametrize("language", ["en", *TRANSLATED])
def test_every_text_is_written_for_one_and_for_two(program, language) -> None:
    counted = [one.id for one in program if one.pluralizable]
    assert len(counted) > 60
    with in_language(language):
        for singular, plural in counted:
            values = {name: AnyNumber() for name in fields(plural) - {"count"}}
            one, two = (ngettext(singular, plural, count, **values) for count in (1, 2))
            assert gettext(plural, singular, count=1, **values) == one
            assert "{" not in one + two and ("{count}" not in plural or "2" in two), plural
            if language == "en":
                assert one.replace("1", "2") != two, plural
                note = Note(plural, singular, count=1, **values)
                assert str(note) == translated(note) == one


class AnyNumber(float):
    """A number that any format writes as a letter."""

    def __format__(self, spec: str) -> str:
        return "n"
