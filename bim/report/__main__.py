"""Write docs/issues.md, the page of all codes, from the catalogue: `python -m bim.report`."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from bim.report.issue import CATALOGUE, Template, catalogue

PAGE = Path("docs/issues.md")
HEAD = """# Issues of a model

Every building that is read has `issues`: what is missing, faulty or assumed in its file. An issue
is data: `code`, `where` (GUID, name or file), `values`, `effect` and `severity`.

```python
import bim

building = bim.read_ifc("house.ifc")
losses = [issue for issue in building.issues if issue.severity == "loss"]
lines = [f"{issue.where} {bim.issue_text(issue).line}" for issue in losses]
```

`problems.csv` of every command has the columns where, what, consequence, code and severity.

| severity | meaning |
|---|---|
| loss | part of the model is not simulated |
| warning | results may be wrong |
| unused | the file states something that no result depends on |
| assumption | a missing or faulty value was replaced or repaired |
| info | nothing changes |

Words in braces are values of the issue. This page is written from `bim/report/catalogue.toml` by
`python -m bim.report`.
"""


def page() -> str:
    """The page in Markdown: a table of the codes of each chapter of the catalogue."""
    parts = [HEAD]
    for title, codes in _chapters():
        parts += [f"\n## {title}\n", "| code | severity | what | effect | fix |", "|---|---|---|---|---|"]
        parts += [_row(code, catalogue()[code]) for code in codes]
    return "\n".join(parts) + "\n"


def _chapters() -> list[tuple[str, list[str]]]:
    """Titles of the catalogue's chapters and their codes."""
    title, pairs = "", []
    for line in CATALOGUE.read_text(encoding="utf-8").splitlines():
        if line.startswith("# ----"):
            title = line.strip("# -")
        elif line.startswith("[issue."):
            pairs.append((title, line[len("[issue.") : -1]))
    grouped = groupby(pairs, key=lambda pair: pair[0])
    return [(name[:1].upper() + name[1:], [code for _, code in own]) for name, own in grouped]


def _row(code: str, template: Template) -> str:
    fixes = dict.fromkeys(filter(None, (template.fix, template.fix_command)))
    cells = (f"`{code}`", template.severity, template.what, template.effect, "<br>".join(fixes))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
