"""The names of `import bim`, and the modules that they come from."""

from .account import Account as Account
from .surroundings.placement import with_surroundings as with_surroundings
from .fenestration import ShadingState as ShadingState
from .gbxml.building import read_gbxml as read_gbxml
from .gbxml.write import write_gbxml as write_gbxml
from .honeybee.building import read_honeybee as read_honeybee
from .honeybee.write import write_honeybee as write_honeybee
from .ifc.building import read_ifc as read_ifc
from .ifc.corrections import Corrections as Corrections, read_corrections as read_corrections
from .ifc.fenestration_read import read_fenestration as read_fenestration
from .ifc.results_write import write_results as write_results
from .model import (
    Building as Building,
    Construction as Construction,
    Element as Element,
    Face as Face,
    Georeference as Georeference,
    MaterialLayer as MaterialLayer,
    Room as Room,
    Space as Space,
    Window as Window,
)
from .radiance.daylight import (
    glass_shares as glass_shares,
    opaque_surfaces as opaque_surfaces,
    scene_windows as scene_windows,
)
from .radiance.materials import RadianceMaterial as RadianceMaterial
from .radiance.scene import (
    RadianceObject as RadianceObject,
    RadianceScene as RadianceScene,
    read_radiance as read_radiance,
)
from .report.issue import (
    Effect as Effect,
    Issue as Issue,
    IssueText as IssueText,
    Phrase as Phrase,
    issue_text as issue_text,
)
from .sensors import sensor_grid as sensor_grid, view_point as view_point
from .shell import open_edges as open_edges
from .shoebox import WindowRectangle as WindowRectangle, shoebox as shoebox
from .to_energyplus import write_epjson as write_epjson
from .to_gltf import write_gltf as write_gltf
from .to_mitsuba import write_mitsuba as write_mitsuba
from .to_radiance import write_radiance as write_radiance
from .to_thermal import ThermalRoom as ThermalRoom, thermal_room as thermal_room
from .to_tracer import (
    exterior_surfaces as exterior_surfaces,
    interior_surfaces as interior_surfaces,
    window_groups as window_groups,
)
