"""What an error says to the user: a sentence, never the name of a class."""

from __future__ import annotations

from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.files import reason
from thermal.errors import ThermalInputError

LONGEST = 1500  # characters of a message: a file may hold a word of a megabyte


def user_message(error: BaseException) -> str | None:
    """The one line of an error that a user can cause; None for a fault of the program's own."""
    if isinstance(error, (CfsError, ThermalInputError)):
        return one_line(str(error))
    if isinstance(error, OSError) and error.errno is not None:
        where = "" if error.filename is None else f"{error.filename}: "
        return one_line(f"{where}{reason(error)}")
    if isinstance(error, MemoryError):
        return "out of memory"
    return None


def one_line(text: str) -> str:
    """A text without line breaks or control characters, cut off where it is very long."""
    line = " ".join(text.split())
    line = line if len(line) <= LONGEST else f"{line[:LONGEST]} ... ({len(line)} characters)"
    return line if line.isprintable() else "".join(c if c.isprintable() else "\ufffd" for c in line)
