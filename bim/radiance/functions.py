"""Radiance's function language (`.cal` files): definitions and expressions as functions of arrays.

Read are constants, variables and functions of numbers, the operators + - * / ^, the built-in
functions, and those of `rayinit.cal` that need neither recursion nor noise.

Source: `calcomp(1)` of Radiance; `rayinit.cal`; "The RADIANCE 5.1 Synthetic Imaging System", 2.2.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

Values = NDArray[np.float64]
DEEPEST = 64  # functions that call each other
TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([A-Za-z_][\w.]*)|(.))")
CONSTANTS = {"PI": np.pi, "DEGREE": np.pi / 180, "FTINY": 1e-7, "FHUGE": 1e10}
BUILT_IN: dict[str, Callable[..., Values]] = {
    "if": lambda a, b, c: np.where(a > 0, b, c),
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "exp": np.exp,
    "log": np.log,
    "log10": np.log10,
    "floor": np.floor,
    "ceil": np.ceil,
    "abs": np.abs,
    "sgn": np.sign,
    "sq": lambda a: a * a,
    "min": np.minimum,
    "max": np.maximum,
    "bound": lambda a, b, c: np.clip(b, a, c),
    "mod": lambda n, d: n - np.floor(n / d) * d,
    "frac": lambda a: a - np.floor(a),
    "and": lambda a, b: np.where(a > 0, b, a),
    "or": lambda a, b: np.where(a > 0, a, b),
    "not": lambda a: np.where(a > 0, -1.0, 1.0),
    "Atan2": lambda a, b: np.degrees(np.arctan2(a, b)),
    "Sin": lambda a: np.sin(np.radians(a)),
    "Cos": lambda a: np.cos(np.radians(a)),
    "Tan": lambda a: np.tan(np.radians(a)),
}


@dataclass(frozen=True, slots=True)
class _Number:
    value: float


@dataclass(frozen=True, slots=True)
class _Call:
    name: str
    arguments: tuple[_Node, ...] | None  # None: a variable


@dataclass(frozen=True, slots=True)
class _Sum:
    operator: str
    left: _Node
    right: _Node


_Node = _Number | _Call | _Sum


@dataclass(frozen=True, slots=True)
class FunctionFile:
    """Definitions of a function file: parameters and body of each name."""

    definitions: Mapping[str, tuple[tuple[str, ...], _Node]]

    def value(self, expression: str, variables: Mapping[str, Values | float], numbers: Sequence[float]) -> Values:
        """Value [..] of an expression.

        Args: variables: of the ray by name (Rdot, Px, ...); numbers: of the primitive, A1 on.

        Raises: `ValueError` for a name that is not known, or an expression that cannot be read.
        """
        known = CONSTANTS | {f"A{i}": a for i, a in enumerate(numbers, 1)} | dict(variables)
        with np.errstate(all="ignore"):
            return _Evaluation(self.definitions, known, numbers).value(_Parser(expression).whole(), {}, 0)


@dataclass(frozen=True, slots=True)
class _Evaluation:
    definitions: Mapping[str, tuple[tuple[str, ...], _Node]]
    known: Mapping[str, Values | float]
    numbers: Sequence[float]

    def value(self, node: _Node, parameters: Mapping[str, Values], depth: int) -> Values:
        """Value [..] of a node, in a function of these parameters."""
        if depth > DEEPEST:
            raise ValueError("recursive functions are not read")
        if isinstance(node, _Number):
            return np.asarray(node.value)
        if isinstance(node, _Sum):
            a, b = (self.value(each, parameters, depth) for each in (node.left, node.right))
            return _calculated(node.operator, a, b)
        if node.arguments is None:
            return self._variable(node.name, parameters, depth)
        values = [self.value(each, parameters, depth) for each in node.arguments]
        if node.name in self.definitions:
            names, body = self.definitions[node.name]
            if len(names) != len(values):
                raise ValueError(f"{node.name} takes {len(names)} arguments")
            return self.value(body, dict(zip(names, values, strict=True)), depth + 1)
        if node.name == "arg":
            number = int(np.rint(values[0]).max())
            if not 0 <= number <= len(self.numbers):
                raise ValueError(f"arg({number}): there are {len(self.numbers)} numbers")
            return np.asarray(self.numbers[number - 1] if number else float(len(self.numbers)))
        if node.name == "select" and len(values) > 1:
            at = np.clip(np.rint(values[0]).astype(int) - 1, 0, len(values) - 2)
            return np.asarray(np.choose(at, values[1:]))
        if node.name not in BUILT_IN:
            raise ValueError(f"function {node.name} is not known")
        try:
            return np.asarray(BUILT_IN[node.name](*values))
        except TypeError:
            raise ValueError(f"{node.name} does not take {len(values)} arguments") from None

    def _variable(self, name: str, parameters: Mapping[str, Values], depth: int) -> Values:
        if name in parameters:
            return parameters[name]
        names, body = self.definitions.get(name, ((), None))
        if body is not None and not names:
            return self.value(body, {}, depth + 1)
        if name not in self.known:
            raise ValueError(f"{name} is not known")
        return np.asarray(self.known[name], dtype=float)


def read_functions(path: Path) -> FunctionFile:
    """The definitions of a function file.

    Raises: `DataError` for a file that cannot be read.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    try:
        return parsed_functions(text)
    except ValueError as error:
        raise DataError(f"is no function file: {error}", file=path) from None


def parsed_functions(text: str) -> FunctionFile:
    """The definitions of a function file's text.

    Raises: `ValueError` for text that is none.
    """
    without = text
    while (shorter := re.sub(r"\{[^{}]*\}", " ", without)) != without:
        without = shorter
    definitions: dict[str, tuple[tuple[str, ...], _Node]] = {}
    for statement in filter(None, map(str.strip, without.split(";"))):
        match = re.fullmatch(r"([A-Za-z_][\w.]*)\s*(?:\(([^()]*)\))?\s*[:=](.*)", statement, re.S)
        if match is None:
            raise ValueError(f"expected a definition, got {statement[:40]!r}")
        name, parameters, body = match.groups()
        names = tuple(map(str.strip, parameters.split(","))) if parameters else ()
        definitions[name] = (names, _Parser(body).whole())
    return FunctionFile(definitions)


def find_functions(name: str, scene_file: Path) -> Path | None:
    """The file that a primitive names as its functions; None where there is none.

    Radiance looks in the working directory and in RAYPATH. A scene that has been moved names
    folders that are not there: the folders of the scene file and above it are searched for
    ever shorter ends of the name.
    """
    stated = Path(name)
    folders = [Path(), *map(Path, filter(None, os.environ.get("RAYPATH", "").split(os.pathsep)))]
    around = [scene_file.parent, *list(scene_file.resolve().parents)[1:3]]
    parts = [part for part in stated.parts if part not in (".", stated.anchor)]
    ends = [Path(*parts[i:]) for i in range(len(parts))]
    candidates = [folder / stated for folder in folders]
    candidates += [folder / end for end in ends for folder in around]
    return next((path for path in candidates if path.is_file()), None)


def _calculated(operator: str, a: Values, b: Values) -> Values:
    if operator == "+":
        return a + b
    if operator == "-":
        return a - b
    if operator == "*":
        return a * b
    return np.asarray(np.divide(a, b) if operator == "/" else np.power(a, b))


class _Parser:
    """Recursive descent over one expression; - binds more closely than ^, as in `calexpr.c`."""

    def __init__(self, text: str) -> None:
        self.tokens = [m.groups() for m in TOKEN.finditer(text) if m.group().strip()]
        self.text, self.at = text.strip(), 0

    def whole(self) -> _Node:
        node = self._sum()
        if self.at < len(self.tokens):
            raise ValueError(f"cannot be read: {self.text[:60]!r}")
        return node

    def _sign(self) -> str | None:
        return self.tokens[self.at][2] if self.at < len(self.tokens) else None

    def _accept(self, *signs: str) -> str | None:
        sign = self._sign()
        if sign in signs and sign is not None:
            self.at += 1
            return sign
        return None

    def _sum(self) -> _Node:
        node = self._product()
        while sign := self._accept("+", "-"):
            node = _Sum(sign, node, self._product())
        return node

    def _product(self) -> _Node:
        node = self._power()
        while sign := self._accept("*", "/"):
            node = _Sum(sign, node, self._power())
        return node

    def _power(self) -> _Node:
        node = self._signed()
        return _Sum("^", node, self._power()) if self._accept("^") else node

    def _signed(self) -> _Node:
        if self._accept("-"):
            return _Sum("-", _Number(0.0), self._single())
        self._accept("+")
        return self._single()

    def _single(self) -> _Node:
        if self._accept("("):
            node = self._sum()
            self._expect(")")
            return node
        if self.at >= len(self.tokens):
            raise ValueError(f"ends too early: {self.text[:60]!r}")
        number, name, _ = self.tokens[self.at]
        self.at += 1
        if number is not None:
            return _Number(float(number))
        if name is None:
            raise ValueError(f"cannot be read: {self.text[:60]!r}")
        if not self._accept("("):
            return _Call(name, None)
        arguments = [self._sum()]
        while self._accept(","):
            arguments.append(self._sum())
        self._expect(")")
        return _Call(name, tuple(arguments))

    def _expect(self, sign: str) -> None:
        if not self._accept(sign):
            raise ValueError(f"{sign} is missing: {self.text[:60]!r}")
