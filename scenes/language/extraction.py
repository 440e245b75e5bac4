"""Messages of the program for its catalogues: extraction, and what a catalogue lacks.

`python -m scenes.language.extraction` brings `de.po` and `fr.po` up to date with the code and names
what has no translation; it never changes one that is there.
"""

from __future__ import annotations

import ast
import io
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from babel.messages import Catalog
from babel.messages.extract import DEFAULT_KEYWORDS, extract_from_dir
from babel.messages.frontend import parse_mapping_cfg
from babel.messages.pofile import read_po, write_po

from scenes.language.catalogue import TRANSLATED

ARGUMENTS = {"gettext": 1, "N_": 1, "Note": 1, "ThermalNote": 1, "ngettext": 2}  # that are messages
PACKAGES = [Path(__file__).parents[2] / name for name in ("scenes", "bim", "mitsuba_cfs", "thermal")]
HEADER = """\
# Text of the pages of mitsuba-cfs in {language}, by the English text in the code.
# `make catalogues` adds what is new in the code; translations are written by hand.
msgid ""
msgstr ""
"Language: {code}\\n"
"Content-Type: text/plain; charset=utf-8\\n"
"Plural-Forms: {plural}\\n"

"""


def extract_python(
    fileobj: IO[bytes], keywords: object, comment_tags: object, options: object
) -> Iterator[tuple[int, str, str | tuple[str, ...], list[str]]]:
    """Messages of a Python file: literal texts of `gettext`, `Note`, `ngettext` and `N_`.

    A second literal text of `gettext` and `Note` is the singular.

    Babel's own extraction loses calls inside another call's arguments.
    """
    for node in ast.walk(ast.parse(fileobj.read())):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        count = ARGUMENTS.get(name, 0)
        texts = [a.value for a in node.args[:2] if isinstance(a, ast.Constant)]
        if name == "ngettext" and len(texts) == count:
            yield node.lineno, name, tuple(texts), []
        elif count == 1 and len(texts) == 2:
            yield node.lineno, "ngettext", tuple(reversed(texts)), []
        elif count == 1 and texts:
            yield node.lineno, name, texts[0], []


def extract_table(
    fileobj: IO[bytes], keywords: object, comment_tags: object, options: dict[str, str]
) -> Iterator[tuple[int, str, str, list[str]]]:
    """Messages of a TOML table: texts at the keys of the option `keys`; all of `whole`'s tables.

    The text at a key with "-one" after it is the singular of that at the key.
    """
    keys, whole = options.get("keys", "").split(), options.get("whole", "").split()
    for text in _texts(tomllib.load(fileobj), keys, whole, taken=False):
        yield 1, "gettext" if isinstance(text, str) else "ngettext", text, []


def _texts(value: Any, keys: list[str], whole: list[str], *, taken: bool) -> Iterator[str | tuple[str, str]]:
    if isinstance(value, str):
        if taken and any(letter.isalpha() for letter in value):
            yield value
    elif isinstance(value, list):
        for one in value:
            yield from _texts(one, keys, whole, taken=taken)
    elif isinstance(value, dict):
        for key, one in value.items():
            if key in whole:
                yield from _texts(list(one), keys, whole, taken=True)
            if f"{key}-one" in value and (taken or key in keys):
                yield value[f"{key}-one"], one
                continue
            yield from _texts(one, keys, whole, taken=taken or key in keys or key in whole)


def extracted() -> Catalog:
    """Every message of the program with the files that it is in."""
    config = Path(__file__).with_name("babel.cfg")
    with config.open(encoding="utf-8") as file:
        methods, options = parse_mapping_cfg(file, str(config))
    catalog = Catalog()
    keywords = {**DEFAULT_KEYWORDS, "Note": None, "ThermalNote": None}
    for package in PACKAGES:
        for path, _, message, comments, context in extract_from_dir(package, methods, options, keywords=keywords):
            place = f"{package.name}/{Path(path).as_posix()}"
            catalog.add(message, None, [(place, None)], auto_comments=comments, context=context)
    return catalog


def update() -> None:
    """Bring the catalogues up to date and print what they lack."""
    template = extracted()
    for language in TRANSLATED:
        path = Path(__file__).with_name(f"{language}.po")
        with path.open("rb") as file:
            catalog = read_po(file, locale=language)
        catalog.update(template, no_fuzzy_matching=True, update_creation_date=False)
        catalog.obsolete.clear()
        write(catalog, path)
        for message in catalog:
            if message.id and not (all(message.string) if message.pluralizable else message.string):
                print(f"{path.name}: {message.id!r}")


def write(catalog: Catalog, path: Path) -> None:
    """Write a catalogue, its messages in the order of the files that they are in."""
    text = io.BytesIO()
    write_po(text, catalog, width=0, sort_by_file=True, include_lineno=False, omit_header=True)
    header = HEADER.format(language=catalog.locale.english_name, code=catalog.locale, plural=catalog.plural_forms)
    path.write_text(header + text.getvalue().decode().strip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    update()
