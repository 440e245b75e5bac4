"""The names of `import scenes`, and the modules that they come from."""

from .design.design import DesignResult as DesignResult, run_design as run_design
from .design.each import run_each as run_each
from .design.design_file import Design as Design, read_design as read_design
from .fit.fit import FitResult as FitResult, run_fit as run_fit
from .fit.fit_file import Fit as Fit, read_fit as read_fit
from .input_files import read_building as read_building
from .fenestration.systems import FenestrationSystem as FenestrationSystem, read_system as read_system
from .fenestration.tilts import tilt_states as tilt_states
from .input_files import read_weather as read_weather
from .room.control_hour import ControlHour as ControlHour
from .room.operation import Operation as Operation, read_operation as read_operation
from .room.options import RoomOptions as RoomOptions
from .results import (
    DaylightResult as DaylightResult,
    GlareResults as GlareResults,
    LuminancePicture as LuminancePicture,
    OperationResult as OperationResult,
    RoomYear as RoomYear,
    ShadingYear as ShadingYear,
    ThermalResult as ThermalResult,
)
from .comply.comply import check_building as check_building
from .comply.options import ComplyOptions as ComplyOptions
from .comply.results import Compliance as Compliance
from .simulation import SimulatedYear as SimulatedYear, simulate as simulate
from .study.store import CaseResult as CaseResult
from .study.study import StudyResult as StudyResult, run_study as run_study
from .study.study_file import Study as Study, read_study as read_study
