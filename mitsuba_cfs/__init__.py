"""Daylight, glare and solar gains behind complex fenestration systems, traced with Mitsuba 3.

The face for people with their own geometry: triangles and arrays in, arrays out, no building.

    import mitsuba_cfs as cfs

    sky = cfs.annual_sky(cfs.read_epw("city.epw"))
    system = cfs.BsdfOptics(cfs.read_bsdf_xml("blind.xml").band("Visible"))
    scene = cfs.DaylightScene(interior, outdoors, [window_group], points, normals, view)
    light = cfs.daylight(scene, [[system]], sky)
    lux, error = cfs.illuminance_with_error(light)
    dgp = cfs.hourly_glare(light, hours=[1000]).dgp

The names and their modules are in `__init__.pyi`; a name is loaded when it is first used, and the
Mitsuba variant is chosen when something is first traced.  docs/python.md runs it all.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
