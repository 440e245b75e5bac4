"""A project folder: input files, a study file that `cfs study` reads, results.

    inputs/             building, weather, systems, surroundings
    study.toml          rooms, systems, weather, options: a study file, see docs/studies.md
    operation.toml      gains and set points, where some are chosen
    page.toml           title of the pages, where one is stated
    uses.toml           uses of rooms that the page states, for `cfs comply --uses`
    results/NAME/       what the commands write
    commands.jsonl      every command that was run, when, and how it ended

The page changes only what it shows; keys and entries of others in these files stay.
"""

from __future__ import annotations

import json
import math
import os
import re
import threading
import unicodedata
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import tomlkit
from pydantic import BaseModel
from tomlkit.items import AoT, Table

from bim.building_file import check_building_file
from bim.ifc.corrections import corrections_file, read_corrections
from bim.names import JOINT
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, reason, write_text
from scenes.comply.uses import UsesFile
from scenes.input_files import read_weather
from scenes.result_folder import DOSSIER, REPORT, remove_results
from scenes.room.operation_tables import OperationTables
from scenes.study.study_file import Study
from scenes.toml_file import check_kinds, read_table

INPUTS, RESULTS, LOGS = "inputs", "results", "log"
STUDY, OPERATION, USES, PAGE = "study.toml", "operation.toml", "uses.toml", "page.toml"
JOURNAL = "commands.jsonl"
BUILDINGS = (".ifc", ".ifczip", ".hbjson", ".gbxml", ".rad")
WEATHER = (".epw",)
AROUND = (".obj", ".stl", ".ply", ".gltf", ".glb", ".cityjson", ".gml", ".geojson", ".hor")
BESIDE = (".toml", ".csv")  # data of a system or a building, beside it
NAME = re.compile(r"[^\w .()+-]")
WRITTEN = "# written by cfs app\n"
OPERATED = "controlled "  # beginning of the file names of systems that the page makes
EXPORTED = 200  # files for other programs that the page lists
OWN_LOADS = (".hbjson", ".gbxml", ".xml")  # buildings whose file has set points of its own
LOADS = {"heating_c": 20.0, "cooling_c": 26.0}  # of a new project
GAINS = ("equipment_w_m2", "lighting_w_m2", "lighting_target_lx")


@dataclass(frozen=True, slots=True)
class ProjectFile:
    """A file of a project, relative to its folder."""

    path: str
    kind: str  # building, weather, system, surroundings or beside
    size: int  # [byte]


@dataclass(frozen=True, slots=True)
class MadeSystem:
    """A system of the library: its name on the page and its files, the open state first."""

    name: str
    files: tuple[str, ...]


def plain_name(text: str) -> str:
    """A file name without folders and without what file systems refuse; "" where none is left."""
    text = unicodedata.normalize("NFC", text).replace("\\", "/").rsplit("/", 1)[-1]
    return NAME.sub("_", text).strip(" .")[-120:]


def slug(text: str) -> str:
    """A text as the name of a folder."""
    return re.sub(r"[^\w-]+", "-", unicodedata.normalize("NFC", text)).strip("-").lower() or "as-is"


def kind_of(path: Path) -> str:
    """What a file is for, by its ending and, of XML, its first element.

    Raises: `DataError` for a file that no command reads.
    """
    suffix = path.suffix.lower()
    if suffix == ".xml":
        root = _root(path)
        if root in ("WindowElement", "gbXML"):
            return "system" if root == "WindowElement" else "building"
        raise DataError(f"is XML with <{root}>; expected a BSDF file or gbXML", file=path)
    kinds = {
        **dict.fromkeys(BUILDINGS, "building"),
        **dict.fromkeys(WEATHER, "weather"),
        **dict.fromkeys(AROUND, "surroundings"),
        **dict.fromkeys(BESIDE, "beside"),
    }
    if suffix in kinds:
        return kinds[suffix]
    known = ", ".join((*BUILDINGS, *WEATHER, ".xml", *BESIDE, *AROUND))
    raise DataError(f"has an ending that is not read; expected one of {known}", file=path)


def _root(path: Path) -> str:
    """The name of a file's first XML element, its namespace left out."""
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            return str(element.tag).rpartition("}")[2]
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    except (ElementTree.ParseError, ValueError) as error:
        raise DataError(f"is no XML: {error}", file=path) from None
    return ""


def toml_text(table: Mapping[str, Any], before: str = "") -> str:
    """A table as TOML; comments and the order of an earlier text stay."""
    document = tomlkit.parse(before)
    _fill(document, table)
    return tomlkit.dumps(document)


def write_table(path: Path, table: Mapping[str, Any], *, head: str = "") -> None:
    """Write a TOML file, with the comments that it has; a new one begins with the head."""
    before = path.read_text(encoding="utf-8") if path.is_file() else head
    write_text(path, toml_text(table, before))


def _fill(into: MutableMapping[str, Any], table: Mapping[str, Any]) -> None:
    """Make a document's table equal to another one; entries without a value are left out."""
    wanted = {key: value for key, value in table.items() if value is not None}
    for key in [one for one in into if one not in wanted]:
        del into[key]
    after: list[Any] = []  # a comment below the last entry is of what follows
    if isinstance(into, Table):
        body = into.value.body
        while body and body[-1][0] is None:
            after.insert(0, body.pop())
    for key, value in wanted.items():
        old = into.get(key)
        if isinstance(value, dict) and isinstance(old, MutableMapping):
            _fill(old, value)
        elif repr(tomlkit.item(old).unwrap() if old is not None else None) != repr(value):
            into[key] = _entries(old, value) if _is_tables(value) else value
    if isinstance(into, Table):
        into.value.body.extend(after)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _entries(old: Any, tables: Sequence[Mapping[str, Any]]) -> AoT:
    """Tables as entries of a document; each is an earlier one of the same name, where there is one."""
    known = {one.get("name"): one for one in old} if isinstance(old, AoT) else {}
    entries = tomlkit.aot()
    for table in tables:
        entry = known.pop(table.get("name"), None)
        entry = tomlkit.table() if entry is None else entry
        _fill(entry, table)
        entries.append(entry)
    return entries


def _alone(method: Callable[..., Any]) -> Callable[..., Any]:
    """A method of a project that reads its files, changes them and writes them, one at a time."""

    @wraps(method)
    def locked(self: Project, *args: Any) -> Any:
        with self.lock:
            return method(self, *args)

    return locked


class Project:
    """A project folder, read anew at each call: the command line may change it meanwhile."""

    def __init__(self, folder: Path) -> None:
        """Make the folder where there is none; `DataError` where it cannot be."""
        self.folder = folder.absolute()
        self.lock = threading.RLock()  # requests and the thread of the commands change files
        try:
            for name in (INPUTS, RESULTS, LOGS):
                (self.folder / name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DataError(f"cannot be written: {reason(error)}", file=folder) from None

    # ---- files

    def files(self) -> list[ProjectFile]:
        """The input files, those of unknown kinds left out."""
        files = []
        for path in sorted((self.folder / INPUTS).rglob("*")):
            if path.is_file() and not path.is_symlink() and not path.name.startswith("."):
                with suppress(DataError):
                    place = path.relative_to(self.folder).as_posix()
                    files.append(ProjectFile(place, kind_of(path), path.stat().st_size))
        return files

    @_alone
    def take(self, part: Path, name: str) -> ProjectFile:
        """Put an uploaded file into its place and into the study.

        Raises: `DataError` for a file that no command reads, whose upload is removed.
        """
        target = self.folder / INPUTS / name
        named = part.with_name(f"{part.name}{Path(name).suffix}")
        part.rename(named)
        try:
            kind = kind_of(named)
            if kind == "building":
                check_building_file(named)
            elif kind == "weather":
                read_weather(named)
            size = named.stat().st_size
            named.replace(target)
        except DataError as error:
            raise DataError(error.message, file=name, field=error.field) from None
        finally:
            named.unlink(missing_ok=True)
        file = ProjectFile(target.relative_to(self.folder).as_posix(), kind, size)
        self._join(file)
        return file

    def _join(self, file: ProjectFile) -> None:
        """Use a new file in the study; several IFC files are one building."""
        study = self.study()
        if not study:
            study["quick"] = True  # a new project's first answer comes soon
            if not (self.folder / OPERATION).exists():
                self._change_loads(study, LOADS)
        if file.kind == "building":
            files = self._building(study)
            if file.path not in files:
                if file.path.lower().endswith(OWN_LOADS) and self.operation() == {"loads": LOADS}:
                    self._change_loads(study, {})
                ifc = (".ifc", ".ifczip")
                both = all(path.lower().endswith(ifc) for path in (*files, file.path))
                self._set_building(study, [*files, file.path] if both else [file.path])
        elif file.kind == "weather":
            entry = {"name": Path(file.path).stem, "weather": file.path}
            study["climate"] = [entry, *study.get("climate", [])[1:]]
        elif file.kind == "system":
            systems = study.setdefault("system", [])
            if all(one.get("bsdf") != file.path for one in systems):
                systems.append({"name": free_name(Path(file.path).stem, systems), "bsdf": file.path})
        elif file.kind == "surroundings":
            around = study.setdefault("surroundings", [])
            around += [file.path] if file.path not in around else []
        self.write_study(study)

    @_alone
    def remove(self, path: str) -> None:
        """Remove an input file, and its entries of the study.

        Raises: `DataError` for what is no input file of the project.
        """
        if path not in {file.path for file in self.files()}:
            raise DataError("is no input file of this project", file=path)
        (self.folder / path).unlink()
        study = self.study()
        files = self._building(study)
        if path in files:
            self._set_building(study, [one for one in files if one != path])
        for key, name in (("climate", "weather"), ("system", "bsdf"), ("system", "operation")):
            entries = study.get(key)
            if entries is not None:
                study[key] = [one for one in entries if one.get(name) != path]
        if path in study.get("surroundings", []):
            study["surroundings"].remove(path)
        self.write_study(study)

    # ---- the study

    def study(self) -> dict[str, Any]:
        """The tables of the study file; empty where there is none.

        Raises: `DataError` for a file that is no study of the page: a value of another kind, a building's
            file that would be an option of a command.
        """
        study = self._table(STUDY, Study)
        for one in self._building(study):
            if one.startswith("-"):
                raise DataError("expected a file of a building", file=self.folder / STUDY, field="room.building")
        return study

    def write_study(self, study: Mapping[str, Any]) -> None:
        """Write the study file, empty lists left out."""
        kept = {key: value for key, value in study.items() if value not in ([], {}, None, "")}
        check_kinds(Study, kept, self.folder / STUDY)
        write_table(self.folder / STUDY, kept)

    @staticmethod
    def _building(study: Mapping[str, Any]) -> list[str]:
        """The files of the building that the page shows: those of the first room entry with one."""
        entry: Mapping[str, Any] = next((one for one in study.get("room", []) if "building" in one), {})
        return [entry["building"], *entry.get("linked", [])] if entry else []

    @staticmethod
    def _set_building(study: dict[str, Any], files: Sequence[str]) -> None:
        rooms = study.setdefault("room", [])
        entry = next((one for one in rooms if "building" in one), None)
        if not files:
            if entry is not None:
                rooms.remove(entry)
            return
        if entry is None:
            entry = {}
            rooms.insert(0, entry)
        if entry.get("building") != files[0]:
            for key in ("spaces", "join"):
                entry.pop(key, None)
            entry["name"] = Path(files[0]).stem
        entry |= {"building": files[0], "linked": list(files[1:])}
        if not entry["linked"]:
            del entry["linked"]

    def building(self) -> list[str]:
        """The building's files, relative to the project."""
        return self._building(self.study())

    @_alone
    def change(self, wanted: Mapping[str, Any]) -> None:
        """Change rooms, systems, title, loads and uses as the page states them.

        Raises: `DataError` for a key or value that the page has not.
        """
        study = self.study()
        for key, value in wanted.items():
            change = CHANGES.get(key)
            if change is None:
                raise DataError(f"is none of {', '.join(CHANGES)}", field=key)
            change(self, study, value)
        self.write_study(study)

    def _change_title(self, study: dict[str, Any], value: Any) -> None:
        """The title of the comparison, of reports and of dossiers."""
        study["title"] = _text(value, "title")
        path = self.folder / PAGE
        write_table(path, (_finite_table(path) if path.is_file() else {}) | {"title": study["title"]}, head=WRITTEN)

    def _change_spaces(self, study: dict[str, Any], value: Any) -> None:
        entry = next((one for one in study.get("room", []) if "building" in one), None)
        if entry is None:
            raise DataError("there is no building yet", field="spaces")
        entry["spaces"] = [_text(one, "spaces") for one in _list(value, "spaces")]
        if not entry["spaces"]:
            del entry["spaces"]

    def _change_join(self, study: dict[str, Any], value: Any) -> None:
        """Rooms that are to be one, each group as "Hall + Living"."""
        entry = next((one for one in study.get("room", []) if "building" in one), None)
        if entry is None:
            raise DataError("there is no building yet", field="join")
        groups = [_text(one, "join") for one in _list(value, "join")]
        for group in groups:
            if group.startswith("-") or len(group.split(JOINT)) < 2:
                raise DataError(f"expected two names of rooms with {JOINT.strip()!r} between", field="join")
        entry["join"] = list(dict.fromkeys(groups))
        if not entry["join"]:
            del entry["join"]

    def _change_furniture(self, study: dict[str, Any], value: Any) -> None:
        for entry in study.get("room", []):
            if "building" in entry:
                entry["furniture"] = value is True

    def _change_systems(self, study: dict[str, Any], value: Any) -> None:
        """Systems with their names, in the order of the page; files are inputs of the project."""
        files = {file.path for file in self.files()}
        systems: list[dict[str, Any]] = []
        for one in _list(value, "systems"):
            if not isinstance(one, dict):
                raise DataError("expected a system", field="systems")
            entry = {key: one[key] for key in SYSTEM_KEYS if one.get(key) not in (None, "")}
            entry["name"] = free_name(_text(entry.get("name", "system"), "systems"), systems)
            for key in ("bsdf", "operation"):
                if key in entry and entry[key] not in files:
                    raise DataError("is no input file of this project", file=str(entry[key]))
            systems.append(entry)
        study["system"] = systems

    def _change_quick(self, study: dict[str, Any], value: Any) -> None:
        study["quick"] = value is True
        if not study["quick"]:
            del study["quick"]

    def _change_loads(self, study: dict[str, Any], value: Any) -> None:
        """Set points [C] and gains of all rooms; None of both set points: free-running."""
        if not isinstance(value, dict):
            raise DataError("expected a table", field="loads")
        numbers = {key: _number(value.get(key), key) for key in (*LOADS, *GAINS)}
        operation = self.operation()
        for table, keys in (("loads", tuple(LOADS)), ("gains", GAINS)):
            entries = {key: numbers[key] for key in keys if numbers[key] is not None}
            rest = {k: v for k, v in operation.get(table, {}).items() if k not in keys}
            operation[table] = rest | entries
        operation = {key: one for key, one in operation.items() if one != {}}
        if operation:
            write_table(self.folder / OPERATION, operation, head=WRITTEN)
            study["operation"] = OPERATION
        else:
            (self.folder / OPERATION).unlink(missing_ok=True)
            study.pop("operation", None)
        for one in study.get("system", []):
            path = self.folder / one.get("operation", "")
            if path.parent == self.folder / INPUTS and path.name.startswith(OPERATED):
                kept = {k: v for k, v in _finite_table(path).items() if k not in ("loads", "gains")}
                write_table(path, kept | operation, head=WRITTEN)

    def _change_uses(self, _study: dict[str, Any], value: Any) -> None:
        """Uses of rooms by GUID; an empty text takes the file's."""
        if not isinstance(value, dict):
            raise DataError("expected a table", field="uses")
        path = self.folder / USES
        table = _finite_table(path) if path.is_file() else {}
        rooms = dict(table.get("rooms", {}))
        for guid, use in value.items():
            rooms[guid] = _text(use, "uses") if use else ""
        table["rooms"] = {guid: use for guid, use in rooms.items() if use}
        if table["rooms"] or len(table) > 1:
            write_table(path, table)
        else:
            path.unlink(missing_ok=True)

    def _change_corrections(self, study: dict[str, Any], value: Any) -> None:
        """North [deg] and spaces that are outdoors, in the corrections file beside an IFC file."""
        files = self._building(study)
        if not files or not files[0].lower().endswith(".ifc"):
            raise DataError("corrections are of IFC files", field="corrections")
        path = corrections_file(self.folder / files[0])
        before = path.read_text(encoding="utf-8") if path.is_file() else None
        table = _finite_table(path) if before is not None else {}
        if not isinstance(value, dict) or not set(value) <= {"north", "outdoors", "indoors"}:
            raise DataError("expected north, outdoors or indoors", field="corrections")
        if "north" in value:
            table["north"] = _number(value["north"], "north")
        for key in ("outdoors", "indoors"):
            if key in value:
                table[key] = [_text(one, key) for one in _list(value[key], key)]
        table = {key: one for key, one in table.items() if one not in (None, [], {})}
        if not table:
            path.unlink(missing_ok=True)
            return
        write_table(path, table)
        try:
            read_corrections(path)
        except DataError:
            if before is None:
                path.unlink()
            else:
                write_text(path, before)
            raise

    def operation(self) -> dict[str, Any]:
        """Gains and set points of all rooms."""
        return self._table(OPERATION, OperationTables)

    def _table(self, name: str, model: type[BaseModel]) -> dict[str, Any]:
        """A TOML file of the project, whose values are of the model's kinds; empty where there is none."""
        path = self.folder / name
        table = _finite_table(path) if path.is_file() else {}
        check_kinds(model, table, path)
        return table

    def corrections(self) -> dict[str, Any]:
        """The corrections beside the building's first file."""
        files = self.building()
        path = corrections_file(self.folder / files[0]) if files else None
        return _finite_table(path) if path is not None and path.is_file() else {}

    def uses(self) -> dict[str, str]:
        """Uses of rooms that the page states, by GUID."""
        return dict(self._table(USES, UsesFile).get("rooms", {}))

    @_alone
    def use_made(self, made: MadeSystem) -> None:
        """Take a system as a variant; one of several files moves between them, by glare."""
        study = self.study()
        systems = study.setdefault("system", [])
        name = free_name(made.name, systems)
        if len(made.files) == 1:
            systems.append({"name": name, "bsdf": made.files[0]})
        else:
            path = self.folder / INPUTS / f"{OPERATED}{Path(made.files[-1]).stem}.toml"
            states = [{"bsdf": Path(one).relative_to(INPUTS).as_posix()} for one in made.files]
            table = {"system": states, "control": {"rule": "glare"}} | self.operation()
            write_table(path, table, head=WRITTEN)
            file = path.relative_to(self.folder).as_posix()
            systems.append({"name": name, "operation": file})
        self.write_study(study)

    def states(self, operation: str) -> list[str]:
        """The BSDF files of a moving system, the open one first, relative to the project."""
        tables, folder = self._table(operation, OperationTables).get("system", []), Path(operation).parent
        return [(folder / one["bsdf"]).as_posix() for one in tables if "bsdf" in one]

    # ---- results

    def results(self) -> list[dict[str, Any]]:
        """Folders of results with the pages and tables in them."""
        results = []
        for folder in sorted((self.folder / RESULTS).iterdir()):
            if not folder.is_dir() or folder.is_symlink():
                continue
            pages = {
                name: f"{RESULTS}/{folder.name}/{file}" for name, file in PAGES.items() if (folder / file).is_file()
            }
            if pages:
                time = max((self.folder / page).stat().st_mtime for page in pages.values())
                results.append({"name": folder.name, "pages": pages, "time": time})
        return results

    def exported(self) -> list[str]:
        """Files for other programs, relative to the project; of folders the files in them."""
        folder = self.folder / RESULTS / "export"
        paths = (path for path in sorted(folder.rglob("*")) if path.is_file())
        return [path.relative_to(self.folder).as_posix() for path in paths][:EXPORTED]

    def clear(self, name: str) -> None:
        """Remove results that this program wrote; files of others in their folder stay."""
        remove_results(self.folder / RESULTS / plain_name(name))

    def record(self, line: Mapping[str, Any]) -> None:
        """Append a line to the journal of commands."""
        with (self.folder / JOURNAL).open("ab+") as file:
            if file.tell():
                file.seek(-1, os.SEEK_END)
                if file.read(1) != b"\n":  # a line that a full disk has cut
                    file.write(b"\n")
            file.write(json_text(line, ensure_ascii=False).encode() + b"\n")

    def journal(self) -> list[dict[str, Any]]:
        """The commands that were run, the latest last; lines that are none are left out."""
        path = self.folder / JOURNAL
        lines = []
        for text in path.read_text("utf-8", errors="replace").splitlines() if path.is_file() else ():
            with suppress(ValueError, RecursionError):
                line = json.loads(text)
                if isinstance(line, dict) and isinstance(line.get("command"), list):
                    lines.append(line)
        return lines


PAGES = {  # of a folder of results, by what they are called
    "report": REPORT,
    "dossier": DOSSIER,
    "explorer": "explore/index.html",
    "table": "results.csv",
    "check": "check.html",
    "problems": "problems.csv",
}
SYSTEM_KEYS = ("name", "bsdf", "operation", "u_value", "g_value", "see_through")
CHANGES = {
    "title": Project._change_title,
    "spaces": Project._change_spaces,
    "join": Project._change_join,
    "furniture": Project._change_furniture,
    "systems": Project._change_systems,
    "quick": Project._change_quick,
    "loads": Project._change_loads,
    "uses": Project._change_uses,
    "corrections": Project._change_corrections,
}


def free_name(name: str, entries: Sequence[Mapping[str, Any]]) -> str:
    """The name, with a number where an entry has it already."""
    names, result, number = {one.get("name") for one in entries}, name, 2
    while result in names:
        result, number = f"{name} {number}", number + 1
    return result


def _text(value: Any, field: str) -> str:
    if not isinstance(value, str) or not value.strip() or len(value) > 200:
        raise DataError("expected a text of at most 200 letters", field=field)
    return value.strip()


def _list(value: Any, field: str) -> list[Any]:
    if not isinstance(value, list) or len(value) > 2000:
        raise DataError("expected a list", field=field)
    return value


def _number(value: Any, field: str) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e5:
        raise DataError("expected a number", field=field)
    return float(value)


def _finite_table(path: Path) -> dict[str, Any]:
    """A TOML file; `DataError` for a number that is not finite, which no page can hold."""
    table = read_table(path)
    field = next(_not_finite(table), None)
    if field is not None:
        raise DataError("expected a finite number", file=path, field=field)
    return table


def _not_finite(value: object, field: str = "") -> Iterator[str]:
    """The fields whose numbers are infinite or none."""
    if isinstance(value, float) and not math.isfinite(value):
        yield field
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        yield from _not_finite(entry, f"{field}.{key}" if field else str(key))
