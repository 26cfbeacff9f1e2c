"""Cable, hose or string from the laboratory to a link that pulls at a point: a spring along each axis."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Port, amplitude


def force(
    x: float,
    y: float,
    z: float,
    tether_x: float,
    tether_y: float,
    tether_z: float,
    tether_kx: float,
    tether_ky: float,
    tether_kz: float,
) -> tuple[float, float, float]:
    r"""Force of the laboratory on the point at (x, y, z), along the undeflected T's axes.

    Equation: $F_i = f_i - k_i x_i$ for i = x, y, z.
    Units: m, N, N/m -> N.
    Validity: small changes of the cable's way, along T's axes alone; without friction. About a joint's axis alone, with
        friction, it is `ground_cable`.
    Source: J. H. Ginsberg, Engineering Dynamics (2008), section 5.1: linear restoring forces.
    """
    return tether_x - tether_kx * x, tether_y - tether_ky * y, tether_z - tether_kz * z


TETHER = Effect(
    "tether",
    Port.EXTERNAL_FORCE,
    force,
    (
        amplitude("tether_x", "N", Normal(0.0, 5.0), "pull along x, at T's origin", 1e3),
        amplitude("tether_y", "N", Normal(0.0, 5.0), "pull along y", 1e3),
        amplitude("tether_z", "N", Normal(0.0, 5.0), "pull along z", 1e3),
        amplitude("tether_kx", "N/m", Normal(0.0, 20.0), "stiffness along x", 1e4),
        amplitude("tether_ky", "N/m", Normal(0.0, 20.0), "stiffness along y", 1e4),
        amplitude("tether_kz", "N/m", Normal(0.0, 20.0), "stiffness along z", 1e4),
    ),
    family="cable",
    order=420,
)
