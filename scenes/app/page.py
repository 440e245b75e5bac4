"""The page's text: template, style and scripts, those of the other pages among them."""

from __future__ import annotations

from scenes.explore.folder import script_words
from scenes.language.catalogue import in_language
from scenes.report.page import FILES, environment
from scenes.report.page_files import page_files

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
