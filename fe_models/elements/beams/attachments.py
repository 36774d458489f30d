"""Attachments at the nodes of a frame: point masses, springs, rigid links."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.elements.beams.slices import Slices, second_moments
from fe_models.errors import BeamError
from fe_models.foundation.arrays import Array, IntArray, frozen, tilde
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields

__all__ = ["PointMass", "RigidLink", "Spring"]

ROUNDING = 1e-14  #: absolute value of an entry divided by the lever length, below which it counts as zero
SYMMETRIC = 1e-9  #: largest relative asymmetry of a given matrix that counts as rounding


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class PointMass:
    """Rigid piece attached to a node.

    Parameters
    ----------
    node
        Index of the node that carries the mass.
    mass
        Mass [kg].
    inertia
        Inertia about the centre of mass, mesh axes, (3, 3) [kg m²], or three principal values, or one for all axes.
    offset
        Vector from the node to the centre of mass, mesh axes, (3,) [m].

    Raises
    ------
    BeamError
        If the mass is negative, the inertia is not symmetric positive semidefinite, or a number is not finite.
    """

    node: int
    mass: float
    inertia: Any = 0.0
    offset: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        where = f"point mass at node {self.node}"
        inertia = np.asarray(self.inertia, dtype=float)
        if inertia.ndim < 2:
            inertia = np.diag(np.broadcast_to(inertia, (3,)))
        object.__setattr__(self, "inertia", frozen(inertia))
        object.__setattr__(self, "offset", frozen(self.offset))
        if not 0 <= self.mass < np.inf:
            raise BeamError(f"{where}: mass: expected a mass of zero or more, got {self.mass}")
        if inertia.shape != (3, 3) or not np.isfinite(inertia).all():
            raise BeamError(f"{where}: inertia: expected finite numbers (3, 3), (3,) or one, got {self.inertia}")
        scale = np.abs(inertia).max()
        if np.abs(inertia - inertia.T).max() > SYMMETRIC * scale or np.linalg.eigvalsh(inertia)[0] < -SYMMETRIC * scale:
            raise BeamError(f"{where}: inertia: expected a symmetric tensor without negative principal values")
        if np.shape(self.offset) != (3,) or not np.isfinite(self.offset).all():
            raise BeamError(f"{where}: offset: expected three finite numbers, got {self.offset}")


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Spring:
    """Linear spring between two nodes. It acts at one point, to which both nodes are rigidly connected.

    The spring force is stiffness @ d. The two nodes move the point rigidly by two motions, and d is the motion by the
    second node minus the motion by the first, six components in the axes of the triad. Rigid-body motion therefore
    causes no force, for any positions of the nodes.

    Parameters
    ----------
    nodes
        Indices of the two nodes.
    stiffness
        Stiffness of three translations and three rotations, (6,) diagonal or (6, 6) [N/m, N, N m].
    damping
        Viscous damping, (6,) or (6, 6) [N s/m, N s, N m s]; None: no damping.
    point
        Point at which the spring acts, (3,) [m]; None: midway between the nodes.
    triad
        Axes of the spring as columns, in mesh axes, (3, 3).

    Raises
    ------
    BeamError
        If both nodes are the same, or a matrix is not symmetric positive semidefinite.
    """

    nodes: tuple[int, int]
    stiffness: Any
    damping: Any = None
    point: Any = None
    triad: Any = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        where = f"spring between nodes {self.nodes[0]} and {self.nodes[1]}"
        if self.nodes[0] == self.nodes[1]:
            raise BeamError(f"{where}: expected two nodes; a spring to the ground would hold the body")
        for name in ("stiffness", "damping"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(_semidefinite(f"{where}: {name}", getattr(self, name))))
        triad = frozen(self.triad)
        object.__setattr__(self, "triad", triad)
        if triad.shape != (3, 3) or np.abs(triad.T @ triad - np.eye(3)).max() > 1e-8 or np.linalg.det(triad) < 0:
            raise BeamError(f"{where}: triad: expected orthonormal right-handed axes as columns")
        if self.point is not None:
            object.__setattr__(self, "point", frozen(self.point))
            if np.shape(self.point) != (3,) or not np.isfinite(self.point).all():
                raise BeamError(f"{where}: point: expected three finite coordinates, got {self.point}")


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class RigidLink:
    """Rigid link (RBE2 inside a body): followers move rigidly with a leader node, and their dofs are eliminated.

    Parameters
    ----------
    node
        Index of the leading node, which keeps its dofs.
    followers
        Indices of the nodes that follow it, (n,).

    Raises
    ------
    BeamError
        If there is no follower, or the leader is one of the followers.
    """

    node: int
    followers: Any

    def __post_init__(self) -> None:
        object.__setattr__(self, "followers", frozen(np.atleast_1d(self.followers), np.int64))
        if not len(self.followers) or self.node in self.followers:
            raise BeamError(
                f"rigid link at node {self.node}: expected other nodes that follow it, got {self.followers}"
            )


def point_slices(nodes: Array, masses: tuple[PointMass, ...]) -> Slices:
    """Return the point masses as slices that the six dofs of their nodes move."""
    n = len(masses)
    at = np.array([item.node for item in masses], dtype=np.int64)
    offset = np.array([item.offset for item in masses]).reshape(n, 3)
    principal = [second_moments(item.inertia) for item in masses]
    motion = np.tile(np.eye(6), (n, 1, 1, 1))
    motion[:, 0, :3, 3:] = -tilde(offset)
    return Slices(
        position=(nodes[at] + offset)[:, None],
        mass=np.array([item.mass for item in masses]).reshape(n, 1),
        axes=np.array([axes for _, axes in principal]).reshape(n, 1, 3, 3),
        moments=np.array([values for values, _ in principal]).reshape(n, 1, 3),
        motion=motion,
        dofs=6 * at[:, None] + np.arange(6),
    )


def spring_matrix(nodes: Array, spring: Spring, matrix: Array) -> tuple[Array, IntArray]:
    """Return a spring matrix over the twelve dofs u of both nodes, Bᵀ matrix B with d = B u, and the dof numbers."""
    B, dofs = spring_motion(nodes, spring)
    return B.T @ matrix @ B, dofs


def spring_motion(nodes: Array, spring: Spring) -> tuple[Array, IntArray]:
    """Return B in d = B u, (6, 12), where d is the motion of the second side relative to the first, and dof numbers."""
    first, second = (nodes[node] for node in spring.nodes)
    half = (second - first) / 2
    levers = (half, -half) if spring.point is None else (spring.point - first, spring.point - second)
    B = np.zeros((6, 12))
    axes = np.asarray(spring.triad).T
    for sign, at, lever in ((-1.0, 0, levers[0]), (1.0, 6, levers[1])):
        x, y, z = lever
        turned = axes @ np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # theta × lever
        turned[np.abs(turned) < ROUNDING * np.linalg.norm(lever)] = 0.0  # a spring along its line resists no rotation
        B[:3, at : at + 3] = sign * axes
        B[:3, at + 3 : at + 6] = sign * turned
        B[3:, at + 3 : at + 6] = sign * axes
    return B, np.concatenate([6 * node + np.arange(6) for node in spring.nodes])


def _semidefinite(where: str, values: Any) -> Array:
    matrix = np.asarray(values, dtype=float)
    if matrix.shape == (6,):
        matrix = np.diag(matrix)
    if matrix.shape != (6, 6) or not np.isfinite(matrix).all():
        raise BeamError(f"{where}: expected six numbers or a matrix (6, 6), got {np.shape(values)}")
    scale = np.abs(matrix).max()
    if np.abs(matrix - matrix.T).max() > SYMMETRIC * scale or np.linalg.eigvalsh(matrix)[0] < -SYMMETRIC * scale:
        raise BeamError(f"{where}: expected a symmetric matrix without negative eigenvalues")
    return matrix
