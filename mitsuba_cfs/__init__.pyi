"""The names of `import mitsuba_cfs`, and the modules that they come from."""

from . import variants as variants
from .bsdf.blinds import venetian_blind as venetian_blind
from .bsdf.bsdf_file import BsdfFile as BsdfFile
from .bsdf.checks import check_bsdf as check_bsdf
from .bsdf.evaluate import bsdf_values as bsdf_values, direct_hemispherical as direct_hemispherical
from .bsdf.generate import (
    GeneratedBsdf as GeneratedBsdf,
    generate_klems as generate_klems,
    generate_tensor_tree as generate_tensor_tree,
)
from .bsdf.evaluate import klems_of as klems_of
from .bsdf.glazing import Glazing as Glazing, Pane as Pane, specular_klems as specular_klems
from .bsdf.klems import KLEMS_FULL as KLEMS_FULL, KlemsBasis as KlemsBasis, KlemsBsdf as KlemsBsdf
from .bsdf.layers import LayeredSystem as LayeredSystem, combine_layers as combine_layers
from .bsdf.periodic import PeriodicLayer as PeriodicLayer, SlatMaterial as SlatMaterial
from .bsdf.plugin import klems_plugin as klems_plugin
from .bsdf.tensor_plugin import tensor_tree_plugin as tensor_tree_plugin
from .bsdf.tensor_tree import TensorTreeBsdf as TensorTreeBsdf
from .bsdf.xml import read_bsdf_xml as read_bsdf_xml
from .bsdf.xml import write_bsdf_xml as write_bsdf_xml
from .errors import CfsError as CfsError, DataError as DataError, VariantError as VariantError
from .glare.annual import AnnualGlare as AnnualGlare
from .glare.classes import glare_class as glare_class, protection_level as protection_level
from .glare.evaluation import GlareOptions as GlareOptions, GlareResult as GlareResult, evaluate as evaluate
from .gloss import (
    Gloss as Gloss,
    dielectric as dielectric,
    lacquer as lacquer,
    mirror as mirror,
    pane as pane,
    radiance_gloss as radiance_gloss,
    radiance_trans as radiance_trans,
)
from .images.hdr import Picture as Picture, read_hdr as read_hdr, write_hdr as write_hdr
from .images.view import View as View, fisheye as fisheye, parse_view as parse_view
from .matrices.cache import MatrixCache as MatrixCache
from .matrices.mtx_io import read_matrix as read_matrix, write_matrix as write_matrix
from .methods.glare import hourly_glare as hourly_glare, pictures as pictures, rated_pictures as rated_pictures
from .methods.light import (
    daylight as daylight,
    daylight_coefficients as daylight_coefficients,
    direct_sun as direct_sun,
    eye_illuminance as eye_illuminance,
    illuminance as illuminance,
    illuminance_with_error as illuminance_with_error,
    with_pictures as with_pictures,
    with_view as with_view,
)
from .methods.optics import AngularOptics as AngularOptics, BsdfOptics as BsdfOptics
from .methods.phase_light import PhaseLight as PhaseLight, phase_light as phase_light
from .methods.phase_matrices import (
    PhaseMatrices as PhaseMatrices,
    phase_matrices as phase_matrices,
    with_outdoors as with_outdoors,
)
from .methods.point_in_time import PathLight as PathLight
from .methods.scene import DaylightScene as DaylightScene, Sampling as Sampling
from .metrics.room import RoomMetrics as RoomMetrics, room_metrics as room_metrics
from .sky.annual import AnnualSky as AnnualSky, annual_sky as annual_sky, given_sky as given_sky
from .sky.cie import cie_patches as cie_patches
from .sky.epw import read_epw as read_epw
from .sky.matrix import sky_matrix as sky_matrix
from .sky.patches import ReinhartSky as ReinhartSky
from .sky.sun import sun_directions as sun_directions
from .sky.epw import read_wea as read_wea
from .sky.weather import Weather as Weather
from .surfaces import Surfaces as Surfaces, WindowGroup as WindowGroup, WindowSurface as WindowSurface
from .trace.matrices.daylight import daylight_matrix as daylight_matrix
from .trace.kernels.estimate import Estimate as Estimate, Stopping as Stopping
from .trace.matrices.view import view_matrix as view_matrix
