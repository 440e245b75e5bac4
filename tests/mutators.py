"""Mutations of files that mostly still parse: each format is changed by its own tokens.

`tests/bim/bim_fuzz.py` spoils bytes; nearly all of those files fail at the first check.  Here a
number becomes another number, an element moves, a value has another type.
"""

from __future__ import annotations

import copy
import io
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.bim.bim_fuzz import odd_values

Mutator = Callable[[bytes, np.random.Generator], bytes]

NUMBERS = (
    "0",
    "-0.0",
    "-1",
    "1",
    "2",
    "0.5",
    "1e-320",
    "1e-12",
    "1e5",
    "1e12",
    "1e38",
    "1e300",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "-inf",
    "2147483648",
    "99999999999999999999",
    "1.0000001",
    "",
    "x",
)
TOKEN = re.compile(rb"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?|[A-Za-z_][\w-]*")
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
DEEP = 3000
HEADER = 8  # lines of an EPW
MISSING = ("99.9", "999", "9999", "99999", "999999", "-60", "69", "100", "0.1")  # and bounds


def of_text(content: bytes, random: np.random.Generator) -> bytes:
    """Text: one to three tokens replaced, or lines dropped, repeated, exchanged, put elsewhere."""
    for _ in range(int(random.integers(1, 4))):
        kind = int(random.integers(8))
        if kind < 5:
            content = _other_token(content, random)
            continue
        lines = content.splitlines(keepends=True) or [b""]
        i, j = (int(random.integers(len(lines))) for _ in range(2))
        if kind == 5:
            del lines[i]
        elif kind == 6:
            lines.insert(j, lines[i])
        else:
            lines[i], lines[j] = lines[j], lines[i]
        content = b"".join(lines)
    return content


def _other_token(content: bytes, random: np.random.Generator) -> bytes:
    tokens = list(TOKEN.finditer(content))
    if not tokens:
        return content
    token = tokens[int(random.integers(len(tokens)))]
    if token.group()[:1].isalpha() and random.random() < 0.5:
        other = tokens[int(random.integers(len(tokens)))].group()
    else:
        other = NUMBERS[int(random.integers(len(NUMBERS)))].encode()
    return content[: token.start()] + other + content[token.end() :]


def of_weather(content: bytes, random: np.random.Generator) -> bytes:
    """EPW: its header or a day as text, or a field marked as missing, or odd, for some hours."""
    lines = content.splitlines(keepends=True)
    if random.random() < 0.4:
        return of_text(b"".join(lines[:HEADER]), random) + b"".join(lines[HEADER:])
    first = int(random.integers(HEADER, len(lines)))
    hours = slice(first, first + int(random.choice([1, 2, 6, 7, 24])))
    if random.random() < 0.5:
        lines[hours] = [of_text(b"".join(lines[hours]), random)]
        return b"".join(lines)
    column = int(random.integers(1, lines[first].count(b",") + 1))
    odd = str(random.choice([*MISSING, *NUMBERS])).encode()
    for hour in range(*hours.indices(len(lines))):
        fields = lines[hour].rstrip().split(b",")
        fields[column : column + 1] = [odd]
        lines[hour] = b",".join(fields) + b"\n"
    return b"".join(lines)


def of_toml(content: bytes, random: np.random.Generator) -> bytes:
    """TOML: as text, now and then a value nested very deep."""
    if random.random() < 0.02:
        return content + b"\nnested = " + b"[" * DEEP + b"]" * DEEP + b"\n"
    return of_text(content, random)


def of_json(content: bytes, random: np.random.Generator) -> bytes:
    """JSON: one or two values odd or gone, or a value in the place of another."""
    document = json.loads(content)
    if random.random() < 0.02:
        return content.replace(b":", b":" + b"[" * DEEP, 1)
    if random.random() < 0.3:
        document = _exchanged(document, random)
    (spoilt,) = odd_values(document, 1, int(random.integers(1 << 31)))
    return json.dumps(spoilt).encode()


def _exchanged(document: Any, random: np.random.Generator) -> Any:
    """A document with a value replaced by a copy of another one of it."""
    document = copy.deepcopy(document)
    owners: list[tuple[Any, Any]] = []

    def collect(part: Any) -> None:
        items = part.items() if isinstance(part, dict) else enumerate(part)
        for key, value in items:
            owners.append((part, key))
            if isinstance(value, dict | list):
                collect(value)

    collect(document)
    owner, key = owners[int(random.integers(len(owners)))]
    other, where = owners[int(random.integers(len(owners)))]
    owner[key] = copy.deepcopy(other[where])
    return document


def of_xml(content: bytes, random: np.random.Generator) -> bytes:
    """XML: elements dropped, repeated, moved; texts and attributes odd."""
    root = ET.fromstring(content)
    for _ in range(int(random.integers(1, 4))):
        every = [(parent, child) for parent in root.iter() for child in parent]
        if not every:
            break
        parent, child = every[int(random.integers(len(every)))]
        other = every[int(random.integers(len(every)))][1]
        match int(random.integers(7)):
            case 0:
                parent.remove(child)
            case 1:
                parent.append(copy.deepcopy(child))
            case 2:
                other.append(copy.deepcopy(child if len(list(child.iter())) < 200 else child[0]))
            case 3 if child.attrib:
                key = list(child.attrib)[int(random.integers(len(child.attrib)))]
                child.attrib[key] = str(random.choice([*NUMBERS, other.text or "", "meter"]))
            case _:
                child.text = _other_text(child.text or "", random)
    return ET.tostring(root)


def _other_text(text: str, random: np.random.Generator) -> str:
    odd = NUMBERS[int(random.integers(len(NUMBERS)))]
    numbers = list(NUMBER.finditer(text))
    if len(numbers) < 2:
        return odd
    number = numbers[int(random.integers(len(numbers)))]
    return text[: number.start()] + odd + text[number.end() :]


def of_picture(content: bytes, random: np.random.Generator) -> bytes:
    """A file with a header of text and pixels or numbers: its header as text, or its bytes."""
    end = content.find(b"\n\n") + 2
    end = content.find(b"\n", end) + 1
    if random.random() < 0.7:
        return of_text(content[:end], random) + content[end:]
    spoilt = bytearray(content)
    for _ in range(int(random.integers(1, 5))):
        spoilt[int(random.integers(end, len(spoilt)))] = int(random.choice([0, 1, 2, 128, 255]))
    return bytes(spoilt)


def of_script(content: bytes, random: np.random.Generator) -> bytes:
    """A data file of the explorer: JSON inside of one call."""
    start, stop = content.index(b"(") + 1, content.rindex(b")")
    return content[:start] + of_json(content[start:stop], random) + content[stop:]


def of_arrays(content: bytes, random: np.random.Generator) -> bytes:
    """A NumPy archive: an array gone, of another type or shape, or its record odd."""
    with np.load(io.BytesIO(content)) as data:
        arrays = {name: data[name] for name in data.files}
    name = list(arrays)[int(random.integers(len(arrays)))]
    if name == "record" and random.random() < 0.8:
        arrays[name] = np.frombuffer(of_json(arrays[name].tobytes(), random), np.uint8)
    elif random.random() < 0.3:
        del arrays[name]
    else:
        odd = ([], [[1.0]], 3, "text", [np.nan, np.inf], np.zeros((2, 3, 4)), [b"x"])
        arrays[name] = np.asarray(odd[int(random.integers(len(odd)))])
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def of_properties(content: bytes, random: np.random.Generator) -> bytes:
    """An IFC file: a value of one of its last four properties as text, or nested very deep."""
    lines = content.splitlines(keepends=True)
    places = [number for number, line in enumerate(lines) if b"IFCPROPERTYSINGLEVALUE" in line]
    number = int(random.choice(places[-4:]))
    before, text, after = lines[number].partition(b"$,")
    if random.random() < 0.02:
        after = b"IFCTEXT('" + b"[" * DEEP + b"]" * DEEP + b"'),$);\n"
    else:
        after = of_text(after, random)
    lines[number] = before + text + after
    return b"".join(lines)
