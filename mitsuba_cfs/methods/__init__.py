"""Where matrices, systems and skies become light: the one place of the phase sums and of paths.

    scene     the room and its outdoors, without what fills the windows
    systems   of each window group its states, as each method takes them
    sky       `mitsuba_cfs.sky.annual.AnnualSky`

A method is taken in three steps, each of which costs something of its own:

    traced = traced_scene("five-phase", scene, sampling)    # once for a scene
    filled = traced.with_systems(systems)                   # once for its systems
    light = filled.light(sky)                               # illuminance, pictures, glare of hours
"""

METHODS = ("three-phase", "five-phase", "point-in-time")
METRICS = ("DGP", "eDGP", "sDGP", "illuminance")
