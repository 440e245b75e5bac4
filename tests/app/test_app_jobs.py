"""Commands of `cfs app`: each in a process that may be stopped or die; the journal keeps them."""

from __future__ import annotations

import os
import shutil
import signal
import time
from dataclasses import replace
from pathlib import Path

import pytest

from mitsuba_cfs.errors import DataError
from scenes.app import actions
from scenes.app.jobs import Jobs
from scenes.app.project import Project
from scenes.demo import OFFICE

WAIT_S = 240.0


@pytest.fixture
def project(tmp_path) -> Project:
    one = Project(tmp_path / "project")
    part = one.folder / "inputs" / ".upload"
    shutil.copyfile(OFFICE, part)
    one.take(part, Path(OFFICE).name)
    return one


@pytest.fixture
def jobs(project):
    # As uvicorn does in `cfs app`: what a shell runs in the background ignores SIGINT, and so would the commands
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    one = Jobs(project)
    yield one
    one.close()
    signal.signal(signal.SIGINT, before)


def until(happened) -> None:
    end = time.monotonic() + WAIT_S
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_command_reports_its_progress_and_leaves_its_results(project, jobs) -> None:
    seen: list[str] = []
    jobs.on_done = lambda action: seen.append(action.out)
    check = actions.check(project)
    jobs.add([replace(check, command=(*check.command, "--no-cache"))])  # a stored one has no stages
    until(lambda: not jobs.busy)
    (job,) = jobs.facts()
    assert job["state"] == "done" and job["code"] == 0, job["lines"]
    assert job["progress"]["fraction"] == 1.0 and job["progress"]["stage"]
    assert "Model: usable" in job["lines"] and not any('"stage"' in line for line in job["lines"])
    assert (project.folder / "results" / "check.json").is_file() and seen == [job["out"]]
    (line,) = project.journal()
    assert line["command"][:2] == ["cfs", "check"] and line["state"] == "done"
    (log,) = (project.folder / "log").iterdir()
    assert log.read_text("utf-8").startswith("$ cfs check inputs/office.ifc")


@pytest.mark.parametrize("form", ["gltf", "radiance"])
def test_the_first_export_of_a_project_makes_its_folder(project, jobs, form) -> None:
    export = actions.export(project, form)
    jobs.add([export])
    until(lambda: not jobs.busy)
    (job,) = jobs.facts()
    assert job["state"] == "done", job["lines"]
    assert (project.folder / export.out).exists()


def test_stop_and_resume(project, jobs, monkeypatch) -> None:
    blind = actions.library("double clear", "venetian 25 mm inside, 45 deg")  # traced for seconds
    take = jobs._take

    def stop_at_first_progress(job, line, log) -> None:
        take(job, line, log)
        if job.number == 1 and job.progress and job.code is None:
            jobs.stop(2)
            jobs.stop(1)

    monkeypatch.setattr(jobs, "_take", stop_at_first_progress)
    jobs.add([blind, actions.check(project)])
    until(lambda: not jobs.busy)
    assert [job["state"] for job in jobs.facts()] == ["stopped", "stopped"]
    assert jobs.facts()[0]["code"] == 130 and not (project.folder / blind.out).exists()
    jobs.again(2)
    until(lambda: not jobs.busy)
    assert [job["state"] for job in jobs.facts()] == ["stopped", "stopped", "done"]
    assert [line["state"] for line in project.journal()] == ["stopped", "done"]


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL is of Linux")
def test_a_command_that_dies_takes_nothing_with_it(project, jobs) -> None:
    check = actions.check(project)
    jobs.add([check])
    until(lambda: jobs._process is not None)
    os.kill(jobs._process.pid, signal.SIGKILL)
    until(lambda: not jobs.busy)
    assert jobs.facts()[0]["state"] == "failed"
    jobs.add([check])
    until(lambda: not jobs.busy)
    assert jobs.facts()[1]["state"] == "done"


def test_the_same_command_waits_once(project, jobs) -> None:
    check = actions.check(project)
    jobs.add([check])
    until(lambda: jobs.facts()[0]["state"] == "running")
    jobs.add([check])
    jobs.add([check])
    assert len(jobs.facts()) == 2


@pytest.mark.parametrize("fault", ["system", "log", "journal"])
def test_a_fault_at_the_end_of_a_command_lets_the_next_one_run(project, jobs, fault) -> None:
    def wrong(action) -> None:
        raise DataError("is no TOML", file=project.folder / "study.toml")

    check = actions.check(project)
    if fault == "system":
        jobs.on_done = wrong
    elif fault == "log":
        shutil.rmtree(project.folder / "log")
    else:
        (project.folder / "commands.jsonl").mkdir()
    jobs.add([check])
    until(lambda: not jobs.busy)
    job = jobs.facts()[0]
    assert job["state"] == ("failed" if fault == "system" else "done")
    assert (fault != "system") or job["lines"][-1].startswith("error: ")
    jobs.on_done = lambda action: None
    jobs.again(1)
    until(lambda: not jobs.busy)
    assert jobs.facts()[1]["state"] == "done"


def test_a_line_that_a_full_disk_has_cut_takes_no_other_with_it(project) -> None:
    line = {"command": ["cfs", "check"]}
    project.record(line)
    with (project.folder / "commands.jsonl").open("a") as file:
        file.write('{"command": ["cf')
    project.record(line)
    project.record(line)
    assert project.journal() == [line] * 3
