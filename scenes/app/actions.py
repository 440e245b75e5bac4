"""Command lines of the page's buttons: what a click does is what the shell does in the project."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bim.ifc.corrections import corrections_file
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import read_json
from scenes.app.project import INPUTS, PAGE, RESULTS, STUDY, USES, Project, slug
from scenes.language.catalogue import gettext

CHECK = f"{RESULTS}/check.json"
EXPORTS = {  # options of `cfs export`, and the names of their files
    "gltf": "building.glb",
    "radiance": "radiance",
    "mitsuba": "mitsuba",
    "epjson": "model.epJSON",
    "honeybee": "model.hbjson",
    "gbxml": "model.gbxml",
}
AS_IN_FILE = "as in the building's file"
LANGUAGES = ("en", "de", "fr")


@dataclass(frozen=True, slots=True)
class Action:
    """A command of the page."""

    kind: str  # check, run, comply, study, export, systems
    title: str  # the system or the files that it is for
    command: tuple[str, ...]  # after `cfs`, run in the project's folder
    out: str  # file or folder that it writes, relative to the project

    @property
    def text(self) -> str:
        """The command as it is typed."""
        return shlex.join(("cfs", *self.command))


def check(project: Project) -> Action:
    """Read the building: rooms, windows, problems and the 3D model."""
    files, study = _files(project), project.study()
    around = [part for one in study.get("surroundings", []) for part in _pair(one)]
    html = f"{RESULTS}/check.html"
    command = ("check", *files, *_joined(study), *around, "--json", CHECK, "--html", html)
    return Action("check", ", ".join(Path(one).name for one in files), command, CHECK)


def _pair(path: str) -> tuple[str, str]:
    return ("--surroundings", path)


def _files(project: Project) -> list[str]:
    files = project.building()
    if not files:
        raise DataError("drop an IFC, HBJSON or gbXML file first", field="building")
    return files


def computations(project: Project, wanted: Mapping[str, Any]) -> list[Action]:
    """The commands of what is wanted, the quick ones first.

    Args:
        wanted: `report`, `annual_glare`, `explore`, `compare`: true or false; `standards`: names of
            rule sets; `language` of the pages.

    Raises: `DataError` for what is missing.
    """
    study = project.study()
    systems: list[dict[str, Any]] = study.get("system", []) or [{"name": AS_IN_FILE}]
    language = wanted.get("language", "en")
    if language not in LANGUAGES:
        raise DataError(f"expected one of {', '.join(LANGUAGES)}", field="language")
    standards = wanted.get("standards", [])
    if not isinstance(standards, list) or not all(isinstance(one, str) for one in standards):
        raise DataError("expected names of rule sets", field="standards")
    pages = ("--language", language) if language != "en" else ()
    titled = ("--page", PAGE) if (project.folder / PAGE).is_file() else ()
    actions: list[Action] = []
    for system, name in zip(systems, _folders(systems), strict=True):
        shared = _inputs(project, study)
        if wanted.get("report"):
            command = ["run", *shared, *_filled(project, study, system), *_options(study)]
            command += ["--annual-glare"] if wanted.get("annual_glare") else []
            command += ["--explore"] if wanted.get("explore") else []
            out = f"{RESULTS}/report-{name}"
            actions.append(Action("run", _name(system), (*command, *titled, *pages, "--out", out, "--replace"), out))
        if standards:
            command = ["comply", *shared, *_states(project, system), *_options(study)]
            command += [part for one in standards for part in ("--standard", one)]
            command += ["--annual-glare"] if wanted.get("annual_glare") else []
            command += ["--uses", USES] if (project.folder / USES).is_file() else []
            out = f"{RESULTS}/rules-{name}"
            actions.append(Action("comply", _name(system), (*command, *titled, *pages, "--out", out, "--replace"), out))
    if wanted.get("compare"):
        _weather(study)
        _files(project)
        out = f"{RESULTS}/comparison"
        actions.append(Action("study", "", ("study", STUDY, *pages, "--out", out, "--replace"), out))
    return actions


def _folders(systems: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of the systems as those of folders, with a number where one is taken."""
    folders: list[str] = []
    for system in systems:
        name = first = slug(_name(system))
        number = 2
        while name in folders:
            name, number = f"{first}-{number}", number + 1
        folders.append(name)
    return folders


def _name(system: Mapping[str, Any]) -> str:
    """A system's name, else that of its file."""
    return str(system.get("name") or Path(system.get("bsdf") or system.get("operation") or "").stem)


def result_titles(study: Mapping[str, Any]) -> dict[str, str]:
    """The systems of folders of results by the folders' names, as `computations` calls them."""
    systems = study.get("system", [])
    named = list(zip(systems, _folders(systems), strict=True))
    return {f"{kind}-{name}": _name(one) for kind in ("report", "rules") for one, name in named}


def _made_by(name: str, journal: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """The line of the last command that made a folder of results."""
    out = f"{RESULTS}/{name}"
    return next((one for one in reversed(journal) if one.get("state") == "done" and out in one["command"]), None)


def preview(project: Project, name: str, journal: Sequence[Mapping[str, Any]]) -> bool:
    """Whether a folder of results was made with `--quick`, or by a study that says so."""
    line = _made_by(name, journal)
    folder = project.folder / RESULTS / name
    try:
        return (line is not None and "--quick" in line["command"]) or quick_study(folder)
    except DataError:  # a damaged file; the table of variants names it
        return False


def quick_study(results: Path) -> bool:
    """Whether a folder holds the results of a study with few rays.

    Raises: `DataError` for a record that cannot be read.
    """
    record = results / "study.json"
    return record.is_file() and bool(read_json(record).get("quick"))


def outdated(project: Project, name: str, journal: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """What has changed since a folder of results was made: input files, "choices" of the page.

    Args:
        name: the folder in `results`.
        journal: the lines of `Project.journal`; nothing is known of results whose command is not in it.
    """
    out = f"{RESULTS}/{name}"
    line = _made_by(name, journal)
    if line is None:
        return ()
    command = [str(part) for part in line["command"]]
    after = [*command[1:], ""]
    wanted = {
        "report": True,
        "annual_glare": "--annual-glare" in command,
        "explore": "--explore" in command,
        "compare": True,
        "standards": [after[i] for i, part in enumerate(command) if part == "--standard"],
        "language": next((after[i] for i, part in enumerate(command) if part == "--language"), "en"),
    }
    try:
        planned = {one.out: ["cfs", *one.command] for one in computations(project, wanted)}
    except DataError:
        planned = {}
    changed = [Path(one).name for one in _read_by(project, command) if _newer(project.folder / one, line)]
    return (*dict.fromkeys(changed), *(["choices"] if planned.get(out) != command else []))


def _read_by(project: Project, command: Sequence[str]) -> list[str]:
    """The files that a command reads, relative to the project."""
    files = [part for part in command if not part.startswith("-") and (project.folder / part).is_file()]
    if STUDY in files:
        files += [one.path for one in project.files()]
    files += [state for one in files if one.endswith(".toml") and one != STUDY for state in project.states(one)]
    beside = [corrections_file(Path(one)).as_posix() for one in files if one.lower().endswith(".ifc")]
    return [*files, *(one for one in beside if (project.folder / one).is_file())]


def _newer(path: Path, line: Mapping[str, Any]) -> bool:
    """Whether a file was written after a command began, whose time is rounded to seconds."""
    return path.is_file() and path.stat().st_mtime > float(line.get("started", 0)) + 1


def export(project: Project, form: str) -> Action:
    """Write the rooms for another program."""
    if form not in EXPORTS:
        raise DataError(f"expected one of {', '.join(EXPORTS)}", field="export")
    study = project.study()
    out = f"{RESULTS}/export/{EXPORTS[form]}"
    building = _files(project)
    command = ["export", *building, *_rooms(study), f"--{form}", out]
    weather = [one["weather"] for one in study.get("climate", []) if one.get("weather")]
    command += ["--weather", weather[0]] if form == "epjson" and weather else []
    return Action("export", form, tuple(command), out)


def _weather(study: Mapping[str, Any]) -> str:
    weather = [one["weather"] for one in study.get("climate", []) if one.get("weather")]
    if not weather:
        raise DataError("drop a weather file (EPW) first", field="weather")
    return str(weather[0])


def _entry(study: Mapping[str, Any]) -> Mapping[str, Any]:
    return next((one for one in study.get("room", []) if "building" in one), {})


def _rooms(study: Mapping[str, Any]) -> list[str]:
    entry = _entry(study)
    flags = [part for one in entry.get("spaces", []) for part in ("--space", one)]
    flags += [*_joined(study), *(["--furniture"] if entry.get("furniture") else [])]
    return flags + [part for one in study.get("surroundings", []) for part in _pair(one)]


def _joined(study: Mapping[str, Any]) -> list[str]:
    return [part for one in _entry(study).get("join", []) for part in ("--join", one)]


def _inputs(project: Project, study: Mapping[str, Any]) -> list[str]:
    building = _files(project)
    return [*building, "--weather", _weather(study), *_rooms(study)]


def _filled(project: Project, study: Mapping[str, Any], system: Mapping[str, Any]) -> list[str]:
    """The options of `cfs run` for a system and the operation of the rooms."""
    flags = _bsdf(system)
    flags += [part for one in system.get("see_through", []) for part in ("--see-through", one)]
    for key, option in (("u_value", "--u"), ("g_value", "--g")):
        flags += [option, f"{system[key]:g}"] if key in system else []
    operation = system.get("operation") or study.get("operation")
    return [*flags, "--operation", operation] if operation else flags


def _states(project: Project, system: Mapping[str, Any]) -> list[str]:
    """The options of `cfs comply` for a system: a moving one is moved by its own control."""
    operation = system.get("operation")
    if "bsdf" in system or not operation:
        return _bsdf(system)
    return ["--operation", operation] if project.states(operation) else []


def _bsdf(system: Mapping[str, Any]) -> list[str]:
    return ["--cfs", system["bsdf"]] if "bsdf" in system else []


def _options(study: Mapping[str, Any]) -> list[str]:
    flags = ["--quick"] if study.get("quick") else []
    for name, value in study.get("options", {}).items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        flags += ["--set", f"{name}={text}"]
    return flags


def library(glazing: str, shade: str) -> Action:
    """Make a system of the library in the project's inputs."""
    named = [glazing, shade] if shade else [glazing]
    out = library_file(glazing, shade)
    command = ["bsdf", "library", "--glazing", glazing]
    command += ["--shade", shade] if shade else []
    return Action("systems", " + ".join(named), (*command, "--out", out), out)


def library_file(glazing: str, shade: str) -> str:
    """Where a system of the library is kept, relative to the project."""
    return f"{INPUTS}/{slug(f'{glazing} {shade}')}.xml"


def rule_sets() -> Sequence[dict[str, str | bool]]:
    """Names, titles and editions of the rule sets, and whether they ask for glare."""
    from scenes.comply.rules import read_rule, rule_names

    rules = [(name, read_rule(name)) for name in rule_names()]
    return [
        {"name": name, "title": gettext(rule.title), "edition": rule.edition, "glare": "glare" in rule.parts}
        for name, rule in rules
    ]
