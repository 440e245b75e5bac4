"""What a run says at its head of the building's file and of its place."""

from __future__ import annotations

from bim.account import NOT_USABLE
from bim.model import Building
from bim.report.issue import Issue, issue_text
from mitsuba_cfs.sky.weather import Weather

TREES = "trees-by-month"
AT_THE_HEAD = ("rooms-joined-by-size", TREES)  # codes of issues that are notes of a run
FAR_SITE_DEG = 2.0  # a weather station further than this from the building's site is reported


def model_notes(building: Building) -> tuple[str, ...]:
    """Whether the model will do, what of it was joined, and what of it no result depends on."""
    issues = (
        issue for issue in building.issues
        if issue.severity == "unused" or issue.code in AT_THE_HEAD
    )  # fmt: skip
    return (*_account_notes(building), *map(_note, issues))


def unused_notes(building: Building) -> tuple[str, ...]:
    """What of a building's file a command with uses, sensors and eyes of its own leaves out."""
    found = [*tree_notes(building)]
    found += [_note(issue) for issue in building.issues if issue.severity == "unused"]
    held = {
        "uses of rooms": building.uses, "sensor grids": building.grids, "views": building.views,
    }  # fmt: skip
    counts = [f"{len(some)} {what}" for what, some in held.items() if some]
    if counts and building.file is not None:
        found.append(f"{building.file.name} holds {', '.join(counts)}: not used here.")
    return tuple(found)


def tree_notes(building: Building) -> tuple[str, ...]:
    """How much light the trees outdoors let pass."""
    return tuple(_note(issue) for issue in building.issues if issue.code == TREES)


def _note(issue: Issue) -> str:
    return f"{issue_text(issue, 'command').line}."


def _account_notes(building: Building) -> tuple[str, ...]:
    """Why the model will not do, where that is so."""
    account = building.account
    return account.lines[:1] if account is not None and account.verdict == NOT_USABLE else ()


def site_notes(building: Building, weather: Weather) -> tuple[str, ...]:
    """A sentence where building and weather lie far apart."""
    if building.latitude_deg is None or building.longitude_deg is None:
        return ()
    north = building.latitude_deg - weather.latitude_deg
    east = (building.longitude_deg - weather.longitude_deg + 180) % 360 - 180
    if max(abs(north), abs(east)) <= FAR_SITE_DEG:
        return ()
    return (
        f"The building's site ({building.latitude_deg:.1f} N, {building.longitude_deg:.1f} E) is "
        f"far from the weather station {weather.site} ({weather.latitude_deg:.1f} N, "
        f"{weather.longitude_deg:.1f} E): the sun is the weather station's.",
    )
