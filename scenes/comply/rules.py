"""Rule files: what an edition of a standard asks, as data, with its clauses and sources."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.needs import AnyNeed, Need
from scenes.language.catalogue import N_
from scenes.room.operation_tables import OperationTables
from scenes.toml_file import Positive, Share, TomlTable, read_table, validated

FOLDER = files(__package__) / "rules"
NOT_MET = N_("not met")
# How rooms are aggregated over the building; "no building": nothing, and no room misses it
Over = Literal["room", "area mean", "each room", "area of rooms", "room of each dwelling", "no building"]


class GridTable(TomlTable):
    """Where the sensors of a rule are."""

    height: Positive  # above the floor [m]
    margin: Annotated[float, Field(ge=0)]  # off the walls [m]
    spacing: Positive | None = None  # [m]; None: EN 17037's p, by the size of the room


class LevelTable(TomlTable):
    """A level of a criterion, or its points: the needs that are all met."""

    name: str
    needs: Annotated[tuple[AnyNeed, ...], Field(min_length=1)]
    count: Annotated[int, Field(ge=1)] | None = None  # of the needs that must be met; None: all
    over: Over = "room"
    share: Share | None = None  # of the area whose rooms meet the needs, for "area of rooms"

    @model_validator(mode="after")
    def _has_its_share(self) -> LevelTable:
        if (self.over == "area of rooms") != (self.share is not None):
            raise ValueError('over = "area of rooms" and share belong together')
        return self


class CriterionTable(TomlTable):
    """One thing that a rule asks, with its levels from the least to the highest."""

    key: str
    title: str
    clause: str
    openings: Literal["any", "walls", "roof"] = "any"  # of the rooms that it is for
    occupied: bool = False  # of regularly occupied rooms alone
    uses: tuple[str, ...] = ()  # of rooms of these uses alone; none: of all
    other_than: tuple[str, ...] = ()  # not of rooms of these uses
    weather: tuple[str, ...] = ()  # as of the rule: the criterion is for this weather alone
    missed: str = NOT_MET  # in words, of a room or building that reaches no level
    level: Annotated[tuple[LevelTable, ...], Field(min_length=1)]

    @property
    def over(self) -> Over:
        """How its levels aggregate rooms over the building."""
        return self.level[0].over

    @property
    def needs(self) -> Iterator[Need]:
        """The needs of all levels."""
        return (need for level in self.level for need in level.needs)

    def words_of(self, reached: str) -> str:
        """What a page says of a level reached, in English."""
        return self.missed if reached == NOT_MET else reached


class SetupTable(TomlTable):
    """Gains, air and set points that a standard prescribes for rooms of some uses."""

    uses: Annotated[tuple[str, ...], Field(min_length=1)]
    operation: OperationTables


class RuleTable(TomlTable):
    """A rule file."""

    title: str
    edition: str
    source: Annotated[tuple[str, ...], Field(min_length=1)]
    included: tuple[str, ...] = ()  # parts of the standard that are computed, in sentences
    left_out: tuple[str, ...] = ()  # parts that are not
    # conditions without which there is no verdict: a word of the weather's site or file name
    weather: tuple[str, ...] = ()
    # and one of these words in what its header states of the source; without, figures but no verdict
    header: tuple[str, ...] = ()
    setup: tuple[SetupTable, ...] = ()  # of rooms by use; a heat criterion of others has no verdict
    grid: GridTable
    criterion: Annotated[tuple[CriterionTable, ...], Field(min_length=1)]
    least_altitude_deg: dict[str, float] = Field({})  # of the sun, by country of a weather file

    @model_validator(mode="after")
    def _is_set_up(self) -> RuleTable:
        for criterion in self.criterion:
            heats = any("heat" in need.parts for need in criterion.needs)
            missing = [use for use in criterion.uses if self.operation_of(use) is None]
            if self.setup and heats and (missing or not criterion.uses):
                raise ValueError(f"criterion {criterion.key}: a setup is missing for its uses")
        return self

    def operation_of(self, use: str) -> OperationTables | None:
        """The operation that the rule prescribes for a use; None: none."""
        return next((one.operation for one in self.setup if use in one.uses), None)

    def fits(self, weather: Weather) -> bool:
        """Whether the weather is of a place, or name, that the rule asks for: heat is computed in it."""
        return not self.sites or _named(weather, self.sites)

    def judges(self, weather: Weather) -> bool:
        """Whether the rule gives a verdict with the weather: its header, too, states what the rule asks for."""
        words = (re.search(rf"\b{re.escape(word)}(?![A-Za-z])", weather.source) for word in self.header)
        return self.fits(weather) and (not self.header or any(words))

    @property
    def weather_asked(self) -> str:
        """The weather that the rule, or one of its criteria, asks for: the first word of each list."""
        lists = (self.weather, *(one.weather for one in self.criterion))
        return ", ".join(dict.fromkeys(words[0] for words in lists if words))

    @property
    def sites(self) -> tuple[str, ...]:
        """Words of the weather that the rule, or one of its criteria, asks for."""
        words = [*self.weather, *(word for one in self.criterion for word in one.weather)]
        return tuple(dict.fromkeys(words))

    def of_weather(self, weather: Weather) -> RuleTable:
        """The rule with the criteria for this weather; all of them where none is for it."""
        fitting = [one for one in self.criterion if not one.weather or _named(weather, one.weather)]
        return self.model_copy(update={"criterion": tuple(fitting) or self.criterion})

    @property
    def parts(self) -> frozenset[str]:
        """The parts of `Findings` that the rule needs."""
        return frozenset(part for one in self.criterion for need in one.needs for part in need.parts)


def _named(weather: Weather, words: Iterable[str]) -> bool:
    """Whether a weather's site or file name has one of the words."""
    name = "" if weather.file is None else weather.file.name
    texts = (weather.site.casefold(), name.casefold())
    return any(word.casefold() in text for word in words for text in texts)


# Editions after those of the rule files, by a part of their plain name, and the rule that is here
NOT_AVAILABLE = {
    "lm8322": ("ANSI/IES LM-83-22", "lm83"),
    "leedv5": ("LEED v5", "leed-v4.1"),
    "breeamv7": ("BREEAM New Construction version 7", "breeam-hea01"),
    "breeam7": ("BREEAM New Construction version 7", "breeam-hea01"),
}


def rule_names() -> tuple[str, ...]:
    """Names of the rules that come with the program."""
    return tuple(sorted(Path(str(one)).stem for one in FOLDER.iterdir() if one.name[-5:] == ".toml"))


def rule_named(name: str) -> str:
    """The rule that a name means, as standards are written: "EN 17037" is en17037, "WELL v2" well-v2.

    Raises: `DataError` for a name that is none, or that several rules could be.
    """
    plain = _plain(name)
    found = [rule for rule in rule_names() if _plain(rule) == plain]
    found = found or [rule for rule in rule_names() if plain and _plain(rule).startswith(plain)]
    found = found or [rule for rule in rule_names() if len(plain) > 3 and _is_edition(plain, read_rule(rule).edition)]
    if len(found) == 1:
        return found[0]
    for later, (edition, earlier) in NOT_AVAILABLE.items():
        if not found and later in plain:
            raise DataError(
                f"{edition} is not included: neither its text nor a source of its limits was available; {earlier} is "
                "the latest edition here; write the limits of your copy into a rule file (docs/comply.md)",
                field="--standard",
            )
    known = ", ".join(found or rule_names())
    message = f"{name!r} may be each of {known}" if found else f"no rule {name!r}; there are {known}, and files"
    raise DataError(message, field="--standard")


def _is_edition(plain: str, edition: str) -> bool:
    """Whether a plain name is an edition without its publisher, or without its last amendment."""
    whole = _plain(edition)
    return whole.startswith(plain) or whole.endswith(plain)


def _plain(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum())


def read_rule(name: str) -> RuleTable:
    """The rule of that name, or of a TOML file.

    Raises: `DataError` for a name that is none and a file that is wrong.
    """
    path = Path(name)
    if path.suffix != ".toml":
        path = Path(str(FOLDER / f"{rule_named(name)}.toml"))
    return validated(RuleTable, read_table(path), path)
