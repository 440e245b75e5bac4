"""The small files and choices of a check against rules, read before its building is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.options import OTHER_ALTITUDE_DEG, ComplyOptions
from scenes.comply.rules import RuleTable, read_rule, rule_named
from scenes.comply.uses import RoomUses, read_uses
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.input_files import InputFiles
from scenes.input_files import read_files as read_inputs
from scenes.room.operation import Operation, read_operation


@dataclass(frozen=True, slots=True)
class ComplyFiles:
    """What the files of a check hold, all but the building."""

    inputs: InputFiles
    rules: dict[str, RuleTable]  # by name
    uses: RoomUses
    closed: FenestrationSystem | None
    lamps: Operation | None  # luminaires and colours of rooms
    least_altitude_deg: float
    altitude_source: str  # in words

    @property
    def weather(self) -> Weather:
        """The weather of the year."""
        return self.inputs.weather


def read_files(options: ComplyOptions) -> ComplyFiles:
    """The rules, the weather, the systems and the uses of a check.

    Raises: `DataError` for what cannot be used.
    """
    if options.building is None or options.weather is None:
        raise ValueError("a check of files needs a building and a weather")
    if options.operation is not None and options.closed is not None:
        raise DataError("the operation file has the closed state: its last [[system]]", field="--closed")
    rules = {
        Path(name).stem if name[-5:] == ".toml" else rule_named(name): read_rule(name) for name in options.standards
    }
    if not rules:
        raise DataError("expected at least one rule", field="--standard")
    inputs = read_inputs(options, light_only=True)  # checks the building too
    rules = {name: rule.of_weather(inputs.weather) for name, rule in rules.items()}
    _check_weather(rules, inputs.weather)
    altitude, source = least_altitude(options, rules, inputs.weather)
    closed = None if options.closed is None else read_system(options.closed, by="--closed")
    uses = read_uses(options.uses)
    lamps = None if options.lamps is None else read_operation(options.lamps)
    return ComplyFiles(inputs, rules, uses, closed, lamps, altitude, source)


def _check_weather(rules: Mapping[str, RuleTable], weather: Weather) -> None:
    """Raise `DataError` where each rule asks for other weather, so that there would be no verdict at all."""
    if any(rule.fits(weather) for rule in rules.values()):
        return
    name, rule = next(iter(rules.items()))
    message = f"{name} gives no verdict for {weather.site}: it asks for that of {rule.weather_asked}"
    raise DataError(message, file=weather.file, field="--weather")


def least_altitude(options: ComplyOptions, rules: dict[str, RuleTable], weather: Weather) -> tuple[float, str]:
    """Least altitude of the sun [deg] that counts as sunlight, and where it is from."""
    if options.least_altitude_deg is not None:
        return options.least_altitude_deg, Note("given by --sun-altitude")
    country = weather.site.rpartition(", ")[2]
    for name, rule in rules.items():
        if country in rule.least_altitude_deg:
            source = Note("for {country}, rule file {rule}", country=country, rule=name)
            return rule.least_altitude_deg[country], source
    return OTHER_ALTITUDE_DEG, Note(
        "assumed: no rule file has a value for {country}; --sun-altitude sets it",
        country=country or Note("the country"),
    )
