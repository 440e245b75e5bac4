"""The server of `cfs app` in a thread of the test, and requests of its page and of strangers."""

from __future__ import annotations

import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn

from scenes.app.jobs import Jobs
from scenes.app.project import Project
from scenes.app.server import AppServer, UploadLimits

WAIT_S = 240.0  # for a command: the processor may be shared with many


@dataclass
class Served:
    """A running server."""

    project: Project
    jobs: Jobs
    server: AppServer
    port: int

    @property
    def address(self) -> str:
        """The address that the command prints."""
        return f"http://127.0.0.1:{self.port}/?token={self.server.token}"

    @property
    def cookie(self) -> str:
        """The cookie of a page that was opened by that address."""
        return f"cfs_app_{self.port}={self.server.token}"

    def ask(
        self, method: str, path: str, body: bytes | None = None, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of an answer to a request with these headers alone."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        sent = {"Host": f"127.0.0.1:{self.port}"} | {name.replace("_", "-"): value for name, value in headers.items()}
        with closing(connection):
            connection.request(method, path, body, sent)
            answer = connection.getresponse()
            found = {name.lower(): value for name, value in answer.getheaders()}
            return answer.status, found, answer.read()

    def page(self, method: str, path: str, value: Any = None, **headers: str) -> tuple[int, Any]:
        """Status and JSON of an answer to a request of the page itself."""
        own = {"Cookie": self.cookie, "Origin": f"http://127.0.0.1:{self.port}"}
        body = value if isinstance(value, bytes | None) else json.dumps(value).encode()
        if not isinstance(value, bytes | None):
            own["Content_Type"] = "application/json"
        status, _, text = self.ask(method, path, body, **(own | headers))
        try:
            return status, json.loads(text)
        except ValueError:
            return status, text.decode()

    def upload(self, file: Path, name: str | None = None) -> tuple[int, Any]:
        """Send a file as the page does."""
        return self.page("POST", f"/api/upload?name={name or file.name}", file.read_bytes())

    def idle(self) -> None:
        """Wait until no command runs."""
        end = time.monotonic() + WAIT_S
        while self.jobs.busy:
            if time.monotonic() > end:
                raise AssertionError(f"still busy: {self.jobs.facts()}")
            time.sleep(0.05)


@contextmanager
def serving(folder: Path, *, language: str = "en", limits: UploadLimits | None = None) -> Iterator[Served]:
    """A server of a project folder on a free port."""
    project = Project(folder)
    jobs = Jobs(project)
    served = AppServer(project, jobs, language=language, limits=limits)
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        port = listening.getsockname()[1]
        settings = uvicorn.Config(served.app(port), log_level="warning", timeout_graceful_shutdown=1)
        server = uvicorn.Server(settings)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        try:
            while not server.started:
                time.sleep(0.01)
            yield Served(project, jobs, served, port)
        finally:
            server.should_exit = True
            thread.join(30)
            jobs.close()
