"""The elements of an XML file one after the other, without namespaces: `xml_elements`.

Entities are refused: a file of a few lines with them can fill the memory or read other files.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, wrong_encoding

DEEPEST = 100  # elements within each other
CHUNK = 1 << 20  # bytes parsed at once


def xml_elements(
    path: Path, root: str | None, *, depth: int, most_bytes: int
) -> Iterator[tuple[ElementTree.Element, int]]:
    """The elements of a depth (1: the root) with their lines; what was yielded is not kept.

    Names of elements and attributes are without namespaces.

    Args: root: its name; None: any.

    Raises: `DataError` for a file that cannot be read, is no XML, has another root, declares
    entities, is bigger or more deeply nested than what is read.
    """
    reader = _Reader(path, root, depth)
    try:
        if path.stat().st_size > most_bytes:
            raise DataError(f"is too big: at most {most_bytes >> 20} MiB are read", file=path)
        with path.open("rb") as file:
            while chunk := file.read(CHUNK):
                reader.parser.Parse(chunk, False)
                yield from reader.taken()
        reader.parser.Parse(b"", True)
        yield from reader.taken()
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    except (expat.ExpatError, LookupError, ValueError) as error:
        if isinstance(error, DataError):
            raise
        message = wrong_encoding(path.read_bytes()) or f"is no XML: {error}"
        raise DataError(message, file=path) from None
    finally:
        del reader.parser  # which holds the reader: both would stay until garbage is collected


class _Reader:
    """A parser that builds the elements of one depth."""

    def __init__(self, path: Path, root: str | None, depth: int) -> None:
        self.path, self.root, self.depth = path, root, depth
        self.level, self.line = 0, 0
        self.builder = ElementTree.TreeBuilder()
        self.done: list[tuple[ElementTree.Element, int]] = []
        self.parser = parser = expat.ParserCreate(namespace_separator="}")
        parser.buffer_text = True
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.CharacterDataHandler = self._data
        parser.EntityDeclHandler = parser.ExternalEntityRefHandler = self._refuse

    def taken(self) -> list[tuple[ElementTree.Element, int]]:
        """The elements that are complete, each of them once."""
        done, self.done = self.done, []
        return done

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.level += 1
        if self.level > DEEPEST:
            line = self.parser.CurrentLineNumber
            raise DataError(f"line {line}: elements nested too deeply", file=self.path)
        if self.level == 1 and self.root not in (None, _local(name)):
            message = f"expected {self.root}, got {_local(name)[:40]}"
            raise DataError(message, file=self.path)
        if self.level == self.depth:
            self.builder = ElementTree.TreeBuilder()
            self.line = self.parser.CurrentLineNumber
        if self.level >= self.depth:
            self.builder.start(_local(name), {_local(k): v for k, v in attributes.items()})

    def _end(self, name: str) -> None:
        if self.level >= self.depth:
            self.builder.end(_local(name))
        if self.level == self.depth:
            self.done.append((self.builder.close(), self.line))
        self.level -= 1

    def _data(self, text: str) -> None:
        if self.level >= self.depth:
            self.builder.data(text)

    def _refuse(self, *_: object) -> None:
        raise DataError("declares entities, which are not read", file=self.path)


def _local(name: str) -> str:
    return name.rpartition("}")[2]
