"""Derivatives of the residual and the rows at one state, by displacements in ground axes and by parameters."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.design.gradients.parameters import Neighbour, Parameter
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.engine.open_equations.rows import Structure, row_parts
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State

__all__ = ["Point", "PointTangents", "in_blocks", "parameter_residuals", "tangents_at"]


BLOCK = 100  #: number of points whose derivatives by parameters are stored at once


@dataclass(frozen=True, eq=False)
class Point:
    """A state with accelerations and wrenches of the engine."""

    t: float
    state: State
    u_dot: Array  #: (n_u,)
    w: Array  #: (n_w,)
    w_start: Array | None = None  #: wrenches at the beginning of the step; None: w
    #: continuous angles through full turns; empty: start from zero
    angle: Array = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def R(self) -> Array:
        """R_GB of the bodies, (n_b, 3, 3), stored because a point is written for every neighbouring system."""
        return rotation_matrix(self.state.p)

    def write(self, work: Work) -> None:
        """Write the point into working arrays."""
        set_iterate(work, self.state, self.u_dot, self.w, R=self.R)
        work.state.w_start[:] = self.w if self.w_start is None else self.w_start
        work.state.time[...] = self.t


@dataclass(frozen=True, eq=False)
class PointTangents:
    """Matrices at a point; equations of motion and laws of wrenches are multiplied by c_k.

    Unknowns: displacements, velocities, accelerations in ground axes (translations), and c_k times the wrenches.
    """

    M: Array  #: c_k times derivative by accelerations, (n_u, n_u)
    C: Array  #: c_k times derivative by velocities, (n_u, n_u)
    K: Array  #: c_k times derivative by displacements, (n_u, n_u)
    J: Array  #: wrenches give the forces on bodies J.T @ w, (n_w, n_u)
    G_x: Array  #: derivative of the rows by displacements, (n_w, n_u)
    G_v: Array  #: derivative of the rows by velocities, (n_w, n_u)
    V: Array  #: derivative of the rows by c_k times the wrenches, (n_w, n_w)


def tangents_at(structure: Structure, model: Model, work: Work, point: Point, c_k: float = 1.0) -> PointTangents:
    """Return the matrices at a point that satisfies the equations of motion."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    point.write(work)
    n_u, n_w = structure.n_u, len(structure.holds)
    H, G = [], []
    for weights in ((c_k, 0.0, 0.0), (0.0, c_k, c_k), (0.0, 0.0, c_k)):
        evaluate_and_linearize(model, work, *weights)
        H.append(body_matrix(model, work))
        if weights[0] == 0.0:
            rows = row_parts(structure, model, work)
            G.append(whole(structure, rows.G, n_w))
    V = np.zeros((n_w, n_w))
    for c, block in enumerate(rows.V):
        own = slice(int(model.connections.w0[c]), int(model.connections.w0[c + 1]))
        V[own, own] = block
    assert H[0].shape == (n_u, n_u)
    return PointTangents(H[0], H[1] - H[2], H[2], whole(structure, rows.J, n_w), G[1], G[0] - G[1], V)


def body_matrix(model: Model, work: Work) -> Array:
    """Return H of all bodies, with rows in body axes and columns for displacements in ground axes."""
    n_u = int(model.bodies.u0[-1])
    result = np.zeros((n_u, n_u))
    for i in range(len(model.bodies.kind)):
        first, last = int(model.bodies.u0[i]), int(model.bodies.u0[i + 1])
        n = last - first
        block = work.solver.H[model.bodies.h0[i] : model.bodies.h0[i + 1]].reshape(n, n)
        result[first:last, first:last] = block
        result[first:last, first : first + 3] = block[:, :3] @ work.state.R[i].T
        result[first : first + 3, first:last] = work.state.R[i] @ result[first : first + 3, first:last]
    return result


def whole(structure: Structure, parts: tuple[Array, ...], n_w: int) -> Array:
    """Return the matrix of all rows from the matrices of each end."""
    result = np.zeros((n_w, structure.n_u))
    for end, part in zip(structure.ends, parts, strict=True):
        result[end.w0 : end.w0 + end.size, end.u0 : end.u0 + end.n] += part
    return result


def residuals_of(neighbour: Neighbour, point: Point, c_k: float) -> Array:
    """Return c_k times the residual of the bodies (ground axes), followed by the residual of the rows, (n_u + n_w,)."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    work, model = neighbour.work, neighbour.compiled.model
    point.write(work)
    evaluate_and_linearize(model, work, 0.0, 0.0, c_k)
    own = c_k * work.bodies.residual
    at = model.bodies.u0[:-1, None] + np.arange(3)
    own[at] = (work.state.R @ own[at][:, :, None])[:, :, 0]
    return np.concatenate([own, work.connections.g])


def parameter_residuals(parameters: tuple[Parameter, ...], points: Sequence[Point], c_k: float = 1.0) -> Array:
    """Return the derivatives of c_k times the residual, and of the rows, by parameters, (n_points, n_u + n_w, n_p)."""
    columns = []
    for p in parameters:  # system by system, so that the kernels reuse the data of each
        values = [np.array([residuals_of(each, point, c_k) for point in points]) for each in p.around]
        columns.append(p.derivative(values))
    return np.moveaxis(np.array(columns), 0, -1)


def in_blocks(parameters: tuple[Parameter, ...], points: Sequence[Point], c_k: float) -> Iterator[tuple[Point, Array]]:
    """Yield each point with its `parameter_residuals`, computed for many points at once."""
    for first in range(0, len(points), BLOCK):
        block = points[first : first + BLOCK]
        yield from zip(block, parameter_residuals(parameters, block, c_k), strict=True)
