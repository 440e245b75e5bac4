"""What a file of a page changes: head, logo and sections; what is wrong with it is one line."""

from __future__ import annotations

import base64
import io
import re
import zlib

import pytest
from PIL import Image

from mitsuba_cfs.errors import DataError
from scenes.cli import run
from scenes.demo import OFFICE, STUDY, WEATHER
from scenes.page_options import LOGO_BYTES, DossierSection, PageOptions, RunSection, StudySection, read_page
from scenes.report.page import report_html
from scenes.study_report.page import study_report_html
from tests.report.browser import chromium, inspect
from tests.report.synthetic import run_result
from tests.report.test_study_report import study

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><rect width="9" height="9"/></svg>'
HEADINGS = {  # of the sections that a run's report can do without
    "verdict": "Verdict",
    "rooms": "Overview of the rooms",
    "daylight": "Daylight",
    "glare": "Glare",
    "operation": "Operation",
    "temperatures": "Temperatures and comfort",
    "glazing": "Glazing and shading",
    "model": "3D model",
    "problems": "Problems in the building model",
    "method": "Method",
    "inputs": "Inputs and versions",
    "glossary": "Glossary",
}


def picture(kind: str, size: tuple[int, int] = (4, 3)) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", size).save(stream, kind)
    return stream.getvalue()


def page_file(folder, text: str):
    path = folder / "page.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def result():
    return run_result(picture_size=96)


@pytest.mark.parametrize(
    ("name", "content", "kind"),
    [
        ("a.svg", SVG.encode(), "image/svg+xml"),
        ("a.png", picture("png"), "image/png"),
        ("a.of any name", picture("jpeg"), "image/jpeg"),
    ],
)
def test_title_author_and_logo_stand_in_the_head(result, tmp_path, name, content, kind) -> None:
    (tmp_path / name).write_bytes(content)
    text = f'title = "Sky <light>"\nauthor = "A & B"\nlogo = "{name}"\n'
    options = read_page(page_file(tmp_path, text), RunSection)
    assert options.inputs == (tmp_path / "page.toml", tmp_path / name)
    logo = f"data:{kind};base64,{base64.b64encode(content).decode()}"
    for page in (report_html(result, options), study_report_html(study(), options)):
        head = page[page.index("<title>") : page.index("</header>")]
        assert "<h1>Sky &lt;light&gt;</h1>" in head and "<title>Sky &lt;light&gt;" in head
        assert f'src="{logo}"' in head
        assert "<dt>Author</dt><dd>A &amp; B</dd>" in head


@pytest.mark.parametrize("name", HEADINGS)
def test_a_section_is_left_out_alone_and_the_foot_says_so(result, name) -> None:
    page = report_html(result, PageOptions(left_out=(name,)))
    there = set(re.findall(r"<h[23]>([^<]+)</h[23]>", page))
    assert there & set(HEADINGS.values()) == set(HEADINGS.values()) - {HEADINGS[name]}
    for anchor in re.findall(r'href="#([^"]+)"', page):
        assert f'id="{anchor}"' in page
    assert f"Sections left out by the page file: {name}." in page.partition("<footer>")[2]
    assert result.notes[0] in page


def test_without_a_file_the_page_is_as_it_was(result) -> None:
    page = report_html(result)
    assert set(HEADINGS.values()) <= set(re.findall(r"<h[23]>([^<]+)</h[23]>", page))
    assert "Left out" not in page and '<img class="logo"' not in page
    assert f"<h1>{result.building.name}</h1>" in page and "<dt>Author" not in page


@pytest.mark.parametrize("name", ["verdict", "comparison", "model", "problems", "method", "inputs"])
def test_a_study_without_a_section(name) -> None:
    page = study_report_html(study(), PageOptions(left_out=(name,)))
    assert f'id="{name}"' not in page and f'href="#{name}"' not in page
    assert 'id="cases"' in page and "Sections left out by the page file" in page


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
@pytest.mark.parametrize(
    "make", [lambda o: report_html(run_result(picture_size=96), o), lambda o: study_report_html(study(), o)]
)
def test_a_page_without_its_sections_has_no_fault_in_a_browser(make, tmp_path) -> None:
    left_out = ("verdict", "comparison", "rooms", "model")
    found = inspect(make(PageOptions(logo=LOGO, left_out=left_out)), tmp_path, use="")
    assert found["faults"] == []
    assert found["scroll"] <= found["width"]


LOGO = "data:image/svg+xml;base64," + base64.b64encode(SVG.encode()).decode()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("titel = 'A'", "titel: no such key; did you mean title?"),
        ("title = ''", "title: expected a text that is not empty, got ''"),
        ("[sections]\nglosary = false", "sections.glosary: no such key; did you mean glossary?"),
        ("[sections]\nmodel = 7", "sections.model: expected true or false, got 7"),
        ("logo = 'none.png'", "logo: {folder}/none.png cannot be read: "),
        ("logo = 'a.txt'", "logo: {folder}/a.txt is no PNG, JPEG or SVG picture"),
        ("logo = 'cut.png'", "logo: {folder}/cut.png is no PNG, JPEG or SVG picture"),
        ("logo = 'other.xml'", "logo: {folder}/other.xml is no PNG, JPEG or SVG picture"),
        ("logo = 'big.svg'", "logo: {folder}/big.svg has 500 kB; at most 500 kB"),
        ("logo = 'wide.png'", "logo: {folder}/wide.png has 4001 x 1 pixels; at most 4000 a side"),
        ("logo = 'lies.png'", "logo: {folder}/lies.png is no PNG, JPEG or SVG picture"),
        ("logo = '.'", "logo: {folder} cannot be read: "),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path, text, words) -> None:
    (tmp_path / "a.txt").write_text("a logo")
    (tmp_path / "cut.png").write_bytes(picture("png", (900, 900))[:60])
    (tmp_path / "other.xml").write_text("<a/>")
    (tmp_path / "big.svg").write_text(SVG + " " * LOGO_BYTES)
    lies = picture("png", (9, 9))  # its header says that it has 3.6 gigapixels, which must not be made
    head = lies[12:16] + (60_000).to_bytes(4) * 2 + lies[24:29]
    (tmp_path / "lies.png").write_bytes(lies[:12] + head + zlib.crc32(head).to_bytes(4) + lies[33:])
    (tmp_path / "wide.png").write_bytes(picture("png", (4001, 1)))
    path = page_file(tmp_path, text)
    with pytest.raises(DataError) as error:
        read_page(path, RunSection)
    said = str(error.value)
    assert said.startswith(f"{path}: {words.format(folder=tmp_path)}")
    assert "\n" not in said


@pytest.mark.parametrize(
    ("sections", "other", "near"), [(StudySection, "comparson", "comparison"), (DossierSection, "source", "sources")]
)
def test_each_page_has_its_own_sections(tmp_path, sections, other, near) -> None:
    assert read_page(page_file(tmp_path, f"[sections]\n{near} = false"), sections).left_out == (near,)
    with pytest.raises(DataError, match=f"sections.{other}: no such key; did you mean {near}?"):
        read_page(page_file(tmp_path, f"[sections]\n{other} = false"), sections)


@pytest.mark.parametrize(
    "words",
    [
        ["run", OFFICE, "--weather", WEATHER],
        ["comply", OFFICE, "--weather", WEATHER, "--standard", "en17037"],
        ["study", STUDY],
    ],
    ids=lambda words: words[0],
)
def test_a_wrong_file_ends_a_command_before_it_computes(tmp_path, capsys, words) -> None:
    path = page_file(tmp_path, "[sections]\nproblem = false\n")
    out = tmp_path / "out"
    assert run([*map(str, words), "--out", str(out), "--page", str(path)]) == 1
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == f"error: {path}: sections.problem: no such key; did you mean problems?"
    assert not out.exists()
