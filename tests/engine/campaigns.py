"""What the archive holds: campaigns, their recordings, and how each was made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from engine.encoders import PERFECT, Encoders
from engine.hardware import Array, Bungee, Hardware
from engine.laboratory import QUIET, Laboratory
from engine.mcap_file import Format

CAMPAIGNS_FOLDER = Path(__file__).resolve().parents[2] / "campaigns"

SMALL = Format(message_index=False)
SMALLER = Format(message_index=False, chunk_s=100.0)

# The cord hangs from 3 m above the CoG that the nominal numbers give at az = el = 0 and carries
# the antenna's weight, 137 N, there.
ABOVE_ANTENNA = Bungee(anchor=(0.07, 0.06, 3.2), stiffness=60.0, free_length=3.0 - 137.3 / 60.0)


@dataclass(frozen=True, slots=True)
class Run:
    """One recording of a campaign."""

    file: str
    trajectory: str
    wrench_hz: float = 100.0
    encoder_hz: float = 50.0
    form: Format = SMALL
    gaps: tuple[tuple[str, float, float], ...] = ()  # stream, start and end (s after its first message)
    bungee: Bungee | None = None  # one that no parameter file knows
    hung: bool = False  # on the bungee of the campaign's parameter files
    loop: str | None = None  # "open" or "closed"; None: as the campaign's controller


@dataclass(frozen=True, slots=True)
class Campaign:
    """One campaign: hardware drawn with `seed` around the nominal numbers of its parameter files."""

    name: str
    seed: int
    day: int  # of the test programme
    runs: tuple[Run, ...]
    drawn_around: tuple[str, ...] = ()  # parameter files, where they are not the nominal ones
    laboratory: Laboratory = QUIET
    encoders: Encoders = PERFECT

    @property
    def folder(self) -> Path:
        return CAMPAIGNS_FOLDER / self.name

    def hardware(self) -> Hardware:
        """Return the campaign's true hardware."""
        return Hardware.from_campaign(self.folder, seed=self.seed, files=self.drawn_around)

    def over_a_turn(self) -> Array | None:
        """Return what the encoders of this article are off by over a turn, if they do more than round."""
        return None if self.encoders == PERFECT else self.encoders.over_a_turn(self.seed)


_CALIBRATION = Run("AZPS_ATA.mcap", "AZPS_ATA", wrench_hz=50.0, encoder_hz=20.0)

# The means of 1996, and of them what the paper asked for afterwards.
_OF_1996 = ("parameters/rig.toml", "parameters/expected.toml")
_WORKSHOP = Laboratory(floor=2e-4, tilt=3e-6, joints=2e-3, motors=5e-5)
_SWITCHING = Encoders(once=(1e-4, 1e-4), twice=(5e-5, 5e-5), bit=(1e-4, 0.0), noise=(1e-4, 0.0))
_SHORT = Run("AZPS_ATA.mcap", "AZPS_SHORT", wrench_hz=20.0, encoder_hz=5.0, form=SMALLER)
_EL089 = Run("EL089P00_1.mcap", "EL089_AZ90", wrench_hz=25.0, encoder_hz=10.0, form=SMALLER)

_ALL = (
    Campaign(
        "EL089",
        seed=89,
        day=0,
        runs=(
            Run("AZPS_ATA.mcap", "AZPS_ATA", encoder_hz=100.0),
            Run("EL089P00_1.mcap", "EL089P00", encoder_hz=100.0),
            Run("EL089P00_2.mcap", "EL089P00", encoder_hz=100.0),
            Run("EL089P00_3.mcap", "EL089P00", encoder_hz=100.0),
        ),
    ),
    Campaign(
        "AZPS_ATA",
        seed=101,
        day=1,
        runs=(
            _CALIBRATION,
            Run("AZPS_ATA_1.mcap", "AZPS_ATA", wrench_hz=50.0, encoder_hz=20.0),
            Run("AZPS_ATA_2.mcap", "AZPS_ATA", wrench_hz=50.0, encoder_hz=20.0),
        ),
    ),
    Campaign(
        "AESING00",
        seed=102,
        day=2,
        runs=(
            _CALIBRATION,
            Run("AESING00_1.mcap", "AESING00"),
            Run("AESING00_2.mcap", "AESING00", gaps=(("wrench", 61.0, 61.4), ("encoder", 130.0, 130.2))),
        ),
    ),
    Campaign(
        "AESTPP00",
        seed=103,
        day=3,
        runs=(_CALIBRATION, Run("AESTPP00_1.mcap", "AESTPP00"), Run("AESTPP00_2.mcap", "AESTPP00")),
    ),
    Campaign(
        "ELSTPP00",
        seed=104,
        day=4,
        runs=(
            _CALIBRATION,
            Run("ELSTPP00_1.mcap", "ELSTPP00"),
            Run("ELSTPP00_2.mcap", "ELSTPP00", form=Format(compression="lz4", message_index=False)),
        ),
    ),
    Campaign(
        "ACQ600",
        seed=105,
        day=5,
        runs=(
            _CALIBRATION,
            Run("ACQ600_1.mcap", "ACQ600"),
            Run("ACQ600_2.mcap", "ACQ600", form=Format(message_index=False, kept=0.85)),
        ),
    ),
    Campaign(
        "AL012M00",
        seed=106,
        day=6,
        runs=(
            _CALIBRATION,
            Run("AL012M00_1.mcap", "AL012M00", bungee=ABOVE_ANTENNA),
            Run("AL012M00_2.mcap", "AL012M00", bungee=ABOVE_ANTENNA),
        ),
    ),
    Campaign(
        "ALSTPP00",
        seed=107,
        day=7,
        runs=(
            _CALIBRATION,
            Run("ALSTPP00_1.mcap", "ALSTPP00", bungee=ABOVE_ANTENNA, form=Format(encoding="json", message_index=False)),
            Run("ALSTPP00_2.mcap", "ALSTPP00", bungee=ABOVE_ANTENNA, form=Format(encoding="json", message_index=False)),
        ),
    ),
    Campaign(
        "DUMMY1",
        seed=108,
        day=8,
        runs=(
            Run("SWPAZ000_1.mcap", "SWPAZ000", encoder_hz=20.0, loop="open"),
            Run("SWPEL000_1.mcap", "SWPEL000", encoder_hz=20.0, loop="closed"),
            Run("TRKL0000_1.mcap", "TRKL0000", encoder_hz=20.0, loop="open"),
            Run("TRKL0000_2.mcap", "TRKL0000", encoder_hz=20.0, loop="closed"),
        ),
    ),
    Campaign(
        "DUMMY3",
        seed=109,
        day=9,
        runs=(
            Run("SWPEL000_1.mcap", "SWPEL000", encoder_hz=20.0, loop="open"),
            Run("TRKL0000_1.mcap", "TRKL0000", encoder_hz=20.0, loop="closed"),
        ),
    ),
    Campaign(
        "EL089_FM",
        seed=110,
        day=10,
        runs=(
            _CALIBRATION,
            Run("EL089P00_1.mcap", "EL089P00", encoder_hz=20.0),
            Run("EL089P00_2.mcap", "EL089P00", encoder_hz=20.0),
        ),
    ),
    Campaign(
        "EL089_CORD",
        seed=111,
        day=11,
        runs=(
            _CALIBRATION,
            Run("EL089P00_1.mcap", "EL089P00", wrench_hz=50.0, hung=True),
            Run("EL089P00_2.mcap", "EL089P00", wrench_hz=50.0, hung=True, loop="closed"),
        ),
    ),
    Campaign(
        "AL012_CORD",
        seed=112,
        day=12,
        runs=(
            _CALIBRATION,
            Run("AL012M00_1.mcap", "AL012M00", hung=True),
            Run("AL012M00_2.mcap", "AL012M00", hung=True),
        ),
    ),
    Campaign(
        "EL089_1996",
        seed=113,
        day=13,
        runs=(
            Run("AZPS_ATA.mcap", "AZPS_RESTS", wrench_hz=20.0, encoder_hz=5.0, form=SMALLER),
            _EL089,
            replace(_EL089, file="EL089P00_2.mcap"),
            Run("ACQ600_1.mcap", "ACQ600_FAR", wrench_hz=40.0, encoder_hz=5.0, form=SMALLER),
        ),
        drawn_around=_OF_1996,
        laboratory=_WORKSHOP,
        encoders=_SWITCHING,
    ),
    Campaign(
        "EL089_ADC",  # the article and the noise of EL089_1996
        seed=113,
        day=14,
        runs=(_SHORT, _EL089),
        drawn_around=_OF_1996,
        laboratory=_WORKSHOP,
        encoders=replace(_SWITCHING, bit=(0.0, 0.0), noise=(0.0, 0.0)),
    ),
    Campaign(
        "DUMMY_1996",
        seed=114,
        day=15,
        runs=(_SHORT, _EL089),
        drawn_around=_OF_1996,
        laboratory=_WORKSHOP,
        encoders=_SWITCHING,
    ),
    Campaign(
        "APM_1996",  # the mechanism of EL089_1996
        seed=113,
        day=16,
        runs=(_SHORT,),
        drawn_around=_OF_1996,
        laboratory=_WORKSHOP,
        encoders=_SWITCHING,
    ),
)

CAMPAIGNS = {campaign.name: campaign for campaign in _ALL}
