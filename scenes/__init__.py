"""From files to the year of a room: the face for scripts, the command line, studies and reports.

    import scenes as cfs

    room = cfs.read_building("house.ifc").room("Office")
    year = cfs.simulate(room, cfs.read_system("blind.xml"), cfs.read_weather("city.epw"))
    year.daylight.sda, year.glare.worst, year.heat.operative_c
    year.write("results")

The names and their modules are in `__init__.pyi`; a name is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
