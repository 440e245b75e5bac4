"""The outdoors that sensors see straight through the windows' beam, in place of V_d and D."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.klems_peak import held_beams
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.phase_scene import OUTDOOR_DEPTH, PhaseScene
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.kernels.scattering import patch_beams
from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix

BATCHES = 4
HELD = 0.98  # share of a beam that T's diagonal has at the least
INNER_SHARE = 8  # rays of a sensor that glass to another room is looked for with, for each of V
SHARE = 1  # paths of a sensor for V, for each that looks straight through a group


class StraightViews:
    """What the straight beam of each group shows the sensors, in each of its states.

        B s - V_d diag(tau) D s

    is added to V T D s: patches of 10 to 15 degrees blur the sky that a sensor sees through a
    beam (11 % of a sensor's light beside a small opening), and means over a group the edges that
    not all of its points see alike, and the lobe of a glossy facade.  The three-phase method has it
    of cut groups, of glass to another room, and where there is gloss: the patches of the others
    are what it is.
    """

    def __init__(self, traced: PhaseScene, systems: Sequence[States]) -> None:
        """From the states of each window group [G]; nothing is traced yet."""
        self._traced, self._systems = traced, systems
        self._found: dict[tuple[int, int, bool], Estimate] = {}

    def beam(self, g: int, j: int) -> NDArray[np.float64]:
        """What of T's diagonal goes straight on, of a group in a state [K].

        Nothing where the diagonal holds less than the beam: the cells of a tensor tree lie across
        patches, and what of a beam T has beside the diagonal would be counted twice.
        """
        inner = g - len(self._traced.scene.outdoor_groups)
        if inner >= 0:
            return self._traced.scene.beyond[inner].beam
        optics, omega = self._systems[g][j], KLEMS_FULL.projected_solid_angles()
        through = patch_beams([optics.scattering], KLEMS_FULL)[0]
        held = np.minimum(through, np.diag(optics.transmission))
        return held if omega @ held >= HELD * (omega @ through) else np.zeros_like(held)

    def held(self, g: int, j: int) -> NDArray[np.float64]:
        """What of T goes straight on, of a group in a state [K, K]."""
        beams = patch_beams([self._systems[g][j].scattering], KLEMS_FULL)[0]
        return held_beams(self.transmission(g, j), beams, KLEMS_FULL)

    def transmission(self, g: int, j: int) -> NDArray[np.float64]:
        """T of a group in a state [K, K]."""
        return self._systems[g][j].transmission

    def matrix(self, g: int, j: int, *, direct: bool = False) -> Estimate | None:
        """B of a group in a state [S, P]; None where there is nothing of it.

        Args: direct: without what the outdoors reflects.
        """
        traced = self._traced
        if g >= len(traced.scene.outdoor_groups):
            return self._of_inner(g, direct=direct) if self.beam(g, j).any() else None
        sharp = traced.five_phase or len(traced.parts.of(g)) > 1 or traced.scene.exterior.glossy
        if not sharp or not self.beam(g, j).any():
            return None
        direct = direct and len(traced.scene.exterior.triangles) > 0  # else nothing reflects
        if (g, j, direct) not in self._found:
            scene, chosen = traced.scene, traced.sampling
            ways: list = [None] * len(scene.groups)
            ways[g] = self._systems[g][j].scattering
            found = straight_view_matrix(
                scene.interior, scene.exterior, scene.groups, ways, *scene.sensors(),
                subdivision=chosen.subdivision,
                samples=max(chosen.sensor_samples // SHARE // BATCHES, 1),
                max_depth=1 if direct else OUTDOOR_DEPTH,
                stopping=Stopping(batches=BATCHES), seed=chosen.seed, cache=traced.cache,
                scenes=traced.scenes,
            )  # fmt: skip
            self._found[g, j, direct] = found.part(np.s_[g])
        return self._found[g, j, direct]

    def _of_inner(self, g: int, *, direct: bool) -> Estimate:
        """B of a group that looks into another room [S, P]; nothing comes straight from the sky."""
        if (g, 0, False) not in self._found:
            samples = INNER_SHARE * self._traced.sampling.sensor_samples // BATCHES
            found = self._traced.borrowed_view(g, samples, Stopping(batches=BATCHES))
            self._found[g, 0, False] = found
        found = self._found[g, 0, False]
        return replace(found, values=np.zeros_like(found.values)) if direct else found

    def rest(self, g: int, j: int, q: int) -> NDArray[np.float64]:
        """What the sensors have of the luminance before a part of a group but for B [S, K].

        V T - V_d diag(tau)
        """
        found = self._traced.sensors.values[:, q] @ self.transmission(g, j)
        if self.matrix(g, j) is None:
            return found
        return found - self._traced.direct_sensors[:, q] * self.beam(g, j)
