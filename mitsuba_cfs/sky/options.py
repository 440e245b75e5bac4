"""Options of sun and sky, and their defaults.

A module of its own, so that a command's options are known before anything heavy is imported.
"""

from __future__ import annotations

SUBDIVISIONS = (1, 2, 4, 6)  # Reinhart's MF of the sky's patches
SUN_MODELS = ("spa", "radiance", "energyplus")
GROUNDS = ("reflected", "gendaylit")  # see `mitsuba_cfs.sky.matrix`
LEAST_ALTITUDE_DEG = 3.0  # below it, global minus diffuse says nothing about the direct beam
PARTS = ("all", "sky", "sun")
SUN_PATCHES = 4  # gendaymtx spreads the sun over this many patches
LABELS = {"start": 0.0, "middle": 0.5, "end": 1.0}  # where in its interval a time stands
