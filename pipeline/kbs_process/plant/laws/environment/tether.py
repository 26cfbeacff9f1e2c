"""Cable, hose or string from the laboratory to a link that pulls at a point: a spring along each axis."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


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


_PULL, _STIFFNESS = Normal(0.0, 5.0), Normal(0.0, 20.0)

TETHER = Effect(
    name="tether",
    order=420,
    port=Port.EXTERNAL_FORCE,
    equation=force,
    parameters=(
        Parameter("tether_x", "N", _PULL, "pull along x, at T's origin", (-1e3, 1e3), role="amplitude"),
        Parameter("tether_y", "N", _PULL, "pull along y", (-1e3, 1e3), role="amplitude"),
        Parameter("tether_z", "N", _PULL, "pull along z", (-1e3, 1e3), role="amplitude"),
        Parameter("tether_kx", "N/m", _STIFFNESS, "stiffness along x", (-1e4, 1e4), role="amplitude"),
        Parameter("tether_ky", "N/m", _STIFFNESS, "stiffness along y", (-1e4, 1e4), role="amplitude"),
        Parameter("tether_kz", "N/m", _STIFFNESS, "stiffness along z", (-1e4, 1e4), role="amplitude"),
    ),
    reference="J. H. Ginsberg, Engineering Dynamics (2008), section 5.1",
)
