"""How often sound samples are called bad, and bad ones are found, on drawn recordings of six channels.

    cd tests && python -m benchmarks.bad_samples [RECORDINGS]

A kind of signal and a rate are drawn in turn; sizes are drawn from the seed, which is the recording's number. Printed
is for each kind and rate: of how many sound recordings some sample was called a spike, a lost stretch, a blow or a
step, or the stream a mixture; then how many of single bad samples were found, by how far they are off in sigma of the
noise, and how many of these were kept as blows. A zero and a full-scale reading are as far off as the signal is.
"""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from collections.abc import Callable

import numpy as np

from kbs_process.signals.records import Array
from kbs_process.stages.align.spikes import Spikes

CHANNELS = 6
LEVEL, NOISE = 50.0, 0.02  # N, of a channel
FULL_SCALE = 200.0
RATES = (5.0, 20.0, 100.0, 1000.0)
SAMPLES = {5.0: 1500, 20.0: 3000, 100.0: 6000, 1000.0: 10_000}
SIGMAS = (5.0, 10.0, 20.0, 50.0, 100.0)
Draw = Callable[[Array, np.random.Generator], Array]


def slow(t: Array, rng: np.random.Generator) -> Array:
    """What gravity does as the article turns, from channel to channel otherwise, about a level."""
    w = 2.0 * np.pi / rng.uniform(20.0, 60.0)
    swing = rng.uniform(0.2, 5.0, CHANNELS) * np.sin(w * t[:, None] + rng.uniform(0.0, 6.3, CHANNELS))
    moving: Array = LEVEL + swing + NOISE * rng.standard_normal((len(t), CHANNELS))
    return moving


def coarse(t: Array, rng: np.random.Generator) -> Array:
    """The same in codes of 0.3 to 10 times the noise."""
    code = NOISE * rng.uniform(0.3, 10.0)
    return np.asarray(code * np.rint(slow(t, rng) / code))


def drift(t: Array, rng: np.random.Generator) -> Array:
    """The same on a zero that wanders."""
    walk = np.cumsum(rng.standard_normal((len(t), CHANNELS)), axis=0)
    return slow(t, rng) + NOISE * rng.uniform(0.1, 2.0) * walk


def rung(t: Array, rng: np.random.Generator) -> Array:
    """The same with ten blows that ring, in all channels by their own shares."""
    x, f, damping = slow(t, rng), rng.uniform(3.0, 60.0), rng.uniform(0.01, 0.1)
    for at in rng.uniform(t[0], t[-1], 10):
        late = np.maximum(t - at, 0.0)
        ringing = np.exp(-2.0 * np.pi * f * damping * late) * np.sin(2.0 * np.pi * f * late)
        x += rng.uniform(-1.0, 1.0, CHANNELS) * rng.uniform(1.0, 500.0) * NOISE * ringing[:, None]
    return x


def tone(t: Array, rng: np.random.Generator) -> Array:
    """The same with tones at any frequency that samples show."""
    f = rng.uniform(0.0, 0.5 / (t[1] - t[0]), CHANNELS)
    return slow(t, rng) + NOISE * rng.uniform(1.0, 30.0, CHANNELS) * np.sin(2.0 * np.pi * f * t[:, None])


KINDS: dict[str, Draw] = {"white": slow, "coarse": coarse, "drift": drift, "blows": rung, "tones": tone}


def found(x: Array, rate: float) -> Spikes:
    """What is found of samples (n, c)."""
    spikes = Spikes(np.zeros(CHANNELS), 1.0 / rate)
    stamp = np.round(1e9 * np.arange(len(x)) / rate).astype(np.int64)
    for at in range(0, len(x), 4096):
        list(spikes.push(stamp[at : at + 4096], x[at : at + 4096]))
    list(spikes.flush())
    return spikes


def main(recordings: int = 1000) -> None:
    """Print the table."""
    called: dict[tuple[str, float], Counter[str]] = defaultdict(Counter)
    hits: dict[tuple[str, float], Counter[str]] = defaultdict(Counter)
    bad = {"zero": 0.0, "full": FULL_SCALE, **{f"{sigma:.0f}s": sigma for sigma in SIGMAS}}
    for seed in range(recordings):
        names = list(KINDS)
        kind, rate = names[seed % len(names)], RATES[seed // len(names) % len(RATES)]
        rng = np.random.default_rng(seed)
        x = KINDS[kind](np.arange(SAMPLES[rate]) / rate, rng)
        sound = found(x, rate)
        told = called[kind, rate]
        told.update(["recordings"])
        told.update(key for key in ("spikes", "lost", "blows") if getattr(sound, key))
        told.update(["steps"] * bool(sound.lasting()) + ["mixed"] * (sound.mixed is not None))
        places = np.linspace(200, len(x) - 200, len(bad)).astype(int)
        for place, (name, size) in zip(places, bad.items(), strict=True):
            x[place, seed % CHANNELS] = size if name in ("zero", "full") else x[place, seed % CHANNELS] + size * NOISE
        seen = found(x, rate)
        stamps = dict(zip(bad, np.round(1e9 * places / rate).astype(np.int64).tolist(), strict=True))
        for key, oddities in (("", seen.spikes), (" kept", seen.blows)):
            firsts = {one.first for one in oddities if one.channel == seed % CHANNELS}
            hits[kind, rate].update(name + key for name, stamp in stamps.items() if stamp in firsts)
    columns = ("spikes", "lost", "blows", "steps", "mixed")
    print(
        f"{'kind':7}{'Hz':>6}{'n':>5} |"
        + "".join(f"{name:>7}" for name in columns)
        + " |"
        + "".join(map("{:>9}".format, bad))
    )
    for (kind, rate), told in sorted(called.items()):
        n, hit = told["recordings"], hits[kind, rate]
        false = "".join(f"{told[name]:7}" for name in columns)
        right = "".join(f"{hit[name]:5}/{hit[f'{name} kept']:<3}" for name in bad)
        print(f"{kind:7}{rate:6.0f}{n:5} |{false} |{right}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
