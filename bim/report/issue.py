"""Issues of a building model as data: a code, a place, values, an effect.

No text is written where an issue is made: `catalogue.toml` has the English templates of each code,
and `issue_text` fills them where they are shown.

Severity: "loss", part of the model is not simulated; "warning", results may be wrong; "unused", the
file states something that no result depends on; "assumption", a missing or faulty value was
replaced or repaired; "info", nothing changes.
"""

from __future__ import annotations

import string
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

from mitsuba_cfs.notes import Note, filled

Severity = Literal["loss", "warning", "unused", "assumption", "info"]
Audience = Literal["python", "command"]  # whom a fix is for: an argument, or a flag
Fill = Callable[..., str]  # as `mitsuba_cfs.notes.filled`: template, singular, values by name
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
CATALOGUE = Path(__file__).parent / "catalogue.toml"
SMALL_AREA = 0.1  # [m2]
LISTED = 6  # names that a text lists before it counts the rest
COLUMNS = ("where", "what", "consequence", "code", "severity")  # of `issue_rows`


class Template(NamedTuple):
    """Severity and English templates of a code, as `catalogue.toml` has them."""

    severity: Severity
    what: str
    effect: str
    fix: str = ""  # for Python callers
    fix_command: str = ""  # for the command line; "" where it is as for Python callers
    group: tuple[str, ...] = ()  # values that tell issues of the code apart where they are counted
    singular: Mapping[str, str] = {}  # templates in place of these where the value `count` is 1

    @property
    def fields(self) -> frozenset[str]:
        """Names of the values that the templates need."""
        return frozenset().union(*map(_fields, self[1:5]))


@dataclass(frozen=True, slots=True)
class Term:
    """A name of a table of the program, such as of a default material, as a value of an issue."""

    name: str


@dataclass(frozen=True, slots=True)
class Phrase:
    """A phrase of the catalogue, as a value of an issue."""

    key: str
    values: Mapping[str, str | int | float | Phrase] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        missing = _fields(phrases()[self.key]) - self.values.keys()
        if missing:
            raise ValueError(f"phrase {self.key}: lacks {', '.join(sorted(missing))}")


@dataclass(frozen=True, slots=True)
class Effect:
    """The part of the building that an issue takes from the simulation."""

    lost: Literal["", "room", "window"] = ""  # which is left out because of the issue
    glass: float = 0.0  # area of the glass that the issue concerns [m2]


@dataclass(frozen=True, slots=True)
class Issue:
    """One fault or assumption of the input."""

    code: str  # a key of the catalogue, such as "window-without-room"
    where: str  # GUID or name of the element, or the file
    values: Mapping[str, str | int | float | tuple[str | Phrase, ...] | Phrase | Term] = field(
        default_factory=dict, hash=False
    )  # named values of the templates
    effect: Effect = Effect()

    def __post_init__(self) -> None:
        if self.code not in catalogue():
            raise ValueError(f"no issue has the code {self.code!r}")
        missing = catalogue()[self.code].fields - self.values.keys() - {"where"}
        if missing:
            raise ValueError(f"issue {self.code}: lacks {', '.join(sorted(missing))}")

    @property
    def severity(self) -> Severity:
        """Severity of the code."""
        return catalogue()[self.code].severity


def area_words(area: float) -> Phrase:
    """An area [m2] as a value of an issue, also one that a digit after the point shows as 0."""
    return Phrase("area", {"area": area}) if area >= SMALL_AREA else Phrase("area-small")


class IssueText(NamedTuple):
    """An issue in words."""

    what: str
    effect: str
    fix: str  # "" where there is none

    @property
    def consequence(self) -> str:
        """The effect, with the fix where there is one."""
        return f"{self.effect}; {self.fix}" if self.fix else self.effect

    @property
    def pair(self) -> tuple[str, str]:
        """What the issue is, and its consequence."""
        return self.what, self.consequence

    @property
    def line(self) -> str:
        """All of it in one line, without a period at the end."""
        return f"{self.what}: {self.consequence}"


@cache
def catalogue() -> Mapping[str, Template]:
    """The templates of each code."""
    return {code: _template(code, table) for code, table in _tables()["issue"].items()}


@cache
def phrases() -> Mapping[str, str]:
    """The English templates of the phrases."""
    return {key: text for key, text in _tables()["phrase"].items() if not key.endswith("-one")}


def issue_text(issue: Issue, audience: Audience = "python", fill: Fill = filled) -> IssueText:
    """The text of an issue.

    Args:
        audience: whom the fix is for.
        fill: fills a template: in another language with its translation.
    """
    template = catalogue()[issue.code]
    words = {key: _words(value, fill) for key, value in issue.values.items()}
    fix = template.fix if audience == "python" else template.fix_command or template.fix
    texts = (
        fill(text, template.singular.get(text, ""), **{"where": issue.where, **words}) if text else ""
        for text in (template.what, template.effect, fix)
    )
    return IssueText(*texts)


def issue_note(issue: Issue, audience: Audience = "command") -> Note:
    """An issue as a sentence that a page can show in another language."""
    text = issue_text(issue, audience, Note)
    if text.fix:
        return Note("{what}: {effect}; {fix}.", **text._asdict())
    return Note("{what}: {effect}.", what=text.what, effect=text.effect)


def issue_rows(
    issues: Iterable[Issue], audience: Audience = "python", fill: Fill = filled
) -> list[tuple[str, str, str, str, str]]:
    """Rows of `COLUMNS`; the consequence is the effect with the fix."""
    rows: list[tuple[str, str, str, str, str]] = []
    for issue in issues:
        what, consequence = issue_text(issue, audience, fill).pair
        rows.append((issue.where, what, consequence, issue.code, issue.severity))
    return rows


def templates() -> tuple[str, ...]:
    """Every English template of the catalogue, each once: what a language translates."""
    texts = [text for template in catalogue().values() for text in template[1:5] if text]
    texts += [text for template in catalogue().values() for text in template.singular.values()]
    return tuple(dict.fromkeys([*texts, *_tables()["phrase"].values()]))


def _words(value: object, fill: Fill) -> object:
    """A value as the templates take it: phrases and lists as text, numbers as they are."""
    if isinstance(value, Term):
        return fill(value.name)
    if isinstance(value, Phrase):
        words = {key: _words(one, fill) for key, one in value.values.items()}
        return fill(phrases()[value.key], _tables()["phrase"].get(f"{value.key}-one", ""), **words)
    if isinstance(value, tuple):
        parts = {f"part_{n}": _words(one, fill) for n, one in enumerate(value[:LISTED])}
        listed = fill(", ".join(f"{{{key}}}" for key in parts), **parts)
        if len(value) <= LISTED:
            return listed
        return fill(phrases()["more"], names=listed, count=len(value) - LISTED)
    return value


@cache
def _fields(template: str) -> frozenset[str]:
    return frozenset(name for _, name, _, _ in string.Formatter().parse(template) if name)


@cache
def _tables() -> Mapping[str, dict[str, Any]]:
    return tomllib.loads(CATALOGUE.read_text(encoding="utf-8"))


def _template(code: str, table: Mapping[str, Any]) -> Template:
    if table["severity"] not in SEVERITIES:
        raise ValueError(f"issue {code}: severity {table['severity']!r} is none of {SEVERITIES}")
    singular = {table[key]: table[f"{key}-one"] for key in table if f"{key}-one" in table}
    texts = {
        key.replace("-", "_"): value for key, value in table.items() if key != "group" and not key.endswith("-one")
    }
    return Template(**texts, group=tuple(table.get("group", ())), singular=singular)
