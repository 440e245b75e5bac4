"""Who is let in by the server of `cfs app`, and what may be uploaded and read."""

from __future__ import annotations

import os

import pytest

from scenes.app.server import UploadLimits
from scenes.demo import OFFICE, VENETIAN_BLIND
from tests.app.served import serving
from tests.conftest import fill

GLAZING = VENETIAN_BLIND.with_name("glazing.xml")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("app") / "project") as one:
        yield one


def test_the_address_with_the_token_lets_a_browser_in(served) -> None:
    status, headers, _ = served.ask("GET", f"/?token={served.server.token}")
    assert (status, headers["location"]) == (303, "/")
    cookie = headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie
    status, headers, body = served.ask("GET", "/", Cookie=cookie.partition(";")[0])
    assert status == 200 and b"<main" in body
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy and "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy


@pytest.mark.parametrize(
    "headers",
    [{}, {"Cookie": "cfs_app_1=x"}, {"Host": "cfs.example.org"}, {"Host": "127.0.0.1"}, {"Host": "127.0.0.1:1"}],
    ids=["nothing", "another cookie", "another name", "no port", "another port"],
)
def test_strangers_are_refused(served, headers) -> None:
    if "Host" in headers:
        headers = headers | {"Cookie": served.cookie}
    assert served.ask("GET", "/api/state", **headers)[0] == 403
    assert served.ask("GET", "/?token=guess", **headers)[0] == 403


@pytest.mark.parametrize("origin", [None, "null", "http://evil.example", "http://127.0.0.1:1", "https://127.0.0.1"])
def test_only_the_page_may_change_something(served, origin) -> None:
    headers = {"Cookie": served.cookie, "Content_Type": "application/json"}
    body = b'{"title": "changed"}'
    foreign = headers if origin is None else headers | {"Origin": origin}
    assert served.ask("POST", "/api/change", body, **foreign)[0] == 403
    assert "title" not in served.project.study()
    own = headers | {"Origin": f"http://127.0.0.1:{served.port}"}
    assert served.ask("POST", "/api/change", body, **own)[0] == 200
    assert served.project.study().pop("title") == "changed"
    (served.project.folder / "study.toml").unlink()


def test_a_form_of_another_page_is_no_request(served) -> None:
    """A browser sends forms without asking; they cannot have this type of content."""
    own = {"Cookie": served.cookie, "Origin": f"http://127.0.0.1:{served.port}"}
    for kind in ("text/plain", "application/x-www-form-urlencoded"):
        status, _, body = served.ask("POST", "/api/run", b'{"check": true}', Content_Type=kind, **own)
        assert status == 422 and b"expected a JSON object" in body


def test_data_are_not_for_other_sites_even_with_the_cookie(served) -> None:
    for site, status in (("cross-site", 403), ("same-site", 403), ("same-origin", 200)):
        answer = served.ask("GET", "/api/state", Cookie=served.cookie, Sec_Fetch_Site=site)
        assert answer[0] == status


def test_result_files_have_an_address_of_their_own_and_no_access_to_the_page(served) -> None:
    folder = served.project.folder / "results" / "report-x"
    folder.mkdir(exist_ok=True)
    (folder / "report.html").write_text("<p>report</p>")
    secret = served.server._known.files
    status, headers, body = served.ask("GET", f"/files/{secret}/results/report-x/report.html")
    assert status == 200 and body == b"<p>report</p>"
    assert headers["content-security-policy"].startswith("sandbox ")
    assert "allow-same-origin" not in headers["content-security-policy"]
    assert served.ask("GET", "/files/guess/results/report-x/report.html")[0] == 403
    assert served.ask("GET", f"/files/{served.server.token}/results/report-x/report.html")[0] == 403


@pytest.mark.parametrize(
    "path",
    [
        "study.toml",
        "inputs/office.ifc",
        "results/../study.toml",
        "results/%2e%2e/study.toml",
        "results/..%2fstudy.toml",
        "..%2f..%2f..%2fetc/passwd",
        "/etc/passwd",
        "%2fetc%2fpasswd",
        "results",
        "results/link.txt",
        "results/linked/secret.txt",
    ],
)
def test_nothing_but_results_is_read(served, path, tmp_path) -> None:
    folder = served.project.folder
    (folder / "study.toml").write_text("title = 'x'\n")
    (folder / "inputs" / "office.ifc").write_text("x")
    secret = tmp_path / "secret.txt"
    secret.write_text("secret")
    for link, target in (("link.txt", secret), ("linked", tmp_path)):
        (folder / "results" / link).unlink(missing_ok=True)
        os.symlink(target, folder / "results" / link)
    status, _, body = served.ask("GET", f"/files/{served.server._known.files}/{path}")
    assert status == 404 and b"secret" not in body and b"root:" not in body
    for name in ("study.toml", "inputs/office.ifc", "results/link.txt", "results/linked"):
        (folder / name).unlink()


def test_an_upload_stays_in_its_folder(served) -> None:
    status, taken = served.upload(GLAZING, "..%2F..%2F..%2Fglazing.xml")
    assert status == 200 and taken["path"] == "inputs/glazing.xml" and taken["kind"] == "system"
    assert (served.project.folder / "inputs" / "glazing.xml").is_file()
    assert not list(served.project.folder.parent.glob("*.xml"))


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("run.sh", b"rm", "ending that is not read"),
        ("house.ifc", b"<html>", "house.ifc"),
        ("city.epw", b"LOCATION", "city.epw"),
        ("page.xml", b"<html></html>", "XML with <html>"),
        ("page.xml", b"<broken", "is no XML"),
        ("..", b"", "no name"),
    ],
)
def test_a_file_that_no_command_reads_is_refused_by_name(served, name, content, fault) -> None:
    before = sorted((served.project.folder / "inputs").iterdir())
    status, answer = served.page("POST", f"/api/upload?name={name}", content)
    assert status == 422 and fault in answer["error"]
    assert sorted((served.project.folder / "inputs").iterdir()) == before


def test_limits_of_size_and_number(tmp_path) -> None:
    limits = UploadLimits(file_bytes=600_000, total_bytes=900_000, files=2)
    with serving(tmp_path / "project", limits=limits) as served:
        status, answer = served.page("POST", "/api/upload?name=a.xml", b"x" * 600_001)
        assert status == 422 and "larger than the 1 MB" in answer["error"]
        # a stream that states no size is cut off as well
        own = {"Cookie": served.cookie, "Origin": f"http://127.0.0.1:{served.port}"}
        chunks = (b"x" * 100_000 for _ in range(7))
        status, _, body = served.ask("POST", "/api/upload?name=a.xml", chunks, **own)
        assert status == 422 and b"larger" in body
        assert served.upload(GLAZING, "one.xml")[0] == 200  # 516 kB
        assert served.upload(GLAZING, "two.xml")[0] == 422  # more than all may have
        assert served.upload(OFFICE)[0] == 200
        status, answer = served.upload(OFFICE, "other.ifc")
        assert status == 422 and "at most 2 input files" in answer["error"]
        assert len(list((served.project.folder / "inputs").iterdir())) == 2
        served.jobs.close()


def test_a_full_disk_is_one_line_and_keeps_the_project(small_disk) -> None:
    with serving(small_disk / "project") as served:
        assert served.page("POST", "/api/change", {"title": "before"})[0] == 200
        folder = served.project.folder
        before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        fill(small_disk)
        for answer in (
            served.page("POST", "/api/change", {"title": "after"}),
            served.upload(GLAZING),
            served.page("POST", "/api/demo", {}),
        ):
            assert answer[0] == 422 and "the disk is full" in answer[1]["error"], answer
            assert ".upload" not in answer[1]["error"] and ".part" not in answer[1]["error"]
        assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
        (small_disk / "filler").unlink()
        assert served.upload(GLAZING)[0] == 200
        served.jobs.close()
