"""A weather file made here: a year of clear skies, to be read or to be spoilt."""

from __future__ import annotations

from pathlib import Path

import numpy as np

HEADER = """LOCATION,Testville,-,XYZ,made for a test,0,48.0,8.0,1.0,250.0
DESIGN CONDITIONS,0
TYPICAL/EXTREME PERIODS,0
GROUND TEMPERATURES,1,.5,,,,1,2,3,4,5,6,7,8,9,10,11,12
HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0
COMMENTS 1,none
COMMENTS 2,none
DATA PERIODS,1,{steps},Data,Sunday, 1/ 1,12/31
"""
MONTH_DAYS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


def epw_rows(steps: int = 1, leap: bool = False) -> list[list[str]]:
    """The fields of every row of a year: a clear sky by day, nothing else of interest."""
    rows = []
    for month, days in enumerate(MONTH_DAYS, start=1):
        for day in range(1, days + 1 + (leap and month == 2)):
            for hour in range(1, 25):
                for step in range(1, steps + 1):
                    shine = max(0.0, np.sin(np.pi * (hour - 6) / 12))
                    row = ["1999", str(month), str(day), str(hour), str(60 * step // steps), "?"]
                    row += ["10.0", "5.0", "71", "98000", "0", "0", "300", f"{800 * shine:.0f}"]
                    row += [f"{700 * shine:.0f}", f"{120 * shine:.0f}", "999999", "999999", "999999"]
                    row += ["9999", "270", "3.5", "5", "5", "9999", "99999", "9", "999999999"]
                    rows.append([*row, "0", "0", "0", "88", "0.2", "0", "0"])
    return rows


def write_epw(path: Path, rows: list[list[str]], steps: int = 1) -> Path:
    """A whole EPW file of the rows."""
    path.write_text(HEADER.format(steps=steps) + "\n".join(",".join(row) for row in rows) + "\n")
    return path
