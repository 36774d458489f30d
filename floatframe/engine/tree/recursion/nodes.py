"""The tree of bodies with elementary joints as records, and the working arrays of the recursions.

A node has one elementary joint: a fixed one (0 rates), a screw about the third axis of its frames (1), a translation
(3) or a rotation (3). A cylindrical, universal or planar joint and the free motion of a body are chains of nodes, of
which only the last one carries a body. The frame of a node is the outer frame of its joint. The moments of a rigid body
refer to this frame, so that the only transformation of a rigid body is that of its joint. For a flexible body it is the
frame of the body, in which the markers of its joints move.

Sizes: n_n nodes, n_x positions, n_v rates. Positions and rates are ordered by bodies: those of the joint, then the
modal coordinates. A rotation has four positions (Euler parameters w, x, y, z) and three rates (angular velocity).
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.records import Size, integer, real, tabled, zeros

__all__ = [
    "FIXED",
    "NO_MARKER",
    "ROTATION",
    "SCREW",
    "TRANSLATION",
    "Dense",
    "NodeWork",
    "Nodes",
    "new_dense",
    "new_node_work",
]

FIXED, SCREW, TRANSLATION, ROTATION = 0, 1, 2, 3  #: values of `Nodes.kind`
NO_MARKER = -1

n_d, n_dn = Size("rates of matrices"), Size("nodes of matrices")
n_n, n_b, n_v, n_x, n_above = (Size(name) for name in ("nodes", "n_b", "rates", "positions", "columns above"))


@tabled
class Nodes(NamedTuple):
    """Nodes of a tree, parents before children."""

    parent: IntArray = integer(n_n)  #: parent of each node, -1 for the ground
    kind: IntArray = integer(n_n)  #: FIXED, SCREW, TRANSLATION or ROTATION
    is_near: IntArray = integer(n_n)  #: whether a rotation's rates are in axes of the parent, with opposite sign
    n_z: IntArray = integer(n_n)  #: number of rates of the joint
    x0: IntArray = integer(n_n)  #: index of the first position of the joint
    v0: IntArray = integer(n_n)  #: index of the first rate of the joint
    #: translation along the axis per unit rate; sign for a translation joint
    slide: Array = real(n_n, unit="m/rad or 1")
    turn: Array = real(n_n)  #: rotation about the axis per unit rate
    A: Array = real(n_n, 3, 3)  #: inner frame of the joint relative to the undeformed parent
    r: Array = real(n_n, 3, unit="m")  #: origin of the inner frame
    body: IntArray = integer(n_n)  #: body that the node carries, -1 for none
    n_q: IntArray = integer(n_n)  #: number of modes of the body
    q0: IntArray = integer(n_n)  #: index of the body's first mode in `state.q`
    u0: IntArray = integer(n_n)  #: index of the body's first velocity in `state.u`
    xq: IntArray = integer(n_n)  #: index of the body's first mode among the positions
    vq: IntArray = integer(n_n)  #: index of the body's first mode among the rates
    above: IntArray = integer(n_n)  #: marker of the joint on a flexible parent, else -1
    own: IntArray = integer(n_n)  #: marker of a flexible body at its joint, else -1
    F: Array = real(n_n, 3, 3)  #: outer frame of the joint in axes of the undeformed flexible body
    #: mass of the body; its moments refer to the outer frame of the joint, undeformed
    mass: Array = real(n_n, unit="kg")
    s: Array = real(n_n, 3, unit="kg m")  #: first moment
    J: Array = real(n_n, 3, 3, unit="kg m²")  #: inertia about the origin
    P: Array = real(n_n, 3, 3, unit="kg m²")  #: second moment about the origin, the integral of c cᵀ over mass
    h0: IntArray = integer(n_n + 1)  #: index of a flexible body's matrix in flat arrays with (6 + n)² numbers for each
    g0: IntArray = integer(n_n + 1)  #: index of its matrix of joint and modes in a flat array, (n_z + n)²
    c0: IntArray = integer(n_n + 1)  #: index of the columns of a flexible parent's modes


@tabled
class NodeWork(NamedTuple):
    """The results of the recursions, in node axes unless stated otherwise."""

    x: Array = real(n_x)  #: positions
    v: Array = real(n_v)  #: rates
    a: Array = real(n_v)  #: rates of change of the rates v
    force: Array = real(n_v)  #: generalised forces
    force_given: Array = real(n_v)  #: given forces along the rates
    gravity: Array = real(3, unit="m/s²")  #: acceleration of gravity, ground axes
    R: Array = real(n_n, 3, 3)  #: outer frame of the joint relative to the parent
    p: Array = real(n_n, 3, unit="m")  #: origin of the outer frame relative to the parent, axes of the parent
    omega: Array = real(n_n, 3, unit="rad/s")
    alpha: Array = real(n_n, 3, unit="rad/s²")
    acc: Array = real(n_n, 3, unit="m/s²")  #: acceleration of the origin minus gravity
    U_spin: Array = real(n_n, 3, 3, unit="rad²/s²")  #: derivative of the acceleration of body points by their position
    f: Array = real(n_n, 3, unit="N")  #: force required by the subtree
    t: Array = real(n_n, 3, unit="N m")  #: moment about the origin required by the subtree
    #: wrench of the joint on its outer frame, in axes and at the origin of that frame
    reaction: Array = real(n_n, 6, unit="N, N m")
    R_G: Array = real(n_n, 3, 3)  #: rotation from node axes to ground axes
    r_G: Array = real(n_n, 3, unit="m")  # noqa: N815  #: origin, ground axes
    rho: Array = real(n_n, 3, unit="m")  #: position of marker `above` in the parent body
    A: Array = real(n_n, 3, 3)  #: inner frame of the joint relative to the parent
    R_own: Array = real(n_n, 3, 3)  #: outer frame of the joint relative to the flexible body
    #: arrays from here on are in ground axes; motion (translation, rotation) of a node's frame at its origin for unit
    #: rate
    S: Array = real(n_v, 6, unit="m or 1, rad")
    #: motion for a unit of a flexible parent's mode, with the parent's frame fixed
    above: Array = real(n_above, 6, unit="m, rad")
    #: matrices of flexible bodies including their subtrees, flat
    H: Array = real(Size("numbers of H"), unit="kg, kg m, kg m²")
    mass: Array = real(n_n, unit="kg")  #: mass of the subtree, with its joints and modes fixed
    s: Array = real(n_n, 3, unit="kg m")  #: first moment about the origin of the node
    J: Array = real(n_n, 3, 3, unit="kg m²")
    I_ff: Array = real(n_n, 3, 3, unit="kg")  #: articulated inertia: force per acceleration
    I_ft: Array = real(n_n, 3, 3, unit="kg m")  #: articulated inertia: force per angular acceleration
    I_tt: Array = real(n_n, 3, 3, unit="kg m²")  #: articulated inertia: moment per angular acceleration
    U: Array = real(n_v, 6, unit="kg, kg m, kg m²")  #: wrench on the node per acceleration along a rate
    #: inverse of the articulated inertia along the rates of the joint
    D: Array = real(n_n, 3, 3, unit="1/kg or 1/(kg m²)")
    #: LU factors of the inertia along rates and modes of flexible bodies
    G: Array = real(Size("numbers of G"), unit="kg, kg m²")
    pivot: IntArray = integer(n_v)
    V: Array = real(n_v, 6)  #: product G⁻¹ U for flexible bodies
    local: Array = real(Size("most"))  #: working space for one flexible body
    right: Array = real(n_v, unit="N, N m")  #: right side of M x = b, later the accelerations
    wrench: Array = real(n_n, 6, unit="N, N m")  #: bias wrench of the subtree on a node
    motion: Array = real(n_n, 6, unit="m/s², rad/s²")  #: acceleration of a node, at its origin


@tabled
class Dense(NamedTuple):
    """Arrays that grow with the square of the number of rates, and arrays for derivatives; empty if not requested.

    Ground axes, motions and wrenches about the origin of the ground.
    """

    M: Array = real(n_d, n_d, unit="kg m²")  #: mass matrix
    columns: Array = real(Size("right sides"), n_d)  #: right sides, then solutions
    by_z: Array = real(n_d, n_d)  #: derivative of forces by positions
    by_rate: Array = real(n_d, n_d)  #: derivative of forces by rates
    S: Array = real(n_d, 6, unit="m, rad")  #: motion of a rate's subtree per unit rate
    change: Array = real(n_d, 18)  #: Y and X for the position, X for the rate, see recursion/tangents.py
    above: Array = real(n_above, 6)  #: motion of the subtree per unit of a flexible parent's mode
    above_change: Array = real(n_above, 18)
    momentum: Array = real(n_dn, 3, unit="kg m/s")  #: momentum of a subtree
    Q: Array = real(n_dn, 3, 3, unit="kg m²/s")  #: moment of a subtree per common change of its angular velocities
    s: Array = real(n_dn, 3, unit="kg m")  #: first moment of a subtree
    J: Array = real(n_dn, 3, 3, unit="kg m²")
    wrench: Array = real(n_dn, 6, unit="N, N m")  #: wrench required by a subtree
    row_a: Array = real(n_d, 6)  #: force along a rate per unit of X of its complete subtree
    row_b: Array = real(n_d, 3)  #: force along a rate per unit rotation of Y
    by_mode: Array = real(n_d, 12)  #: wrench for a unit of a mode, and for a unit of its rate


def new_dense(nodes: Nodes, n_v: int, n_right: int, *, is_whole: bool) -> Dense:
    """Return arrays for matrices; is_whole: for mass matrix and derivatives, otherwise only for right sides."""
    sizes = {
        "rates of matrices": n_v,
        "right sides": n_right,
        "columns above": int(nodes.c0[-1]),
        "nodes of matrices": len(nodes.parent),
    }
    if is_whole:
        return zeros(Dense(), sizes)
    return zeros(Dense(), dict.fromkeys(sizes, 0))._replace(columns=np.zeros((n_right, n_v)))


def new_node_work(nodes: Nodes, n_x: int, n_v: int) -> NodeWork:
    """Return the working arrays of the recursions."""
    sizes = {
        "nodes": len(nodes.parent),
        "rates": n_v,
        "positions": n_x,
        "columns above": int(nodes.c0[-1]),
        "numbers of H": int(nodes.h0[-1]),
        "numbers of G": int(nodes.g0[-1]),
        "most": int(max(nodes.n_q + nodes.n_z, default=0)) + 6,
    }
    work = zeros(NodeWork(), sizes)
    work.A[:] = nodes.A
    work.rho[:] = nodes.r
    work.R_own[:] = np.eye(3)
    return work
