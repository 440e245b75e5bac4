"""The names of `import thermal`, and the modules that they come from."""

from .balance import (
    BalanceOptions as BalanceOptions,
    ZoneResult as ZoneResult,
    simulate as simulate,
    simulate_zones as simulate_zones,
)
from .blackbox import (
    Fenestration as Fenestration,
    LayerAbsorptances as LayerAbsorptances,
    layer_absorptances as layer_absorptances,
)
from .climate import (
    Climate as Climate,
    Solar as Solar,
    no_sun as no_sun,
    sky_temperature as sky_temperature,
    undisturbed_ground as undisturbed_ground,
)
from .closure import Closure as Closure
from .comfort import (
    AdaptiveComfort as AdaptiveComfort,
    adaptive_comfort as adaptive_comfort,
    operative_temperature as operative_temperature,
    pmv_ppd as pmv_ppd,
    running_mean as running_mean,
    standard_effective_temperature as standard_effective_temperature,
)
from .control import (
    by_cut_off as by_cut_off,
    by_glare as by_glare,
    by_threshold as by_threshold,
    by_schedule as by_schedule,
    switched as switched,
)
from .errors import ThermalInputError as ThermalInputError
from .glazing import Gap as Gap, en410_g_value as en410_g_value, en673_u_value as en673_u_value
from .glazing_unit import (
    GasGap as GasGap,
    GlazingLayer as GlazingLayer,
    GlazingUnit as GlazingUnit,
    Openings as Openings,
)
from .ground import (
    Footprint as Footprint,
    GroundElement as GroundElement,
    Soil as Soil,
    basement as basement,
    slab_on_ground as slab_on_ground,
    suspended_floor as suspended_floor,
)
from .gvalue import ThermalData as ThermalData, thermal_data as thermal_data
from .iso15099 import Iso15099Data as Iso15099Data, iso15099_data as iso15099_data
from .emitters import HeatedSlab as HeatedSlab, IdealLoads as IdealLoads
from .moisture import Humidity as Humidity, MoistZone as MoistZone, zone_humidity as zone_humidity
from .ventilation import (
    AirTransfer as AirTransfer,
    Leakage as Leakage,
    SupplyAir as SupplyAir,
    WindowAiring as WindowAiring,
)
from .zone import (
    Gains as Gains,
    Layer as Layer,
    OpaqueSurface as OpaqueSurface,
    WindowElement as WindowElement,
    Zone as Zone,
    work_hours as work_hours,
)
