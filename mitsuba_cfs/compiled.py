"""Compiled functions, cached on disk if there is a folder for them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from numba import njit
from numba.core.caching import IndexDataCacheFile

from mitsuba_cfs.source_code import OWN, code_version


class _OwnedCode(IndexDataCacheFile):
    """Numba's cached code of a function; each file holds its source and signature.

    Numba numbers the files in an index.  Two processes that compile a function at once for
    different arguments, or from different sources, give both codes one number; who called it for
    one then got the other's code, and without an error numbers that mean nothing.
    """

    def save(self, key: object, data: object) -> None:
        super().save(key, ((self._source_stamp, key), data))

    def load(self, key: object) -> object:
        match super().load(key):
            case (owner, data) if owner == (self._source_stamp, key):
                return data
        return None  # another's, or of an older form: compiled again

    def _load_index(self) -> dict:
        try:
            return super()._load_index()
        except (AttributeError, ImportError):
            return {}  # of another version, with arguments of types that this one does not have

    def cached(self) -> bool:
        """Whether code of this source is cached, for any arguments."""
        return any(self.load(key) is not None for key in self._load_index())


def compiled(compiler: Callable = njit, /, *arguments, **options) -> Callable[[Callable], Callable]:
    """A decorator: numba's `compiler` with these arguments; the compiled code is cached on disk.

    That is `__pycache__` beside the module, else (a read-only install) the user's cache folder, or
    the one that NUMBA_CACHE_DIR names; where none can be written, each process compiles again.
    Code is found again while its module and all that this imports, whose functions may be inlined
    into it, are as they were.
    """

    def decorator(function: Callable) -> Callable:
        try:
            kept = compiler(*arguments, cache=True, **options)(function)
        except RuntimeError:  # numba: no locator available
            return compiler(*arguments, **options)(function)
        if compiler is njit:  # the others are given their one signature
            file, module = kept._cache._cache_file, function.__module__
            file.__class__ = _OwnedCode
            if module.partition(".")[0] in OWN:  # numba goes by the age of the function's own file
                file._source_stamp = code_version(module)
        return kept

    return decorator


def must_compile(function: Callable) -> bool:
    """Whether the first call of a compiled function will compile it."""
    if function.signatures:
        return False
    file = getattr(function._cache, "_cache_file", None)  # none where nothing can be kept
    return file is None or not file.cached()


@contextmanager
def alone_in_compiling(function: Callable) -> Iterator[None]:
    """Wait until no other process is in this context with a compiled function, and keep others out of it.

    Who finds that a function must be compiled waits here for the process that is at it, and then
    loads its code.  What is locked is the function's own source file: nothing is written, and the
    system lets go of it with the process.  Where files cannot be locked, nobody waits.
    """
    with open(function.__code__.co_filename, "rb") as source:
        if sys.platform != "win32":
            import fcntl

            with suppress(OSError):
                fcntl.flock(source, fcntl.LOCK_EX)
        yield
