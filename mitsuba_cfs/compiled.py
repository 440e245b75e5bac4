"""Compiled functions, kept on disk where there is a folder for it."""

from __future__ import annotations

from collections.abc import Callable

from numba import njit


def compiled(compiler: Callable = njit, /, *arguments, **options) -> Callable[[Callable], Callable]:
    """A decorator: numba's `compiler` with these arguments, and what it compiles kept on disk.

    That is `__pycache__` beside the module, else (a read-only install) the user's cache folder, or
    the one that NUMBA_CACHE_DIR names; where none can be written, each process compiles anew.
    """

    def decorator(function: Callable) -> Callable:
        try:
            return compiler(*arguments, cache=True, **options)(function)
        except RuntimeError:  # numba: no locator available
            return compiler(*arguments, **options)(function)

    return decorator
