"""What `--quick` chooses where the user does not: every number of a first look is stated here."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from scenes.language.catalogue import N_

NOTE = N_(
    "Quick run: few rays, few sensors, small pictures. This is a preview; run without --quick for reliable results."
)

ROOM = {  # by the names of `scenes.room.options.NAMES`: `cfs run` and `cfs study`
    "picture_count": 1,
    "picture_size": 200,
    "picture_samples": 2,
    "sky_subdivision": 2,
    "sensor_spacing": 1.0,
    "sensor_samples": 2_048,
    "patch_samples": 1_024,
    "sun_points": 128,
    "path_samples": 128,
    "heat_step_s": 3600.0,
}
VIEWS = {"size": 200, "samples": 8, "worst": 1}  # of `scenes.year_of_glare.options.YearOptions`
# of `[trace]` in `cfs thermal`: what its light takes of a room's
HEAT = {
    name: ROOM[name]
    for name in (
        "picture_size",
        "picture_samples",
        "sensor_spacing",
        "sensor_samples",
        "patch_samples",
        "sun_points",
        "path_samples",
    )
}
PV = {"samples": 512}  # of `scenes.photovoltaics.study.run_pv`


def picks(table: Mapping[str, object], stated: Collection[str]) -> dict[str, Any]:
    """The choices of a table for options that the user did not state."""
    return {name: value for name, value in table.items() if name not in stated}
