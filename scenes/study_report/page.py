"""The page of a study: its template filled with figures and tables."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

from markupsafe import Markup

from mitsuba_cfs.files import write_text
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report import page as run_page
from scenes.report import tables
from scenes.report.names import glossary
from scenes.report.numbers import counted, rounded, share
from scenes.report.page_files import page_files
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
        title=page.title or study.title or "Study of fenestration systems",
        facts=facts(study) + page.facts,
        verdict=study_verdict(study),
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
        problems=problems_table(study),
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
        *([("Run", NOTE)] if study.quick else []),
        ("Cases", f"{len(cases)}" + (f", {study.failed} failed" if study.failed else "")),
        ("Rooms", named(c.place for c in cases)),
        ("Systems", named(c.system for c in cases)),
        ("Climates", named(c.climate for c in cases)),
        ("Turned by", named(f"{c.orientation_deg:g}°" for c in cases)),
        ("Methods", named(c.options.method for c in cases)),
        ("Computed in", f"{rounded(study.seconds, 0)} s" + _reused(study)),
    )


def _reused(study: StudyResult) -> str:
    return f", {counted(study.reused, 'case')} from before" if study.reused else ""


def problems_table(study: StudyResult) -> tables.Table:
    """What is wrong with the building files and what was done about it."""
    columns = tuple(
        tables.Column(label, numeric=False) for label in ("Where", "What", "Consequence and repair")
    )
    return tables.Table(
        "By element", columns, tuple((p.where, p.what, p.consequence) for p in study.problems)
    )


def inputs_table(study: StudyResult) -> tables.Table:
    """The files of the study with their hashes."""
    found = {}
    for case in study.plan.cases:
        for kind, source in (
            ("Building", case.building),
            ("Fenestration", case.bsdf),
            ("Its thermal values", case.thermal),
            ("Weather", case.weather),
            ("Operation", case.operation),
        ):
            if path := getattr(source, "path", None):
                found[kind, path] = source.sha256
    columns = tuple(tables.Column(c, numeric=False) for c in ("Input", "File", "SHA-256"))
    rows = tuple((kind, path.name, digest) for (kind, path), digest in found.items())
    return tables.Table("Input files", columns, rows)
