"""Geometric stiffness of a straight beam without a mesh, from section forces in equilibrium (theory.md §7).

n(x), m(x) are the forces that the part beyond x exerts on the part before it. They result from loads per unit mass,
loads on stations and the support reaction beyond x. They do work on the second-order strains of a section, and n·e_x
also on those of its twisted fibres. Loads off the axis do work on the second-order rotation of their section:

    Gamma = u' - theta × e  +  [-theta × u' + ½ theta × (theta × e)],   kappa = theta'  +  [-½ theta × theta']
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cms.body.geometric_stiffness import SPIN_PAIRS, GeometricStiffness
from cms.body.reduced_body import BodyFrame
from cms.reduction.assumed_mode_beams.beam_fields import inertia_rows, rigid_fields
from fe_models.body.beam_line import BeamLine
from fe_models.body.mass_loads import MassLoads, rotation_work
from fe_models.foundation.arrays import Array

__all__ = ["beam_geometric_stiffness"]

E_X = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class BeamLoads:
    """Loads per unit mass and wrenches on stations; load j is the sum of both."""

    mass: MassLoads  #: k loads
    x_station: Array  #: (n_stations,) [m]
    wrench: Array  #: force and moment on the stations, (n_stations, 6, k) [N, N m]


def beam_geometric_stiffness(
    line: BeamLine, points: tuple[Array, Array], motion: Array, strain: Array, x_station: Array, frame: BodyFrame
) -> GeometricStiffness:
    """Return the geometric stiffness of the unit loads of a frame.

    Parameters
    ----------
    line
        The beam.
    points
        Gauss points and weights with breaks at the stations, (n,) each [m].
    motion, strain
        Motion and strain of the sections for the modes at the points, (n, 6, n_q), see
        `cms.reduction.assumed_mode_beams.beam_fields`.
    x_station
        Positions of the interfaces, (n_stations,) [m].
    frame
        A Tisserand or nodal frame, which is the support of all loads.
    """
    loads = balanced(line, unit_loads(x_station, frame), frame)
    K = work_of_second_order(line, points, motion, strain, loads)
    return GeometricStiffness(
        translation=K[:3],
        rotation=K[3:6],
        spin=K[6:12],
        interfaces=K[12:].reshape(len(x_station), 6, *K.shape[1:]),
    )


def unit_loads(x_station: Array, frame: BodyFrame) -> BeamLoads:
    """Return the 12 loads per unit mass, then six for each station, along the axes of B."""
    e, k = frame.axes.T, 12 + 6 * len(x_station)  # e[a]: axis a of B
    A, b = np.zeros((k, 3, 3)), np.zeros((k, 3))
    b[:3] = -e
    for a in range(3):
        A[3 + a] = -np.cross(e[a], np.eye(3)).T
    for j, (p, q) in enumerate(SPIN_PAIRS):
        A[6 + j] = float(p == q) * np.eye(3) - (np.outer(e[p], e[q]) + np.outer(e[q], e[p])) / 2
    b[3:] = -A[3:] @ frame.origin
    wrench = np.zeros((len(x_station), 6, k))
    for i in range(len(x_station)):
        wrench[i, :, 12 + 6 * i : 18 + 6 * i] = np.kron(np.eye(2), frame.axes)
    return BeamLoads(MassLoads(A, b), x_station, wrench)


def balanced(line: BeamLine, loads: BeamLoads, frame: BodyFrame) -> BeamLoads:
    """Return each load with the reaction of the support: inertia of a rigid motion, or forces on held dofs."""
    x, weight = line.points(2)
    rigid = rigid_fields(x, np.zeros(3))
    q, mu, _ = densities(line, x, loads.mass)
    density = np.concatenate([q, mu], axis=1) * weight[:, None, None]
    at_stations = rigid_fields(loads.x_station, np.zeros(3))
    resultant = np.einsum("nci,ncj->ij", rigid, density) + np.einsum("nci,ncj->ij", at_stations, loads.wrench)
    if frame.kind == "tisserand":
        rows = inertia_rows(line, x, weight, rigid)
        amounts = np.linalg.solve(rows.T @ rows, resultant)
        return BeamLoads(loads.mass.plus_rigid(-amounts, np.zeros(3)), loads.x_station, loads.wrench)
    station, component = frame.dofs.T
    reaction = np.linalg.solve(at_stations[station, component].T, -resultant)
    wrench = np.array(loads.wrench)
    np.add.at(wrench, (station, component), reaction)
    return BeamLoads(loads.mass, loads.x_station, wrench)


def densities(line: BeamLine, x: Array, mass: MassLoads) -> tuple[Array, Array, Array]:
    """Return force and couple, (n, 3, k), and V = Σ f oᵀ, (n, 3, 3, k), per length at positions x."""
    centers = np.column_stack([x, np.zeros((len(x), 2))])
    q = line.at("rho_A", x)[:, None, None] * mass.at(centers)
    E = np.stack([np.zeros(len(x)), line.at("rho_Iz", x), line.at("rho_Iy", x)], axis=1)
    V = np.einsum("jab,nb->nabj", mass.A, E)
    return q, axial(V), V


def axial(V: Array) -> Array:
    """Return Σ o × f from V = Σ f oᵀ, (n, 3, k)."""
    return np.stack([V[:, 2, 1] - V[:, 1, 2], V[:, 0, 2] - V[:, 2, 0], V[:, 1, 0] - V[:, 0, 1]], axis=1)


def section_forces(line: BeamLine, x: Array, loads: BeamLoads) -> tuple[Array, Array]:
    """Return n and m at positions x, (n, 3, k) each: loads beyond x, moments about x."""
    cuts = np.array([0.0, *line.breaks, line.length])
    xi, weight = np.polynomial.legendre.leggauss(line.degree // 2 + 2)
    k = loads.mass.k
    n, m = np.zeros((len(x), 3, k)), np.zeros((len(x), 3, k))
    for start, end in pairwise(cuts):  # from x, or from the start of the piece, to its end
        first = np.clip(x, start, end)
        half = (end - first) / 2
        for at, w in zip(xi, weight, strict=True):
            place = first + half * (1 + at)
            q, mu, _ = densities(line, place, loads.mass)
            amount = (half * w)[:, None, None]
            n += amount * q
            m += amount * (mu + (place - x)[:, None, None] * across(q))
    for place, wrench in zip(loads.x_station, loads.wrench, strict=True):
        beyond = (place > x)[:, None, None]
        n += beyond * wrench[:3]
        m += beyond * (wrench[3:] + (place - x)[:, None, None] * across(wrench[None, :3]))
    return n, m


def across(v: Array) -> Array:
    """Return e_x × v, (n, 3, k)."""
    return np.stack([np.zeros_like(v[:, 0]), -v[:, 2], v[:, 1]], axis=1)


def work_of_second_order(
    line: BeamLine, points: tuple[Array, Array], motion: Array, strain: Array, loads: BeamLoads
) -> Array:
    """Return the matrices of all loads over the modes, (k, n_q, n_q)."""
    x, weight = points
    n, m = section_forces(line, x, loads)
    _, _, V = densities(line, x, loads.mass)
    theta, turned = motion[:, 3:], strain[:, 3:]
    # u' = Gamma + theta × e
    slope = strain[:, :3] - across(theta)
    half = np.cross(slope[:, :, None, :], theta[:, :, :, None], axis=1)  # -(theta_k × u_l'), [n, a, k, l]
    K = np.einsum("naj,nakl,n->jkl", n, half, weight, optimize=True)
    half = np.cross(turned[:, :, None, :], theta[:, :, :, None], axis=1)
    K += np.einsum("naj,nakl,n->jkl", m, half, weight / 2, optimize=True)
    K = K + K.transpose(0, 2, 1)
    moments = np.moveaxis(np.einsum("naj,b->nabj", n, E_X) - V, 3, 1)  # [n, j, a, b]
    K += np.einsum("nak,njab,nbl,n->jkl", theta, rotation_work(moments), theta, weight, optimize=True)
    radius2 = (line.at("EIy", x) + line.at("EIz", x)) / line.at("EA", x)
    twist = turned[:, 0]
    K += np.einsum("nj,nk,nl,n->jkl", n[:, 0], twist, twist, weight * radius2, optimize=True)
    return np.asarray((K + K.transpose(0, 2, 1)) / 2)
