"""evalglare's command line: its flags, as a table, and what they mean for us."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

if TYPE_CHECKING:
    from mitsuba_cfs.glare.evaluation import GlareOptions
    from mitsuba_cfs.images.view import View

# flag: (types of its arguments, their names, help)
FLAGS: dict[str, tuple[tuple[type, ...], str, str]] = {
    "-d": ((), "", "All figures, and a line for each glare source."),
    "-D": ((), "", "One line with more figures."),
    "-V": ((), "", "Only the vertical illuminance."),
    "-v": ((), "", "The version."),
    "-b": ((float,), "FACTOR", "Threshold: above 100 in cd/m2 (default 2000), else times the "
           "task's or picture's average (default 5 with a task)."),
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
}  # fmt: skip
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


def _values(
    flag: str, types: tuple[type, ...], names: str, words: tuple[str, ...]
) -> tuple[Any, ...]:
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


def options(request: Request) -> GlareOptions:
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
