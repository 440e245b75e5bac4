"""EN 17037's levels of daylight provision, as its rule file has them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from mitsuba_cfs.metrics.en17037 import MINIMUM_AREA, TARGET_AREA, DaylightProvision
from scenes.toml_file import read_table

RULE = Path(str(files(__package__) / "comply" / "rules" / "en17037.toml"))


@dataclass(frozen=True, slots=True)
class ProvisionLevel:
    """A level of daylight provision with openings in walls."""

    name: str
    target: float  # [lx] on half the area, half the daylight hours
    minimum: float  # [lx] on 95 % of the area, half the daylight hours

    @property
    def words(self) -> str:
        """Both limits."""
        return f"{self.target:g} and {self.minimum:g} lx"


@cache
def provision_levels() -> tuple[ProvisionLevel, ...]:
    """The levels of method 2, the lowest first."""
    criteria = read_table(RULE)["criterion"]
    levels = next(one["level"] for one in criteria if one["key"] == "provision")
    result = []
    for level in levels:
        limits = {need["area"]: float(need["at_least"]) for need in level["needs"]}
        result.append(ProvisionLevel(level["name"], limits[TARGET_AREA], limits[MINIMUM_AREA]))
    return tuple(result)


def level_number(provision: DaylightProvision) -> int:
    """The highest level that a room reaches: 1 the lowest of them, 0 none."""
    met = [
        number
        for number, level in enumerate(provision_levels(), 1)
        if provision.target_illuminance >= level.target and provision.minimum_illuminance >= level.minimum
    ]
    return max(met, default=0)
