"""Drawings of a room in a dossier: plans of the view and of the light, bars of the sun."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from scenes.comply.results import CheckedRoom, Compliance, GridSummary
from scenes.figures.chart import Chart, ChartMark, box
from scenes.figures.plan import FloorPlan, plan, plan_frame
from scenes.figures.scale import ColourScale, Tick
from scenes.language.catalogue import decimal, gettext, ngettext
from scenes.language.numbers import day_and_month, rounded

FIRST_HOUR, LAST_HOUR = 4, 21  # of the sun's bars
# plans of the light, and the needs of rules that look at what they show, the nearest first
LIGHT_PLANS = {
    "half time": ("reached_lux",),
    "daylight factor": ("reached_factor",),
    "daylight autonomy": ("sda", "view_free", "leni", "mean_hours", "worst_hours", "equinox"),
    "sunlit hours": ("ase",),
}
MOST_BARS = 12  # openings with a bar of their own
MOST_LETTERS = 28  # of the name beside a bar


def plans(result: Compliance, room: CheckedRoom) -> tuple[FloorPlan, ...]:
    """Plans of what the rules look at in a room."""
    return (*_view_plans(result, room), *_light_plans(result, room), *_glare_plans(room))


def _view_plans(result: Compliance, room: CheckedRoom) -> Iterator[FloorPlan]:
    wanted = any("view" in rule.parts for rule in result.rules.values())
    if room.view is None or not wanted:
        return
    frame = plan_frame(room.space, room.view.points)
    angle = room.view.sight_angle_deg
    title = gettext("Horizontal sight angle")
    scale = ColourScale(0, 90, title, "°")
    text = gettext(
        "{least} to {most}°.",
        least=rounded(float(np.min(angle)), 0),
        most=rounded(float(np.max(angle)), 0),
    )
    yield plan(frame, angle, scale, title=title, explanation=text)
    layers = room.view.layer_count
    scale = ColourScale(0, 3, gettext("Layers"), "")
    text = gettext(
        "Layers (landscape, sky, ground) visible through one opening; 0 where the landscape is not "
        "visible."
    )
    yield plan(frame, layers, scale, title=gettext("Layers of the view"), explanation=text)


def _light_plans(result: Compliance, room: CheckedRoom) -> Iterator[FloorPlan]:
    """One plan of each quantity, on the grid of the first rule that asks for it."""
    for kind, needs in LIGHT_PLANS.items():
        found = _asking(result, room, needs)
        if found is None:
            continue
        name, grid = found
        frame = plan_frame(room.space, grid.points)
        height = decimal(f"{grid.points[0, 2] - room.space.floor_level:.2f}")
        of_grid = gettext("Grid of {rule}, {height} m above the floor.", rule=name, height=height)
        if kind == "daylight factor":
            title, factor = gettext("Daylight factor"), 100 * grid.factor
            scale = ColourScale(0, max(float(np.ceil(factor.max())), 1.0), title, "%")
            text = gettext("Overcast sky.") + " " + of_grid
            yield plan(frame, factor, scale, title=title, explanation=text, digits=1)
        elif kind == "half time":
            title = gettext("Illuminance in half of the daylight hours")
            top = float(max(np.ceil(grid.half_time.max() / 250) * 250, 750))
            scale = ColourScale(0, top, gettext("Illuminance"), "lx")
            text = gettext("Reached in half of the daylight hours, blinds open.") + " " + of_grid
            yield plan(frame, grid.half_time, scale, title=title, explanation=text)
        elif kind == "daylight autonomy":
            title = gettext("Daylight autonomy")
            scale = ColourScale(0, 100, title, "%")
            text = (
                gettext("300 lx, 8 to 18 o'clock, blinds open.")
                if grid.closed is None
                else gettext("300 lx, 8 to 18 o'clock, blinds operated.")
            )
            text += " " + of_grid
            yield plan(frame, 100 * grid.autonomy, scale, title=title, explanation=text)
        elif grid.sunlit_hours.any():
            title = gettext("Sunlit hours")
            top = float(np.ceil(grid.sunlit_hours.max() / 50) * 50)
            scale = ColourScale(0, top, gettext("Direct sun"), "h")
            text = gettext("1000 lx of direct sun, 8 to 18 o'clock, blinds open.") + " " + of_grid
            yield plan(frame, grid.sunlit_hours, scale, title=title, explanation=text)


def _asking(
    result: Compliance, room: CheckedRoom, needs: Sequence[str]
) -> tuple[str, GridSummary] | None:
    """Name and grid of the first rule with the first of some needs; None where no rule has any."""
    grids = {} if room.light is None else room.light.grids
    for wanted in needs:
        for name, grid in grids.items():
            criteria = result.rules[name].criterion
            if any(need.what == wanted for one in criteria for need in one.needs):
                return name, grid
    return None


def _glare_plans(room: CheckedRoom) -> Iterator[FloorPlan]:
    glare = None if room.light is None else room.light.glare
    if glare is None or len(glare.eyes) == 1:
        return
    eyes, seat = np.unique(glare.eyes, axis=0, return_inverse=True)
    worst = np.zeros(len(eyes))  # of the directions of each eye
    np.maximum.at(worst, seat.ravel(), glare.not_exceeded())
    frame = plan_frame(room.space, eyes)
    scale = ColourScale(0.2, 0.6, gettext("Daylight glare probability"), "")
    text = (
        gettext(
            "DGP exceeded in 5 % of the hours of use, worst direction of each seat, blinds "
            "operated."
        )
        if glare.operated
        else gettext(
            "DGP exceeded in 5 % of the hours of use, worst direction of each seat, blinds open."
        )
    )
    yield plan(frame, worst, scale, title=gettext("Glare"), explanation=text, digits=2)


def shortened(name: str) -> str:
    """A name without its middle where it would take the room of the bars beside it."""
    half = MOST_LETTERS // 2
    return name if len(name) <= MOST_LETTERS else f"{name[:half]}…{name[-half:]}"


def sun_bars(result: Compliance, room: CheckedRoom) -> Chart | None:
    """When the sun may shine on each opening, and on any."""
    wanted = any("sun" in rule.parts for rule in result.rules.values())
    if room.sun is None or not wanted or not room.sun.openings:
        return None
    openings = room.sun.openings[:MOST_BARS]
    rows = [(gettext("any opening"), room.sun.times)]
    rows += [(shortened(one.name), one.times) for one in openings]
    count = len(rows)
    x_range, y_range = (60.0 * FIRST_HOUR, 60.0 * LAST_HOUR), (0.0, float(count))
    marks = []
    for style, some in (("part1", rows[:1]), ("part0", rows[1:])):
        start = 0 if style == "part1" else 1
        path = "".join(
            box(a, b, count - 1 - i + 0.2, count - i - 0.2, x_range, y_range)
            for i, (_, times) in enumerate(some, start)
            for a, b in times
        )
        marks.append(ChartMark(path, style, filled=True))
    hours = range(FIRST_HOUR, LAST_HOUR + 1, 2)
    span = LAST_HOUR - FIRST_HOUR
    more = len(room.sun.openings) - len(openings)
    text = gettext(
        "{date}, local standard time, cloudless: {hours} h at any opening.",
        date=day_and_month(result.day.day),
        hours=rounded(room.sun.hours, 2),
    )
    if more:
        text += " " + ngettext(
            "{count} more opening in the table.", "{count} more openings in the table.", more
        )
    return Chart(
        gettext("Possible sunlight at the openings"), text,
        gettext("Hour"), "",
        tuple(Tick(100 * (h - FIRST_HOUR) / span, str(h), "") for h in hours),
        tuple(Tick(100 * (count - i - 0.5) / count, name, "", False)
              for i, (name, _) in enumerate(rows)),
        tuple(marks), height=30 + 18 * count,
    )  # fmt: skip
