"""Parameter files: the rig's numbers, each with value, unit, sigma and source."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import ConfigDict, Field

from kbs_process.campaign.formats.kind import CHANNELWISE, PAIRWISE, Kind
from kbs_process.campaign.formats.tables import LinkName, Magnitude, QuantityTable, SomeDistinct, Table
from kbs_process.rig.model import JointType

Lengths = Annotated[QuantityTable, Kind("m", (3,))]
Angles = Annotated[QuantityTable, Kind("rad", (3,))]


class SpreadTable(Table):
    """A table whose keys may be spread over several parameter files."""

    spread: ClassVar[bool] = True


class GravityTable(SpreadTable):
    """Weight at the place of the test."""

    magnitude: Annotated[QuantityTable, Kind("m/s^2", low=0.0, high=100.0)] = Field(description="0 in flight")


class AmplifierTable(Table):
    """The transducer's low-pass before sampling: Butterworth."""

    order: Annotated[int, Field(ge=1, le=8)]
    corner: Annotated[QuantityTable, Kind("Hz", low=0.0, strict=True)] = Field(
        description="Butterworth low-pass before sampling"
    )


class TransducerTable(SpreadTable):
    """The force/torque transducer that carries the article, or that a link carries."""

    together: ClassVar[tuple[str, ...]] = ("stiffness", "damping")

    on: str = Field(description='"lab" or the joint whose link carries the transducer')
    channels: SomeDistinct[Literal["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]] = Field(description="channels recorded")
    tilt: Annotated[QuantityTable, Kind("rad", (2,))] = Field(description="inclination about x and y")
    stiffness: Annotated[QuantityTable | None, Kind("N m/rad", (3,), low=0.0, strict=True)] = Field(
        None, description="about x, y, z; left out: rigid"
    )
    damping: Annotated[QuantityTable | None, Kind("N m s/rad", (3,), low=0.0)] = Field(
        None, description="about x, y, z; only with stiffness"
    )
    cross_coupling: Annotated[QuantityTable, Kind(PAIRWISE, (6, 6))] = Field(
        description="raw = (I + this) wrench; row: channel that reads"
    )
    bias: Annotated[QuantityTable, Kind(CHANNELWISE, (6,))]
    noise: Annotated[QuantityTable, Kind(CHANNELWISE, (6,), low=0.0, high=1e6)] = Field(description="rms of a sample")
    resolution: Annotated[QuantityTable, Kind(CHANNELWISE, (6,), low=0.0, high=1e6)] = Field(description="of a sample")
    amplifier: AmplifierTable | None = None


class ControllerTable(SpreadTable):
    """The pointing controller."""

    cycle: Annotated[QuantityTable, Kind("s", low=1e-5, high=100.0)] = Field(description="real-time cycle")
    loop: Literal["open", "closed"]
    Kp: Annotated[QuantityTable, Kind("1", each_joint=True)]
    Ki: Annotated[QuantityTable, Kind("1/s", each_joint=True)]
    latency: Annotated[int, Field(ge=0, le=1_000_000)] = Field(description="of the encoder in the loop, cycles")
    acceleration: Annotated[QuantityTable | None, Kind("rad/s^2", each_joint=True, low=0.0, strict=True)] = None
    lowest: Annotated[QuantityTable | None, Kind("rad", each_joint=True)] = None
    highest: Annotated[QuantityTable | None, Kind("rad", each_joint=True)] = None


class SpacecraftTable(SpreadTable):
    """Where the wrench is referred to."""

    position: Lengths = Field(description="centre of mass from T's origin, in T")
    attitude: Angles = Field(description="rotation vector that turns T's axes into S's")


class BodyTable(SpreadTable):
    """A rigid body."""

    on: str = Field(description='link that carries the body: "lab", "T" or a joint')
    mass: Annotated[QuantityTable, Kind("kg", low=0.0)]
    cog: Lengths = Field(description="from the link's origin, in the link's axes")
    inertia: Annotated[QuantityTable, Kind("kg m^2", (6,))] = Field(
        description="xx, yy, zz, xy, xz, yz of the tensor about the CoG"
    )


class EffortTable(Table):
    """What the joint's drive puts in, as recorded: reading = effort / gain + bias + noise.

    It goes with drive = "motion" only.
    """

    gain: QuantityTable = Field(
        description='unit "1": recorded as torque or force; "N m/A", "N m/V" ("N/A", "N/V" of a prismatic joint): as '
        "current or voltage"
    )
    bias: QuantityTable = Field(description="of the reading; with sigma 0 no zero of it is estimated")
    noise: QuantityTable = Field(description="rms of a sample")
    resolution: QuantityTable = Field(description="of a sample")


class EncoderTable(Table):
    """The encoder of a joint; its unit is m of a prismatic one."""

    step: Annotated[QuantityTable, Kind("rad", low=0.0, high=1.0, of_joint=True)] = Field(
        description="one code; 0 is unquantised"
    )
    offset: Annotated[QuantityTable, Kind("rad", of_joint=True)]


class DriveTable(SpreadTable):
    """Motor and gear of a joint."""

    ratio: Annotated[QuantityTable, Kind("1", low=0.0, strict=True)] = Field(
        description="motor turns in an output turn"
    )
    # The rotor of a direct drive is part of the body that it moves.
    rotor_inertia: Annotated[QuantityTable, Kind("kg m^2", low=0.0)]
    steps_per_turn: Annotated[QuantityTable, Kind("1", low=0.0, strict=True)] = Field(
        description="microsteps of the field in a motor turn"
    )
    parameters: dict[str, QuantityTable] = Field({}, description="what the effects of the model ask for, by name")


class JointTable(SpreadTable):
    """A joint and the link that it moves."""

    parent: str = Field(description='link that carries the joint: "lab", "T" or another joint')
    axis: Annotated[list[Magnitude], Field(min_length=3, max_length=3)] = Field(
        description="direction of positive turning, right-handed, or of positive sliding, in the parent's axes"
    )
    type: JointType = Field(
        "revolute",
        description="does the joint turn its link (default) or slide it? A prismatic joint's angles are ways, in units "
        "of length",
    )
    viscous: Annotated[QuantityTable | None, Kind("N m s/rad", low=0.0, of_joint=True)] = Field(
        None, description='viscous friction, N s/m of a prismatic joint; only with drive = "motion"'
    )
    effort: EffortTable | None = None
    origin: Lengths = Field(description="of the joint's link, in the parent's axes")
    misalignment: Angles = Field(description="small rotation of the axis")
    encoder: EncoderTable | None = None
    drive: DriveTable | None = None


class ExternalTable(SpreadTable):
    """One effect of the laboratory on the rig."""

    on: str = Field(description='link that a force acts on; "lab" for what moves the floor, "T" for its mounting')
    point: Annotated[QuantityTable | None, Kind("m", (3,))] = Field(
        None, description="where a force acts, in the link's axes"
    )
    parameters: dict[str, QuantityTable] = Field({}, description="what the effect asks for, by name")


class InertialTable(SpreadTable):
    """Where an instrument of three axes is, and how it is turned."""

    on: str = Field(description='link that carries it: "lab", "T" or a joint')
    attitude: Angles = Field(description="rotation vector that turns the link's axes into the instrument's")
    noise: QuantityTable = Field(description="rms of a sample")


class GyroTable(InertialTable):
    """A gyro: reads the link's rate in its own axes."""

    noise: Annotated[QuantityTable, Kind("rad/s", low=0.0)] = Field(description="rms of a sample")


class AccelerometerTable(InertialTable):
    """An accelerometer: reads its acceleration less gravity's in its own axes, g upwards at rest."""

    position: Lengths = Field(description="from the link's origin, in the link's axes")
    noise: Annotated[QuantityTable, Kind("m/s^2", low=0.0)] = Field(description="rms of a sample")


class ParameterFile(SpreadTable):
    """A campaign may spread these tables over several files. Together they give all that is not optional."""

    model_config = ConfigDict(title="parameter file: the rig's numbers, each with value, unit, sigma and source")

    gravity: GravityTable
    transducer: TransducerTable | None = None
    controller: ControllerTable | None = None
    spacecraft: SpacecraftTable | None = None
    accelerometer: AccelerometerTable | None = None
    gyro: GyroTable | None = None
    body: dict[LinkName, BodyTable] = Field({})
    joint: Annotated[dict[LinkName, JointTable], Field(min_length=1)]
    external: dict[LinkName, ExternalTable] = Field(
        {}, description="what the laboratory does to the rig besides carrying it, by the name of the plant's effect"
    )
