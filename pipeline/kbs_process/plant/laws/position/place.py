"""Where on a joint's range a law acts, and over how much of it: parameters that several laws have."""

from __future__ import annotations

from kbs_process.plant.effect import LogNormal, Normal, Parameter


def place(name: str, description: str, parts: int) -> Parameter:
    """Return an angle of a joint that is looked for in the middles of so many parts of its range."""
    grid = tuple((i + 0.5) / parts for i in range(parts))
    return Parameter(
        name, "rad", Normal(0.0, 3.0), description, (-100.0, 100.0), grid=grid, over="joint_angle", proposed="place"
    )


def width(name: str, description: str, median: float, grid: tuple[float, ...]) -> Parameter:
    """Return the width, in shares of a joint's range, of what is at a place."""
    prior = LogNormal(median, 1.0)
    return Parameter(name, "rad", prior, description, (1e-4, 3.0), grid=grid, over="joint_angle.span", proposed="width")
