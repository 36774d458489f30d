"""The antenna with pins instead of hinges and massless rigid struts: positions and forces in closed form.

One petal in its plane, with r outward and z along the mast. The petal rotates about its hinge (r_h, 0) by theta from
the mast. Its elbow, at the distance c along it, is supported by a strut of length l from the slider (r_s, s):

    x² + (c cos theta - s)² = l²,    x = r_h + c sin theta - r_s,    s = c cos theta + sqrt(l² - x²)
    ds/dtheta = -c sin theta - x c cos theta / sqrt(l² - x²)

Virtual work of n petals and the slider:  F ds + n M_theta dtheta + F_slider ds = 0, with M_theta the opening moment on
one petal about its hinge and F the force on the slider along +z. The strut force follows from the slider: n S (s - c
cos theta)/l = -(F + F_slider); compression is positive and pushes the slider up.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["AntennaGeometry", "Mechanism", "mechanism"]


@dataclass(frozen=True)
class AntennaGeometry:
    """Lengths of one petal and its strut [m]."""

    hinge_radius: float = 0.6  #: distance of the petal hinges from the mast
    slider_radius: float = 0.15  #: distance of the feet of the struts from the mast
    elbow: float = 1.2  #: distance from the hinge along the petal to the strut
    strut: float = 1.75  #: length of a strut


@dataclass(frozen=True, eq=False)
class Mechanism:
    """State of the mechanism at given angles of the petals, (n,) each."""

    theta: Array  #: angle of the petals from the mast [rad]
    slider: Array  #: height s of the slider [m]
    rate: Array  #: derivative ds/dtheta of the slider height [m/rad]
    drive: Array  #: force F of the drive on the slider along +z [N]
    strut: Array  #: compression of one strut [N]
    strut_angle: Array  #: angle of a strut from the mast, at its foot, downward [rad]


def mechanism(
    geometry: AntennaGeometry,
    theta: Array | float,
    *,
    n_petals: int,
    petal_moment: Array | float = 0.0,
    slider_force: Array | float = 0.0,
) -> Mechanism:
    """Return positions and forces of the pin-jointed antenna.

    Parameters
    ----------
    geometry
        Lengths.
    theta
        Angles of the petals from the mast, (n,) [rad].
    n_petals
        Number of petals that the slider drives.
    petal_moment
        Moment on one petal about its hinge, opening if positive, due to weight, hinges and inertia [N m].
    slider_force
        Force on the slider along +z besides the drive, due to its weight [N].
    """
    theta = np.atleast_1d(np.asarray(theta, dtype=float))
    c = geometry.elbow
    x = geometry.hinge_radius + c * np.sin(theta) - geometry.slider_radius
    height = np.sqrt(geometry.strut**2 - x**2)
    slider = c * np.cos(theta) + height
    rate = -c * np.sin(theta) - x * c * np.cos(theta) / height
    drive = -n_petals * np.asarray(petal_moment) / rate - np.asarray(slider_force)
    strut = -(drive + np.asarray(slider_force)) * geometry.strut / (n_petals * height)
    return Mechanism(theta, slider, rate, np.broadcast_to(drive, theta.shape), strut, np.arctan2(x, height))
