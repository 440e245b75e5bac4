"""The rules by which groups of windows change their shading state, as tables of a file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from bim.to_tracer import COMPASS
from scenes import plausible
from scenes.room.schedules import CLOCK, OrSchedule, ScheduleTable, states_or_name
from scenes.toml_file import Positive, Share, TomlTable

if TYPE_CHECKING:
    Facade = str
else:
    Facade = Literal[(*COMPASS, "roof")]

SCENARIOS = Path(__file__).with_name("control_scenarios.toml")
# rules that need nothing computed: of the weather, the sun's altitude, the use of the room
WEATHER_RULES = ("outdoor temperature", "wind", "rain", "day", "night", "occupied", "unoccupied")
ROOM_RULES = {  # that the heat balance decides, by the quantity of a `RoomCondition`
    "air temperature": "air",
    "operative temperature": "operative",
    "cooling": "cooling",
    "heating": "heating",
}
LOAD_RULES = ("cooling", "heating")
# rules of which all groups take a combination of states together
JOINT_RULES = ("glare", "work plane", "daylight")
# conditions that are met or not
INVERTIBLE = (*WEATHER_RULES, *ROOM_RULES, "irradiance", "illuminance", "sun depth")
OF_SCENARIO = ("scenario", "setpoint", "setpoint_2")
WAITS = ("open_delay_h", "hold_h", "until", "most_moves")  # keys that make a rule wait
MOST_CONDITIONS = 4  # n of a room: the heat balance chooses from 2^n alternatives


@cache
def scenarios() -> dict[str, dict[str, Any]]:
    """The named scenarios of control: rule, source, what the source has and was not available."""
    return tomllib.loads(SCENARIOS.read_text("utf-8"))


def scenario_rule(name: str, stated: Mapping[str, Any]) -> dict[str, Any]:
    """The table of a named scenario's rule, with the set points that are stated.

    Raises: `ValueError` for a set point that the scenario lacks or needs.
    """
    scenario = scenarios()[name]
    points = dict(scenario.get("set_points", {}))
    for key in ("setpoint", "setpoint_2"):
        if stated.get(key) is not None:
            if key not in points:
                raise ValueError(f"{key}: the scenario {name!r} has no such set point")
            points[key] = stated[key]

    def filled(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: filled(one) for key, one in value.items()}
        if isinstance(value, list):
            return [filled(one) for one in value]
        return points[value[1:]] if isinstance(value, str) and value[:1] == "$" else value

    rule: dict[str, Any] = filled(scenario["rule"])
    return rule


def stated_keys(rule: ShadingRule) -> dict[str, Any]:
    """The keys that a table of a rule needs to be read as the rule: also those of its scenario."""
    own = scenarios()[rule.scenario]["rule"].keys() if rule.scenario else set()
    stated = rule.model_dump(mode="json", exclude_defaults=True)
    stated |= rule.model_dump(mode="json", include={"rule", *own})
    return stated | ({"parts": [stated_keys(one) for one in rule.parts]} if rule.parts else {})


class ShadingRule(TomlTable):
    """The rule by which a group of windows changes its state.

    States are numbered from 0 in the order of the file.
    """

    # a named rule of `control_scenarios.toml`; keys besides replace its own
    scenario: str = ""
    setpoint: float | None = None  # of the scenario, in the unit that its source has
    setpoint_2: float | None = None
    rule: Literal[
        "always",
        "schedule",
        "irradiance",
        "illuminance",
        "glare",
        "work plane",
        "daylight",
        "cut-off",
        "sun depth",
        "outdoor temperature",
        "wind",
        "rain",
        "day",
        "night",
        "occupied",
        "unoccupied",
        "air temperature",
        "operative temperature",
        "cooling",
        "heating",
        "manual",
        "any",
        "all",
        "predictive",
    ] = "always"
    parts: tuple[ShadingRule, ...] = ()  # of "any", the most closed state, and "all", the most open
    open_delay_h: Annotated[float, plausible.HOURS] = 0.0  # opens after more light for so long [h]
    hold_h: Annotated[float, plausible.HOURS] = 0.0  # least time between two moves [h]
    # once closed, not opened before sunset, midnight, sunrise or the first hour of use of a day
    until: Literal["", "sunset", "midnight", "sunrise", "arrival"] = ""
    inverse: bool = False  # closed where the condition would open, and open where it would close
    most_moves: Annotated[int, Field(ge=1, le=100)] | None = None  # a day; then it stays
    # "always"; the closed one of the rules that open and close; 0: the last
    state: Annotated[int, Field(ge=0)] = 0
    # "schedule": 24 states, or the name of a schedule of states
    schedule: Annotated[tuple[int, ...] | str, OrSchedule(plausible.STATE, states_or_name)] = ()
    close_above: Annotated[Positive, plausible.SUN] = 200.0  # "irradiance" on the windows [W/m2]
    open_below: Annotated[float, plausible.SUN] | None = None
    # "illuminance" of the windows (20000), "work plane" (3000): daylight that is not exceeded [lx]
    close_above_lx: Annotated[Positive, plausible.EYE] | None = None
    open_below_lx: Annotated[float, plausible.EYE] | None = None  # "illuminance"
    # "daylight": closed as far as so much is left
    target_lx: Annotated[Positive, plausible.TARGET] = 500.0
    # "work plane", "daylight", "manual": the sensor nearest to this place [m]; default: the mean of
    # the work plane, for "manual" behaviour by the sun the sensor nearest to the room's view
    at: tuple[float, float, float] | None = None
    # "sun depth": distance from the facade that the sun may reach [m], on a plane above the floor
    deepest_m: Annotated[float, plausible.LENGTH] = 1.0
    plane_height_m: Annotated[float, plausible.LENGTH] = 0.0
    beam_above: Annotated[float, plausible.SUN] = 50.0  # in a direct sun of so much [W/m2]
    # temperatures: "outdoor temperature", and those of the room at the end of the step before
    close_above_c: Annotated[float, plausible.OUTDOOR] | None = None  # 20 outdoors, 24 in the room
    open_below_c: Annotated[float, plausible.OUTDOOR] | None = None
    # "cooling", "heating": power at the end of the step before above which it closes [W]
    close_above_w: Annotated[float, plausible.POWER] = 0.0
    open_above_m_s: Annotated[Positive, plausible.WIND] = 10.0  # "wind": closed in less wind
    # "irradiance", "illuminance", "cut-off", "sun depth": sun and sky that reach the windows, or
    # those of a weather station on the roof, without surroundings, turned to the facade or level
    sensor: Literal["window", "roof", "horizontal"] = "window"
    limit_lx: Annotated[Positive, plausible.EYE] = 3473.0  # "glare": vertical illuminance of the eye; sDGP 0.40
    limit_dgp: Share | None = None  # "glare": DGP of every hour's picture in place of Ev
    seat: tuple[float, float, float] | None = None  # "glare": the eye [m]; default: the room's view
    looks_deg: float | None = None  # "glare": azimuth of the line of sight from north by east
    # of equally good combinations: the one with the least state, or the most view through
    prefer: Literal["open", "view"] = "open"
    # "manual": the people whose habits are followed
    behaviour: Literal["LM-83", "Lightswitch-2002", "Haldi-Robinson"] = "Lightswitch-2002"
    seed: Annotated[int, Field(ge=0)] = 0  # "manual": of Haldi and Robinson's people
    slat_tilts_deg: tuple[float, ...] = ()  # "cut-off": of each state; default: of its system
    slat_width: Annotated[Positive, plausible.SLAT] = 0.08  # [m]
    slat_spacing: Annotated[Positive, plausible.SLAT] = 0.072  # [m]

    @model_validator(mode="before")
    @classmethod
    def _of_scenario(cls, table: Any) -> Any:
        name = table.get("scenario") if isinstance(table, dict) else None
        if not name:
            points = [k for k in ("setpoint", "setpoint_2") if isinstance(table, dict) and k in table]
            if points:
                raise ValueError(f"{points[0]}: belongs to a `scenario`")
            return table
        if name not in scenarios():
            near = get_close_matches(str(name), scenarios(), n=1)
            more = f"; did you mean {near[0]!r}?" if near else ""
            raise ValueError(f"scenario: there is no {name!r}{more}")
        whole = scenario_rule(name, table) | table
        own = {*OF_SCENARIO, "parts", *WAITS}
        stray = [key for key in table if key in ShadingRule.model_fields and key not in own]
        if whole["rule"] in ("any", "all") and "rule" not in table and stray:
            raise ValueError(
                f"{stray[0]}: the scenario {name!r} combines rules with keys of their own: state its `parts`"
            )
        return whole

    def fault(self, states: int, schedules: Mapping[str, ScheduleTable]) -> tuple[str, str] | None:
        """The key that does not fit windows with `states` states, and the fault."""
        by_room = any(leaf.rule in ROOM_RULES for leaf in self.leaves)
        together = any(leaf.rule in (*JOINT_RULES, "manual") for leaf in self.leaves)
        if by_room and together and (self.open_delay_h or self.hold_h):
            key = "open_delay_h" if self.open_delay_h else "hold_h"
            message = "does not act on the room's temperature and on glare, daylight or people"
            return key, f"{message} together: state it in the parts"
        if by_room and (self.until or self.most_moves):
            key = "until" if self.until else "most_moves"
            return key, "does not go with the room's temperature or loads"
        if self.rule in ROOM_RULES and self.opens_below_c > self.closes_above_c:
            return "open_below_c", "lies above close_above_c"
        if self.rule == "illuminance" and self.opens_below_lx > self.closes_above_lx:
            return "open_below_lx", "lies above close_above_lx"
        if self.inverse and self.rule not in INVERTIBLE:
            return "inverse", f'does not fit the rule "{self.rule}"'
        if self.sensor == "horizontal" and self.rule in ("cut-off", "sun depth"):
            return "sensor", f'"horizontal" does not fit the rule "{self.rule}"'
        if self.rule in ("any", "all"):
            if not self.parts:
                return "parts", f'the rule "{self.rule}" needs tables of rules'
            if len({leaf for leaf in self.leaves if leaf.rule == "manual"}) > 1:
                return "parts", 'a group is moved by people of one kind: several rules "manual"'
            if self._parts_several_limits:
                message = 'rules of light ("glare", "work plane", "daylight") of a group act'
                return "parts", f'{message} together: as parts of one "any"'
            for number, one in enumerate(self.parts):
                fault = one.fault(states, schedules)
                if fault is not None:
                    return f"parts.{number}.{fault[0]}", fault[1]
            return None
        if self.rule == "schedule" and isinstance(self.schedule, str):
            wrong = sorted(set(schedules[self.schedule].stated) - set(range(states)))
            if wrong:
                message = f"has state {wrong[0]:g}: the windows have {states}, from 0"
                return "schedule", f"{self.schedule!r} {message}"
            return None
        used: tuple[int, ...] = (self.state,)
        if self.rule == "schedule" and not isinstance(self.schedule, str):
            used = self.schedule
        if self.rule == "schedule" and len(self.schedule) != CLOCK:
            return "schedule", f"expected {CLOCK} states, got {len(self.schedule)}"
        if any(not 0 <= state < states for state in used):
            return "state", f"a state outside 0 to {states - 1}: the windows have {states}"
        if self.rule == "cut-off" and self.slat_tilts_deg and len(self.slat_tilts_deg) != states:
            return "slat_tilts_deg", f"expected one for each of {states} states"
        return None

    @property
    def _parts_several_limits(self) -> bool:
        """Whether parts have different rules of light that the rule does not take together."""
        of_light = [one for one in self.parts if one._limits_of_light]
        if len({limit for one in of_light for limit in one._limits_of_light}) < 2:
            return False
        together = all(one.rule == "any" or not one.parts for one in of_light)
        return len(of_light) > 1 and not (self.rule == "any" and together)

    @property
    def _limits_of_light(self) -> set[str]:
        """The distinct rules of light that it has."""
        keys = {"rule", "at", "close_above_lx", "target_lx", "limit_lx", "limit_dgp", "seat", "looks_deg"}
        joint = (leaf for leaf in self.leaves if leaf.rule in JOINT_RULES)
        return {leaf.model_dump_json(include=keys) for leaf in joint}

    @property
    def closes_above_c(self) -> float:
        """`close_above_c` or its default."""
        default = 24.0 if self.rule in ROOM_RULES else 20.0
        return default if self.close_above_c is None else self.close_above_c

    @property
    def closes_above_lx(self) -> float:
        """`close_above_lx` or its default."""
        default = 3000.0 if self.rule == "work plane" else 20000.0
        return default if self.close_above_lx is None else self.close_above_lx

    @property
    def opens_below_lx(self) -> float:
        """`open_below_lx` or its default."""
        return self.closes_above_lx if self.open_below_lx is None else self.open_below_lx

    @property
    def opens_below_c(self) -> float:
        """`open_below_c` or its default."""
        return self.closes_above_c if self.open_below_c is None else self.open_below_c

    @property
    def leaves(self) -> tuple[ShadingRule, ...]:
        """The rule itself, or the rules that it combines."""
        if self.rule not in ("any", "all"):
            return (self,)
        return tuple(leaf for one in self.parts for leaf in one.leaves)


class PredictiveTable(TomlTable):
    """Control that looks ahead, of all groups of a room together."""

    horizon_h: Annotated[int, Field(ge=1, le=8784)] = 24  # planned; a year: one plan
    # how the hours ahead are known: as yesterday's, as what comes with an error, or as what comes
    forecast: Literal["yesterday", "error", "perfect"] = "yesterday"
    sun_error: Share = 0.25  # of "error", relative standard deviation 24 h ahead
    temperature_error_k: Annotated[float, Field(ge=0, le=10)] = 1.5  # likewise [K]
    seed: Annotated[int, Field(ge=0)] = 0  # of the errors
    # what counts as glare: DGP of the pictures of each combination, or 6.2e-5 Ev + 0.184
    glare: Literal["DGP", "Ev"] = "DGP"
    heating_weight: Annotated[float, Field(ge=0, le=100)] = 1.0  # of 1 kWh of heat
    cooling_weight: Annotated[float, Field(ge=0, le=100)] = 1.0
    lighting_weight: Annotated[float, Field(ge=0, le=100)] = 1.0
    # [Wh] that the move of a group costs, and an occupied hour without any view through
    move_wh: Annotated[float, Field(ge=0, le=1e4)] = 0.0
    view_wh: Annotated[float, Field(ge=0, le=1e4)] = 0.0


Across = Literal["room", "storey", "zone", "building"]


class GroupTable(ShadingRule):
    """Windows that move together by a rule; keys that it lacks are those of `control`."""

    name: str = ""  # in results; default: its first window or facade
    windows: tuple[str, ...] = ()  # names or GUIDs
    # or the windows of these facades, in the rooms of these storeys, zones (IfcZone) and spaces; of all without
    facades: tuple[Facade, ...] = ()
    storeys: tuple[str, ...] = ()
    zones: tuple[str, ...] = ()
    spaces: tuple[str, ...] = ()  # names or GUIDs
    across: Across | None = None  # None: those of `control`
    sensor_rooms: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _names_some(self) -> GroupTable:
        if not (self.windows or self.facades or self.storeys or self.zones or self.spaces):
            raise ValueError("name `windows`, `facades`, `storeys`, `zones` or `spaces`")
        if self.across not in (None, "room") and self.windows and not self.name:
            raise ValueError("name: windows of several rooms need one")
        return self


class ControlTable(ShadingRule):
    """Control of the shading states: which windows move together, and by which rule."""

    # windows that no entry of `group` names move together by facade (orientation), one by one, or
    # all of a room
    groups: Literal["facade", "window", "room"] = "facade"
    # windows of which rooms move together: of one room, or of all rooms of a storey, a zone (IfcZone), the building
    across: Across = "room"
    # rooms whose sensors, seats, temperature and people the rule reads: names or GUIDs; all rooms of the group without
    sensor_rooms: tuple[str, ...] = ()
    group: tuple[GroupTable, ...] = ()  # the first entry that names a window applies to it
    predictive: PredictiveTable = PredictiveTable()  # of the rule "predictive"

    @model_validator(mode="after")
    def _spans_rooms(self) -> ControlTable:
        if self.groups == "window" and self.across != "room":
            raise ValueError('across: with `groups = "window"` each window moves alone')
        if self.sensor_rooms and not self.shares:
            raise ValueError("sensor_rooms: the windows of each room move by themselves: state `across`")
        for number, one in enumerate(self.group):
            if one.sensor_rooms and self.across_of(one) == "room":
                raise ValueError(f"group.{number}.sensor_rooms: the windows of each room move alone: state `across`")
        return self

    @property
    def shares(self) -> bool:
        """Whether windows of several rooms move together."""
        return any(self.across_of(one) != "room" for one in (None, *self.group))

    def across_of(self, group: GroupTable | None) -> Across:
        """Of which rooms the windows of an entry of `group` move together; None: those that no entry names."""
        return self.across if group is None or group.across is None else group.across

    def sensor_rooms_of(self, group: GroupTable | None) -> tuple[str, ...]:
        """The rooms that the rule of an entry of `group` reads; none: all whose windows it moves."""
        return self.sensor_rooms if group is None or not group.sensor_rooms else group.sensor_rooms

    @model_validator(mode="after")
    def _predicts_all(self) -> ControlTable:
        fault = self.plan_fault
        if fault is not None:
            place, message = fault
            raise ValueError(f"{place.removeprefix('control.')}: {message}")
        return self

    @property
    def plan_fault(self) -> tuple[str, str] | None:
        """The path of the key that the plans of all groups together cannot follow, and why."""
        if not any(leaf.rule == "predictive" for _, rule in self.rules for leaf in rule.leaves):
            return None
        for place, rule in self.rules:
            if rule.rule != "predictive":
                return (f"{place}.rule", '"predictive" plans all groups of a room together, and alone')
            for key in WAITS:
                if getattr(rule, key):
                    return f"{place}.{key}", 'the rule "predictive" does not wait: leave it out'
        return None

    @property
    def is_random(self) -> bool:
        """Whether people of a seed move the windows: others in each room."""
        leaves = (leaf for _, rule in self.rules for leaf in rule.leaves)
        return any(leaf.rule == "manual" and leaf.behaviour == "Haldi-Robinson" for leaf in leaves)

    def rule_of(self, group: GroupTable | None) -> ShadingRule:
        """The rule of an entry of `group`; None: of the windows that no entry names."""
        stated = {key: getattr(self, key) for key in ShadingRule.model_fields}
        if group is not None:
            stated |= self.changed_by(group)
        return ShadingRule.model_construct(**stated)

    def changed_by(self, table: ShadingRule) -> dict[str, Any]:
        """Keys of the rule that differ where `table` holds, of some windows or rooms.

        A scenario is what its source says, whatever holds elsewhere; a rule takes nothing from
        another scenario.
        """
        fields = ShadingRule.model_fields
        keys, left_out = table.model_fields_set & fields.keys(), set[str]()
        if "scenario" in keys:
            left_out = set(fields)
        elif "rule" in keys and self.scenario:
            left_out = {*OF_SCENARIO, *scenarios()[self.scenario]["rule"]}
        changed = {key: fields[key].get_default() for key in left_out}
        return changed | {key: getattr(table, key) for key in keys}

    @property
    def rules(self) -> tuple[tuple[str, ShadingRule], ...]:
        """Every rule, with the path of its table."""
        others = ((f"control.group.{n}", self.rule_of(one)) for n, one in enumerate(self.group))
        return ("control", self.rule_of(None)), *others
