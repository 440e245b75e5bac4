"""Arrays as the explorer's data files hold them: small, and read by a browser without a library."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, write_text

BEFORE, AFTER = "cfs.give(", ");\n"  # of the JSON in a data file, a script


def packed(array: ArrayLike, kind: str) -> dict[str, Any]:
    """An array as base64 of its bytes, deflated plane by plane, the lowest bytes first.

    Args: kind: of its numbers: u1, i2, u2, i4 or f4, little end first.
    """
    values = np.ascontiguousarray(array).astype(f"<{kind}").ravel()
    planes = values.view(np.uint8).reshape(-1, values.itemsize).T
    press = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = press.compress(np.ascontiguousarray(planes).tobytes()) + press.flush()
    return {"kind": kind, "length": len(values), "data": base64.b64encode(data).decode("ascii")}


def write_data(path: Path, data: object) -> None:
    """Write data as a script, which a page that was opened as a file may load."""
    write_text(path, BEFORE + json.dumps(data, separators=(",", ":")) + AFTER)


def read_data(path: Path) -> Any:
    """The data of such a script.

    Raises: `DataError` for a file that is none.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if not (text.startswith(BEFORE) and text.endswith(AFTER)):
            raise ValueError("is empty" if not text else "another text than one call of cfs.give")
        return json.loads(text.removeprefix(BEFORE).removesuffix(AFTER))
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise DataError(f"is no data of an explorer: {reason(error)}", file=path) from None
