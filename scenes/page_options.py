"""Title, author, logo and sections of a page, from a user's file."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar
from xml.etree import ElementTree

from PIL import Image
from pydantic import Field

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from scenes.figures.picture import bytes_uri
from scenes.language.catalogue import Language, gettext
from scenes.toml_file import TomlTable, read_table, validated

# Optional sections of a page, by their names in a file; those of a room apply to each room.
# Assumptions and notes are always shown: figures without them mislead.
RunSection = Literal[
    "verdict",
    "orientation",
    "rooms",
    "daylight",
    "glare",
    "spectral",
    "operation",
    "temperatures",
    "glazing",
    "model",
    "problems",
    "method",
    "inputs",
    "glossary",
]
StudySection = Literal["verdict", "comparison", "model", "problems", "method", "inputs", "glossary"]
DesignSection = Literal["candidates", "search", "inputs"]
FitSection = Literal["readings", "noise"]
DossierSection = Literal["rooms", "problems", "sources"]
GlareSection = Literal["worst", "seats", "views"]

Section = TypeVar("Section", bound=str)
Line = Annotated[str, Field(min_length=1, max_length=200)]
LOGO_BYTES = 500_000  # in every page that is sent on
LOGO_PIXELS = 4000  # of its longer side
SVG = "{http://www.w3.org/2000/svg}svg"


class PageTable(TomlTable, Generic[Section]):
    """A file of a page; the logo's path is relative to it."""

    title: Line | None = None
    author: Line | None = None
    logo: Path | None = None
    language: Language = "en"
    sections: dict[Section, bool] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PageOptions:
    """Options of a page besides its results."""

    title: str = ""  # empty: the page's own
    author: str = ""
    logo: str = ""  # data URI
    left_out: tuple[str, ...] = ()  # names of sections
    language: Language = "en"
    inputs: tuple[Path, ...] = ()  # files that this was read from

    @property
    def facts(self) -> tuple[tuple[str, str], ...]:
        """Additional facts in the page's head."""
        return ((gettext("Author"), self.author),) if self.author else ()

    def shows(self, section: str) -> bool:
        """Whether the page has a section."""
        return section not in self.left_out


OWN_PAGE = PageOptions()


def read_page(path: Path | None, sections: Any, language: Language | None = None) -> PageOptions:
    """The options of a page; the page's own where there is no file.

    Args:
        sections: literal type of the optional sections of this page.
        language: of the page; None: that of the file.

    Raises: `DataError` that names file and key.
    """
    if path is None:
        return PageOptions(language=language or "en")
    table: PageTable = validated(PageTable[sections], read_table(path), path)
    logo = None if table.logo is None else path.parent / table.logo
    return PageOptions(
        title=table.title or "",
        author=table.author or "",
        logo="" if logo is None else _logo_uri(logo, path),
        left_out=tuple(name for name, shown in table.sections.items() if not shown),
        language=language or table.language,
        inputs=(path,) if logo is None else (path, logo),
    )


def _logo_uri(logo: Path, path: Path) -> str:
    """A picture file as a data URI; `DataError` of the file `path` that names it."""

    def fault(what: str) -> DataError:
        return DataError(f"{logo} {what}", file=path, field="logo")

    try:
        content = logo.read_bytes()
    except OSError as error:
        raise fault(f"cannot be read: {reason(error)}") from error
    if len(content) > LOGO_BYTES:
        raise fault(f"has {len(content) / 1000:.0f} kB; at most {LOGO_BYTES // 1000} kB")
    if _is_svg(content):
        return bytes_uri(content, "image/svg+xml")
    try:
        with Image.open(io.BytesIO(content), formats=("PNG", "JPEG")) as picture:
            if max(picture.size) > LOGO_PIXELS:
                width, height = picture.size
                raise fault(f"has {width} x {height} pixels; at most {LOGO_PIXELS} a side")
            picture.load()
            return bytes_uri(content, f"image/{str(picture.format).lower()}")
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:  # SyntaxError: Pillow's, of a broken PNG
        raise fault("is no PNG, JPEG or SVG picture") from error


def _is_svg(content: bytes) -> bool:
    try:
        return ElementTree.fromstring(content).tag == SVG
    except ElementTree.ParseError:
        return False
