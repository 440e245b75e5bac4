"""Templates, styles and scripts of the pages.

They are read as the module that fills them is loaded, which is before the work: a program that is
replaced while it computes for hours writes the page that belongs to its own figures.
"""

from __future__ import annotations

from importlib.resources import files


def page_files(package: str) -> dict[str, str]:
    """The text of every file in the folder `templates` of a package, by its name."""
    folder = files(package) / "templates"
    result = sorted((one for one in folder.iterdir() if one.is_file()), key=lambda one: one.name)
    return {one.name: one.read_text("utf-8") for one in result}
