"""An independent engine: synthetic recordings of a two-axis pointing mechanism on a six-component transducer.

Rigid bodies by MuJoCo; drives, controller, sensors and recorder by this package alone. It shares
no code with the package under test: the two meet only in files, and in tests that compare them.

Noise-free, to compare a plant with::

    from engine import Hardware, TRAJECTORIES, simulate
    hardware = Hardware.from_campaign("campaigns/EL089")            # nominal numbers
    hardware = Hardware.from_campaign("campaigns/EL089", seed=7)    # drawn around them
    hardware = hardware.with_values({"joint.el.drive.Ts0": 0.0, "loop": "closed"})
    result = simulate(hardware, TRAJECTORIES["EL089P00"]().until(90.0), rate_hz=100.0)
    result.t, result.wrench, result.angles, result.encoder, result.field_t, result.field

`Commands(t, position, rate)` takes any motion, one row a real-time cycle. Conventions: wrench
(n, 6) = Fx Fy Fz Tx Ty Tz that the unit exerts on the transducer, about T's origin, in the axes of
the deflected plate, after the amplifier; axes in the order az, el; SI. A run starts at rest in
static equilibrium under gravity with the field at R times the first commanded angles, and lasts
until the last command. In closed loop, the encoder angle of cycles before the first is that of the first.
"""

from engine.hardware import Bungee, Hardware
from engine.simulation import Result, simulate
from engine.trajectories import TRAJECTORIES, Commands

__all__ = ["TRAJECTORIES", "Bungee", "Commands", "Hardware", "Result", "simulate"]
