"""How the Blackbox of a fenestration system is closed: what its resistance and films follow."""

from __future__ import annotations

from dataclasses import dataclass, replace

from thermal.blackbox import Fenestration, linear_u, with_realised_films
from thermal.errors import require, require_range
from thermal.glazing import Gap, gap_resistance

U_MODELS = ("constant", "linear", "gap")


@dataclass(frozen=True, slots=True)
class Closure:
    """What is known of a system besides U and g.

    constant: the resistance between the two layers is that of U at the measuring condition;
    linear: U grows with the mean temperature; gap: as the gas gap of a double glazing does.
    """

    u_model: str = "constant"  # one of U_MODELS
    gap: Gap | None = None  # for "gap"
    realised_inner_resistance: float | None = None  # [m2 K/W], see `with_realised_films`
    realised_outer_resistance: float | None = None

    def __post_init__(self) -> None:
        known = ", ".join(U_MODELS)
        require(self.u_model in U_MODELS, "u_model", f"{self.u_model!r} is not of {known}")
        fits = (self.u_model == "gap") == (self.gap is not None)
        require(fits, "u_model", '"gap" and the data of a gap belong together')
        for value in (self.realised_inner_resistance, self.realised_outer_resistance):
            if value is not None:
                require_range(value, 1e-3, 1.0, "realised resistance", "m2 K/W")

    @property
    def changes_films(self) -> bool:
        """Whether the films are not those at which U and g were measured."""
        return not (
            self.realised_inner_resistance is None and self.realised_outer_resistance is None
        )

    def close(self, plain: Fenestration) -> Fenestration:
        """The system with this closure; `plain` has the constant resistance of its U."""
        closed = plain
        if self.u_model == "linear":
            closed = replace(closed, resistance=linear_u(closed.u_value))
        if self.gap is not None:
            resistance = gap_resistance(closed.u_value, self.gap, item=closed.name)
            closed = replace(closed, resistance=resistance)
        if not self.changes_films:
            return closed
        return with_realised_films(
            closed,
            r_inner_realised=self.realised_inner_resistance,
            r_outer_realised=self.realised_outer_resistance,
        )
