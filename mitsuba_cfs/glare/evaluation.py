"""Glare of a luminance picture: sources, indices and averages, as evalglare 3 rates them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import check_number
from mitsuba_cfs.glare import indices, passes
from mitsuba_cfs.glare.areas import Zones, angles_to, split_by_zone
from mitsuba_cfs.glare.glare_view import GlareView, in_picture_order, seen
from mitsuba_cfs.glare.position_index import position_index, view_angles
from mitsuba_cfs.glare.sources import Sources, glare_sources, pixel_sources, with_disc
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.notes import Note

BACKGROUNDS = ("indirect", "average", "illuminance")
FIELDS = ("all", "total", "both eyes")
POSITION_MODELS = ("guth", "kim")
GROUPINGS = {  # what a source is
    "evalglare": Note("groups of adjacent bright pixels (evalglare)"),
    "pixels": Note("each bright pixel (raytools)"),
}


@dataclass(frozen=True, slots=True)
class Task:
    """A task area: all pixels within half of `angle` of one pixel."""

    x: int  # column
    y: int  # row counted from the bottom, as in evalglare's -t
    angle: float  # opening angle [rad]


@dataclass(frozen=True, slots=True)
class GlareOptions:
    """How glare is rated; the defaults are those of evalglare 3."""

    threshold: float | None = None  # [cd/m2] above 100, else times the task's or picture's average;
    #                                 None: 2000 cd/m2, with a task 5 times its luminance
    task: Task | None = None
    search_radius: float = 0.2  # [rad] opening angle
    peak: float | None = 50000.0  # [cd/m2] None: no peaks
    smoothing: bool = False
    field_of_view: str = "all"  # "all", "total" or "both eyes" (Guth)
    background: str = "indirect"  # L_b: (E_v - E_dir)/pi, "average" without sources, E_v/pi
    position_model: str = "guth"  # or "kim"
    illuminance: float | None = None  # [lx] measured or calculated elsewhere, used for DGP
    low_light: bool = False
    age: float | None = None  # [years]
    zones: Zones | None = None  # sources are cut at their borders
    grouping: str = "evalglare"  # or "pixels", see `GROUPINGS`
    sun: str = "source"  # its disc is a source of its own, or part of its "pixels"

    def __post_init__(self) -> None:
        if self.background not in BACKGROUNDS:
            raise ValueError(f"background {self.background!r}: expected one of {BACKGROUNDS}")
        if self.grouping not in GROUPINGS:
            raise ValueError(f"grouping {self.grouping!r}: expected one of {tuple(GROUPINGS)}")
        if self.grouping == "pixels" and self.zones is not None:
            raise ValueError("zones cut grouped sources: not with grouping 'pixels'")
        if self.sun not in ("source", "pixels"):
            raise ValueError(f"sun {self.sun!r}: expected 'source' or 'pixels'")
        if self.field_of_view not in FIELDS:
            raise ValueError(f"field_of_view {self.field_of_view!r}: expected one of {FIELDS}")
        if self.position_model not in POSITION_MODELS:
            message = f"position_model {self.position_model!r}: expected one of {POSITION_MODELS}"
            raise ValueError(message)
        check_number("search_radius [rad]", self.search_radius, 1e-6, np.pi)
        for name in ("threshold", "peak", "illuminance", "age"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), 0.0)

    @property
    def rule(self) -> str:
        """Definition of the glare sources as text."""
        own = Note("separate source") if self.sun == "source" else Note("part of its pixels")
        return Note("{grouping}; solar disc: {sun}", grouping=GROUPINGS[self.grouping], sun=own)


@dataclass(frozen=True)
class GlareResult:
    """Glare of one picture.  Arrays [n] run over the sources in evalglare's order."""

    geometry: GlareView
    options: GlareOptions
    luminance: NDArray[np.float64]  # [nx, ny] scan order, 0 where a pixel does not count [cd/m2]
    whole_luminance: NDArray[np.float64]  # the same before the field of view was cut
    sources: Sources
    zones: NDArray[np.int64]  # [n] zone of each source, 0 outside
    position: NDArray[np.float64]  # [n] position index
    direction: NDArray[np.float64]  # [n, 3] unit, of the pixel that holds the centre
    sigma: NDArray[np.float64]  # [n] angle to the line of sight [rad]
    Ev: float  # illuminance at the eye, from the picture [lx]
    Ev_direct: float  # of the sources [lx]
    mean_luminance: float  # [cd/m2]
    background_luminance: float  # [cd/m2]
    task_luminance: float  # of the task area, else of the picture [cd/m2]
    threshold: float  # [cd/m2]
    largest_luminance: float  # [cd/m2]
    dgp: float
    dgi: float
    ugr: float
    ugp: float
    vcp: float
    cgi: float
    dgr: float
    contrast: float = field(repr=False, default=0.0)  # sum L^2 omega/P^2
    discs: tuple[SunDisc, ...] = ()  # that are sources of their own, the last
    dgp_standard_error: float = np.nan  # from the noise of the picture; NaN: not known

    @cached_property
    def unlimited_dgp(self) -> float:
        """DGP without its limit of 1, of which the standard error is stated."""
        return _dgp(self.options, self.Ev, self.contrast, most=np.inf)

    @cached_property
    def sdgp(self) -> float:
        """Simplified DGP, from the illuminance alone."""
        return indices.simplified_dgp(self.Ev)

    @cached_property
    def Lveil(self) -> float:
        """Veiling luminance after Poynter [cd/m2]."""
        return indices.veiling_luminance(self.sources.luminance, self.sources.solid_angle, self.sigma)

    @property
    def labels(self) -> NDArray[np.int32]:
        """Source number of each pixel [ny, nx] of the picture, 0 where none."""
        return in_picture_order(self.sources.labels)

    @property
    def count(self) -> int:
        """Number of sources."""
        return len(self.position)


def evaluate(
    luminance: ArrayLike,
    view: View | GlareView,
    *,
    options: GlareOptions | None = None,
    discs: Sequence[SunDisc] = (),
    **changes: Any,
) -> GlareResult:
    """Glare of a picture.

    Args:
        luminance: [ny, nx] row 0 at the top [cd/m2].
        view: the picture's view, or its `GlareView`, computed once for many pictures.
        options: how glare is rated; `changes` are single options by name.
        discs: the sun and its images in mirrors, where the picture's pixels are without them.

    Raises:
        ValueError: negative or NaN pixels, another size than the view's, a parallel view.
    """
    options = GlareOptions(**changes) if options is None else options
    geometry = view if isinstance(view, GlareView) else GlareView(view)
    picture, Ev, mean, largest = prepare(luminance, geometry)
    whole = picture
    if options.field_of_view != "all":
        picture = np.where(seen(geometry, options.field_of_view), picture, 0.0)
    task = mean if options.task is None else task_luminance(picture, geometry, options.task)
    threshold = _threshold(options, task)
    for disc in discs:
        flux = disc.luminance * disc.solid_angle
        Ev, mean = Ev + _disc_illuminance(disc, geometry), mean + flux / geometry.total_solid_angle
        largest = max(largest, disc.luminance)
    discs = tuple(d for d in discs if d.luminance > threshold and _in_field(d, geometry, options))
    sources, zones, direction, position = _placed(picture, geometry, threshold, options, discs)
    sigma = view_angles(direction, geometry.view)[0]
    direct = float(sources.illuminance.sum())
    background = _background(options, geometry, sources, Ev, direct, mean)
    L, w, P = sources.luminance, sources.solid_angle, position
    contrast = indices.contrast_term(L, w, P)
    rating = indices.discomfort_glare_rating(L, w, P, mean)
    return GlareResult(
        geometry=geometry,
        options=options,
        luminance=picture,
        whole_luminance=whole,
        sources=sources,
        zones=zones,
        position=position,
        direction=direction,
        sigma=sigma,
        Ev=Ev,
        Ev_direct=direct,
        mean_luminance=mean,
        background_luminance=background,
        task_luminance=task,
        threshold=threshold,
        largest_luminance=largest,
        dgp=_dgp(options, Ev, contrast),
        dgi=indices.daylight_glare_index(L, w, P, background),
        ugr=indices.unified_glare_rating(contrast, background),
        ugp=indices.unified_glare_probability(contrast, background),
        vcp=indices.visual_comfort_probability(rating) if len(L) else 100.0,
        cgi=indices.cie_glare_index(contrast, Ev, direct),
        dgr=rating,
        contrast=contrast,
        discs=discs,
    )


def _placed(
    picture: NDArray[np.float64],
    geometry: GlareView,
    threshold: float,
    options: GlareOptions,
    discs: tuple[SunDisc, ...],
) -> tuple[Sources, NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Sources, and zone, direction and position index of each [n]; the discs are last."""
    sources, zones = _sources(picture, geometry, threshold, options)
    # evalglare rounds to four bytes before it cuts off: a whole number stays one
    pixel = sources.x.astype(np.float32).astype(int), sources.y.astype(np.float32).astype(int)
    direction = geometry.directions[pixel]
    position = _positions(options, geometry, pixel, direction)
    for disc in discs:
        sources = with_disc(sources, disc, _disc_illuminance(disc, geometry), geometry)
        own = position_index(disc.direction[None], geometry.view, model=options.position_model)
        zones, position = np.append(zones, 0), np.append(position, own)
        direction = np.vstack([direction, disc.direction])
    return sources, zones, direction, position


def _disc_illuminance(disc: SunDisc, geometry: GlareView) -> float:
    """Illuminance at the eye by a disc [lx]."""
    return disc.luminance * disc.solid_angle * float(disc.direction @ geometry.forward)


def _sources(
    picture: NDArray[np.float64], geometry: GlareView, threshold: float, options: GlareOptions
) -> tuple[Sources, NDArray[np.int64]]:
    """The picture's sources, and the zone [n] of each."""
    if options.grouping == "pixels":
        sources = pixel_sources(picture, geometry, threshold)
        return sources, np.zeros(len(sources.pixels), dtype=np.int64)
    sources = glare_sources(
        picture,
        geometry,
        threshold,
        search_radius=options.search_radius,
        peak=options.peak,
        smoothing=options.smoothing,
    )
    if options.zones is not None:
        return split_by_zone(sources, options.zones, picture, geometry)
    return sources, np.zeros(len(sources.pixels), dtype=np.int64)


def _positions(
    options: GlareOptions,
    geometry: GlareView,
    pixel: tuple[NDArray[np.int64], NDArray[np.int64]],
    direction: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Position index [n] of pixels in directions [n, 3]."""
    if options.position_model == "guth" and options.grouping == "pixels":
        return geometry.guth[pixel]  # computed once for all pictures of the view
    return position_index(direction, geometry.view, model=options.position_model)


def _in_field(disc: SunDisc, geometry: GlareView, options: GlareOptions) -> bool:
    """Whether the disc is in the evaluated field of view."""
    if options.field_of_view == "all":
        return True
    return bool(seen(geometry, options.field_of_view)[geometry.pixel_at(disc.direction)])


def prepare(luminance: ArrayLike, geometry: GlareView) -> tuple[NDArray[np.float64], float, float, float]:
    """A picture [ny, nx] checked, in scan order [nx, ny], 0 where a pixel does not count.

    Returns:
        the picture, its illuminance at the eye [lx], average and largest luminance [cd/m2].
    """
    luminance = np.ascontiguousarray(luminance)
    expected = (geometry.view.height, geometry.view.width)
    if luminance.shape != expected:
        raise ValueError(f"a picture of shape {luminance.shape} for a view of {expected}")
    if luminance.dtype not in (np.float32, np.float64):
        luminance = luminance.astype(np.float64)
    if not geometry.total_solid_angle > 0:
        raise ValueError("the view has no pixel in front of the eye")
    picture = np.empty(geometry.valid.shape)
    Ev, flux, largest, bad = passes.gather(luminance, geometry.weight, geometry.projected, picture)
    if bad:
        raise ValueError(f"{bad} negative, infinite or NaN pixels in the luminance picture")
    return picture, Ev, flux / geometry.total_solid_angle, largest


def task_luminance(picture: NDArray[np.float64], geometry: GlareView, task: Task) -> float:
    """Average luminance [cd/m2] over solid angle of a task area; `picture` in scan order."""
    within = 2 * angles_to(task.x, task.y, geometry) <= task.angle
    weight = geometry.solid_angle[within]
    if not weight.sum() > 0:
        raise ValueError(f"a task area of {task.angle:g} rad holds no pixel")
    return float(picture[within] @ weight / weight.sum())


def _threshold(options: GlareOptions, task: float) -> float:
    """Luminance [cd/m2] above which a pixel is bright."""
    factor = options.threshold
    if factor is None:
        factor = 2000.0 if options.task is None else 5.0
    return factor if factor > 100 else factor * task


def _background(
    options: GlareOptions, geometry: GlareView, sources: Sources, Ev: float, direct: float, mean: float
) -> float:
    """Background luminance [cd/m2]."""
    if options.background == "indirect":
        return (Ev - direct) / np.pi
    if options.background == "illuminance":
        return Ev / np.pi
    total, omega = geometry.total_solid_angle, float(sources.solid_angle.sum())
    if total == omega:
        return mean
    lit = float(sources.luminance @ sources.solid_angle)
    return (total * mean - lit) / (total - omega)


def _dgp(options: GlareOptions, Ev: float, contrast: float, most: float = 1.0) -> float:
    """DGP with the corrections asked for."""
    illuminance = Ev if options.illuminance is None else options.illuminance
    dgp = indices.daylight_glare_probability(illuminance, contrast, most=most)
    if options.low_light:
        dgp *= indices.low_light_factor(illuminance)
    if options.age is not None:
        dgp *= indices.age_factor(options.age)
    return dgp
