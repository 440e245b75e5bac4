"""Issues in the order of their weight in the result, those of one kind counted once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bim.report.issue import Audience, Fill, Issue, IssueText, Phrase, catalogue, issue_text, phrases
from mitsuba_cfs.notes import filled

LOST = {"room": 2, "window": 1}


@dataclass(frozen=True, slots=True)
class Ranked:
    """Issues of one kind."""

    issues: tuple[Issue, ...]

    @property
    def count(self) -> int:
        """How many issues these are."""
        return len(self.issues)

    @property
    def glass(self) -> float:
        """Area of the glass that they concern [m2]."""
        return sum(issue.effect.glass for issue in self.issues)

    @property
    def first(self) -> Issue:
        """The weightiest of them."""
        return max(self.issues, key=lambda issue: issue.effect.glass)

    def text(self, audience: Audience = "python", fill: Fill = filled) -> IssueText:
        """The text of the first issue as an example, after the number of issues."""
        text = issue_text(self.first, audience, fill)
        if self.count == 1:
            return text
        what = fill(phrases()["times"], count=self.count, what=text.what)
        return text._replace(what=what)


def ranked(issues: Sequence[Issue]) -> list[Ranked]:
    """Issues by area of glass, then lost rooms and windows, then by number."""
    groups: dict[tuple[object, ...], list[Issue]] = {}
    for issue in issues:
        groups.setdefault(_kind(issue), []).append(issue)
    result = [Ranked(tuple(group)) for group in groups.values()]
    return sorted(result, key=lambda r: (-r.glass, -LOST.get(r.first.effect.lost, 0), -r.count))


def _kind(issue: Issue) -> tuple[object, ...]:
    """The code, the loss, and the values that tell issues of the code apart."""
    values = (issue.values[name] for name in catalogue()[issue.code].group)
    keys = (value.key if isinstance(value, Phrase) else value for value in values)
    return (issue.code, issue.effect.lost, *keys)
