"""The server of the page: this machine only, with a token, and for pages of its own alone.

Three rules guard it. A request's Host must be the loopback address with this port, so that no name
of another's leads here. The page and its data need a cookie, which the address with the token sets;
a request that changes something needs the page's own Origin besides. Result files are served under
a path with a secret of its own, sandboxed: a script in them has no access to the page.
"""

from __future__ import annotations

import asyncio
import csv
import hmac
import json
import math
import mimetypes
import os
import secrets
import shutil
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from mitsuba_cfs.errors import CfsError, DataError
from mitsuba_cfs.files import json_text, read_json, reason
from scenes.app import actions
from scenes.app.jobs import Jobs
from scenes.app.project import GAINS, INPUTS, LOADS, RESULTS, MadeSystem, Project, plain_name
from scenes.explore.folder import script_words
from scenes.fenestration.library import Sheet, glazing_entry, library, shade_entry, sheets
from scenes.head import FAR_SITE_DEG
from scenes.input_files import read_weather
from scenes.language.catalogue import gettext, in_language
from scenes.report.names import quantity
from scenes.report.page import FILES, environment
from scenes.report.page_files import page_files
from scenes.report.typography import prose
from scenes.user_errors import user_message

# Columns of `results.csv`; + where more is better, - where less is
FIGURES = {
    "sda300_50": "+",
    "ase1000_250": "-",
    "udi_300_3000": "+",
    "glare_intolerable_h": "-",
    "operative_max_c": "-",
    "heating_kwh": "-",
    "cooling_kwh": "-",
    "lighting_kwh": "-",
}


def variants(project: Project, language: str = "en") -> dict[str, Any] | None:
    """Rooms by systems with their key figures; None before a comparison.

    Returns: `columns` with label, unit, digits, meaning and which way is better; `rows` with room,
        system, error and values; `quick`: whether it is a preview.
    """
    folder = project.folder / RESULTS / "comparison"
    table = folder / "results.csv"
    if not table.is_file():
        return None
    try:
        with table.open(encoding="utf-8", newline="") as file:
            cases = list(csv.DictReader(file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot be read: {reason(error)}", file=table) from None
    if not all(case.get("space") and case.get("system") for case in cases):
        raise DataError("expected the columns space and system", file=table)
    shown = [key for key in FIGURES if any(case.get(key) for case in cases)]
    with in_language(language):
        named = [quantity(key) for key in shown]
    return {
        "columns": [
            {
                "key": key,
                "label": q.label,
                "unit": q.unit,
                "digits": q.digits,
                "meaning": q.meaning,
                "better": FIGURES[key],
            }
            for key, q in zip(shown, named, strict=True)
        ],
        "rows": [
            {
                "room": case["space"],
                "system": case["system"],
                "error": case.get("error", ""),
                "values": [_number(case.get(key, "")) for key in shown],
            }
            for case in cases
        ],
        "quick": actions.quick_study(folder),
    }


def _number(text: str) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


class _Answers(HTMLParser):
    """Collects the paragraphs of class "answer", with which a page of results begins."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[str] = []
        self._within = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a paragraph."""
        if tag == "p" and ("class", "answer") in attrs:
            self._within = True
            self.found.append("")

    def handle_endtag(self, tag: str) -> None:
        """End it."""
        self._within = self._within and tag != "p"

    def handle_data(self, data: str) -> None:
        """Add its text."""
        if self._within:
            self.found[-1] += data


HEAD = 400_000  # characters of a page in which its answers are
MOST_ANSWERS = 40


def answers(page: Path) -> tuple[str, ...]:
    """The sentences that a report or dossier begins with."""
    status = page.stat()
    return _answers(page, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=200)
def _answers(page: Path, _time: int, _size: int) -> tuple[str, ...]:
    reader = _Answers()
    with page.open(encoding="utf-8", errors="replace") as file:
        reader.feed(file.read(HEAD))
    texts = (" ".join(text.split()) for text in reader.found[:MOST_ANSWERS])
    return tuple(text for text in texts if text)


INDEX = "index.html"
SCRIPTS = "scenes/app/templates/"  # where the messages of scripts are from
OWN = page_files("scenes.app")
SHARED = {name: FILES[name] for name in ("style.css", "viewer.js")}
SHARED |= {"words.js": page_files("scenes.explore")["words.js"]}
PAGE_FILES = {name: text for name, text in OWN.items() if name != INDEX} | SHARED


def page_html(project: str, language: str, files: str) -> str:
    """The page of a project; `files`: the path that its results are served under."""
    with in_language(language):
        words = script_words(SCRIPTS)
        template = environment(OWN).get_template(INDEX)
        return template.render(project=project, language=language, words=words, files=files)


LOOPBACK = "127.0.0.1"
SELF_ONLY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data:; connect-src 'self'; frame-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
SANDBOXED = "sandbox allow-scripts allow-popups allow-downloads allow-modals; frame-ancestors 'self'"
JSON = "application/json"
POLL_S = 20.0  # a request for news is answered at the latest after that
STEP_S = 0.1  # between two looks for news
BODY = 1 << 20  # most bytes of a request that is no upload


@dataclass(frozen=True, slots=True)
class UploadLimits:
    """What may be uploaded."""

    file_bytes: int = 1 << 30  # of one file
    total_bytes: int = 4 << 30  # of all inputs
    files: int = 200


@dataclass(frozen=True, slots=True)
class Secrets:
    """What a request shows to be let in."""

    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))  # of the page
    files: str = field(default_factory=lambda: secrets.token_urlsafe(24))  # of the result files


class Guard:
    """Lets only requests of this machine's own page through."""

    def __init__(self, app: ASGIApp, port: int, known: Secrets) -> None:
        """Guard an application at a port."""
        self._app, self._known = app, known
        self._hosts = {f"{name}:{port}" for name in (LOOPBACK, "localhost")}
        self._origins = {f"http://{host}" for host in self._hosts}
        self.cookie = f"cfs_app_{port}"  # cookies are shared by all ports of a host

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or refuse."""
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self._app(scope, receive, send)
            return
        request = Request(scope, receive)
        fault = self._fault(request)
        if fault is not None:
            await Response(fault, 403, media_type="text/plain")(scope, receive, send)
            return
        if request.url.path == "/" and "token" in request.query_params:
            answer = RedirectResponse("/", 303, {"Referrer-Policy": "no-referrer"})
            answer.set_cookie(self.cookie, self._known.token, httponly=True, samesite="strict")
            await answer(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _fault(self, request: Request) -> str | None:
        """Why a request is refused; None where it is not."""
        host, origin = request.headers.get("host", ""), request.headers.get("origin")
        if host not in self._hosts:
            return "This page is served to this machine only."
        path = request.url.path
        if path.startswith("/files/"):
            known = _same(path.split("/")[2], self._known.files)
            return None if known and request.method in ("GET", "HEAD") else "Wrong address."
        if request.method not in ("GET", "HEAD") and origin not in self._origins:
            return "Only the page itself may change something."
        if path == "/" and "token" in request.query_params:
            known = _same(request.query_params["token"], self._known.token)
        elif request.headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            return "Another page asked."
        else:
            known = _same(request.cookies.get(self.cookie, ""), self._known.token)
        return None if known else "Open the address that `cfs app` printed: it holds the token."


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


Answer = Callable[[Request], Awaitable[Response]]


class AppServer:
    """The page, its data and its commands for one project."""

    def __init__(
        self, project: Project, jobs: Jobs, *, language: str = "en", limits: UploadLimits | None = None
    ) -> None:
        """Serve a project."""
        self._project, self._jobs, self._language = project, jobs, language
        self._limits = limits or UploadLimits()
        self._known = Secrets()
        self._rules: list[dict[str, str | bool]] | None = None
        self._taking = 0  # bytes of uploads under way
        self._made: dict[str, list[MadeSystem]] = {}  # systems that wait for a file, by its name
        jobs.on_done = self._use_made

    @property
    def token(self) -> str:
        """What the address of the page holds."""
        return self._known.token

    def app(self, port: int) -> Guard:
        """The guarded application at a port."""
        routes = [
            Route("/", self._page),
            Route("/app/{name}", self._script),
            Route("/files/{secret}/{path:path}", self._file),
            Route("/api/state", self._answered(self._state)),
            Route("/api/jobs", self._answered(self._news)),
            Route("/api/check", self._answered(self._check)),
            Route("/api/rules", self._answered(self._rule_sets)),
            Route("/api/variants", self._answered(self._variants)),
            Route("/api/library", self._answered(self._library)),
            Route("/api/library", self._answered(self._from_library), methods=["POST"]),
            Route("/api/demo", self._answered(self._demo), methods=["POST"]),
            Route("/api/again", self._answered(self._again), methods=["POST"]),
            Route("/api/upload", self._answered(self._upload), methods=["POST"]),
            Route("/api/change", self._answered(self._change), methods=["POST"]),
            Route("/api/remove", self._answered(self._remove), methods=["POST"]),
            Route("/api/plan", self._answered(self._plan), methods=["POST"]),
            Route("/api/run", self._answered(self._run), methods=["POST"]),
            Route("/api/stop", self._answered(self._stop), methods=["POST"]),
        ]

        @asynccontextmanager
        async def lifespan(_: Starlette) -> Any:
            yield
            self._jobs.close()

        return Guard(Starlette(routes=routes, lifespan=lifespan), port, self._known)

    # ---- pages and files

    async def _page(self, _: Request) -> Response:
        text = page_html(self._project.folder.name, self._language, f"/files/{self._known.files}/")
        return HTMLResponse(text, headers=_headers(SELF_ONLY))

    async def _script(self, request: Request) -> Response:
        text = PAGE_FILES.get(request.path_params["name"])
        if text is None:
            return Response("Not found.", 404)
        kind = mimetypes.guess_type(request.path_params["name"])[0] or "text/plain"
        return Response(text, media_type=kind, headers=_headers(SELF_ONLY))

    async def _file(self, request: Request) -> Response:
        """A file of results, or a log; nothing else of the machine."""
        path = self._project.folder / request.path_params["path"]
        place = Path(os.path.realpath(path))
        inside = (Path(os.path.realpath(self._project.folder / one)) for one in (RESULTS, "log"))
        if not any(place.is_relative_to(one) for one in inside) or not place.is_file():
            return Response("Not found.", 404, headers=_headers(SANDBOXED))
        return FileResponse(place, headers=_headers(SANDBOXED))

    def _answered(self, answer: Callable[[Request], Awaitable[Any]]) -> Answer:
        """A handler that gives JSON, and a user's mistake in one line."""

        async def handler(request: Request) -> Response:
            try:
                with in_language(self._language):
                    value = await answer(request)
            except ClientDisconnect:
                return Response(status_code=499)
            except (CfsError, ValueError, OSError) as error:
                message = user_message(error)
                if message is None:
                    raise
                return _json({"error": message}, 422)
            return _json(value)

        return handler

    # ---- data

    async def _state(self, _: Request) -> Any:
        return await asyncio.to_thread(self._facts)

    def _facts(self) -> dict[str, Any]:
        study, operation = self._project.study(), self._project.operation()
        entry: Mapping[str, Any] = next((one for one in study.get("room", []) if "building" in one), {})
        gains = operation.get("gains", {})
        systems = study.get("system", [])
        results, titles = self._project.results(), actions.result_titles(study)
        journal = self._project.journal()
        for result in results:
            result["outdated"] = actions.outdated(self._project, result["name"], journal)
            result["quick"] = actions.preview(self._project, result["name"], journal)
            result["title"] = _result_title(result["name"], titles)
            pages = [result["pages"].get(name) for name in ("report", "dossier")]
            result["answers"] = [text for page in pages if page for text in answers(self._project.folder / page)]
        return {
            "name": self._project.folder.name,
            "folder": str(self._project.folder),
            "title": study.get("title", ""),
            "files": [asdict(file) for file in self._project.files()],
            "building": self._project.building(),
            "spaces": entry.get("spaces", []),
            "join": entry.get("join", []),
            "furniture": entry.get("furniture", False),
            "weather": [one.get("weather") for one in study.get("climate", [])],
            "station": self._station(study),
            "surroundings": study.get("surroundings", []),
            "systems": systems,
            "sheets": self._sheets(systems),
            "operated": "system" in operation,  # the operation file has systems of its own
            "quick": study.get("quick", False),
            "loads": {key: operation.get("loads", {}).get(key) for key in LOADS}
            | {key: gains.get(key) for key in GAINS},
            "uses": self._project.uses(),
            "corrections": self._project.corrections(),
            "others": sum("building" not in one for one in study.get("room", [])),
            "results": results,
            "exported": self._project.exported(),
            "journal": journal[-50:],
        }

    def _station(self, study: Mapping[str, Any]) -> dict[str, Any] | None:
        """Place of the weather station, and from which difference of degrees it is far; None where unknown."""
        file = next((one["weather"] for one in study.get("climate", []) if one.get("weather")), None)
        path = self._project.folder / str(file)
        if file is None or not path.is_file():
            return None
        status = path.stat()
        try:
            return _station(path, status.st_mtime_ns, status.st_size)
        except DataError:  # a file that was changed since: a command names its fault
            return None

    async def _news(self, request: Request) -> Any:
        """The commands, once they differ from what the page has."""
        known = request.query_params.get("version", "")
        for _ in range(round(POLL_S / STEP_S)):
            if str(self._jobs.version) != known or await request.is_disconnected():
                break
            await asyncio.sleep(STEP_S)
        return {"version": self._jobs.version, "jobs": self._jobs.facts()}

    async def _check(self, _: Request) -> Any:
        path = self._project.folder / actions.CHECK
        if not path.is_file():
            return None
        check = await asyncio.to_thread(read_json, path)
        check["head"] = [prose(line) for line in check["head"]]
        for issue in check["issues"]:
            issue |= {key: prose(issue[key]) for key in ("what", "effect")}
        return check

    async def _rule_sets(self, _: Request) -> Any:
        if self._rules is None:
            self._rules = list(await asyncio.to_thread(actions.rule_sets))
        return self._rules

    async def _variants(self, _: Request) -> Any:
        return await asyncio.to_thread(variants, self._project, self._language)

    async def _library(self, _: Request) -> Any:
        return await asyncio.to_thread(_library_facts)

    def _sheets(self, systems: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Figures of the systems that are of the library, by their files."""
        known = {actions.library_file(one.glazing, one.shade): _sheet_facts(one) for one in sheets().values()}
        by_name = {}
        for system in systems:
            file = system.get("bsdf") or system.get("operation", "")
            states = self._project.states(file) if "bsdf" not in system and file else [file]
            if states and states[-1] in known:
                by_name[file] = known[states[-1]]
        return by_name

    # ---- changes

    async def _from_library(self, request: Request) -> Any:
        """Make a system of the library and take it as a variant once it is there."""
        wanted = await _body(request)
        glazing, shade = str(wanted.get("glazing", "")), str(wanted.get("shade", ""))
        titles = [glazing_entry(glazing).title]
        titles = [shade_entry(shade).title, *titles] if shade else titles
        moving = bool(shade) and wanted.get("moving") is True
        if moving and shade_entry(shade).fixed:
            raise DataError(f"{shade} is fixed: it cannot move", field="moving")
        files = [actions.library_file(glazing, shade)]
        files = [actions.library_file(glazing, ""), *files] if moving else files
        missing = [one for one in files if not (self._project.folder / one).is_file()]
        made = MadeSystem(titles[0] + (", moving" if moving else ""), tuple(files))
        if not missing:
            await asyncio.to_thread(self._project.use_made, made)
            self._jobs.touch()
            return None
        self._made.setdefault(missing[-1], []).append(made)
        makes = (actions.library(glazing, one) for one in dict.fromkeys(("", shade)))
        self._jobs.add([one for one in makes if one.out in missing])
        return None

    def _use_made(self, action: actions.Action) -> None:
        for made in self._made.get(action.out, ()):
            self._project.use_made(made)
        self._made.pop(action.out, None)

    async def _demo(self, _: Request) -> Any:
        """Copy the demo's office and weather into the project."""
        from scenes.demo import OFFICE, WEATHER

        for source in (OFFICE, WEATHER):
            part = self._project.folder / INPUTS / f".upload-{secrets.token_hex(8)}"
            try:
                await asyncio.to_thread(shutil.copyfile, source, part)
                await asyncio.to_thread(self._project.take, part, Path(source).name)
            finally:
                part.unlink(missing_ok=True)
        self._jobs.add([actions.check(self._project)])
        return self._facts()

    async def _again(self, request: Request) -> Any:
        number = (await _body(request)).get("number")
        self._jobs.again(number if isinstance(number, int) else 0)
        return None

    async def _upload(self, request: Request) -> Any:
        name = plain_name(request.query_params.get("name", ""))
        if not name:
            raise UploadError("the file has no name")
        files = await asyncio.to_thread(self._project.files)
        if len(files) >= self._limits.files:
            raise UploadError(f"a project has at most {self._limits.files} input files")
        room = self._limits.total_bytes - sum(file.size for file in files) - self._taking
        most = min(self._limits.file_bytes, room)
        stated = request.headers.get("content-length", "")
        if stated.isdigit() and int(stated) > most:
            raise UploadError(f"{name}: {_too_large(most)}")
        part = self._project.folder / INPUTS / f".upload-{secrets.token_hex(8)}"
        size = 0
        try:
            with part.open("wb") as file:
                async for chunk in request.stream():
                    size += len(chunk)
                    self._taking += len(chunk)
                    if size > most:
                        raise UploadError(f"{name}: {_too_large(most)}")
                    await asyncio.to_thread(file.write, chunk)
            taken = await asyncio.to_thread(self._project.take, part, name)
        finally:
            self._taking -= size
            part.unlink(missing_ok=True)
        if taken.kind in ("building", "surroundings", "beside") and self._project.building():
            self._jobs.add([actions.check(self._project)])
        return asdict(taken)

    async def _change(self, request: Request) -> Any:
        wanted = await _body(request)
        await asyncio.to_thread(self._project.change, wanted)
        if "corrections" in wanted or "join" in wanted:
            self._jobs.add([actions.check(self._project)])
        return self._facts()

    async def _remove(self, request: Request) -> Any:
        wanted = await _body(request)
        if "results" in wanted:
            await asyncio.to_thread(self._project.clear, str(wanted["results"]))
        else:
            before = self._project.building()
            await asyncio.to_thread(self._project.remove, str(wanted.get("file", "")))
            if self._project.building() not in ([], before):
                self._jobs.add([actions.check(self._project)])
        return self._facts()

    async def _plan(self, request: Request) -> Any:
        return [{"command": one.text, "kind": one.kind} for one in self._wanted(await _body(request))]

    async def _run(self, request: Request) -> Any:
        wanted = await _body(request)
        return [job.number for job in self._jobs.add(self._wanted(wanted))]

    def _wanted(self, wanted: Mapping[str, Any]) -> list[actions.Action]:
        if wanted.get("check"):
            return [actions.check(self._project)]
        if "export" in wanted:
            return [actions.export(self._project, str(wanted["export"]))]
        return actions.computations(self._project, wanted)

    async def _stop(self, request: Request) -> Any:
        number = (await _body(request)).get("number")
        self._jobs.stop(number if isinstance(number, int) else 0)
        return None


@lru_cache(maxsize=8)
def _station(path: Path, _time: int, _size: int) -> dict[str, Any]:
    weather = read_weather(path)
    place = {"latitude_deg": weather.latitude_deg, "longitude_deg": weather.longitude_deg}
    return {"name": weather.site, **place, "far_deg": FAR_SITE_DEG}


def _result_title(folder: str, titles: Mapping[str, str]) -> str:
    """The system that a folder of results is of, as the page names it."""
    kind, _, rest = folder.partition("-")
    return titles.get(folder, rest.replace("-", " ")) if kind in ("report", "rules") else ""


def _sheet_facts(sheet: Sheet) -> dict[str, Any]:
    source = shade_entry(sheet.shade).source if sheet.shade else glazing_entry(sheet.glazing).source
    return asdict(sheet) | {"source": gettext(source)}


def _library_facts() -> dict[str, Any]:
    """Glazings, shades and the figures of each pair."""
    known = library()
    return {
        "glazings": [_entry_facts(one.name, one.title, one.source) for one in known.glazing],
        "shades": [_entry_facts(one.name, one.title, one.source) | {"fixed": one.fixed} for one in known.shade],
        "sheets": [asdict(one) for one in sheets().values()],
    }


def _entry_facts(name: str, title: str, source: str) -> dict[str, str | bool]:
    return {"name": name, "title": gettext(title), "source": gettext(source)}


class UploadError(CfsError, ValueError):
    """An upload that is refused."""


def _too_large(most: int) -> str:
    return f"is larger than the {max(most, 0) / 1e6:.0f} MB that are left or allowed"


async def _body(request: Request) -> dict[str, Any]:
    """The JSON object of a request."""
    if request.headers.get("content-type", "").partition(";")[0] != JSON:
        raise UploadError("expected a JSON object")
    text = b""
    async for chunk in request.stream():
        text += chunk
        if len(text) > BODY:
            raise UploadError("the request is too long")
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise UploadError("expected a JSON object")
    return value


def _json(value: Any, status: int = 200) -> Response:
    return Response(json_text(value), status, headers=_headers(SELF_ONLY), media_type=JSON)


def _headers(policy: str) -> dict[str, str]:
    return {
        "Content-Security-Policy": policy,
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cache-Control": "no-store",
    }
