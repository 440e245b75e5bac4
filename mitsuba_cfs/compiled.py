"""Compiled functions, cached on disk if there is a folder for them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba import njit
from numba.core.caching import IndexDataCacheFile
from numba.core.compiler_lock import global_compiler_lock

from mitsuba_cfs.source_code import OWN, code_version

try:
    import fcntl
except ImportError:  # Windows: each process compiles
    fcntl = None  # type: ignore[assignment]

LONGEST_WAIT = 600.0  # [s] for a process that compiles the same function
ASKED = 0.05  # [s] between two attempts to lock


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


@contextmanager
def _locked(path: str) -> Iterator[None]:
    """Hold the lock of a file, for which other processes wait; none where no file can be written."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:
        yield
        return
    try:
        end = time.monotonic() + LONGEST_WAIT
        while fcntl is not None and time.monotonic() < end:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(ASKED)
            except OSError:
                break  # a file system without locks
        yield
    finally:
        os.close(handle)


def _compiled_by_one(function: Callable, lock: str) -> None:
    """Let one process at a time compile a function; the others wait, and load what it stored."""
    compile_now, held = function.compile, False

    def compile_once(signature: object) -> object:
        nonlocal held
        with global_compiler_lock:  # first, as numba takes it for what this function calls
            if held:  # it calls itself, or the other way round
                return compile_now(signature)
            held = True
            try:
                with _locked(lock):
                    return compile_now(signature)
            finally:
                held = False

    function.compile = compile_once


def compiled(compiler: Callable = njit, /, *arguments, **options) -> Callable[[Callable], Callable]:
    """A decorator: numba's `compiler` with these arguments; the compiled code is cached on disk.

    That is `__pycache__` beside the module, else (a read-only install) the user's cache folder, or
    the one that NUMBA_CACHE_DIR names; where none can be written, each process compiles again.
    Code is found again while its module and all that this imports, whose functions may be inlined
    into it, are as they were.  Of several processes one compiles a function, and the others wait for it.
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
            _compiled_by_one(kept, f"{file._index_path}.lock")
        return kept

    return decorator


def must_compile(function: Callable) -> bool:
    """Whether the first call of a compiled function will compile it."""
    if function.signatures:
        return False
    file = getattr(function._cache, "_cache_file", None)  # none where nothing can be kept
    return file is None or not file.cached()
