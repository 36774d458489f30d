"""The compiled system as flat arrays, and the working arrays of the kernels.

Both are plain tuples of arrays, so that one compilation of the kernels serves every system.
Sizes: n_b bodies, n_t types of bodies (instances share one), n_m markers, n_c connections (joints, spring-dampers),
n_w wrench components = rows, n_l loads, n_q modes of all bodies, n_u = 6 n_b + n_q velocities.
Velocities of body i, u[u0[i]:u0[i + 1]]: v_GO in ground axes (3), omega_B (3), q_dot.
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "BUSHING",
    "C1",
    "C2",
    "C3",
    "C4",
    "CONTACT",
    "COUPLER",
    "DAMPING",
    "JOINT",
    "K_ROTATION",
    "K_TRANSLATION",
    "MASS",
    "N_BLOCKS",
    "N_DIAGNOSTICS",
    "N_DRIFTS",
    "SPRING",
    "STIFFNESS",
    "S_AB",
    "USER_FORCE",
    "Memory",
    "Model",
    "Rows",
    "Work",
    "new_rows",
    "new_work",
]

JOINT, SPRING, BUSHING, CONTACT, COUPLER, USER_FORCE = range(6)  #: values of `Model.c_law`
C1, C2, C3, S_AB, C4, MASS, STIFFNESS, DAMPING, K_TRANSLATION, K_ROTATION = range(10)  #: columns of `Model.block0`
N_BLOCKS = 10
N_DIAGNOSTICS = 12  #: kinetic, strain, gravity, springs, linear momentum (3), angular about the origin (3), work (2)
N_DRIFTS = 4  #: of a joint: distance, angle, their rates


class Model(NamedTuple):
    """A compiled system."""

    # bodies
    kind: IntArray  #: type of body, (n_b,)
    n_q: IntArray  #: modes of each body, (n_b,)
    q0: IntArray  #: first mode in q, (n_b + 1,)
    u0: IntArray  #: first velocity in u, (n_b + 1,)
    h0: IntArray  #: first number of the body's matrix in the store of matrices, (n_b + 1,)
    # types of bodies
    mass: Array  #: (n_t,)
    S: Array  #: first moment, (n_t, 3)
    J0: Array  #: inertia about the frame origin, undeformed, (n_t, 3, 3)
    #: C1 [a,k], C2 [a,k], C3 [ab,k], S_ab [l,ab,k], C4 [l,a,k], M, K, D; of stiffened types (whose S_ab hold more, see
    #: stiffening.py) K_t [l,a,k], K_r [l,a,k]; of all types, flat
    blocks: Array
    block0: IntArray  #: where they begin, (n_t, N_BLOCKS)
    is_diagonal: IntArray  #: whether M, K, D are held as diagonals, (n_t, 3)
    is_stiffened: IntArray  #: whether geometric stiffness counts, (n_t,)
    gravity: Array  #: (3,)
    # markers; those of connections first in the list of their body
    m_body: IntArray  #: body, -1 for the ground, (n_m,)
    m_position: Array  #: undeformed, body frame, (n_m, 3)
    m_triad: Array  #: undeformed axes, body frame, (n_m, 3, 3)
    m_psi0: IntArray  #: where Psi [6, n_q] begins in `psi`, -1 for none, (n_m,)
    psi: Array
    m_bend0: IntArray  #: where K_P [l, 6, k] begins in `bend`, -1 for none, (n_m,)
    bend: Array
    m_connection: IntArray  #: connection of which it is an end, -1 for none, (n_m,)
    m_sign: Array  #: +1 at end A, -1 at end B: sign of the wrench, (n_m,)
    m_force: IntArray  #: where the force on it begins in the wrench of its connection, -1 for none, (n_m,)
    m_moment: IntArray  #: where the moment on it begins in the wrench of its connection, -1 for none, (n_m,)
    m_follower: IntArray  #: whether its wrench turns with it, (n_m,)
    m_x0: IntArray  #: Σ (6 + n_q) over the ends before it, (n_m,)
    end0: IntArray  #: ends of body i are ends[end0[i]:end0[i + 1]], (n_b + 1,)
    ends: IntArray
    # connections
    c_size: IntArray  #: number of wrench components = rows, (n_c,)
    c_w0: IntArray  #: first of them, (n_c + 1,)
    c_a: IntArray  #: marker A, (n_c,)
    c_b: IntArray  #: marker B, (n_c,)
    c_law: IntArray  #: JOINT, SPRING, BUSHING, CONTACT, COUPLER or USER_FORCE, (n_c,)
    c_item: IntArray  #: number among the connections of its law, (n_c,)
    row_kind: IntArray  #: see joints/rows.py, (n_w,)
    row_x: Array  #: (n_w, 3)
    row_y: Array  #: (n_w, 3)
    row_z: Array  #: (n_w, 3)
    row_c: Array  #: (n_w,)
    row_part: IntArray  #: where the part of the wrench begins of which it speaks, (n_w,)
    row_motion: IntArray  #: its function of time, -1 for none, (n_w,)
    row_soft: Array  #: compliance over c_k, zero but for redundant constraints, (n_w,)
    row_force0: IntArray  #: forces along its coordinate: first, and the end, (n_w,)
    row_force1: IntArray  #: (n_w,)
    joint_forces: Array  #: columns as in kernels/connections/coordinate_force.py, (n_joint_forces, 7)
    joint_force_motor: IntArray  #: function of time, -1 for none, (n_joint_forces,)
    joint_force_table: IntArray  #: function of the coordinate, -1 for none, (n_joint_forces,)
    piece0: IntArray  #: first piece of each function of time, and the end, (n_functions + 1,)
    piece_t: Array  #: where it begins, (n_pieces,)
    piece: Array  #: its coefficients, see time_functions.py, (n_pieces, 9)
    c_rates: IntArray  #: whether its rows depend on velocities, (n_c,)
    spring_table: IntArray  #: tension as a function of the elongation, -1 for none, (n_springs,)
    springs: Array  #: stiffness, damping, free length, preload, (n_springs, 4)
    bushings: Array  #: stiffness, damping (36 each), preload (6), (n_bushings, 78)
    bushing_table: IntArray  #: force as a function of each deformation, -1 for none, (n_bushings, 6)
    contacts: Array  #: columns as in kernels/connections/contact.py, (n_contacts, 9)
    # coordinates of couplers and user forces, and the forces along them, see kernels/connections/element_coordinate.py
    port0: IntArray  #: first port of each coupler, then of each user force, and the end, (n_networks + 1,)
    p_a: IntArray  #: marker A, (n_p,)
    p_b: IntArray  #: marker B, (n_p,)
    p_row: IntArray  #: row of its value, of the kind PUSH, TWIST or SPAN; that of its rate follows, (n_p,)
    p_force: IntArray  #: first of its three rows of force or torque, -1 for none, (n_p,)
    p_arm: IntArray  #: first of its three rows of moment on A, -1 for none, (n_p,)
    p_factor: Array  #: coefficient in a coupler, (n_p,)
    p_core: IntArray  #: row of the unknown that is its force, or of the multiplier, (n_p,)
    core: IntArray  #: row of the multiplier of each coupler, of the first force of each user force, (n_networks,)
    # markers that slide along the deformed line through stations, see kernels/connections/deformed_line.py
    m_line: IntArray  #: line of a sliding marker, -1 for none, (n_m,)
    line_marker: IntArray  #: the marker that slides, its position that of s = 0, (n_lines,)
    line_other: IntArray  #: marker B, (n_lines,)
    line_row: IntArray  #: row with the prescribed s, -1 for none, (n_lines,)
    line_axis: Array  #: unit vector along the line, body axes, (n_lines, 3)
    line0: IntArray  #: first station of each line, and the end, (n_lines + 1,)
    line_s: Array  #: places of the stations, (n_stations,)
    line_m: IntArray  #: their markers, (n_stations,)
    # user forces
    user_forces: IntArray  #: number of forces, (n_user,)
    user_states: IntArray  #: number of states, (n_user,)
    user_address: IntArray  #: of a C function of the user, 0 for expressions, (n_user,)
    user_tape0: IntArray  #: first of its tapes, those of the forces, then of the rates of the states, (n_user,)
    state0: IntArray  #: first of its states, and the end, (n_user + 1,)
    state_row: IntArray  #: row of each state; those of its rate and algorithmic rate follow, (n_states,)
    state_start: Array  #: values at the start, (n_states,)
    tape0: IntArray  #: first operation of each expression, and the end, (n_tapes + 1,)
    tape_op: IntArray  #: codes of floatframe.functions.expressions, (n_operations,)
    tape_a: IntArray  #: operands, (n_operations,)
    tape_b: IntArray  #: (n_operations,)
    tape_c: Array  #: constants, (n_operations,)
    # loads
    l_marker: IntArray  #: (n_l,)
    l_factor: IntArray  #: function of time by which it is multiplied, -1 for one, (n_l,)
    l_force: Array  #: (n_l, 3)
    l_torque: Array  #: (n_l, 3)
    # load cases on bodies
    d_body: IntArray  #: (n_d,)
    d_factor: IntArray  #: function of time, (n_d,)
    d_first: IntArray  #: where force (3), torque (3), modal forces begin, (n_d,)
    d_values: Array
    # block elimination of the connections, see kernels/schur.py
    order: IntArray  #: connections in the order of elimination, (n_c,)
    s_diagonal: IntArray  #: where the diagonal block begins in the store of blocks, (n_c,)
    s_size: IntArray  #: length of the store, (1,)
    pair_row: IntArray  #: pairs of ends on one body: marker whose rows, (n_pairs,)
    pair_column: IntArray  #: ... marker whose wrench, (n_pairs,)
    pair_block: IntArray  #: ... where the block begins, (n_pairs,)
    after0: IntArray  #: neighbours eliminated later than order[k] are after0[k]:after0[k + 1], (n_c + 1,)
    after: IntArray  #: the neighbour i
    after_lower: IntArray  #: where block (i, j) begins
    after_upper: IntArray  #: where block (j, i) begins
    update0: IntArray  #: first of the n² target blocks of step k, (n_c + 1,)
    update: IntArray  #: where block (i, k) begins, over pairs of neighbours


class Work(NamedTuple):
    """The iterate and everything that follows from it; overwritten by every evaluation."""

    r: Array  #: position of the frame origins, ground axes, (n_b, 3)
    R: Array  #: R_GB, (n_b, 3, 3)
    q: Array  #: (n_q,)
    u: Array  #: velocities, (n_u,)
    u_dot: Array  #: accelerations, (n_u,)
    theta: Array  #: rotation since the beginning of the step, (n_b, 3)
    w: Array  #: wrenches of the connections on their markers A, ground axes, (n_w,)
    w_start: Array  #: the same at the beginning of the step, (n_w,)
    time: Array  #: of the iterate, (1,)
    # bodies
    a_B: Array  # noqa: N815  #: acceleration of the frame origin minus gravity, body axes, (n_b, 3)
    J: Array  #: J(q), (n_b, 3, 3)
    turning: Array  #: right Jacobian at theta: rotation of the body by its unknown, (n_b, 3, 3)
    D_q_dot: Array  #: Σ q_dot_k D_k, (n_b, 3, 3)
    first: Array  #: s(q), (n_b, 3)
    C1: Array  #: 1C(q) = ds/dq [a, k] of each body, (3 n_q,)
    C1_dot: Array  #: K_t q_dot [a, k] of stiffened bodies, (3 n_q,)
    R_dot: Array  #: K_r q_dot [a, k] of stiffened bodies, (3 n_q,)
    W: Array  #: S_ab q [ab, k] of each body, (9 n_q,)
    Y: Array  #: Σ_l 4C_kl q_dot_l [a, k] of each body, (3 n_q,)
    residual: Array  #: inertia and elastic minus applied and reaction forces, body axes, (n_u,)
    # markers
    psi: Array  #: derivative of displacement and rotation by q, laid out as `Model.psi`
    rho: Array  #: from the frame origin, body axes, (n_m, 3)
    rho_dot: Array  #: its rate in the body, (n_m, 3)
    T_left: Array  #: left Jacobian at the elastic rotation, body axes, (n_m, 3, 3)
    angle: Array  #: elastic rotation vector, (n_m, 3)
    angle_dot: Array  #: (n_m, 3)
    spin: Array  #: T_left angle_dot, body axes, (n_m, 3)
    m_r: Array  #: position, ground axes, (n_m, 3)
    m_A: Array  # noqa: N815  #: axes, ground axes, (n_m, 3, 3)
    m_v: Array  #: velocity, ground axes, (n_m, 3)
    m_omega: Array  #: angular velocity, ground axes, (n_m, 3)
    m_wrench: Array  #: force and moment on the marker, ground axes, (n_m, 6)
    m_bias: Array  #: acceleration and angular acceleration at zero u_dot, ground axes, (n_m, 6)
    line: Array  #: place and shape at the sliding markers, see kernels/connections/deformed_line.py, (n_lines, 16)
    # connections
    g: Array  #: residual of the rows, scaled, (n_w,)
    P: Array  #: derivative of the rows by marker motion (r, phi, v, omega), ground axes, (n_m, most rows, 12)
    V: Array  #: derivative of the rows by their own wrench, (n_c, most rows, most rows)
    pair: Array  #: what a bushing or contact makes of the motion of its markers, see connections/pair_force.py, (128,)
    # user forces
    inputs: Array  #: t, values and rates of the coordinates, states
    outputs: Array  #: forces, rates of states
    trial: Array  #: the same, for differences
    gradients: Array  #: of the outputs by the inputs, row by row
    tape: Array  #: results of the operations of an expression
    tape_bar: Array  #: derivatives of its value by them
    state_base: Array  #: known parts of states and of their algorithmic rates after the step, (n_states, 2)
    state_scheme: Array  #: kappa, rho, see kernels/connections/user_force.py, (2,)
    # linear algebra
    H: Array  #: tangent of each body, then its LU factors, flat
    pivot: IntArray  #: (n_u,)
    J_row: Array  #: marker motion (12) by body unknowns, at 12 m_x0
    J_column: Array  #: marker motion (6) by body velocities, at 6 m_x0
    X: Array  #: H⁻¹ J_columnᵀ [unknown, 6], at 6 m_x0
    Z: Array  #: J_row X [12, 6] for each pair of ends, (n_pairs, 12, 6)
    s: Array  #: block matrix of the connections, flat
    s_pivot: IntArray  #: (n_w,)
    mu: Array  #: (n_w,)
    y: Array  #: correction of the bodies, (n_u,)
    weight: Array  #: of the norm of corrections, (n_u,)
    scratch: Array  #: (12 * (6 + largest n_q),)
    factors: Array  #: c_m, c_d, c_k for which H was factorised, zero for never, (3,)
    counts: IntArray  #: evaluations, factorisations, iterations, flag "factorise next", rows, (5,)


def new_work(model: Model) -> Work:
    """Return working arrays for a compiled system."""
    n_b, n_m, n_c = len(model.kind), len(model.m_body), len(model.c_size)
    n_q, n_u, n_w = int(model.q0[-1]), int(model.u0[-1]), int(model.c_w0[-1])
    is_end = model.m_connection >= 0
    on_body = is_end & (model.m_body >= 0)
    n_x = int(sum(6 + model.n_q[model.m_body[m]] for m in np.flatnonzero(on_body)))
    n_largest = int(max(model.n_q, default=0))
    most = int(max(model.c_size, default=0))
    n_ports = np.diff(model.port0)[len(model.port0) - 1 - len(model.user_states) :]
    n_in = int(max(1 + 2 * n_ports + model.user_states, default=0))
    n_out = int(max(model.user_forces + model.user_states, default=0))
    n_tape = int(max(np.diff(model.tape0), default=0))

    def zeros(*shape: int) -> Array:
        return np.zeros(shape)

    return Work(
        r=zeros(n_b, 3),
        R=zeros(n_b, 3, 3),
        q=zeros(n_q),
        u=zeros(n_u),
        u_dot=zeros(n_u),
        theta=zeros(n_b, 3),
        w=zeros(n_w),
        w_start=zeros(n_w),
        time=zeros(1),
        a_B=zeros(n_b, 3),
        J=zeros(n_b, 3, 3),
        turning=zeros(n_b, 3, 3),
        D_q_dot=zeros(n_b, 3, 3),
        first=zeros(n_b, 3),
        C1=zeros(3 * n_q),
        C1_dot=zeros(3 * n_q),
        R_dot=zeros(3 * n_q),
        W=zeros(9 * n_q),
        Y=zeros(3 * n_q),
        residual=zeros(n_u),
        psi=np.array(model.psi),
        rho=zeros(n_m, 3),
        rho_dot=zeros(n_m, 3),
        T_left=zeros(n_m, 3, 3),
        angle=zeros(n_m, 3),
        angle_dot=zeros(n_m, 3),
        spin=zeros(n_m, 3),
        m_r=zeros(n_m, 3),
        m_A=zeros(n_m, 3, 3),
        m_v=zeros(n_m, 3),
        m_omega=zeros(n_m, 3),
        m_wrench=zeros(n_m, 6),
        m_bias=zeros(n_m, 6),
        line=zeros(len(model.line_marker), 16),
        g=zeros(n_w),
        P=zeros(n_m, most, 12),
        V=zeros(n_c, most, most),
        pair=zeros(128),
        inputs=zeros(n_in),
        outputs=zeros(n_out),
        trial=zeros(n_out),
        gradients=zeros(n_in * n_out),
        tape=zeros(n_tape),
        tape_bar=zeros(n_tape),
        state_base=np.column_stack([model.state_start, zeros(len(model.state_start))]),
        state_scheme=np.array([0.0, 1.0]),
        H=zeros(int(model.h0[-1])),
        pivot=np.zeros(n_u, np.int64),
        J_row=zeros(12 * n_x),
        J_column=zeros(6 * n_x),
        X=zeros(6 * n_x),
        Z=zeros(len(model.pair_row), 12, 6),
        s=zeros(int(model.s_size[0])),
        s_pivot=np.zeros(n_w, np.int64),
        mu=zeros(n_w),
        y=zeros(n_u),
        weight=zeros(n_u),
        scratch=zeros(12 * (6 + n_largest)),
        factors=zeros(3),
        counts=np.array([0, 0, 0, 1, 0], np.int64),
    )


class Memory(NamedTuple):
    """What an integrator knows after a step; overwritten by the next."""

    r: Array  #: (n_b, 3)
    p: Array  #: Euler parameters, (n_b, 4)
    q: Array  #: (n_q,)
    u: Array  #: (n_u,)
    u_dot: Array  #: (n_u,)
    a: Array  #: algorithmic acceleration, (n_u,)
    w: Array  #: (n_w,)
    work: Array  #: of point forces; taken by dampers and modal damping, (2,)
    power: Array  #: their rates, (2,)
    step: Array  #: size to which `a` belongs, size wanted next, numbers of steps accepted and rejected, (4,)


class Rows(NamedTuple):
    """Results of consecutive output times."""

    t: Array  #: (n_t,)
    r: Array  #: (n_t, n_b, 3)
    p: Array  #: (n_t, n_b, 4)
    q: Array  #: (n_t, n_q)
    u: Array  #: (n_t, n_u)
    u_dot: Array  #: (n_t, n_u)
    w: Array  #: (n_t, n_w)
    diagnostics: Array  #: (n_t, N_DIAGNOSTICS)
    drift: Array  #: (n_t, n_c, N_DRIFTS)


def new_rows(model: Model, n_t: int) -> Rows:
    """Return room for the results of n_t output times."""
    n_b, n_c = len(model.kind), len(model.c_size)
    n_q, n_u, n_w = int(model.q0[-1]), int(model.u0[-1]), int(model.c_w0[-1])
    shapes = [(), (n_b, 3), (n_b, 4), (n_q,), (n_u,), (n_u,), (n_w,), (N_DIAGNOSTICS,), (n_c, N_DRIFTS)]
    return Rows(*(np.zeros((n_t, *shape)) for shape in shapes))
