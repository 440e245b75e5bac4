"""Find an LLVM library for Dr.Jit, and avoid the versions that abort.

Dr.Jit takes the first libLLVM that it finds. On x86 processors Dr.Jit 1.5 ends the whole process
with LLVM 15 or 16 ("Cannot select: fminimum", at the first minimum of an array), which is what
Debian 12 often has, and it refuses LLVM 14. So the libraries are listed here by their file names,
never by loading them, and the best one is named in DRJIT_LIBLLVM_PATH before Dr.Jit starts. A
setting of the user's own always wins.
"""

from __future__ import annotations

import logging
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

VARIABLE = "DRJIT_LIBLLVM_PATH"
# with Dr.Jit 1.5.0: 15 was seen to abort on x86 with AVX2 alone and with AVX-512, 16 with AVX-512
OLDEST_SOUND = 17
OLDEST = 15  # Dr.Jit 1.5.0 refuses older ones
INSTALL_HINT = (
    "install LLVM 17 or newer (Debian, Ubuntu: apt-get install libllvm19; macOS: brew install "
    f"llvm; Windows: the LLVM installer) or set {VARIABLE} to its shared library"
)

_NAMES = ("libLLVM*.so*", "libLLVM*.dylib", "LLVM-C.dll")
_FILE = re.compile(r"libLLVM([-.]\d[\d.]*)?(\.so[\d.]*|\.dylib)|LLVM-C\.dll")
_IN_NAME = re.compile(r"libLLVM(?:-|\.so\.|\.)(\d+(?:\.\d+)*)")
_IN_FOLDER = re.compile(r"llvm(?:toolchain)?[-@/\\]?(\d+(?:\.\d+)*)", re.IGNORECASE)

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class LlvmLibrary:
    """One LLVM shared library on this machine, and whether Dr.Jit runs with it."""

    path: Path  # as found, not resolved
    version: tuple[int, ...]  # () where neither the name nor its target tells
    usable: bool
    reason: str  # why it is (not) usable, for people

    @property
    def version_text(self) -> str:
        """The version as people write it, `19.1`."""
        return ".".join(map(str, self.version)) or "unknown"


def candidates(folders: Iterable[Path] | None = None, *, x86: bool | None = None) -> list[LlvmLibrary]:
    """Every LLVM library found, best first; one entry per file however many links lead to it.

    Args:
        folders: where to look; by default the system's library folders and `ldconfig -p`.
        x86: whether the processor is of this kind; by default asked of the machine.
    """
    x86 = is_x86() if x86 is None else x86
    files = _files_in(library_folders()) + _cached_files() if folders is None else _files_in(folders)
    by_target: dict[Path, Path] = {}
    for file in files:
        by_target.setdefault(file.resolve(), file)
    judges = [_judge(file, x86) for file in by_target.values()]
    return sorted(judges, key=lambda library: (not library.usable, _negated(library.version)))


def select_library(folders: Iterable[Path] | None = None, *, x86: bool | None = None) -> Path | None:
    """The library that Dr.Jit will load, named in DRJIT_LIBLLVM_PATH; None if there is none.

    Must run before Dr.Jit is first used. The user's own setting is left as it is.
    """
    own = os.environ.get(VARIABLE)
    if own:
        return Path(own)
    best = next((candidate for candidate in candidates(folders, x86=x86) if candidate.usable), None)
    if best is None:
        return None
    os.environ[VARIABLE] = str(best.path)
    log.debug("LLVM %s at %s", best.version_text, best.path)
    return best.path


def is_x86() -> bool:
    """Whether this processor is an x86 one, of 32 or 64 bits."""
    return platform.machine().lower() in {"x86_64", "amd64", "i686", "i386", "x86"}


def library_folders() -> list[Path]:
    """Folders of this system that may contain an LLVM library, the user's first."""
    listed = [os.environ.get(name, "") for name in ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH")]
    folders = [Path(part) for value in listed for part in value.split(os.pathsep) if part]
    folders += [Path(sys.prefix) / "lib"]
    if "CONDA_PREFIX" in os.environ:
        folders += [Path(os.environ["CONDA_PREFIX"]) / "lib"]
    if sys.platform == "win32":
        roots = [os.environ.get(name) for name in ("ProgramFiles", "ProgramFiles(x86)")]
        return [*folders, *(Path(root) / "LLVM" / "bin" for root in roots if root)]
    if sys.platform == "darwin":
        roots = [Path("/opt/homebrew/opt"), Path("/usr/local/opt")]
        return [*folders, *(path for root in roots for path in sorted(root.glob("llvm*/lib")))]
    system = [Path("/usr/lib"), Path("/usr/lib64"), Path("/usr/local/lib"), Path("/usr/local/lib64")]
    multiarch = sorted(Path("/usr/lib").glob("*-linux-*"))
    versioned = [path for root in system for path in sorted(root.glob("llvm*/lib*"))]
    return [*folders, *multiarch, *system, *versioned]


def _files_in(folders: Iterable[Path]) -> list[Path]:
    return [
        file
        for folder in folders
        for pattern in _NAMES
        for file in sorted(folder.glob(pattern))
        if _FILE.fullmatch(file.name) and file.is_file()
    ]


def _cached_files() -> list[Path]:
    """LLVM libraries in the dynamic linker's cache (Linux only)."""
    if not sys.platform.startswith("linux"):
        return []
    tool = next((t for t in ("/sbin/ldconfig", "/usr/sbin/ldconfig") if Path(t).exists()), None)
    lines = _output([tool, "-p"]).splitlines() if tool else []
    paths = [Path(line.partition("=> ")[2].strip()) for line in lines if "libLLVM" in line]
    return [path for path in paths if _FILE.fullmatch(path.name) and path.is_file()]


def _judge(file: Path, x86: bool) -> LlvmLibrary:
    version = version_of(file)
    if not _same_processor(file):
        return LlvmLibrary(file, version, False, "built for another processor than this Python")
    if not version:
        return LlvmLibrary(file, version, False, "its version cannot be told from its name")
    if version[0] < OLDEST:
        return LlvmLibrary(file, version, False, f"older than LLVM {OLDEST}")
    if version[0] < OLDEST_SOUND and x86:
        reason = "aborts Dr.Jit on x86 processors (Cannot select: fminimum)"
        return LlvmLibrary(file, version, False, reason)
    return LlvmLibrary(file, version, True, "usable")


def version_of(file: Path) -> tuple[int, ...]:
    """The LLVM version from the name of the file, of its target, or of their folders."""
    target = file.resolve()
    for name in (target.name, file.name):
        if match := _IN_NAME.match(name):
            return _numbers(match[1])
    for folder in (str(target.parent), str(file.parent)):
        if match := _IN_FOLDER.search(folder):
            return _numbers(match[1])
    headers = sorted(target.parent.parent.glob("lib/clang/*"))  # Windows' LLVM folder
    versions = [_numbers(path.name) for path in headers if path.name[:1].isdigit()]
    return max(versions, default=())


def _same_processor(file: Path) -> bool:
    """Whether an ELF library has the class and machine of the running Python's program."""
    if not sys.platform.startswith("linux"):
        return True
    ours, theirs = _elf_kind(Path(sys.executable)), _elf_kind(file)
    return ours is None or theirs is None or ours == theirs


def _elf_kind(file: Path) -> bytes | None:
    try:
        with file.open("rb") as stream:
            head = stream.read(20)
    except OSError:
        return None
    return head[4:5] + head[18:20] if head[:4] == b"\x7fELF" and len(head) == 20 else None


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".") if part.isdigit())


def _negated(version: tuple[int, ...]) -> tuple[int, ...]:
    """Sorts newer versions first."""
    return tuple(-number for number in (*version, 0, 0, 0)[:3])


def _output(command: list[str]) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout
