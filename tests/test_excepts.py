"""No `except` that takes faults of the program for faults of the user's files.

Broad ones (`Exception`, `BaseException`, bare) stand only in `BROAD`, each with its reason.  The
errors that our own mistakes raise (`TypeError`, `KeyError` ...) are caught only around calls of
other libraries and of builtins, where the arguments come from a file: never around a call of ours.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from tests.modules import MODULES, file_name

BROAD = {  # module and function: why
    "bim/ifc/damage.py: read": "raises again what ifcopenshell did not raise itself",
    "bim/ifc/corrections.py: chosen": "raises again what ifcopenshell did not raise itself",
    "mitsuba_cfs/files.py: replacing": "removes the half-written file and raises again",
    "mitsuba_cfs/trace/kernels/estimate.py: accumulate": "stores the batches and raises again",
    "mitsuba_cfs/processes.py: answer_apart": "ends the process and raises again",
    "mitsuba_cfs/processes.py: wait": "an error is that of the future, which raises it",
    "mitsuba_cfs/processes.py: _work": "sends the error to the parent process, which raises it",
    "scenes/cluster.py: _outcome": "an error of a worker decides which task begins again",
    "scenes/workers.py: _outcome": "sends the error to the parent process, which raises it",
    "scenes/workers.py: _collected": "an error of a task is its result, which the caller raises",
    "scenes/run/outputs.py: _faults": "writes the other files of a long run, then raises",
    "scenes/app/jobs.py: _run": "prints the fault of one command; those that wait are run",
    "scenes/cli.py: run": "one line for a user's mistake; raises everything else again",
}
TABLES = {  # constructors of plain dataclasses take the keys of a file that the program has written
    "scenes/calibration/costs.py: read",
    "scenes/calibration/errors.py: read",
}
ALL = {"Exception", "BaseException"}
MISTAKES = {"TypeError", "AttributeError", "NameError", "KeyError", "IndexError", "LookupError"}
PACKAGES = ("bim", "mitsuba_cfs", "scenes", "thermal")


def names(node: ast.expr | None) -> set[str]:
    """The exceptions of an `except` or of `suppress`; "BaseException" of a bare one."""
    if node is None:
        return {"BaseException"}
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    return {part.attr if isinstance(part, ast.Attribute) else getattr(part, "id", "") for part in parts}


def guarded(tree: ast.Module) -> Iterator[tuple[int, str, set[str], list[ast.stmt]]]:
    """Line, function, exceptions and guarded statements of each `except` and `suppress`."""

    def walk(node: ast.AST, function: str) -> Iterator[tuple[int, str, set[str], list[ast.stmt]]]:
        for child in ast.iter_child_nodes(node):
            inner = child.name if isinstance(child, ast.FunctionDef) else function
            if isinstance(child, ast.Try):
                for handler in child.handlers:
                    yield handler.lineno, inner, names(handler.type), child.body
            if isinstance(child, ast.With):
                for item in child.items:
                    call = item.context_expr
                    if isinstance(call, ast.Call) and "suppress" in ast.unparse(call.func):
                        taken = set().union(*(names(one) for one in call.args))
                        yield call.lineno, inner, taken, child.body
            yield from walk(child, inner)

    yield from walk(tree, "")


def own_names(tree: ast.Module) -> set[str]:
    """Functions and classes of ours that a module defines or imports."""
    found = {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in PACKAGES:
            found |= {alias.asname or alias.name for alias in node.names}
    return found


def own_calls(body: list[ast.stmt], own: set[str]) -> list[str]:
    """Calls of our own functions, methods of `self` among them."""
    calls = [n.func for part in body for n in ast.walk(part) if isinstance(n, ast.Call)]
    found = []
    for function in calls:
        root = function
        while isinstance(root, ast.Attribute | ast.Call | ast.Subscript):
            root = root.func if isinstance(root, ast.Call) else root.value
        name = getattr(root, "id", "")
        if name.endswith(("Error", "Fault")):
            continue  # raised on purpose
        if name in own or (name in ("self", "cls") and isinstance(function, ast.Attribute)):
            found.append(ast.unparse(function))
    return found


def faults(name: str, source: str) -> list[str]:
    tree = ast.parse(source)
    own, found = own_names(tree), []
    for line, function, taken, body in guarded(tree):
        if taken & ALL and f"{name}: {function}" not in BROAD:
            found.append(f"{name}:{line} ({function}) takes every error")
        calls = own_calls(body, own)
        if taken & MISTAKES and calls and f"{name}: {function}" not in TABLES:
            what = ", ".join(sorted(taken & MISTAKES))
            found.append(f"{name}:{line} ({function}) takes {what} of {', '.join(calls)}")
    return found


@pytest.mark.parametrize("path", MODULES, ids=file_name)
def test_no_except_hides_a_mistake_of_ours(path):
    assert not faults(file_name(path), path.read_text("utf-8"))


@pytest.mark.parametrize(
    "body",
    [
        "try:\n    x()\nexcept Exception:\n    pass",
        "try:\n    x()\nexcept:\n    pass",
        "with contextlib.suppress(Exception):\n    x()",
        "def ours(): ...\ntry:\n    ours()\nexcept (ValueError, TypeError):\n    pass",
        "from bim.names import named\nwith suppress(KeyError):\n    named(1)",
        "class A:\n    def f(self):\n        try:\n            self.g()\n        except "
        "AttributeError:\n            pass",
    ],
)
def test_a_hiding_except_is_seen(body):
    assert faults("bim/x.py", body)


def test_builtins_and_libraries_are_no_calls_of_ours():
    assert not faults("bim/x.py", "try:\n    np.asarray(float(x))\nexcept TypeError:\n    pass")


def test_every_exception_of_the_rule_is_there():
    """A reason without its `except` goes."""
    seen = set()
    for path in MODULES:
        name, tree = file_name(path), ast.parse(path.read_text("utf-8"))
        seen |= {f"{name}: {function}" for _, function, taken, _ in guarded(tree) if taken}
    assert set(BROAD) | TABLES <= seen
