"""The same file read twice is the same model, whatever order the mesher's threads finish in."""

from __future__ import annotations

import pytest

from bim.ifc import shapes
from bim.ifc.shapes import read_shapes
from scenes.demo.make_facade import facade


@pytest.fixture(scope="module")
def model():
    """221 products of which no two need the same time."""
    return facade()


def test_shapes_come_in_the_order_of_the_file(model):
    found, _ = read_shapes(model)
    order = [product.id() for product in model.by_type("IfcProduct")]
    assert len(found) > 200
    assert list(found) == [step_id for step_id in order if step_id in found]


def test_an_iterator_that_goes_backwards_changes_nothing(model, monkeypatch):
    first, _ = read_shapes(model)
    iterator = shapes.ifcopenshell.geom.iterator

    class Backwards:
        """Gives what another iterator gives, the last first."""

        def __init__(self, *args, **options):
            self._inner = iterator(*args, **options)
            self._found = []

        def initialize(self):
            more = self._inner.initialize()
            while more:
                self._found.append(self._inner.get())
                more = self._inner.next()
            return bool(self._found)

        def get(self):
            return self._found[-1]

        def next(self):
            self._found.pop()
            return bool(self._found)

        def progress(self):
            return 0

    monkeypatch.setattr(shapes.ifcopenshell.geom, "iterator", Backwards)
    again, _ = read_shapes(model)
    assert list(again) == list(first)
