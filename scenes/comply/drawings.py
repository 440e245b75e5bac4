"""Drawings of a room in a dossier: plans of the view and of the light, bars of the sun."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from scenes.comply.results import CheckedRoom, Compliance, GridSummary
from scenes.figures.chart import Chart, ChartMark, box
from scenes.figures.plan import FloorPlan, plan, plan_frame
from scenes.figures.scale import ColourScale, Tick
from scenes.language.numbers import rounded

FIRST_HOUR, LAST_HOUR = 4, 21  # of the sun's bars
# plans of the light, and the needs of rules that look at what they show, the nearest first
LIGHT_PLANS = {
    "Half of the daylight hours": ("reached_lux",),
    "Daylight factor": ("reached_factor",),
    "Daylight autonomy": ("sda", "view_free", "leni", "mean_hours", "worst_hours", "equinox"),
    "Sunlit hours": ("ase",),
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
    scale = ColourScale(0, 90, "Horizontal sight angle", "°")
    text = f"{rounded(float(np.min(angle)), 0)} to {rounded(float(np.max(angle)), 0)}° by place."
    yield plan(frame, angle, scale, title="Horizontal sight angle", explanation=text)
    layers = room.view.layer_count
    scale = ColourScale(0, 3, "Layers", "")
    text = "Landscape, sky and ground that one opening shows; 0 where the landscape is not seen."
    yield plan(frame, layers, scale, title="Layers of the view", explanation=text)


def _light_plans(result: Compliance, room: CheckedRoom) -> Iterator[FloorPlan]:
    """One plan of each quantity, on the grid of the first rule that asks for it."""
    for title, needs in LIGHT_PLANS.items():
        found = _asking(result, room, needs)
        if found is None:
            continue
        name, grid = found
        frame = plan_frame(room.space, grid.points)
        blinds = "blinds open" if grid.closed is None else "blinds operated"
        height = f"{grid.points[0, 2] - room.space.floor_level:.2f} m high"
        on = f"on the grid of {name}, {height}"
        if title == "Daylight factor":
            factor = 100 * grid.factor
            scale = ColourScale(0, max(float(np.ceil(factor.max())), 1.0), title, "%")
            text = f"Overcast sky, {on}."
            yield plan(frame, factor, scale, title=title, explanation=text, digits=1)
        elif title == "Half of the daylight hours":
            top = float(max(np.ceil(grid.half_time.max() / 250) * 250, 750))
            scale = ColourScale(0, top, "Illuminance", "lx")
            text = f"Illuminance reached in half of the daylight hours, blinds open, {on}."
            yield plan(frame, grid.half_time, scale, title=title, explanation=text)
        elif title == "Daylight autonomy":
            scale = ColourScale(0, 100, title, "%")
            text = f"300 lx, 8 to 18 o'clock, {blinds}, {on}."
            yield plan(frame, 100 * grid.autonomy, scale, title=title, explanation=text)
        elif grid.sunlit_hours.any():
            top = float(np.ceil(grid.sunlit_hours.max() / 50) * 50)
            scale = ColourScale(0, top, "Direct sun", "h")
            text = f"1000 lx of direct sun, 8 to 18 o'clock, blinds open, {on}."
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
    scale = ColourScale(0.2, 0.6, "Daylight glare probability", "")
    blinds = "blinds operated" if glare.operated else "blinds open"
    text = f"Exceeded in 5 % of the hours of use, in each seat's worst direction, {blinds}."
    yield plan(frame, worst, scale, title="Glare", explanation=text, digits=2)


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
    rows = [("any opening", room.sun.times)]
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
    return Chart(
        "Possible sun at the openings",
        f"{result.day.day.day} {result.day.day:%B}, local standard time, cloudless; "
        f"{room.sun.hours:.2f} h at any opening"
        + (f"; {more} more openings in the table." if more else "."),
        "Hour", "",
        tuple(Tick(100 * (h - FIRST_HOUR) / span, str(h), "") for h in hours),
        tuple(Tick(100 * (count - i - 0.5) / count, name, "", False)
              for i, (name, _) in enumerate(rows)),
        tuple(marks), height=30 + 18 * count,
    )  # fmt: skip
