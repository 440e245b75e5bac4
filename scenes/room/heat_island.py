"""The air of a street as an operation file or a study states it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.heat_island import in_city
from mitsuba_cfs.sky.weather import Weather
from scenes.toml_file import Share, TomlTable


class HeatIslandTable(TomlTable):
    """The street that the outdoor air is in, as of `mitsuba_cfs.sky.heat_island`."""

    sky_view: Share
    vegetation: Share
    hourly_shares: Annotated[tuple[Share, ...], Field(min_length=24, max_length=24)]

    def warmed(self, weather: Weather, file: Path | None) -> Weather:
        """The weather with the air of the street; its notes say by how much.

        Args: file: that states the table.

        Raises: `DataError` out of the range of the equation.
        """
        try:
            return in_city(weather, self.sky_view, self.vegetation, self.hourly_shares)
        except ValueError as error:
            raise DataError(str(error), file=file, field="heat_island") from error
