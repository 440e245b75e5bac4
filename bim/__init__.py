"""From a building model (IFC) to rooms, surfaces, windows and sensors.

    import bim

    building = bim.read_ifc("house.ifc")
    office = building.room("Office").space
    points, normals = bim.sensor_grid(office)

The names and their modules are in `__init__.pyi`; a name is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
