"""A folder served on this machine's loopback address, and to nobody else."""

from __future__ import annotations

from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

LOOPBACK = "127.0.0.1"


class _Handler(SimpleHTTPRequestHandler):
    """Files for who asks for them by the loopback address: a foreign name could be anybody's."""

    def send_head(self) -> Any:
        name = self.headers.get("Host", "").partition(":")[0]
        if name not in (LOOPBACK, "localhost"):
            self.send_error(403)
            return None
        return super().send_head()

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


def server(folder: Path, port: int = 0) -> ThreadingHTTPServer:
    """A server of a folder, not running yet; port 0: a free one.

    Raises: `OSError` where the port is taken.
    """
    return ThreadingHTTPServer((LOOPBACK, port), partial(_Handler, directory=str(folder)))
