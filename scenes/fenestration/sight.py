"""What one sees through a window's system: how much goes straight on, and how much is haze."""

from __future__ import annotations

from dataclasses import dataclass

from mitsuba_cfs.bsdf.evaluate import through_peak
from scenes.fenestration.systems import FenestrationSystem

MOST_HAZE = 0.5  # share of the light passed that may be scattered in what counts as a view


@dataclass(frozen=True, slots=True)
class SightThrough:
    """Light of normal incidence through a system."""

    transmittance: float  # all that passes
    straight: float  # what goes straight on

    @property
    def haze(self) -> float:
        """Share of what passes that is scattered, 0 to 1; 1 where nothing passes."""
        if self.transmittance <= 0:
            return 1.0
        return max(1.0 - self.straight / self.transmittance, 0.0)

    @property
    def is_view(self) -> bool:
        """Whether one sees through: at least half of what passes goes straight on."""
        return self.haze <= MOST_HAZE


def sight_through(system: FenestrationSystem) -> SightThrough:
    """Visible transmittance at normal incidence: total, and specular alone."""
    klems = system.visible
    block = klems.transmission_matrix() / klems.basis_in.projected_solid_angles()
    straight = through_peak(block, klems.basis_in, klems.see_through).transmittance[0]
    return SightThrough(float(klems.direct_hemispherical(block)[0]), float(straight))
