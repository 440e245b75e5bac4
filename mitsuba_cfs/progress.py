"""How long computations tell how far they are, without knowing who listens."""

from __future__ import annotations

from collections.abc import Callable, Mapping

Progress = Callable[[str, float], None]
"""Called with a stage's label and the fraction of that stage done, 0 to 1."""


def silent(stage: str, fraction: float) -> None:
    """Listen to nothing: the default of every function that reports progress."""


def part(progress: Progress, start: float, end: float, stage: str | None = None) -> Progress:
    """A `Progress` that fills only `start` to `end` of the outer one.

    For a step made of others: with `stage` its steps all appear under that one label.
    """
    if not 0.0 <= start <= end <= 1.0:
        raise ValueError(f"expected 0 <= start <= end <= 1, got {start} and {end}")

    def inner(label: str, fraction: float) -> None:
        progress(stage or label, start + (end - start) * fraction)

    return inner


def staged(
    progress: Progress, places: Mapping[str, tuple[float, float]], label: str | None = None
) -> Progress:
    """A progress whose stages are parts of larger ones: each from a start to an end.

    Args: places: start and end of each stage, as shares; label: the one stage that they are parts
        of, their own names by default.
    """

    def told(stage: str, fraction: float) -> None:
        start, end = places.get(stage, (0.0, 1.0))
        progress(label or stage, start + (end - start) * fraction)

    return told
