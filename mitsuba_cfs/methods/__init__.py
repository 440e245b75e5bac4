"""Daylight of a scene by the three-phase method, the five-phase method, or path tracing.

The only place where matrices, system optics and skies become illuminance, luminance and glare:

    scene     `DaylightScene`: room and outdoors, without what fills the windows
    systems   of each window group its states, each a `SystemOptics`
    sky       `mitsuba_cfs.sky.annual.AnnualSky`

    light = daylight(scene, systems, sky, method="five-phase", sampling=Sampling())
    lux, error = illuminance_with_error(light)          # [S, L] [lx], relative error [S]
    dgp = hourly_glare(light, "DGP", hours=[10]).dgp    # [n]

By phase methods `daylight` is `phase_matrices`, once for a scene, and `phase_light`, once for its
systems and sky.  All are frozen data; another eye or other outdoors are new data that share what
stays the same.
"""

from mitsuba_cfs.errors import CfsError

METHODS = ("three-phase", "five-phase", "point-in-time")
METRICS = ("DGP", "eDGP", "sDGP", "illuminance")


class UnknownMethodError(CfsError, ValueError):
    """A method or metric that does not exist."""
