"""Hooks of mkdocs.yml: what the site has beside docs/*.md, and where the links of its pages lead.

- README.md is the first page; CONTRIBUTING.md and CHANGELOG.md are pages.
- Each package of the code has a page of its public modules, found by looking: nothing is listed
  by hand.
- A link that leads out of docs/ in the repository leads to a copy of that file in the site.
- A page that loads anything from another address ends the build.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("scenes", "bim", "mitsuba_cfs", "thermal")
NOT_PUBLIC = ("scenes/commands",)  # described by `cfs --help`
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "CHANGELOG.md": "CHANGELOG.md"}
LINK = re.compile(r"(?<=\]\()(?!\w+:|#|/)([^)#\s]+)")  # relative: no scheme, no anchor alone

LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?(?:src|href)=[\"']?(?:https?:)?//[^\"' >]+")


def api_pages() -> dict[str, list[str]]:
    """The modules of each package and sub-package, by the package's dotted name."""
    found: dict[str, list[str]] = {}
    for package in PACKAGES:
        for init in sorted((REPOSITORY / package).rglob("__init__.py")):
            folder = init.parent.relative_to(REPOSITORY).as_posix()
            if not folder.startswith(NOT_PUBLIC):
                names = sorted(path.stem for path in init.parent.glob("[!_]*.py"))
                dotted = folder.replace("/", ".")
                found[dotted] = [f"{dotted}.{name}" for name in names]
    return found


def api_text(package: str, modules: list[str]) -> str:
    """The page of a package: its docstring, then each module."""
    top = f"::: {package}\n    options:\n      heading_level: 1\n      members: false\n"
    return "\n".join([top, *(f"::: {module}\n" for module in modules)])


# Pages that the search of the site shows after those for users: evidence, decisions, internals
LATER_IN_SEARCH = re.compile(
    r"adr/|source/|evidence_|(architecture|benchmarks|capabilities|reliability|validation|CHANGELOG|CONTRIBUTING)\.md|"
    r"api/\w+\.\w+.*\.md"
)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the API pages behind the guide's."""
    pages = [{name: f"api/{name}.md"} for name, modules in api_pages().items() if modules]
    config.nav.insert(-3, {"API": pages})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages made here, and the files outside docs/ that a page links to."""
    for source, name in PAGES.items():
        text = (REPOSITORY / source).read_text("utf-8")
        files.append(File.generated(config, name, content=text))
    for name, modules in api_pages().items():
        if modules:
            files.append(File.generated(config, f"api/{name}.md", content=api_text(name, modules)))
    for page in [*PAGES, *(f"docs/{path.name}" for path in (REPOSITORY / "docs").glob("*.md"))]:
        for link in LINK.findall((REPOSITORY / page).read_text("utf-8")):
            path = _in_repository(page, link)
            target = _in_site(path)
            if target.startswith("source/") and target not in files.src_uris:
                if (REPOSITORY / path).is_file():
                    files.append(
                        File.generated(
                            config, target, abs_src_path=str(REPOSITORY / path), inclusion=InclusionLevel.NOT_IN_NAV
                        )
                    )
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """The page's links, from its place in the site instead of that in the repository."""
    here = page.file.src_uri
    if LATER_IN_SEARCH.match(here):
        page.meta.setdefault("search", {"boost": 0.2})
    if here.startswith(("api/", "source/")):
        return markdown
    source = {name: path for path, name in PAGES.items()}.get(here, f"docs/{here}")

    def led(match: re.Match[str]) -> str:
        target = _in_site(_in_repository(source, match[1]))
        return posixpath.relpath(target, posixpath.dirname(here) or ".")

    return LINK.sub(led, markdown)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Refuse what is loaded from elsewhere: the site is read without a network."""
    if loaded := LOADED.search(output):
        raise PluginError(f"{page.file.src_uri}: loads from outside: {loaded[0]}")
    return output


def _in_repository(page: str, link: str) -> str:
    """Where a link of a page of the repository leads, from the repository's root."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), link))


def _in_site(path: str) -> str:
    """Where the site has a file of the repository; a text that is no page under `source`."""
    if path in PAGES:
        return PAGES[path]
    return path.removeprefix("docs/") if path.startswith("docs/") else f"source/{path}"
