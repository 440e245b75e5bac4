"""The option `--quick` of the commands that trace, and which options the user gave beside it."""

from __future__ import annotations

import click
from click.core import ParameterSource

quick_option = click.option(
    "--quick", is_flag=True, help="Fast preview: few rays, coarse sensor grid, one small picture."
)


def given() -> set[str]:
    """Names of the parameters of the command under way that do not have their default."""
    context = click.get_current_context()
    return {
        name
        for name in context.params
        if context.get_parameter_source(name) not in (ParameterSource.DEFAULT, None)
    }
