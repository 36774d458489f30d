"""The tree of bodies as a record, and the working arrays of its recursions.

A joint of the tree has a marker A and a marker B; one is on the body (far), the other on its parent (near). Its
columns, one for each coordinate rate z_dot_k, describe the motion of B relative to A (docs/relative.md §2):

    v_B - v_A - omega_A × d = Σ A_A tau_k z_dot_k        omega_B - omega_A = Σ a_k z_dot_k

with a_k = A_A alpha_k for side 0 (a screw fixed in A, through its point), A_B alpha_k for side 1 (fixed in B). Free
bodies have six columns: marker A is the ground frame, marker B the frame of the body.

Sizes in addition to those of `kernels.model`: n_k columns and n_s unknowns, which are the columns that are not
prescribed, and the modes. They are ordered by bodies: s0[i]:s0[i + 1] are those of body i, first those of its joint.
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.model import Model, n_b, n_c, n_w
from floatframe.engine.kernels.records import Size, integer, real, tabled, zeros

__all__ = ["COLUMN", "FAR_MODE", "NEAR_MODE", "JointWork", "TangentWork", "Tree", "new_joint_work", "new_tangent_work"]

COLUMN, NEAR_MODE, FAR_MODE = range(3)  #: kinds of jets

n_k, n_s, n_kept, n_j, n_rows, n_l = (
    Size(name) for name in ("columns", "n_s", "kept", "jets", "kept rows", "loop markers")
)


@tabled
class Tree(NamedTuple):
    """Bodies, and the joints between them whose coordinates are unknowns."""

    order: IntArray = integer(n_b)  #: bodies in depth-first order, each after its parent
    parent: IntArray = integer(n_b)  #: parent of each body, -1 for the ground
    joint: IntArray = integer(n_b)  #: connection that carries the body, -1 for a free body
    near: IntArray = integer(n_b)  #: marker on the parent, -1 for the ground frame of a free body
    far: IntArray = integer(n_b)  #: marker on the body, -1 for the frame of a free body
    is_reversed: IntArray = integer(n_b)  #: whether marker B of the joint is on the parent
    column0: IntArray = integer(n_b + 1)  #: first column of the joint of each body
    s0: IntArray = integer(n_b + 1)  #: first unknown of each body
    m0: IntArray = integer(n_b)  #: index of its first mode among the unknowns
    column: IntArray = integer(n_s)  #: joint column of each unknown, -1 for a mode
    mode: IntArray = integer(n_s)  #: index of each unknown in q, -1 for a joint coordinate
    #: index of its algorithmic acceleration in the memory; for a mode the same as that of its velocity
    slot: IntArray = integer(n_s)
    tau: Array = real(n_k, 3, unit="1 or m/rad")  #: translation of the column at unit rate, axes of A
    alpha: Array = real(n_k, 3)  #: rotation of the column at unit rate, axes of A or B
    side: IntArray = integer(n_k)  #: marker in which the column is fixed, 0: A, 1: B
    unknown: IntArray = integer(n_k)  #: index among the unknowns, -1 for a prescribed coordinate
    motion: IntArray = integer(n_k)  #: function of time of a prescribed coordinate, -1 for none
    factor: Array = real(n_k)  #: factor from the prescribed function to the coordinate
    row: IntArray = integer(n_k)  #: row of the joint for this coordinate, -1 for none
    kept: IntArray = integer(n_kept)  #: connections outside the tree, which remain constraints or forces
    is_kept: IntArray = integer(n_c)  #: whether a connection is outside the tree
    #: index of a row among the rows of connections outside the tree, -1 for other rows
    kept_row: IntArray = integer(n_w)
    held: IntArray = integer(Size("held"))  #: constraint joints and couplers outside the tree
    #: symmetry axis of a body that is free or on a ball joint, axes of its joint end; zero for other bodies
    spin_axis: Array = real(n_b, 3)
    #: largest ratio of transverse angular velocity to spin for which the spin is integrated separately
    most_across: Array = real(n_b)
    loop_body: IntArray = integer(n_l)  #: body in a loop
    loop_marker: IntArray = integer(n_l)  #: marker at which the loop leaves this body outwards
    #: index of the first jet at a body's joint; jets are motions of the body and its subtree relative to the parent:
    #: unknown columns, then modes of the parent at the near marker, then modes of the body at the far marker
    jet0: IntArray = integer(n_b + 1)
    jet_kind: IntArray = integer(n_j)  #: COLUMN, NEAR_MODE or FAR_MODE
    jet_item: IntArray = integer(n_j)  #: index of the column, or of the mode in its body
    jet_s: IntArray = integer(n_j)  #: index of the unknown
    own_jet: IntArray = integer(n_s)  #: jet of each unknown at the joint of its own body, -1 for none
    l0: IntArray = integer(n_b + 1)  #: index of the matrix of the unknowns of each body in a flat store
    front0: IntArray = integer(n_b + 1)  #: index of its frontal matrix in a flat array, see kernels/kept_factors.py


@tabled
class JointWork(NamedTuple):
    """Motion and forces of the tree joints in a step; overwritten by every evaluation."""

    d: Array = real(n_b, 3, unit="m")  #: vector from marker A to marker B, axes of A
    Q: Array = real(n_b, 3, 3)  #: rotation of B relative to A, A_Aᵀ A_B
    d_start: Array = real(n_b, 3, unit="m")  #: vector d at the beginning of the step
    Q_start: Array = real(n_b, 3, 3)
    x: Array = real(n_k, unit="m or rad")  #: increments of coordinates since the beginning of a step
    rate: Array = real(n_k, unit="m/s or rad/s")  #: coordinate rates z_dot
    acceleration: Array = real(n_k, unit="m/s² or rad/s²")  #: coordinate accelerations z_ddot
    rate_start: Array = real(n_k, unit="m/s or rad/s")  #: coordinate rates z_dot at the beginning of the step
    acceleration_start: Array = real(n_k, unit="m/s² or rad/s²")
    spins: IntArray = integer(n_b)  #: whether the step integrates the spin about the axis of symmetry separately
    is_known: IntArray = integer()  #: whether the joint motion at the beginning of the step agrees with the memory
    t: Array = real(n_k, 3)  #: translation of the column A_A tau, ground axes
    a: Array = real(n_k, 3)  #: rotation of the column, ground axes
    near: Array = real(n_b, 12, unit="m/s², rad/s², m/s, rad/s")  #: accelerations and velocities of the near marker
    force: Array = real(n_b, 6, unit="N, N m")  #: wrench of the joint on its marker B, ground axes
    residual: Array = real(n_s, unit="N, N m")  #: residual of the projected equations
    own: Array = real(Size("n_u"), unit="N, N m")  #: residual of the bodies without wrenches of tree joints


@tabled
class TangentWork(NamedTuple):
    """The Newton matrix in relative coordinates, see kernels/tangent.py; spatial vectors about the point `origin`."""

    origin: Array = real(3, unit="m")
    screw: Array = real(n_j, 6)  #: screw: motion of bodies for a unit rate of the jet
    jet: Array = real(n_j, 18)  #: weighted variations xi, xi_dot, xi_ddot
    reach: Array = real(n_j, 12)  #: variations xi, xi_dot for an increment in the step
    D: Array = real(n_b, 6, 18)  #: derivative by jets of the force on a body and its subtree
    F: Array = real(n_b, 6, unit="N, N m")  #: force on a body and its subtree
    modal: Array = real(Size("n_q"), 18)  #: derivative by jets of the modal residual
    f: Array = real(6)
    motion: Array = real(12)
    own: Array = real(18)  #: jet of a mode at a marker of its own body
    C: Array = real(n_rows, n_s)  #: derivative of kept rows by unknowns
    #: transposed derivative of unknowns' equations by kept wrenches; later multiplied by K⁻¹
    B: Array = real(n_rows, n_s)
    V: Array = real(n_rows, n_rows)  #: derivative of kept rows by their wrenches; later factors of V - C K⁻¹ B
    V_pivot: IntArray = integer(n_rows)
    by_mode: Array = real(Size("n_q"), 6)  #: derivative by its own modes of the force on a body and its subtree
    L: Array = real(Size("numbers of L"))  #: matrix of each body's unknowns, later its factors, flat
    L_pivot: IntArray = integer(n_s)
    G: Array = real(n_s, 18)  #: derivative of a body's unknowns by the jet of its near marker
    W: Array = real(n_s, 6)  #: derivative of a subtree's force by the unknowns of its first body
    b: Array = real(n_b, 6, unit="N, N m")  #: force on each subtree during a solution
    #: arrays for kernels/kept_factors.py, in axes of each body about its origin
    front: Array = real(Size("numbers of fronts"))  #: matrices of modes, columns and motion, then their factors, flat
    S: Array = real(n_b, 6, Size("n_most"))  #: screws of the modes at the far marker
    #: screws of the parent's modes at the near marker, minus screws of the same modes at the parent's far marker
    T: Array = real(n_b, 6, Size("n_most"))
    Z: Array = real(6, Size("n_most"))
    J: Array = real(n_s, 6)  #: screws of joint columns
    P: Array = real(6, 6)  #: derivative of a subtree's force by the motion of its carrier
    z: Array = real(Size("unknowns and motions"))  #: modes, columns and motion of the carrier, one body after the other
    turn: Array = real(n_b, 3, 3)  #: axes of a body in those of its parent
    shift: Array = real(n_b, 3, unit="m")  #: origin of a body in axes of its parent
    is_exact: IntArray = integer()  #: whether the factors are those of the exact matrix
    is_kept: IntArray = integer()  #: whether the reused body matrices exist
    exactly: IntArray = integer()  #: number of remaining steps that use exact matrices
    #: algorithmic accelerations of the unknowns after the last steps of equal size
    a_last: Array = real(n_s)
    a_before: Array = real(n_s)
    a_first: Array = real(n_s)
    n_known: IntArray = integer()  #: number of these three accelerations that are valid
    #: degree of the extrapolation polynomial that would have predicted the last acceleration best
    degree: IntArray = integer()
    X: Array = real(n_b, 18)  #: jets of bodies during a solution; with reused factors their motion in body axes
    Y: Array = real(n_b, 18)  #: jets of the carriers of bodies during a solution
    #: number of steps with own factors each, counted from the next step whose old factors are too inaccurate
    patience: IntArray = integer()
    left: IntArray = integer()  #: number of these steps that remain
    mass: Array = real(n_b, 6, 6, unit="kg, kg m, kg m²")  #: inertia of subtrees
    weight: Array = real(n_s, unit="kg, kg m²")  #: weights of the norm of corrections
    step: Array = real(n_s)  #: right side, then the correction of the unknowns
    mu: Array = real(n_rows)  #: correction of c_k times the kept wrenches
    K: Array = real(Size("n_dense"), Size("n_dense"))  #: complete matrix for [unknowns, kept wrenches], if requested


def new_joint_work(model: Model, tree: Tree) -> JointWork:
    """Return working arrays for the joints of a tree."""
    sizes = {
        "n_b": len(tree.parent),
        "columns": len(tree.side),
        "n_s": int(tree.s0[-1]),
        "n_u": int(model.bodies.u0[-1]),
    }
    work = zeros(JointWork(), sizes)
    work.Q[:] = np.eye(3)
    work.Q_start[:] = np.eye(3)
    return work


def new_tangent_work(model: Model, tree: Tree, *, is_dense: bool = False) -> TangentWork:
    """Return working arrays for the Newton matrix of a tree; is_dense: also for the complete matrix."""
    n_s, n_rows = int(tree.s0[-1]), int((tree.kept_row >= 0).sum())
    sizes = {
        "n_b": len(tree.parent),
        "jets": len(tree.jet_s),
        "n_q": int(model.bodies.q0[-1]),
        "n_most": int(max(model.bodies.n_q, default=0)),
        "n_s": n_s,
        "kept rows": n_rows,
        "numbers of L": int(tree.l0[-1]),
        "numbers of fronts": int(tree.front0[-1]),
        "unknowns and motions": n_s + 6 * len(tree.parent),
        "n_dense": n_s + n_rows if is_dense else 0,
    }
    return zeros(TangentWork(), sizes)
