"""Run one validation: `python -m tests.validation NAME [options]`, or `--list`."""

from __future__ import annotations

import sys

from tests.scripts import run_script

if __name__ == "__main__":
    sys.exit(run_script("tests.validation", sys.argv[1:]))
