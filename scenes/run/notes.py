"""What a run says at its head of the building's file and of its place."""

from __future__ import annotations

from bim.account import NOT_USABLE
from bim.model import Building
from bim.report.issue import issue_note
from mitsuba_cfs.notes import Note
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
    return (*_account_notes(building), *map(issue_note, issues))


def unused_notes(building: Building) -> tuple[str, ...]:
    """What of a building's file a command with uses, sensors and eyes of its own leaves out."""
    found = [*tree_notes(building)]
    found += [issue_note(issue) for issue in building.issues if issue.severity == "unused"]
    parts = (building.uses, building.grids, building.views)
    if any(parts) and building.file is not None:
        found.append(
            Note(
                "{file} contains {uses} uses of rooms, {grids} sensor grids and {views} views; "
                "they "
                "are not used here.",
                file=building.file.name,
                uses=len(building.uses),
                grids=len(building.grids),
                views=len(building.views),
            )
        )
    return tuple(found)


def tree_notes(building: Building) -> tuple[str, ...]:
    """How much light the trees outdoors let pass."""
    return tuple(issue_note(issue) for issue in building.issues if issue.code == TREES)


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
    note = Note(
        "The site of the building ({north:.1f} N, {east:.1f} E) is far from the weather station "
        "{station} ({station_north:.1f} N, {station_east:.1f} E); the solar positions are those of "
        "the weather station.",
        north=building.latitude_deg,
        east=building.longitude_deg,
        station=weather.site,
        station_north=weather.latitude_deg,
        station_east=weather.longitude_deg,
    )
    return (note,)
