"""Kuhn's Blackbox fenestration model in a transient room heat balance.

    import thermal

    window = thermal.WindowElement("south", 4.0, (0, -1, 0), (thermal.Fenestration("pane", 1.1),))
    zone = thermal.Zone("room", 60.0, surfaces, (window,))
    year = thermal.simulate(zone, climate, solar)

The names and their modules are in `__init__.pyi`; a name is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
