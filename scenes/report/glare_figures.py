"""Luminance pictures of a room: false colour, as the eye sees it, and the glare sources."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_dilation, binary_erosion

from bim.model import Space
from mitsuba_cfs.glare.classes import LIMITS
from mitsuba_cfs.images.view import View
from scenes.figures.picture import photo_uri, png_uri, reduced
from scenes.figures.plan import plan_frame
from scenes.figures.rose import RosePlan, RoseWedge, roses
from scenes.figures.scale import ColourScale
from scenes.language.catalogue import N_, decimal, gettext, ngettext
from scenes.language.numbers import percent, rounded, significant, spoken
from scenes.pictures import tone_mapped
from scenes.report.tables import GLARE_WORDS, glare_class
from scenes.results import GlareMap, GlareResults, LuminancePicture, RoomYear, RunResult

MOST_PICTURES = 4  # the worst ones; the table has them all
MOST_OF_A_RUN = 24  # shared by its rooms, so that the file stays small
LARGEST_SIDE = 620  # [px] of a picture in the page
MANY_ROOMS, SIDE_OF_MANY = 10, 240  # beyond so many rooms [px]
ROSE = 0.47  # radius of a rose, over the distance between eyes
BRIDGE = 4  # slits up to twice as many pixels wide do not split an outline
COMPASS = (
    N_("north"),
    N_("north-east"),
    N_("east"),
    N_("south-east"),
    N_("south"),
    N_("south-west"),
    N_("west"),
    N_("north-west"),
)
OUTLINE = (255, 0, 144)  # of glare sources; occurs in no colour map used here


@dataclass(frozen=True, slots=True)
class GlarePicture:
    """One hour as two pictures and a few words."""

    title: str
    words: str
    dgp: str
    dgp_class: str
    dgp_words: str  # of the class
    numbers: str
    falsecolour: str  # data URI
    seen: str  # data URI, tone-mapped, glare sources outlined
    round: bool  # a fisheye: only the disc is a picture


@dataclass(frozen=True, slots=True)
class ColourView:
    """One of the pictures in its colours, and a few words."""

    title: str
    words: str
    seen: str  # data URI, tone-mapped
    round: bool  # a fisheye: only the disc is a picture


@dataclass(frozen=True, slots=True)
class GlareGallery:
    """The worst pictures of a room and the scale they share."""

    pictures: tuple[GlarePicture, ...]
    scale: ColourScale
    left_out: int
    reduced_to: int = 0  # [px] at most, where the run has many rooms
    colour: ColourView | None = None


def gallery(result: RunResult, room: RoomYear) -> GlareGallery | None:
    """The pictures with most glare, worst first; None without any."""
    pictures = sorted(room.glare.pictures, key=lambda picture: -picture.glare["dgp"])
    if not pictures:
        return None
    chosen = pictures[: max(1, min(MOST_PICTURES, MOST_OF_A_RUN // len(result.spaces)))]
    scale = luminance_scale(chosen)
    many = len(result.spaces) > MANY_ROOMS
    side = SIDE_OF_MANY if many else LARGEST_SIDE
    shown = tuple(glare_picture(result, room.glare.view, p, scale, side) for p in chosen)
    cut = many and max(chosen[0].luminance.shape) > side
    left, colour = len(pictures) - len(chosen), colour_view(result, room.glare, side)
    return GlareGallery(shown, scale, left, side if cut else 0, colour)


def glare_plan(space: Space, year: GlareMap) -> RosePlan:
    """The plan of a room with a rose at each eye: hours of use above each limit by direction of view."""
    frame = plan_frame(space, year.eyes)
    wedges = [
        RoseWedge(eye[:2], way[:2], tuple(year.shares[:, e, n]), _wedge_words(year, e, n))
        for e, eye in enumerate(year.eyes)
        for n, way in enumerate(year.directions)
    ]
    box, body = roses(frame, wedges, ROSE * year.spacing, len(year.directions))
    (e, n), limit = year.worst()[0], LIMITS[-1]
    text = gettext(
        "Eyes {height} m above the floor, {spacing} m apart, {directions} directions each, with the shading of "
        "each hour. The coloured part of a wedge's area is the share of the {hours} hours of use above each limit of "
        "DGP; the whole wedge represents all of them. North is up. Worst view: x {x} m, y {y} m, looking {compass}, "
        "DGP above {limit} in {share} % of the hours. Computed without pictures from the illuminance at the eye, the "
        "windows' luminance and the sun's disc.",
        height=rounded(float(year.eyes[0, 2]) - space.floor_level, 1),
        spacing=rounded(year.spacing, 1),
        directions=len(year.directions),
        hours=rounded(year.hours_of_use, 0),
        x=rounded(float(year.eyes[e, 0]), 1),
        y=rounded(float(year.eyes[e, 1]), 1),
        compass=gettext(compass(year.directions[n])),
        limit=rounded(limit, 2),
        share=percent(100 * float(year.shares[-1, e, n])),
    )
    limits = tuple(rounded(limit, 2) for limit in LIMITS)
    return RosePlan(gettext("Glare by direction of view"), text, *box, body, limits)


def _wedge_words(year: GlareMap, e: int, n: int) -> str:
    """The hours of use above each limit of one view."""
    where = decimal(f"x {year.eyes[e, 0]:.1f} m, y {year.eyes[e, 1]:.1f} m").replace(", y", "; y")
    hours = ", ".join(
        gettext("{hours} h above {limit}", hours=rounded(year.hours_of_use * share, 0), limit=rounded(limit, 2))
        for limit, share in zip(LIMITS, year.shares[:, e, n].tolist(), strict=True)
    )
    return f"{where}; {gettext(compass(year.directions[n]))}: {hours}"


def colour_view(result: RunResult, glare: GlareResults, side: int) -> ColourView | None:
    """The picture in colour reduced to `side` pixels at most; None where the room has none."""
    if glare.colour is None:
        return None
    radiance = glare.colour.radiance
    factor = int(np.ceil(max(radiance.shape) / side))
    return ColourView(
        title=spoken(result.times[glare.colour.hour]),
        words=f"{sun_words(result, glare.colour.hour)}; {gettext('white balance: daylight outdoors')}",
        seen=photo_uri(tone_mapped(reduced(radiance.astype(float), factor))),
        round=glare.view.is_disc,
    )


def luminance_scale(pictures: list[LuminancePicture]) -> ColourScale:
    """Three and a half decades, up to what 99.9 % of each picture's pixels stay below."""
    lit = [p.luminance[p.luminance > 0] for p in pictures]
    top = max((float(np.quantile(values, 0.999)) for values in lit if values.size), default=0.0)
    high = _half_decade(top)
    return ColourScale(max(high / 3000, 1.0), high, gettext("Luminance"), "cd/m²", True, "viridis")


def _half_decade(value: float) -> float:
    """The next of 1, 3, 10, 30, ... at or above the value, at least 1000."""
    power = 10.0 ** np.floor(np.log10(max(value, 1000.0)))
    return float(next(f * power for f in (1, 3, 10) if f * power >= value * 0.999))


def glare_picture(
    result: RunResult, view: View, picture: LuminancePicture, scale: ColourScale, side: int
) -> GlarePicture:
    """One picture reduced to `side` pixels at most."""
    factor = int(np.ceil(max(picture.luminance.shape) / side))
    luminance = reduced(picture.luminance.astype(float), factor)
    glare = picture.glare
    seen = tone_mapped(luminance)
    sources = gettext("no glare source")
    if picture.source_mask is not None and picture.source_mask.any():
        mask = reduced(picture.source_mask.astype(float), factor) > 0.5
        seen[outline(mask)] = OUTLINE
        count = int(glare.get("sources", 0))
        sources = (
            ngettext("{count} glare source (outlined)", "{count} glare sources (outlined)", count) if count else ""
        )
    numbers = f"Ev {significant(glare['ev'], 3)} lx" if "ev" in glare else ""
    brightest = gettext("up to {value} cd/m²", value=significant(float(picture.luminance.max()), 2))
    return GlarePicture(
        title=spoken(result.times[picture.hour]),
        words=sun_words(result, picture.hour),
        dgp=rounded(glare["dgp"], 2),
        dgp_class=glare_class(glare["dgp"]),
        dgp_words=gettext(GLARE_WORDS[glare_class(glare["dgp"])]),
        numbers=", ".join(part for part in (numbers, sources, brightest) if part),
        falsecolour=png_uri(scale.rgba(luminance)[..., :3]),
        seen=photo_uri(seen),
        round=view.is_disc,
    )


def sun_words(result: RunResult, hour: int) -> str:
    """Altitude and azimuth of the sun."""
    sun = result.sun[hour]
    altitude = np.degrees(np.arcsin(np.clip(sun[2], -1, 1)))
    if altitude <= 0:
        return gettext("sun below the horizon")
    azimuth = np.degrees(np.arctan2(sun[0], sun[1])) % 360
    return gettext(
        "solar altitude {altitude}°, azimuth {azimuth}°", altitude=f"{altitude:.0f}", azimuth=f"{azimuth:.0f}"
    )


def compass(direction: NDArray[np.float64]) -> str:
    """The nearest of eight points of the compass, of a vector [3] or [2]."""
    return COMPASS[round(np.degrees(np.arctan2(direction[0], direction[1])) / 45) % 8]


def outline(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rim of each area, two pixels wide; slits as between slats are bridged first."""
    whole = binary_closing(np.pad(mask, BRIDGE), iterations=BRIDGE)[BRIDGE:-BRIDGE, BRIDGE:-BRIDGE]
    return binary_dilation(whole) & ~binary_erosion(whole, border_value=1)
