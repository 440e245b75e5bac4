"""Compiled functions, kept on disk where there is a folder for it."""

from __future__ import annotations

from collections.abc import Callable

from numba import njit
from numba.core.caching import IndexDataCacheFile


class _OwnedCode(IndexDataCacheFile):
    """Numba's kept code of a function, each file with the signature that it is the code of.

    Numba numbers the files in an index.  Two processes that compile a function for different
    arguments at once give both codes one number; who called it for one then got the other's code,
    and without an error numbers that mean nothing.
    """

    def save(self, key: object, data: object) -> None:
        super().save(key, (key, data))

    def load(self, key: object) -> object:
        match super().load(key):
            case (owner, data) if owner == key:
                return data
        return None  # another's, or of an older form: compiled again


def compiled(compiler: Callable = njit, /, *arguments, **options) -> Callable[[Callable], Callable]:
    """A decorator: numba's `compiler` with these arguments, and what it compiles kept on disk.

    That is `__pycache__` beside the module, else (a read-only install) the user's cache folder, or
    the one that NUMBA_CACHE_DIR names; where none can be written, each process compiles anew.
    """

    def decorator(function: Callable) -> Callable:
        try:
            kept = compiler(*arguments, cache=True, **options)(function)
        except RuntimeError:  # numba: no locator available
            return compiler(*arguments, **options)(function)
        if compiler is njit:  # the others are given their one signature
            kept._cache._cache_file.__class__ = _OwnedCode
        return kept

    return decorator
