"""`cfs glare`: glare of luminance pictures, with evalglare's flags and its printed lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, reason, write_table
from scenes.result_folder import ResultFolder

if TYPE_CHECKING:
    from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult
    from mitsuba_cfs.glare.glare_view import GlareView
    from mitsuba_cfs.images.hdr import Picture
    from mitsuba_cfs.images.view import View


# flag: (types of its arguments, their names, help)
FLAGS: dict[str, tuple[tuple[type, ...], str, str]] = {
    "-d": ((), "", "All figures, and a line for each glare source."),
    "-D": ((), "", "One line with more figures."),
    "-V": ((), "", "Only the vertical illuminance."),
    "-v": ((), "", "The version."),
    "-b": (
        (float,),
        "FACTOR",
        "Threshold: above 100 in cd/m2 (default 2000), else times the "
        "task's or picture's average (default 5 with a task).",
    ),
    "-t": ((int, int, float), "X Y ANGLE", "Task area: pixel, y from the bottom; opening angle."),
    "-T": ((int, int, float), "X Y ANGLE", "The same; blue in the check picture."),
    "-r": ((float,), "ANGLE", "Search radius (opening angle), default 0.2."),
    "-y": ((), "", "Extract peaks (as is done without it)."),
    "-Y": ((float,), "LUMINANCE", "Extract peaks from this luminance on, default 50000 cd/m2."),
    "-x": ((), "", "Do not extract peaks."),
    "-s": ((), "", "Smoothing: add what sources surround."),
    "-G": ((int,), "TYPE", "Cut the field of view: 1 total, 2 of both eyes."),
    "-g": ((int,), "TYPE", "Only cut the field of view, into the picture that -c names."),
    "-i": ((float,), "LUX", "Vertical illuminance measured or calculated elsewhere, for DGP."),
    "-I": ((float, int, int), "LUX YMAX YMIN", "The same; fill up a picture cut above and below."),
    "-q": ((int,), "MODE", "Background luminance: 0 (Ev - Edir)/pi, 1 average, 2 Ev/pi."),
    "-P": ((int,), "MODEL", "Position index: 0 Guth and Iwata, 1 Kim."),
    "-C": ((str,), "TYPE", "Corrections of DGP: l+ low light on, l- off, 0 all off."),
    "-B": ((float,), "ANGLE", "Luminance of a horizontal band [rad]."),
    "-l": ((int, int, float), "X Y ANGLE", "A zone around a pixel; sources are cut at its border."),
    "-L": ((int, int, float, float), "X Y A1 A2", "Two zones around a pixel."),
    "-A": ((Path,), "FILE", "Luminance under a mask picture, and PGSV."),
    "-c": ((Path,), "FILE", "Check picture (.hdr), sources coloured."),
    "-u": ((float, float, float), "R G B", "One colour for all sources in the check picture."),
    "-f": ((), "", "Go on with a perspective view that has black corners."),
    "-vf": ((Path,), "FILE", "View file; views stated here replace the picture's."),
    "--age": ((float,), "YEARS", "Age correction of DGP (evalglare had it until 1.17)."),
    "--csv": ((Path,), "FILE", "A table of all pictures, a row each."),
    "--png": ((Path,), "FOLDER", "Falsecolour, tone-mapped and check pictures (.png)."),
    "--scale": ((float, float), "LOW HIGH", "Ends of the falsecolour scale [cd/m2]."),
}
VIEW_FLAGS = "-vta, -vth, -vtv, -vh DEGREES, -vv DEGREES, -vp, -vd, -vu X Y Z, -vs, -vl FRACTION"


@dataclass(slots=True)
class Request:
    """What a command line asks for."""

    stated: dict[str, tuple[Any, ...]] = field(default_factory=dict)  # flag: values
    view: dict[str, Any] = field(default_factory=dict[str, Any])  # fields of `View`
    paths: list[Path] = field(default_factory=list)

    def value(self, flag: str):
        """The flag's only value, or None where it was not stated."""
        return self.stated[flag][0] if flag in self.stated else None


def help_text() -> str:
    """The table of flags for --help."""
    rows = []
    for flag, (_, names, text) in FLAGS.items():
        rows.append(f"  {flag + ' ' + names:22s} {text}")
    view = ["The view instead of the picture's:", f"  {VIEW_FLAGS}"]
    return "\n".join([*rows, "Angles are in radians.", *view])


def parse(words: tuple[str, ...]) -> Request:
    """The request that a command line in evalglare's manner makes; flags in any place."""
    request, at = Request(), 0
    while at < len(words):
        word, at = words[at], at + 1
        if word in FLAGS:
            types, names, _ = FLAGS[word]
            request.stated[word] = _values(word, types, names, words[at : at + len(types)])
            at += len(types)
        elif word.startswith("-v") and len(word) > 2:
            at = _view_option(request, words, at - 1)
        elif word.startswith("-") and word != "-":
            raise click.UsageError(f"unknown option {word}")
        else:
            request.paths.append(Path("/dev/stdin" if word == "-" else word))
    return request


def _values(flag: str, types: tuple[type, ...], names: str, words: tuple[str, ...]) -> tuple[Any, ...]:
    if len(words) < len(types):
        raise click.UsageError(f"{flag} needs {names}")
    try:
        return tuple(kind(word) for kind, word in zip(types, words, strict=True))
    except ValueError:
        raise click.UsageError(f"{flag} needs {names}, found {' '.join(words)}") from None


def _view_option(request: Request, words: tuple[str, ...], at: int) -> int:
    """Take one option of Radiance's view syntax; the place after it."""
    from mitsuba_cfs.images.view import view_changes

    for length in (1, 2, 4):
        changes = view_changes(" ".join(words[at : at + length]))
        if changes:
            request.view |= changes
            return at + length
    raise click.UsageError(f"not a view option: {' '.join(words[at : at + 2])}")


def glare_options(request: Request) -> GlareOptions:
    """How the request wants glare rated."""
    from mitsuba_cfs.glare.areas import Zones
    from mitsuba_cfs.glare.evaluation import BACKGROUNDS, GlareOptions, Task

    task = request.stated.get("-T", request.stated.get("-t"))
    zones = request.stated.get("-L", request.stated.get("-l"))
    corrections = request.value("-C")
    if corrections not in (None, "l+", "l-", "0"):
        raise click.UsageError(f"-C {corrections}: expected l+, l- or 0")
    try:
        return GlareOptions(
            threshold=request.value("-b"),
            task=Task(*task) if task else None,
            search_radius=request.value("-r") or 0.2,
            peak=None if "-x" in request.stated else request.value("-Y") or 50000.0,
            smoothing="-s" in request.stated,
            field_of_view=_choice(request, "-G", {1: "total", 2: "both eyes"}, "all"),
            background=_choice(request, "-q", dict(enumerate(BACKGROUNDS)), BACKGROUNDS[0]),
            position_model=_choice(request, "-P", {0: "guth", 1: "kim"}, "guth"),
            illuminance=request.stated.get("-I", request.stated.get("-i", (None,)))[0],
            low_light=corrections == "l+",
            age=request.value("--age"),
            zones=Zones(*zones) if zones else None,
        )
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def _choice(request: Request, flag: str, meanings: dict[int, str], default: str) -> str:
    number = request.value(flag)
    if number is None:
        return default
    if number not in meanings:
        raise click.UsageError(f"{flag} {number}: expected one of {sorted(meanings)}")
    return meanings[number]


def parsed_view(request: Request, width: int, height: int) -> View | None:
    """The view of the command line, None where it has none; it must have type and both sizes."""
    from mitsuba_cfs.images.view import View, view_changes

    changes = dict(request.view)
    if (path := request.value("-vf")) is not None:
        try:
            text = path.read_text(errors="replace")
        except OSError as error:
            raise DataError(f"cannot be read ({reason(error)})", file=path) from None
        changes = view_changes(text) | changes
    if not changes:
        return None
    if not {"kind", "horizontal_deg", "vertical_deg"} <= changes.keys():
        raise click.UsageError("a view must at least have -vt, -vh and -vv")
    try:
        return View(width=width, height=height, **changes)
    except ValueError as error:
        raise click.UsageError(str(error)) from None


SUFFIXES = {".hdr", ".pic"}
CUTS = {1: "total", 2: "both eyes"}
VERSION = "cfs glare, after evalglare 3.06"


class FlagCommand(click.Command):
    """A command whose own words are evalglare's, which click cannot take apart."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The table of flags."""
        formatter.write("\nFlags (as evalglare's where it has them):\n" + help_text())
        formatter.write("\n")


@click.command(cls=FlagCommand, context_settings={"ignore_unknown_options": True, "help_option_names": ["--help"]})
@click.argument("words", nargs=-1, type=click.UNPROCESSED, metavar="[FLAGS] PICTURE.hdr... FOLDER...")
def command(words: tuple[str, ...]) -> None:
    """Daylight glare probability and other indices of fisheye luminance pictures.

    Prints what evalglare prints for the same flags.  A folder stands for all its .hdr and .pic
    files; with several pictures each one's lines follow its name and class.
    """
    request = parse(words)
    if "-v" in request.stated:
        click.echo(VERSION)
        return
    paths = pictures(request.paths or [Path("/dev/stdin")])
    _check_files(request, paths)
    options = glare_options(request)
    from mitsuba_cfs.glare.glare_view import GlareView
    from mitsuba_cfs.images.hdr import read_hdr

    rows, geometry = [], None
    for path in paths:
        picture = read_hdr(path)
        view = _view(picture, request, path)
        if geometry is None or geometry.view != view:
            geometry = GlareView(view)
        row = _one(path, picture, geometry, options, request, several=len(paths) > 1)
        if row is not None:
            rows.append(row)
    if (table := request.value("--csv")) is not None and rows:
        _write_table(table, rows)


def _check_files(request: Request, paths: list[Path]) -> None:
    """Refuse, before anything is read, what could not be read or written later."""
    for flag in ("-A", "-vf"):
        path = request.value(flag)
        if path is not None and not path.is_file():
            raise DataError("no such file", file=path, field=flag)
    for flag in ("-c", "--csv", "--png"):
        target = request.value(flag)
        if target is None:
            continue
        if flag == "--png" or (flag == "-c" and (len(paths) > 1 or target.is_dir())):
            ResultFolder(target, "glare", adding=True, among=True, field=flag)
        else:
            check_file(target, field=flag, inputs=paths)


def pictures(paths: list[Path]) -> list[Path]:
    """The picture files that the paths stand for, folders as what is in them."""
    result: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES)
            if not inside:
                raise DataError("no .hdr or .pic file in this folder", file=path)
            result += inside
        elif path.exists():
            result.append(path)
        else:
            raise DataError("no such file", file=path)
    return result


def _one(
    path: Path, picture: Picture, geometry: GlareView, options: GlareOptions, request: Request, *, several: bool
) -> dict[str, Any] | None:
    """Rate one picture and print it; its row of the table."""
    from mitsuba_cfs.glare import report
    from mitsuba_cfs.glare.classes import glare_class
    from mitsuba_cfs.glare.evaluation import evaluate

    luminance = picture.luminance
    if "-I" in request.stated:
        luminance = filled(luminance, *request.stated["-I"][1:])
    try:
        if (cut := request.value("-g")) is not None:
            _write_cut(luminance, geometry, cut, request)
            return None
        result = evaluate(luminance, geometry, options=options)
        lines = _lines(result, request)
    except ValueError as error:
        raise DataError(str(error), file=path) from None
    if several:
        click.echo(f"{path}: {glare_class(result.dgp)}")
    for line in lines:
        click.echo(line)
    for notice in notices(result):
        click.echo(f"Notice: {notice}", err=True)
    _write_pictures(path, picture, result, request, several)
    name = {"picture": str(path), "class": glare_class(result.dgp), "sources": result.count}
    return name | report.detailed_figures(result) if "--csv" in request.stated else None


def _view(picture: Picture, request: Request, path: Path) -> View:
    """The view of a picture: the command line's or its own; with what evalglare refuses."""
    height, width = picture.pixels.shape[:2]
    if picture.misplaced_exposure:
        raise DataError(
            "an EXPOSURE entry behind a tab: the pixels' exposure is unknown (after pcomb?)",
            file=path,
            field="EXPOSURE",
        )
    view = parsed_view(request, width, height) or picture.view
    if view is None:
        raise DataError(
            "no valid view in its header: give one, for example -vta -vh 180 -vv 180", file=path, field="VIEW"
        )
    if view.kind == "parallel":
        raise DataError("a parallel view has no glare: expected a fisheye", file=path, field="VIEW")
    if view.kind == "perspective":
        click.echo(f"warning: {path}: a perspective view in its header", err=True)
        if black_corners(picture.luminance) > 0.7 and "-f" not in request.stated:
            raise DataError(
                "black corners, but a perspective view: is it a fisheye? (-f goes on)", file=path, field="VIEW"
            )
    _warn_of_crop(view, request, path)
    return view


def _warn_of_crop(view: View, request: Request, path: Path) -> None:
    """Say where a picture does not show the hemisphere, or shows it out of shape."""
    across, along = view.horizontal_deg / view.width, view.vertical_deg / view.height
    if view.is_fisheye and abs(across / along - 1) > 0.02:
        click.echo(
            f"warning: {path}: {view.width} x {view.height} pixels for {view.horizontal_deg:g} x "
            f"{view.vertical_deg:g} degrees: cropped without a change of its VIEW?",
            err=True,
        )
    narrow = min(view.horizontal_deg, view.vertical_deg) < 180
    if narrow and not {"-i", "-I"} & request.stated.keys():
        click.echo(
            f"warning: {path}: it shows less than 180 degrees, so its illuminance is too low (-i gives it)", err=True
        )


def black_corners(luminance: np.ndarray) -> float:
    """Share of the pixels outside the inscribed circle that are below 7 cd/m2."""
    ny, nx = luminance.shape
    x, y = np.arange(nx) - nx // 2, np.arange(ny) - ny // 2
    outside = np.hypot(x[None, :], y[:, None]) > (nx // 2 + ny // 2) / 2
    return float(np.mean(luminance[outside] < 7.0)) if outside.any() else 0.0


def filled(luminance: np.ndarray, highest: int, lowest: int) -> np.ndarray:
    """A picture [ny, nx] cut above row `highest` and below `lowest` (from the bottom), filled up.

    The last known row is repeated; the bottom row itself stays, as in evalglare.
    """
    upwards = luminance[::-1].copy()
    if not 0 <= lowest < highest <= len(upwards):
        raise click.UsageError(f"-I: rows {highest} and {lowest} of {len(upwards)}")
    upwards[1 : lowest + 1] = upwards[lowest + 1]
    upwards[highest:] = upwards[highest - 1]
    return upwards[::-1]


def _lines(result: GlareResult, request: Request) -> list[str]:
    """What is printed of one picture."""
    from mitsuba_cfs.glare import areas, report
    from mitsuba_cfs.images.hdr import read_hdr

    stated, lines = request.stated, []
    if "-V" in stated:
        return [f"{result.Ev:f}"]
    geometry, luminance = result.geometry, result.luminance
    if "-B" in stated:
        area = areas.band(stated["-B"][0], geometry)
        lines.append(report.band_line(areas.statistics(luminance, area, geometry)))
    if "-A" in stated:
        area = areas.mask_area(read_hdr(stated["-A"][0]).luminance, geometry)
        lines.append(report.mask_line(areas.statistics(luminance, area, geometry), result))
    if result.options.zones is not None and ("-d" in stated or "-A" in stated):
        zone = areas.zone_map(result.options.zones, geometry)
        for number in (1, 2) if result.options.zones.outer is not None else (1,):
            area = areas.statistics(luminance, zone == number, geometry)
            lines.append(report.area_line(f"z{number}", area))
    if "-d" in stated or "-A" in stated:
        return lines + report.detailed_lines(result)
    line = report.brief_line(result) if "-D" in stated else report.short_line(result)
    return [*lines, line]


def notices(result: GlareResult) -> list[str]:
    """Where an index is outside the range that it was made for."""
    notes = []
    if result.Ev < 100:
        notes.append("the vertical illuminance is below 100 lx")
    if result.dgp <= 0.2:
        notes.append("a dark scene: DGP is at most 0.2 and might underestimate glare sources")
    if result.Ev < 380:
        notes.append("a dark scene: below 380 lx DGP might underestimate glare sources")
    return notes


def _write_cut(luminance, geometry: GlareView, cut: int, request: Request) -> None:
    """The picture with its field of view cut, for -g."""
    from mitsuba_cfs.glare.glare_view import in_picture_order, seen
    from mitsuba_cfs.images.hdr import write_hdr

    if cut not in CUTS or "-c" not in request.stated:
        raise click.UsageError("-g needs 1 or 2, and -c FILE for the picture")
    inside = in_picture_order(seen(geometry, CUTS[cut]))
    write_hdr(request.value("-c"), np.where(inside, luminance, 0.0), geometry.view)


def _write_pictures(path: Path, picture: Picture, result: GlareResult, request, several) -> None:
    """The check picture of -c, and what --png asks for."""
    if (check := request.value("-c")) is not None:
        from mitsuba_cfs.images.hdr import write_hdr
        from scenes.pictures import check_radiance

        uniform, blue = request.stated.get("-u"), "-T" in request.stated
        pixels = check_radiance(result, uniform, show_task=blue)
        view, about = result.geometry.view, (VERSION,)
        if several or check.is_dir():
            with ResultFolder(check, "glare", adding=True, among=True, field="-c").replaced() as place:
                write_hdr(place / f"{path.stem}_check.hdr", pixels, view, comments=about)
        else:
            write_hdr(check, pixels, view, comments=about)
    if (folder := request.value("--png")) is not None:
        with ResultFolder(folder, "glare", adding=True, among=True, field="--png").replaced() as place:
            _write_png(place, path.stem, picture, result, request.stated.get("--scale"))


def _write_png(folder: Path, name: str, picture: Picture, result: GlareResult, limits) -> None:
    from mitsuba_cfs.glare.classes import glare_class
    from mitsuba_cfs.glare.glare_view import in_picture_order
    from scenes import pictures as drawn

    title = f"{name}   DGP {result.dgp:.3f} ({glare_class(result.dgp)}), E_v {result.Ev:,.0f} lx"
    valid = in_picture_order(result.geometry.valid)
    colour = picture.pixels if picture.colours == "rgb" else picture.luminance
    drawn.write_falsecolour(
        folder / f"{name}_falsecolour.png", picture.luminance, title=title, seen=valid, limits=limits
    )
    drawn.write_tone_mapped(
        folder / f"{name}.png",
        np.where(valid[..., None], colour, 0.0) if colour.ndim == 3 else np.where(valid, colour, 0.0),
    )
    drawn.write_check_picture(folder / f"{name}_sources.png", result, title=title)


def _write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    import pandas as pd

    write_table(pd.DataFrame(rows), path, index=False, float_format="%.6g")
