"""Options of the commands that make a BSDF."""

from __future__ import annotations

import click
import numpy as np


class Number(click.FloatRange):
    """A finite number within bounds."""

    def convert(self, value, param, ctx) -> float:
        """The number; a usage error where it is none."""
        number = super().convert(value, param, ctx)
        if not np.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return number


basis_option = click.option(
    "--basis", type=click.Choice(["full", "half", "quarter"]), default="full", show_default=True,
    help="Klems basis.",
)  # fmt: skip
tensor_tree_option = click.option(
    "--tensor-tree",
    type=click.IntRange(1, 6),
    help="Write a tensor tree of 4^N cells per hemisphere instead.",
)
cull_option = click.option(
    "--cull", type=Number(0, 1, max_open=True), default=0.9,
    help="Fraction of the tensor tree's cells to merge.",
)  # fmt: skip
