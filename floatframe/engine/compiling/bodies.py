"""Types of bodies as flat arrays; bodies made from the same reduced body share one type."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.stiffening import stiffened_shape_moments
from floatframe.engine.kernels.model import N_BLOCKS, BodyTypes
from floatframe.engine.kernels.records import filled, flat
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.system import Body

__all__ = ["axis_of_inertia", "body_n_q", "body_types", "integers", "offsets", "point_inertia", "type_arrays"]

SYMMETRIC = 0.02  #: relative difference of two moments of inertia below which a body counts as axisymmetric


def integers(values: list[int]) -> IntArray:
    """Return values as an integer array, also if there are none."""
    return np.array(values, dtype=np.int64)


def offsets(sizes: IntArray) -> IntArray:
    """Return the first index of each of consecutive parts, followed by the total length, (n + 1,)."""
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


def body_n_q(body: Body) -> int:
    """Return the number of modes of a body."""
    return body.reduced.n_q if isinstance(body, FlexibleBody) else 0


def body_types(bodies: Sequence[Body]) -> tuple[list[RigidBody | ReducedBody], IntArray]:
    """Return the distinct bodies, instances of one reduced body counted once, and the type of each body.

    Reduced bodies that are not stiffened are returned without their geometric stiffness.
    """
    types: list[RigidBody | ReducedBody] = []
    kind, keys = [], []
    for body in bodies:
        data = body.moved if isinstance(body, FlexibleBody) else body
        key = id(data), isinstance(body, FlexibleBody) and body.is_stiffened
        if key not in keys:
            keys.append(key)
            if isinstance(data, ReducedBody) and data.geometric is not None and not key[1]:
                data = replace(data, geometric=None, quadratic=None)
            types.append(data)
        kind.append(keys.index(key))
    return types, integers(kind)


def axis_of_symmetry(mass: float, S: Array, J0: Array) -> Array:
    """Return the symmetry axis of the inertia about the centre of mass, (3,); zero if the body is not axisymmetric."""
    s = S / mass if mass > 0 else np.zeros(3)
    return axis_of_inertia(J0 - point_inertia(mass, s))


def point_inertia(mass: float, r: Array) -> Array:
    """Return the inertia of a point mass at r, (3, 3)."""
    return mass * (r @ r * np.eye(3) - np.outer(r, r))


def axis_of_inertia(J: Array, within: float = SYMMETRIC) -> Array:
    """Return the symmetry axis of an inertia tensor, (3,); zero if there is none, or if all three moments are equal.

    within: allowed difference of the two moments across the axis, relative to the largest moment.
    """
    moments, axes = np.linalg.eigh(J)
    gaps = np.diff(moments)
    if gaps.min() > within * moments[2] or gaps.max() <= SYMMETRIC * moments[2]:
        return np.zeros(3)
    return axes[:, 0 if gaps[1] < gaps[0] else 2]


def type_arrays(types: list[RigidBody | ReducedBody]) -> BodyTypes:
    """Return the data of the types of bodies as the record of the kernels."""
    blocks: list[Array] = []
    block0 = np.zeros((len(types), N_BLOCKS), np.int64)
    is_diagonal = np.ones((len(types), 3), np.int64)
    has_unit_loads = np.zeros(len(types), np.int64)
    mass, S, J0 = [], [], []
    n = 0
    for t, body in enumerate(types):
        if isinstance(body, RigidBody):
            mass.append(body.mass)
            S.append(body.mass * body.center_of_mass)
            J0.append(body.inertia_about_origin)
            continue
        moments = body.moments.left_out if body.moments.missing else body.moments  # as given to `FlexibleBody`
        mass.append(moments.m)
        S.append(moments.S)
        J0.append(moments.J0)
        square = []
        for k, matrix in enumerate((body.M, body.K, body.D)):
            is_diagonal[t, k] = int(not np.any(matrix - np.diag(np.diag(matrix))))
            square.append(np.diag(matrix) if is_diagonal[t, k] else matrix)
        S_kl = moments.S_kl
        unit_loads: list[Array] = []
        if body.geometric is not None and body.n_q > 0:
            S_kl = stiffened_shape_moments(S_kl, body.geometric)
            unit_loads = [
                np.moveaxis(K, 2, 0) for K in (body.geometric.translation, body.geometric.rotation)
            ]  # [l, a, k]
            has_unit_loads[t] = any(np.any(K) for K in unit_loads)
        parts = [
            moments.C1,
            moments.C2,
            np.moveaxis(moments.C3, 0, 2),
            np.moveaxis(S_kl, 3, 0),  # [l, a, b, k]
            np.transpose(moments.C4, (1, 2, 0)),  # [l, a, k]
            *square,
            *unit_loads,
        ]
        for k, part in enumerate(parts):
            block0[t, k] = n
            blocks.append(part)
            n += part.size
    return filled(
        BodyTypes(),
        mass=mass,
        S=S,
        J0=J0,
        axis=[axis_of_symmetry(m, s, J) for m, s, J in zip(mass, S, J0, strict=True)],
        blocks=flat(blocks),
        block0=block0,
        is_diagonal=is_diagonal,
        has_unit_loads=has_unit_loads,
    )
