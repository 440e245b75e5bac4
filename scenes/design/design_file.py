"""The file of `cfs design`: a study, what may vary in it, what is sought and what must be met."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import Field, model_validator

from mitsuba_cfs.errors import DataError
from scenes import plausible
from scenes.design.measures import GOALS, MEASURES, Limit, Measure, column_measure, need_limit, rule_level
from scenes.fenestration.thermal_file import GlazingLayerTable
from scenes.study.study_file import Name, Study, SystemTable, name_entries, unique, with_places
from scenes.toml_file import Key, Positive, Share, TomlTable, read_table, validated

Slat = Annotated[Positive, plausible.SLAT]
Tilt = Annotated[float, Field(ge=-90, le=90)]
if TYPE_CHECKING:
    MeasureName = str
else:
    MeasureName = Literal[tuple(MEASURES)]
MOST_VALUES = 1000  # of a variable in steps
SYSTEM = "system"  # key of the variable that chooses a [[system]] by its name
ORIENTATIONS = "orientations_deg"  # key of a study
OF_FILES = ("building", "bsdf", "operation", "weather")  # last parts of keys whose values are files


class BlindTable(TomlTable):
    """A venetian blind, whose BSDF is traced as by `cfs bsdf generate`; tilts as there."""

    position: Literal["outdoors", "indoors"] = "outdoors"
    slat_width: Slat = 0.08  # [m]
    slat_spacing: Slat = 0.072  # [m]
    slat_radius: Annotated[float, Field(ge=0)] = 0.0  # of the curvature [m]; 0: flat
    tilt_deg: Tilt = 45.0
    tilts_deg: tuple[Tilt, ...] = ()  # more closed ones, among which the rule chooses
    visible: Share = 0.55  # reflectance
    solar: Share | None = None  # None: as visible
    specular: Share = 0.0
    roughness: Annotated[float, Field(gt=0, le=1)] = 0.06
    emissivity: Share = 0.9
    distance: Annotated[Positive, plausible.GAP] = 0.1  # from the glass [m]
    paths: Annotated[int, Field(ge=256)] = 4096  # for each incident patch and side
    seed: Annotated[int, Field(ge=0)] = 0

    @property
    def tilts(self) -> tuple[float, ...]:
        """The tilts of its states, from the most open to the most closed."""
        return (self.tilt_deg, *sorted(tilt for tilt in set(self.tilts_deg) if tilt > self.tilt_deg))


class DesignSystem(SystemTable):
    """A system as of a study, or panes, with a blind or without."""

    layers: tuple[GlazingLayerTable, ...] = ()  # panes, the outermost first
    blind: BlindTable | None = None
    cost: Annotated[float, Field(ge=0)] | None = None  # per m2 of window, in any currency
    carbon: Annotated[float, Field(ge=0)] | None = None  # embodied, per m2 of window [kg CO2e]

    @property
    def has_optics(self) -> bool:
        """Whether its optics are its own, so that its operation file has no states."""
        return self.bsdf is not None or bool(self.layers)

    @model_validator(mode="after")
    def _of_a_file(self) -> DesignSystem:
        if self.bsdf is not None and self.layers:
            raise ValueError("bsdf and layers exclude each other")
        if self.bsdf is None and self.operation is None and not self.layers:
            raise ValueError("give `bsdf`, `layers` of panes, or `operation` with [[system]] tables in it")
        if self.blind is not None and not self.layers:
            raise ValueError("blind: needs the panes beside it, as `layers`")
        if any(layer.is_shade for layer in self.layers):
            raise ValueError("layers: are panes; the blind is a table of its own")
        if self.bsdf is None and not (self.u_value is None and self.g_value is None):
            raise ValueError("`u_value` and `g_value` belong to a `bsdf`")
        return self


class VariableTable(TomlTable):
    """What may vary: a key with a range, with steps or values; or choices that set several keys."""

    name: str = ""
    key: Key = ""
    low: float | None = None
    high: float | None = None
    step: Positive | None = None  # none: any number between
    values: tuple[Any, ...] = ()
    choices: dict[Name, dict[str, Any]] = Field(default_factory=dict)  # keys and values by name
    unit: str | None = None  # in words of the page; None: by the key

    @model_validator(mode="after")
    def _is_one_kind(self) -> VariableTable:
        ranged = self.low is not None or self.high is not None or self.step is not None
        if sum((ranged, bool(self.values), bool(self.choices))) != 1:
            raise ValueError("give one of `low` and `high`, `values`, and `choices`")
        if bool(self.key) == bool(self.choices):
            raise ValueError("key: is missing" if not self.key else "choices: name their own keys")
        if ranged and (self.low is None or self.high is None or not self.low < self.high):
            raise ValueError("expected `low` below `high`")
        low, high = self.span
        if self.step is not None and (high - low) / self.step > MOST_VALUES:
            raise ValueError(f"step: gives more than {MOST_VALUES} values")
        return self

    @property
    def options(self) -> tuple[Any, ...]:
        """The values that it may have; empty: any number from `low` to `high`."""
        if self.choices:
            return tuple(self.choices)
        if self.values or self.step is None:
            return self.values
        low, high = self.span
        count = int((high - low) / self.step + 1e-9) + 1
        return tuple(round(low + number * self.step, 9) for number in range(count))

    @property
    def span(self) -> tuple[float, float]:
        """The least and the greatest number of a range."""
        return self.low or 0.0, self.high or 0.0

    @property
    def is_number(self) -> bool:
        """Whether its values are numbers, so that neighbours are alike."""
        return not self.choices and all(type(one) in (int, float) for one in self.options)

    def settings(self, value: Any) -> dict[str, Any]:
        """Keys with the values that one of its values stands for."""
        return dict(self.choices[value]) if self.choices else {self.key: value}


class _Measured(TomlTable):
    """A measure by name, or a column of the results."""

    name: MeasureName | None = None
    column: Name | None = None

    @property
    def measure(self) -> Measure:
        """The measure that it names."""
        return column_measure(self.column or "") if self.name is None else MEASURES[self.name]


class ObjectiveTable(_Measured):
    """A measure that is sought least or most; the mean of all rooms, climates and orientations."""

    goal: Literal["least", "most"] | None = None  # None: that of the named measure
    weight: Annotated[float, Field(gt=0)] = 1.0  # in the recommendation, see `scenes.design.ranking`

    @model_validator(mode="after")
    def _is_one(self) -> ObjectiveTable:
        if (self.name is None) == (self.column is None):
            raise ValueError("give either `name` or `column`")
        if self.column is not None and self.goal is None:
            raise ValueError('goal: a column needs "least" or "most"')
        return self

    @property
    def sign(self) -> float:
        """What makes the least of it the best."""
        return GOALS[self.goal or self.measure.goal]


class ConstraintTable(_Measured):
    """A limit of a measure, or the level of a rule; every room, climate and orientation meets it."""

    rule: str | None = None  # standard and criterion, as "en17037 glare"
    level: str | None = None  # None: the least
    at_most: float | None = None
    at_least: float | None = None

    @model_validator(mode="after")
    def _is_one(self) -> ConstraintTable:
        if sum(one is not None for one in (self.name, self.column, self.rule)) != 1:
            raise ValueError("give one of `name`, `column` and `rule`")
        limited = (self.at_most is not None) + (self.at_least is not None)
        if limited != (self.rule is None):
            raise ValueError("a rule has its own limits" if self.rule else "give either `at_most` or `at_least`")
        if self.level is not None and self.rule is None:
            raise ValueError("level: belongs to a `rule`")
        _ = self.limits  # or what is wrong with its rule
        return self

    @property
    def needs_sun(self) -> bool:
        """Whether it is on direct sunlight, which the three-phase method does not have."""
        return any(one is not None and "ase" in one.split() for one in (self.rule, (self.column or "")[:3]))

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The limits that are all to be met.

        Raises: `ValueError` for a rule that there is not, or that a case does not decide.
        """
        if self.rule is not None:
            level = rule_level(self.rule, self.level)
            label = f"{self.rule}, {level.name}"
            return tuple(need_limit(need, label) for need in level.needs)
        one = self.measure
        return (Limit(one.label, one.unit, one.digits, one.value, self.at_most, self.at_least),)


class SearchTable(TomlTable):
    """How it is searched."""

    method: Literal["surrogate", "NSGA-II", "random", "all"] = "surrogate"
    evaluations: Annotated[int, Field(ge=4)] = 60
    seed: Annotated[int, Field(ge=0)] = 1
    # candidates are searched by the three-phase method with few rays and sDGP, then the front again
    quick: bool = True
    front: Annotated[int, Field(ge=1)] = 8  # candidates that are computed in full
    repeats: Annotated[int, Field(ge=0)] = 2  # of the two best with other seeds, for standard errors
    # one answer for each orientation, entry of [[room]], or climate; None: one for all of them
    each: Literal["orientation", "room", "climate"] | None = None


OWN = ("variable", "objective", "constraint", "search")


class Design(Study):
    """A whole design; paths are relative to the file."""

    system: tuple[DesignSystem, ...] = ()
    variable: Annotated[tuple[VariableTable, ...], Field(min_length=1)]
    objective: Annotated[tuple[ObjectiveTable, ...], Field(min_length=1)]
    constraint: tuple[ConstraintTable, ...] = ()
    search: SearchTable = SearchTable()

    @model_validator(mode="before")
    @classmethod
    def _named(cls, table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        stated, systems = table.get("variable") or (), table.get("system") or ()
        if not (isinstance(stated, list | tuple) and isinstance(systems, list | tuple)):
            return table  # pydantic says what is wrong
        variables = [dict(one) if isinstance(one, dict) else one for one in stated]
        for one in variables:
            if isinstance(one, dict) and not one.get("name") and isinstance(one.get("key"), str):
                one["name"] = _words(one["key"])
        chosen = any(isinstance(one, dict) and SYSTEM in _keys(one) for one in variables)
        if len(systems) > 1 and not chosen:
            names = [one.get("name") if isinstance(one, dict) else getattr(one, "name", "") for one in systems]
            variables.insert(0, {"name": SYSTEM, "key": SYSTEM, "values": names})
        return table | ({"variable": variables} if variables else {})

    @model_validator(mode="after")
    def _fits(self) -> Design:
        unique("variable", [one.name for one in self.variable])
        for number, one in enumerate(self.variable):
            if not one.name:
                raise ValueError(f"variable.{number}.name: is missing")
            wrong = [value for value in one.options if SYSTEM in _keys_of(one) and value not in self.names]
            if one.key == SYSTEM and wrong:
                raise ValueError(f"variable.{number}.values: there is no [[system]] {wrong[0]!r}")
        if self.search.each == "orientation" and any(ORIENTATIONS in _keys_of(one) for one in self.variable):
            raise ValueError(f"search.each: {ORIENTATIONS} is a variable, so that the best orientation is sought")
        if any(method == "auto" for method in self.methods) or len(self.methods) > 1:
            raise ValueError("methods: expected one, by which the front is computed")
        for key in ("cost", "carbon"):
            if any(one.name == key for one in (*self.objective, *self.constraint)):
                bare = [system.name for system in self.system if getattr(system, key) is None]
                if bare or not self.system:
                    raise ValueError(f"{key}: is missing of system {', '.join(bare)}".rstrip())
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the systems."""
        return tuple(system.name for system in self.system)


def _keys(table: dict[str, Any]) -> tuple[str, ...]:
    choices = table.get("choices")
    inner = (
        [key for one in choices.values() if isinstance(one, dict) for key in one] if isinstance(choices, dict) else []
    )
    return (str(table.get("key", "")), *inner)


def _keys_of(variable: VariableTable) -> tuple[str, ...]:
    return (variable.key, *(key for one in variable.choices.values() for key in one))


def _words(key: str) -> str:
    """The last part of a key in words, without its unit."""
    last = key.rpartition(".")[2]
    for unit in ("_deg", "_c", "_lx", "_w_m2"):
        last = last.removesuffix(unit)
    return last.replace("_", " ")


def read_design(path: str | PathLike[str], *, quick: bool | None = None) -> Design:
    """The design of a TOML file, its paths made absolute and every entry named.

    Args: quick: in place of the file's `search.quick`.

    Raises: `DataError` naming the file and the key.
    """
    path = Path(path)
    table = read_table(path)
    name_entries(table)
    if quick is not None:
        table["search"] = table.get("search", {}) | {"quick": quick}
    design = validated(Design, table, path)
    variables = tuple(_placed(one, number, path) for number, one in enumerate(design.variable))
    systems = []
    for number, system in enumerate(design.system):
        layers = []
        for layer in system.layers:
            if layer.pane is not None:
                field = f"system.{number}.layers.pane"
                layer = layer.model_copy(update={"pane": _there(layer.pane, path, field)})
            layers.append(layer)
        systems.append(system.model_copy(update={"layers": tuple(layers)} if layers else {}))
    placed = design.model_copy(update={"variable": variables, "system": tuple(systems)})
    return cast(Design, with_places(placed, path))


def _placed(variable: VariableTable, number: int, path: Path) -> VariableTable:
    """The variable with absolute paths of files that are there."""
    field = f"variable.{number}"
    if variable.choices:
        choices = {
            name: {key: _file_of(key, value, path, f"{field}.choices.{name}") for key, value in one.items()}
            for name, one in variable.choices.items()
        }
        return variable.model_copy(update={"choices": choices})
    values = tuple(_file_of(variable.key, value, path, f"{field}.values") for value in variable.values)
    return variable.model_copy(update={"values": values})


def _file_of(key: str, value: Any, path: Path, field: str) -> Any:
    if key.rpartition(".")[2] not in OF_FILES or not isinstance(value, str):
        return value
    return str(_there(Path(value), path, field))


def _there(name: Path, path: Path, field: str) -> Path:
    place = (path.parent / name).absolute()
    if not place.is_file():
        raise DataError(f"no such file: {name}", file=path, field=field)
    return place
