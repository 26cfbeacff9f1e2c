"""What encoders show beside offset and rounding: an error over a turn, and a converter that switches to and fro."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.hardware import Array
from engine.ports import EncoderChange

CODE = 2 * np.pi / 2**14  # rad


@dataclass(frozen=True, slots=True)
class Encoders:
    """How far the encoders of one article are off, az and el, rad. The default is not at all.

    A converter's greatest bit of 6 switches every 32 codes, and so at every quarter of a turn; there its noise decides.
    """

    once: tuple[float, float] = (0.0, 0.0)  # one sigma of the sine and of the cosine of an error once a turn
    twice: tuple[float, float] = (0.0, 0.0)  # the same, twice a turn
    bit: tuple[float, float] = (0.0, 0.0)  # half the error of the greatest bit's weight
    noise: tuple[float, float] = (0.0, 0.0)  # of the converter, before it rounds: rms of a reading

    def over_a_turn(self, seed: int) -> Array:
        """Draw the errors of an article: (4, 2), sine and cosine once a turn, then twice."""
        sigma = np.array([self.once, self.once, self.twice, self.twice])
        return np.asarray(sigma * np.random.default_rng([seed, 1]).standard_normal((4, 2)))

    def change(self, drawn: Array, rng: np.random.Generator) -> EncoderChange:
        """Return what one reader of the encoders sees of it: `rng` gives the converters' noise, reading by reading."""
        bit, noise = np.array(self.bit), np.array(self.noise)

        def shown(t: Array, angles: Array, rates: Array) -> Array:
            turn = np.stack([np.sin(angles), np.cos(angles), np.sin(2 * angles), np.cos(2 * angles)])
            error = np.einsum("kns,ks->ns", turn, drawn) + noise * rng.standard_normal(angles.shape)
            return np.asarray(error + bit * np.sign(np.sin(2 * np.pi * (angles + error) / (64 * CODE))))

        return shown


PERFECT = Encoders()
