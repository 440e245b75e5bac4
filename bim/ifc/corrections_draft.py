"""A corrections file with every doubt of a model: its default in words, alternatives as comments.

The file changes nothing until a line of it is uncommented.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from bim.material_names import material_named
from bim.model import Building
from bim.report.issue import Issue, issue_text

LISTS = {  # key of the corrections: what an entry does, codes of the doubts that it answers
    "indoors": ("compute this space as a room", ("space-outdoors", "space-external")),
    "as_drawn": ("keep the height that the file draws", ("room-cut", "room-raised")),
    "opaque": ("this element has no glass", ("transparent-element-as-window", "opening-glazed")),
    "leave_out": ("leave this element out", ("element-drawn-twice",)),
}
NORTH = ("true-north-missing", "true-north-invalid", "true-north-from-map", "north-contradicts-map")
GLASS = ("window-without-glass", "opening-glazed", "glass-clipped", "glass-in-several-planes")
MATERIALS = ("material-unknown", "material-incomplete", "material-impossible")


def corrections_draft(building: Building) -> str:
    """The text (TOML) of a corrections file for a building read from IFC."""
    issues = building.issues
    lines = [
        f"# Corrections of {building.file.name if building.file else building.name}: every doubt",
        "# of the model with its default. Remove the # before a line to choose what it says.",
        "",
        "# Direction of the model's +y axis, in degrees from north to east.",
        *_words(one for one in issues if one.code in NORTH),
        "# north = 0.0",
        "",
        "# Diffuse reflectance of everything outdoors; default: what each element states.",
        "# surroundings = 0.2",
        "",
        "# Spaces that are outdoors; default: by shape, name and PredefinedType.",
        "outdoors = [",
        *(f"    # {_text(s.guid)},  # {s.label}, {s.volume:.1f} m3" for s in building.spaces),
        "]",
    ]
    for key, (what, codes) in LISTS.items():
        some = [one for one in issues if one.code in codes]
        lines += ["", f"# {key}: {what}.", f"{key} = ["]
        lines += [f"    # {_text(one.where)},  # {_line(one)}" for one in some] + ["]"]
    leaks = [one for one in issues if one.code == "room-leaks"]
    if leaks:
        widest = max(float(str(one.values["width"])) for one in leaks)
        lines += ["", *_words(leaks), f"# close_gaps = {min(1.0, widest + 0.1):.1f}"]
    lines += ["", "# Names of spaces; default: those of the file."]
    for space in building.spaces:
        lines += ["# [[room]]", f"# select = {_text(space.guid)}  # {space.volume:.1f} m3"]
        lines += [f"# name = {_text(space.name)}"]
        lines += [f"# long_name = {_text(space.long_name)}"] if space.long_name else []
    for one in (one for one in issues if one.code in GLASS):
        area = sum(w.area for w in building.windows if w.guid == one.where)
        lines += ["", f"# {_line(one)}", "# [[glass]]", f"# select = {_text(one.where)}"]
        lines += [f"# area = {area:.2f}  # m2"]
    seen = {"unnamed"}  # no material at all
    for one in (one for one in issues if one.code in MATERIALS):
        name = str(one.values["material"])
        if name in seen:
            continue
        seen.add(name)
        layer = material_named(name).layer
        lines += [
            "",
            f"# {_line(one)}",
            "# [[material]]",
            f"# name = {_text(name)}",
            f"# conductivity = {layer.conductivity:g}  # W/(m K); or u = 0.3, W/(m2 K)",
            f"# density = {layer.density:g}  # kg/m3",
            f"# heat_capacity = {layer.heat_capacity:g}  # J/(kg K)",
        ]
    return "\n".join(lines) + "\n"


def _words(issues: Iterable[Issue]) -> list[str]:
    return [f"# {_line(one)}" for one in issues]


def _line(issue: Issue) -> str:
    """What a doubt is and what was done, on one line."""
    text = issue_text(issue, "command")
    return " ".join(f"{text.what}: {text.effect}".split())


def _text(value: str) -> str:
    """A TOML string: JSON's escapes are TOML's."""
    return json.dumps(value, ensure_ascii=False)
