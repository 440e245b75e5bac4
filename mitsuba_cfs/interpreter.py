"""A second Python interpreter that runs this program's code: command line and environment.

With `-c` and `-m` Python looks for modules in the current folder first, which is the user's: a
`json.py` or a folder `scenes` would stand there for the one that is meant.
"""

from __future__ import annotations

import os
import sys


def own_python(*arguments: str) -> list[str]:
    """Command line of a Python that does not import from the current folder, see `own_paths()`."""
    return [sys.executable, "-P", *arguments]


def own_paths() -> dict[str, str]:
    """The environment of this process, with its import path."""
    return os.environ | {"PYTHONPATH": os.pathsep.join(p or os.getcwd() for p in sys.path)}
