"""Issues of a building in tests: chosen by their code, and in words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from bim.report.issue import Issue, issue_text


class HasIssues(Protocol):
    """A building, a scene or a result."""

    @property
    def issues(self) -> Iterable[Issue]: ...


def of_code(source: HasIssues, code: str) -> list[Issue]:
    """The issues of a code."""
    return [issue for issue in source.issues if issue.code == code]


def codes(source: HasIssues) -> list[str]:
    """The codes of all issues, in their order."""
    return [issue.code for issue in source.issues]


def texts(source: HasIssues) -> str:
    """All issues in words as the command line shows them, one a line."""
    return "\n".join(f"{i.where} {issue_text(i, 'command').line}" for i in source.issues)
