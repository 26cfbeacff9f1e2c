"""What an accelerometer or a gyro on a link reads of the rig's motion."""

from __future__ import annotations

from kbs_process.plant.rigid import LinkMotion, accel_at
from kbs_process.rig.model import Inertial
from kbs_process.signals.frames import from_rotation_vector, rotate
from kbs_process.signals.records import Array


def reading(link: LinkMotion, instrument: Inertial) -> Array:
    r"""Return readings (n, 3) in the instrument's own axes: of a gyro without a position, else of an accelerometer.

    Equation: $f = R^T (a - g + \alpha \times d + \omega \times (\omega \times d))$ and $w = R^T \omega$ with $R$ the
        instrument's attitude, $d$ its place from the link's origin, and $a$, $\alpha$, $\omega$ the link's motion.
    Units: m/s^2, rad/s.
    Validity: rigid links; the transducer's plate does not yield, which moves all of them near its resonance.
    """
    turned = link.R @ from_rotation_vector(instrument.attitude.value)
    place = instrument.position
    moving = link.omega if place is None else accel_at(link, rotate(link.R, place.value))
    return rotate(turned.swapaxes(1, 2), moving)
