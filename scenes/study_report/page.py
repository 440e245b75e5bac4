"""The page of a study: its template filled with figures and tables."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from markupsafe import Markup

from mitsuba_cfs.files import write_text
from scenes.language.catalogue import decimal, gettext, in_language, ngettext
from scenes.language.numbers import rounded, share
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report import page as run_page
from scenes.report import tables
from scenes.report.method import METHODS
from scenes.report.names import glossary
from scenes.report.page_files import page_files
from scenes.study.case import Case
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_page, room_of
from scenes.study_report.comparison import (
    bars,
    clock_table,
    comparison_table,
    failures_table,
    finished,
    scatter,
)
from scenes.study_report.explorer import explorer_link
from scenes.study_report.model import study_model
from scenes.study_report.parallel import parallel
from scenes.study_report.verdict import study_verdict

FILES = page_files("scenes.study_report")
SCRIPTS = ("study.js", "parallel.js")
MOST_BESIDE = 3  # cases that are shown at a time
MOST_CASES = 60  # that have a section of their own: some 200 kB each


def write_study_report(study: StudyResult, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the report of a study as one self-contained HTML file."""
    write_text(path, study_report_html(study, page))


def study_report_html(study: StudyResult, page: PageOptions = OWN_PAGE) -> str:
    """The report as text: no script, font or picture is fetched from anywhere."""
    done = finished(study)
    if not done:
        raise ValueError("a report needs at least one case with a result")
    with in_language(page.language):
        return _filled(study, page, done)


def _filled(
    study: StudyResult, page: PageOptions, done: Sequence[tuple[int, Case, CaseResult]]
) -> str:
    rooms = {number: room_of(study, case, r) for number, case, r in done[:MOST_CASES]}
    every = tuple(rooms.values())
    pages = tuple(case_page(study, number, room, every) for number, room in rooms.items())
    errors = [r.figures["illuminance_error_mean"] for _, _, r in done]
    worst = max(r.figures["illuminance_error_max"] for _, _, r in done)
    styles = (run_page.FILES["style.css"], FILES["study.css"])
    scripts = [run_page.FILES[name] for name in run_page.SCRIPTS]
    scripts += [FILES[name] for name in SCRIPTS]
    return run_page.environment(FILES).get_template("study.html.j2").render(
        study=study,
        page=page,
        title=page.title or study.title or gettext("Study of fenestration systems"),
        facts=facts(study) + page.facts,
        verdict=study_verdict(study),
        explored={number: explorer_link(study, number) for number in study.explored},
        beside=len(done) if len(done) <= MOST_BESIDE else 1,
        most_beside=min(len(pages), MOST_BESIDE),
        scatter=scatter(study),
        parallel=parallel(study),
        bars=bars(study),
        table=comparison_table(study),
        failures=failures_table(study),
        clock=clock_table(study),
        choices=tuple(dict.fromkeys(case.chosen for case in study.plan.cases if case.chosen)),
        pages=pages,
        left_out=len(done) - len(pages),
        model=study_model(study),
        has_outdoors=any(b.elements for b, _ in study.plan.rooms.values()),
        problems=tables.issues_table(study.issues),
        inputs=inputs_table(study),
        mean_error=share(sum(errors) / len(errors) / 100),
        worst_error=share(worst / 100),
        version=metadata.version("mitsuba-cfs"),
        glossary=glossary(),
        style=Markup("\n".join(styles)),
        scripts=Markup("\n".join(scripts)),
    )  # fmt: skip


def facts(study: StudyResult) -> tuple[tuple[str, str], ...]:
    """The study in a few facts."""
    cases = study.plan.cases

    def named(values) -> str:
        values = list(dict.fromkeys(values))
        return ", ".join(values) if len(values) <= 4 else f"{len(values)}"

    return (
        *([(gettext("Run"), gettext(NOTE))] if study.quick else []),
        (gettext("Cases"), _cases(study)),
        (gettext("Rooms"), named(c.place for c in cases)),
        (gettext("Systems"), named(c.system for c in cases)),
        (gettext("Climates"), named(c.climate for c in cases)),
        (gettext("Rotation"), named(decimal(f"{c.orientation_deg:g}°") for c in cases)),
        (gettext("Methods"), named(gettext(METHODS[c.options.method]) for c in cases)),
        (gettext("Computing time"), _seconds(study)),
    )


def _cases(study: StudyResult) -> str:
    count = len(study.plan.cases)
    if not study.failed:
        return str(count)
    return gettext("{count}, of which {failed} failed", count=count, failed=study.failed)


def _seconds(study: StudyResult) -> str:
    seconds = rounded(study.seconds, 0)
    if not study.reused:
        return f"{seconds} s"
    return ngettext(
        "{seconds} s, {count} case from an earlier run",
        "{seconds} s, {count} cases from an earlier run",
        study.reused,
        seconds=seconds,
    )


def inputs_table(study: StudyResult) -> tables.Table:
    """The files of the study with their hashes."""
    found = {}
    for case in study.plan.cases:
        for kind, source in (
            (gettext("Building"), case.building),
            (gettext("Fenestration"), case.bsdf),
            (gettext("Thermal data of the system"), case.thermal),
            (gettext("Weather"), case.weather),
            (gettext("Operation"), case.operation),
        ):
            if path := getattr(source, "path", None):
                found[kind, path] = source.sha256
    columns = tuple(tables.Column(title, numeric=False) for title in run_page.input_titles())
    rows = tuple((kind, path.name, digest) for (kind, path), digest in found.items())
    return tables.Table(gettext("Input files"), columns, rows)
