"""Standard output and error that may be closed, or end before the program does."""

from __future__ import annotations

import errno
import io
import os
import sys


class _Stream(io.FileIO):
    """A standard stream that says nothing more once nobody reads it or nothing more fits."""

    def __init__(self, handle: int, name: str) -> None:
        super().__init__(handle, "w", closefd=False)
        self._told = name

    def write(self, data) -> int:  # type: ignore[override]
        """Write; `OSError` names the stream, but where its reader has gone the work goes on."""
        try:
            return super().write(data)
        except OSError as error:
            if error.errno == errno.EAGAIN:
                raise
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            if error.errno == errno.EPIPE:
                return len(memoryview(data).cast("B"))
            raise OSError(error.errno, error.strerror, self._told) from None


def open_streams() -> None:
    """Give the program its three standard streams, whatever the shell left of them.

    A closed one becomes the null device: else the next file that is opened takes its number.
    """
    for handle in range(3):
        try:
            os.fstat(handle)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
    for handle, name, told in ((1, "stdout", "standard output"), (2, "stderr", "standard error")):
        old = getattr(sys, name)
        text = io.TextIOWrapper(
            io.BufferedWriter(_Stream(handle, told)),
            encoding=getattr(old, "encoding", None) or "utf-8",
            errors=getattr(old, "errors", None) or "backslashreplace",
            line_buffering=handle == 2 or getattr(old, "line_buffering", False),
            write_through=getattr(old, "write_through", False),
        )
        setattr(sys, name, text)
