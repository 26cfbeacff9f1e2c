"""What sensors and clocks do to a prediction, one file each; a new one is a file and a line here."""

from __future__ import annotations

from kbs_process.plant.sensing.channel_gain import CHANNEL_GAIN
from kbs_process.plant.sensing.channel_hysteresis import CHANNEL_HYSTERESIS
from kbs_process.plant.sensing.channel_interaction import CHANNEL_INTERACTION
from kbs_process.plant.sensing.channel_lag import CHANNEL_LAG
from kbs_process.plant.sensing.channel_nonlinearity import CHANNEL_NONLINEARITY
from kbs_process.plant.sensing.channel_play import CHANNEL_PLAY
from kbs_process.plant.sensing.channel_s_shape import CHANNEL_S_SHAPE
from kbs_process.plant.sensing.channel_step import CHANNEL_STEP
from kbs_process.plant.sensing.clock_drops import CLOCK_DROPS
from kbs_process.plant.sensing.clock_offset import CLOCK_OFFSET
from kbs_process.plant.sensing.clock_skew import CLOCK_SKEW
from kbs_process.plant.sensing.clock_wander import CLOCK_WANDER
from kbs_process.plant.sensing.clock_warmup import CLOCK_WARMUP
from kbs_process.plant.sensing.cross_coupling import CROSS_COUPLING
from kbs_process.plant.sensing.drift_exponential import DRIFT_EXPONENTIAL
from kbs_process.plant.sensing.drift_linear import DRIFT_LINEAR
from kbs_process.plant.sensing.drift_temperature import DRIFT_TEMPERATURE
from kbs_process.plant.sensing.encoder_eccentricity import ENCODER_ECCENTRICITY
from kbs_process.plant.sensing.encoder_hysteresis import ENCODER_HYSTERESIS
from kbs_process.plant.sensing.encoder_interpolation import ENCODER_INTERPOLATION
from kbs_process.plant.sensing.encoder_profile import ENCODER_PROFILE
from kbs_process.plant.sensing.encoder_quantisation import ENCODER_QUANTISATION
from kbs_process.plant.sensing.encoder_step import ENCODER_STEP
from kbs_process.plant.sensing.encoder_switching import ENCODER_SWITCHING
from kbs_process.plant.sensing.mains import MAINS
from kbs_process.plant.sensing.sensing import Sensing, SensingPort

__all__ = ["SENSING", "Sensing", "SensingPort"]

SENSING: tuple[Sensing, ...] = (
    CHANNEL_GAIN,
    CROSS_COUPLING,
    CHANNEL_INTERACTION,
    CHANNEL_NONLINEARITY,
    CHANNEL_S_SHAPE,
    CHANNEL_STEP,
    CHANNEL_HYSTERESIS,
    CHANNEL_PLAY,
    CHANNEL_LAG,
    DRIFT_LINEAR,
    DRIFT_EXPONENTIAL,
    DRIFT_TEMPERATURE,
    MAINS,
    ENCODER_ECCENTRICITY,
    ENCODER_INTERPOLATION,
    ENCODER_SWITCHING,
    ENCODER_STEP,
    ENCODER_QUANTISATION,
    ENCODER_HYSTERESIS,
    ENCODER_PROFILE,
    CLOCK_OFFSET,
    CLOCK_SKEW,
    CLOCK_WARMUP,
    CLOCK_DROPS,
    CLOCK_WANDER,
)
