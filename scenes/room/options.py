"""What the user may choose about a room; every default is stated here."""

from __future__ import annotations

from dataclasses import dataclass

from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.methods.sampling import Sampling


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomOptions:
    """How a room is computed."""

    method: str = "five-phase"  # one of METHODS
    picture_hours: tuple[str, ...] = ()  # "MM-DD HH"; none: see `scenes.room.glare.default_hours`
    picture_count: int = 10  # at most, where no hours are asked for
    picture_size: int = 600  # pixels of a side of the fisheye picture
    picture_samples: int = 8  # paths for each pixel; 4 x 4 of them share what is reflected
    sky_subdivision: int = 4  # Reinhart's MF
    sensor_spacing: float = 0.5  # [m]
    sensor_height: float = 0.8  # above the floor [m]
    sensor_margin: float = 0.5  # from the walls [m]
    sensor_samples: int = 32_768  # paths for each sensor
    patch_samples: int = 16_384  # paths for each window patch
    sun_points: int = 1024  # places on each window group that the direct sun is taken at
    annual_glare: bool = False  # rate every lit hour, not only the pictures
    path_samples: int = 2_048  # point-in-time: paths for each sensor and hour
    heat_step_s: float = 600.0  # of the heat balance; a whole fraction of an hour
    infiltration_ach: float = 0.5  # [1/h]
    equipment_w_m2: float = 8.0  # while occupied, half of it radiant
    person_w: float = 75.0  # sensible heat of a person
    floor_per_person: float = 15.0  # [m2]
    occupied: tuple[int, int] = (8, 18)  # clock hours, every day
    seed: int = 0

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method: expected one of {METHODS}, got {self.method!r}")
        if self.annual_glare and self.method == "point-in-time":
            raise ValueError("annual glare needs the three-phase or the five-phase method")

    @property
    def sampling(self) -> Sampling:
        """How finely the light is computed."""
        return Sampling(
            sensor_samples=self.sensor_samples,
            patch_samples=self.patch_samples,
            sun_points=self.sun_points,
            view_samples=self.picture_samples,
            picture_samples=2 * self.picture_samples,  # nothing is averaged over hours there
            hour_samples=self.path_samples,
            subdivision=self.sky_subdivision,
            seed=self.seed,
        )
