"""Displacement fields of a straight beam: functions along x, combined with the kinematics of its sections.

At position x the section has the motion (u_x, u_y, u_z, theta_x, theta_y, theta_z) and the strains

    u_x',   u_y' - theta_z,   u_z' + theta_y,   theta_x',   theta_y',   theta_z'

The fields are: axial u(x): u_x; bending v(x): u_y = v, theta_z = v' (along z: u_z = v, theta_y = -v'); torsion
theta(x): theta_x; shear psi(x): theta_z (along z: -theta_y) alone. With v of degree p, bending and shear columns
together span all (v, theta) with theta of degree p - 1, so a thin beam does not lock.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cms.body.invariants import Moments, moments_from_gram
from cms.body.reduced_body import BodyFrame
from cms.modes.mode_sets.axis_functions import axis_functions
from fe_models.body.beam_line import BeamLine
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array

__all__ = ["BeamFields", "beam_fields", "beam_moments", "inertia_rows", "rigid_fields", "strain_rows"]

#: plane, translation component, rotation component, and sign of the rotation for a positive slope
PLANES = (("y", 1, 5, 1.0), ("z", 2, 4, -1.0))


@dataclass(frozen=True, eq=False)
class BeamFields:
    """Displacement fields (columns) at positions along the beam."""

    motion: Array  #: motion of the sections, (n, 6, n_columns)
    strain: Array  #: strains of the sections, (n, 6, n_columns)
    labels: tuple[str, ...]  #: label of each column
    groups: tuple[str, ...]  #: group of each column: axial, torsion, bending or shear


def beam_fields(family: str, counts: Mapping[str, int], line: BeamLine, x: Array) -> BeamFields:
    """Return the fields of a family of functions at positions x, without rigid-body motion.

    Parameters
    ----------
    family
        Key of `cms.modes.mode_sets.axis_functions.AXIS_FUNCTIONS`.
    counts
        Number of functions for "axial", "bending" (each direction), "shear" (each direction) and "torsion".
    line
        The beam.
    x
        Positions, (n,) [m].
    """
    x, span = np.asarray(x, dtype=float), np.array([0.0, line.length])
    motion: list[Array] = []
    strain: list[Array] = []
    labels: list[str] = []
    groups: list[str] = []

    def add(group: str, name: str, parts: Mapping[int, Array], strains: Mapping[int, Array]) -> None:
        for target, values in ((motion, parts), (strain, strains)):
            table = np.zeros((len(x), 6))
            for component, value in values.items():
                table[:, component] = value
            target.append(table)
        labels.append(f"{group} {name}")
        groups.append(group)

    for name, component, first in (("axial", 0, 1), ("torsion", 3, 1)):
        if counts[name]:
            f = axis_functions(family, x, span, counts[name], first)
            for k, function in enumerate(f.names):
                add(name, function, {component: f.values[:, k]}, {component: f.slopes[:, k]})
    for axis, t, r, sign in PLANES:
        if counts["bending"]:
            f = axis_functions(family, x, span, counts["bending"], 2)
            for k, function in enumerate(f.names):
                turned = {t: f.values[:, k], r: sign * f.slopes[:, k]}
                add(f"bending along {axis}", function, turned, {r: sign * f.curvatures[:, k]})
        if counts["shear"]:
            add(f"shear along {axis}", "1", {r: np.full(len(x), sign)}, {t: np.full(len(x), -1.0)})
            if counts["shear"] > 1:
                f = axis_functions(family, x, span, counts["shear"] - 1, 1)
                for k, function in enumerate(f.names):
                    value, slope = sign * f.values[:, k], sign * f.slopes[:, k]
                    add(f"shear along {axis}", function, {r: value}, {t: -f.values[:, k], r: slope})
    shape = (len(x), 6, 0)
    return BeamFields(
        np.stack(motion, axis=2) if motion else np.zeros(shape),
        np.stack(strain, axis=2) if strain else np.zeros(shape),
        tuple(labels),
        tuple(groups),
    )


def rigid_fields(x: Array, origin: Array) -> Array:
    """Return the six rigid-body motions about a point as motions of the sections, (n, 6, 6)."""
    centers = np.column_stack([x, np.zeros((len(x), 2))])
    motion = np.zeros((len(x), 6, 6))
    motion[:, :3] = rigid_motion_of_points(centers, origin)
    motion[:, 3:, 3:] = np.eye(3)
    return motion


def inertia_rows(line: BeamLine, x: Array, weight: Array, motion: Array) -> Array:
    """Return A with AᵀA = ∫ rho_A |u|² + thetaᵀ J theta, (6 n, n_columns)."""
    Iy, Iz = line.at("rho_Iy", x), line.at("rho_Iz", x)
    mass = line.at("rho_A", x)
    density = np.stack([mass, mass, mass, Iy + Iz, Iy, Iz], axis=1)
    return np.asarray((np.sqrt(density * weight[:, None])[:, :, None] * motion).reshape(6 * len(x), -1))


def strain_rows(line: BeamLine, x: Array, weight: Array, strain: Array) -> Array:
    """Return A with AᵀA = ∫ EA u'² + GA gamma² + GJ theta_x'² + EI kappa², (6 n, n_columns).

    If shear is rigid, its strain must be zero.
    """
    laws = [line.at(name, x) for name in ("EA", "GAy", "GAz", "GJ", "EIy", "EIz")]
    stiffness = np.where(np.isfinite(laws), laws, 0.0).T
    return np.asarray((np.sqrt(stiffness * weight[:, None])[:, :, None] * strain).reshape(6 * len(x), -1))


def beam_moments(line: BeamLine, points: tuple[Array, Array], U: Array, frame: BodyFrame) -> Moments:
    """Return the canonical moments of rigid sections at the Gauss points about the frame (docs/theory.md, beams)."""
    x, weight = points
    n = U.shape[2]
    parts = [np.zeros((len(x), 4 + 3 * n)) for _ in range(3)]
    center = np.column_stack([x, np.zeros((len(x), 2))]) - frame.origin
    turned = np.einsum("ba,nbk->nak", frame.axes, U[:, :3])
    parts[0][:, 0] = 1.0
    parts[0][:, 1:4] = center @ frame.axes
    parts[0][:, 4:] = turned.reshape(len(x), -1)
    for part, axis in ((parts[1], 1), (parts[2], 2)):
        e = np.eye(3)[axis]
        part[:, 1:4] = frame.axes.T @ e
        moved = np.cross(U[:, 3:], e[None, :, None], axisa=1, axisb=1, axisc=1)
        part[:, 4:] = np.einsum("ba,nbk->nak", frame.axes, moved).reshape(len(x), -1)
    densities = (line.at("rho_A", x), line.at("rho_Iz", x), line.at("rho_Iy", x))
    gram = sum(a.T @ ((density * weight)[:, None] * a) for a, density in zip(parts, densities, strict=True))
    return moments_from_gram(np.asarray(gram))
