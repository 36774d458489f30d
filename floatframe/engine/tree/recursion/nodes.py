"""The tree of bodies with its joints divided into elementary ones, as records, and the results of the recursions.

A node carries one elementary joint: none (0 rates), a screw about the third axis of its frames (1), a translation (3)
or a rotation (3). A cylindrical, universal or planar joint and the free motion of a body are chains of nodes, of which
the last one carries the body and the others nothing. The frame of a node is the outer frame of its joint; on a rigid
body all moments are taken in that frame, so that a rigid body needs no transformation but that of its joint. On a
flexible body it is the frame of the body, and the markers of its joints move in it.

Sizes: n_n nodes, n_x positions, n_v rates. Positions and rates stand body by body: those of the joint, then the modal
coordinates. A rotation has four positions (Euler parameters w, x, y, z) and three rates (angular velocity).
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
    """Nodes, parents before children."""

    parent: IntArray = integer(n_n)  #: -1 for the ground
    kind: IntArray = integer(n_n)  #: FIXED, SCREW, TRANSLATION or ROTATION
    is_near: IntArray = integer(n_n)  #: for a rotation: whether its rates are in axes of the parent, backwards
    n_z: IntArray = integer(n_n)  #: rates of the joint
    x0: IntArray = integer(n_n)  #: its first position
    v0: IntArray = integer(n_n)  #: its first rate
    slide: Array = real(n_n, unit="m/rad or 1")  #: translation along the axis by the rate; sign of a translation
    turn: Array = real(n_n)  #: rotation about the axis by the rate
    A: Array = real(n_n, 3, 3)  #: inner frame of the joint in the frame of the parent, undeformed
    r: Array = real(n_n, 3, unit="m")  #: its origin
    body: IntArray = integer(n_n)  #: body that it carries, -1 for none
    n_q: IntArray = integer(n_n)  #: modes of the body
    q0: IntArray = integer(n_n)  #: its first mode in `state.q`
    u0: IntArray = integer(n_n)  #: its first velocity in `state.u`
    xq: IntArray = integer(n_n)  #: its first mode among the positions
    vq: IntArray = integer(n_n)  #: its first mode among the rates
    above: IntArray = integer(n_n)  #: flexible parent: marker that carries the joint there, else -1
    own: IntArray = integer(n_n)  #: flexible body: its marker at the joint, else -1
    F: Array = real(n_n, 3, 3)  #: flexible body: outer frame of the joint in axes of the undeformed body
    mass: Array = real(n_n, unit="kg")  #: of the undeformed body, outer frame of the joint
    s: Array = real(n_n, 3, unit="kg m")  #: first moment
    J: Array = real(n_n, 3, 3, unit="kg m²")  #: inertia about the origin
    P: Array = real(n_n, 3, 3, unit="kg m²")  #: second moment about the origin, the integral of c cᵀ over mass
    h0: IntArray = integer(n_n + 1)  #: of a flexible body: its matrices begin here in stores of (6 + n)²
    g0: IntArray = integer(n_n + 1)  #: of its joint and modes, (n_z + n)²
    c0: IntArray = integer(n_n + 1)  #: of the columns of the modes of a flexible parent


@tabled
class NodeWork(NamedTuple):
    """The results of the recursions, in the frame of the node unless stated otherwise."""

    x: Array = real(n_x)  #: positions
    v: Array = real(n_v)  #: rates
    a: Array = real(n_v)  #: their rates
    force: Array = real(n_v)  #: generalised forces
    force_given: Array = real(n_v)  #: force applied along the rates
    gravity: Array = real(3, unit="m/s²")  #: ground axes
    R: Array = real(n_n, 3, 3)  #: outer frame of the joint in the frame of the parent
    p: Array = real(n_n, 3, unit="m")  #: its origin from that of the parent, axes of the parent
    omega: Array = real(n_n, 3, unit="rad/s")
    alpha: Array = real(n_n, 3, unit="rad/s²")
    acc: Array = real(n_n, 3, unit="m/s²")  #: acceleration of the origin minus gravity
    U_spin: Array = real(n_n, 3, 3, unit="rad²/s²")  #: acceleration of a point of the body, less that, by its place
    f: Array = real(n_n, 3, unit="N")  #: force required by the subtree
    t: Array = real(n_n, 3, unit="N m")  #: moment about the origin
    reaction: Array = real(n_n, 6, unit="N, N m")  #: wrench of the joint on its outer frame, axes and point of that
    R_G: Array = real(n_n, 3, 3)  #: axes in those of the ground
    r_G: Array = real(n_n, 3, unit="m")  # noqa: N815  #: origin, ground axes
    rho: Array = real(n_n, 3, unit="m")  #: marker above, in the body of the parent
    A: Array = real(n_n, 3, 3)  #: inner frame of the joint in the frame of the parent
    R_own: Array = real(n_n, 3, 3)  #: outer frame of the joint in the frame of the flexible body
    #: from here on in ground axes; motion (translation, rotation) of the frame of a node, at its origin, for its unit
    #: rate
    S: Array = real(n_v, 6, unit="m or 1, rad")
    #: the same for a mode of the flexible parent, with the parent's frame fixed
    above: Array = real(n_above, 6, unit="m, rad")
    H: Array = real(Size("numbers of H"), unit="kg, kg m, kg m²")  #: of flexible bodies including their subtrees, flat
    mass: Array = real(n_n, unit="kg")  #: mass of the subtree, with its joints and modes fixed
    s: Array = real(n_n, 3, unit="kg m")  #: first moment about the origin of the node
    J: Array = real(n_n, 3, 3, unit="kg m²")
    I_ff: Array = real(n_n, 3, 3, unit="kg")  #: articulated inertia: force by acceleration
    I_ft: Array = real(n_n, 3, 3, unit="kg m")  #: force by angular acceleration
    I_tt: Array = real(n_n, 3, 3, unit="kg m²")  #: moment by it
    U: Array = real(n_v, 6, unit="kg, kg m, kg m²")  #: wrench at the node by acceleration along a rate
    D: Array = real(n_n, 3, 3, unit="1/kg or 1/(kg m²)")  #: inverse of the inertia along the rates of the joint
    G: Array = real(Size("numbers of G"), unit="kg, kg m²")  #: LU of that along rates and modes of flexible bodies
    pivot: IntArray = integer(n_v)
    V: Array = real(n_v, 6)  #: G⁻¹ U of flexible bodies
    local: Array = real(Size("most"))  #: numbers of one flexible body
    right: Array = real(n_v, unit="N, N m")  #: right side, then accelerations
    wrench: Array = real(n_n, 6, unit="N, N m")  #: that hangs on a node
    motion: Array = real(n_n, 6, unit="m/s², rad/s²")  #: acceleration of a node, at its origin


@tabled
class Dense(NamedTuple):
    """Arrays whose size grows with the square of the rates, and those for derivatives; empty if not requested.

    Ground axes, motions and wrenches about the origin of the ground.
    """

    M: Array = real(n_d, n_d, unit="kg m²")  #: mass matrix
    columns: Array = real(Size("right sides"), n_d)  #: right sides, then solutions
    by_z: Array = real(n_d, n_d)  #: forces by positions
    by_rate: Array = real(n_d, n_d)  #: forces by rates
    S: Array = real(n_d, 6, unit="m, rad")  #: motion of the subtree of a rate
    change: Array = real(n_d, 18)  #: Y and X for its position, X for its rate, see recursion/tangents.py
    above: Array = real(n_above, 6)  #: the same by a mode of a flexible parent
    above_change: Array = real(n_above, 18)
    momentum: Array = real(n_dn, 3, unit="kg m/s")  #: of a subtree
    Q: Array = real(n_dn, 3, 3, unit="kg m²/s")  #: moment for a common change of its angular velocities
    s: Array = real(n_dn, 3, unit="kg m")  #: first moment of a subtree
    J: Array = real(n_dn, 3, 3, unit="kg m²")
    wrench: Array = real(n_dn, 6, unit="N, N m")  #: that a subtree needs
    row_a: Array = real(n_d, 6)  #: force along a rate for X of its complete subtree
    row_b: Array = real(n_d, 3)  #: by the rotation of Y
    by_mode: Array = real(n_d, 12)  #: wrench for a mode of a body and for its rate


def new_dense(nodes: Nodes, n_v: int, n_right: int, *, is_whole: bool) -> Dense:
    """Return arrays for matrices; whole: for the mass matrix and derivatives, otherwise only for right sides."""
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
    """Return working arrays."""
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
