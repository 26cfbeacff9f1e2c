"""Modal files: modes of the article on its transducer, one table a pose and one a mode."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from kbs_process.campaign.formats.tables import Magnitude, NotNegative, Positive, Some, Table, Version

Six = Annotated[list[Magnitude], Field(min_length=6, max_length=6)]


class AngleTable(Table):
    """The joint's angle of a pose."""

    value: Magnitude
    unit: Literal["rad", "deg", "mrad"]


class ModeTable(Table):
    """One mode, of unit modal mass."""

    frequency_Hz: Positive
    frequency_sigma_Hz: NotNegative = Field(0.0, description="one standard deviation")
    damping: Annotated[float, Field(gt=0.0, lt=1.0)] = Field(description="of critical")
    damping_sigma: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    shape: Six = Field(
        description="motion of the interface, unit modal mass: 3 x kg^-1/2, 3 x rad kg^-1/2 m^-1; 0 where it is rigid"
    )
    participation: Six = Field(
        description="momentum about T's origin for unit modal velocity: 3 x kg^1/2, 3 x kg^1/2 m"
    )
    gravity: Six = Field(
        [0.0] * 6, description="change of the weight's wrench as the mode tilts the article; 0 if left out"
    )


class PoseTable(Table):
    """The modes at one angle of the joint."""

    angle: AngleTable
    mode: Some[ModeTable]


class ModalFile(Table):
    """All of a modal file."""

    model_config = ConfigDict(title="Modal model of an article on its transducer")

    schema_: Version = Field(alias="schema")
    joint: str = Field(description="the joint over whose angle the modes are tabulated")
    source: str = Field(description="where the modes come from: model, revision, solution")
    pose: Some[PoseTable]
