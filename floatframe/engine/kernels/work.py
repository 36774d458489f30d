"""The working arrays of the kernels: the iterate and all results computed from it, overwritten by every evaluation.

Sizes as in `kernels.model`, and n_most: largest number of modes of a body, most_rows: largest number of rows of a
connection, n_x: Σ (6 + n_q) over the ends of connections. Vectors are in ground axes unless stated otherwise.
"""

from typing import NamedTuple, cast

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.memory import Memory, state_sizes
from floatframe.engine.kernels.model import (
    Model,
    n_angles,
    n_b,
    n_c,
    n_gaps,
    n_lines,
    n_m,
    n_pairs,
    n_q,
    n_states,
    n_stations,
    n_u,
    n_w,
)  # fmt: skip
from floatframe.engine.kernels.records import Size, Tabled, integer, real, stacked, tabled, zeros

__all__ = [
    "BodyWork",
    "BushingWork",
    "ConnectionWork",
    "ContactWork",
    "Counted",
    "GapWork",
    "Iterate",
    "LawWork",
    "LineWork",
    "MarkerWork",
    "PairWork",
    "Past",
    "Solver",
    "SpringWork",
    "StateWork",
    "TapeWork",
    "UserWork",
    "Work",
    "new_work",
    "sizes_of",
    "vectors_of_end",
]

n_x, n_most, most_rows = (Size(name) for name in ("n_x", "n_most", "most_rows"))
n_inputs, n_outputs, n_gradients, n_results = (Size(name) for name in ("inputs", "outputs", "gradients", "results"))
n_accelerated, n_a = Size("accelerated markers"), Size("n_a")
n_past = Size("n_past")
n_law_inputs, n_law_outputs, n_law_slopes = (Size(f"{name} of a law") for name in ("inputs", "outputs", "slopes"))


class Iterate(NamedTuple):
    """The state, rates and wrenches of the present Newton iterate."""

    r: Array = real(n_b, 3, unit="m")  #: position of the frame origins
    R: Array = real(n_b, 3, 3)  #: rotation matrices R_GB of the bodies
    q: Array = real(n_q)
    u: Array = real(n_u, unit="m/s, rad/s, 1/s")  #: velocities
    u_dot: Array = real(n_u, unit="m/s², rad/s², 1/s²")  #: accelerations
    theta: Array = real(n_b, 3, unit="rad")  #: rotation of the body since the beginning of the step, body axes
    spins: IntArray = integer(n_b)  #: whether the step integrates the spin about the axis of symmetry separately
    w: Array = real(n_w, unit="N, N m")  #: wrenches of the connections on their markers A
    w_start: Array = real(n_w, unit="N, N m")  #: wrenches of the connections at the beginning of the step
    time: Array = real(unit="s")
    #: counted angles predicted by their rates; the counted rotations are those nearest to them
    angle: Array = real(n_angles, unit="rad")


class BodyWork(NamedTuple):
    """Results for bodies, see kernels/body.py; body axes."""

    a_B: Array = real(n_b, 3, unit="m/s²")  # noqa: N815  #: acceleration of the frame origin minus gravity
    s: Array = real(n_b, 3, unit="kg m")  #: first moment s(q)
    J: Array = real(n_b, 3, 3, unit="kg m²")  #: inertia J(q) about the frame origin
    D_q_dot: Array = real(n_b, 3, 3, unit="kg m²/s")  #: sum of q_dot_k D_k
    C1: Array = real(3 * n_q, unit="kg m")  #: modal coupling 1C(q) = ds/dq [a, k] of each body
    K_t_q_dot: Array = real(3 * n_q, unit="kg m/s")  #: product K_t q_dot [a, k] of stiffened bodies
    K_r_q_dot: Array = real(3 * n_q, unit="kg m²/s")  #: product K_r q_dot [a, k] of stiffened bodies
    W: Array = real(9 * n_q, unit="kg m²")  #: product S_ab q [ab, k] of each body
    Y: Array = real(3 * n_q, unit="kg m²/s")  #: product Σ_l 4C_kl q_dot_l [a, k] of each body
    residual: Array = real(n_u, unit="N, N m, N m")  #: inertia and elastic forces minus applied and reaction forces
    T_right: Array = real(n_b, 3, 3)  #: right Jacobian at theta: body rotation by the unknown dtheta
    by_turn: Array = real(n_u, 3, unit="N/rad, N m/rad")  #: derivative of the residual by the rotation of the same body
    velocity: Array = real(n_most + 6, unit="m/s, rad/s, 1/s")  #: velocities u of one body
    momentum: Array = real(n_most + 6, unit="kg m/s, kg m²/s")  #: generalised momenta M u of one body
    modal: Array = real(n_most, unit="N m")  #: M q_ddot, K q or D q_dot of one body


class MarkerWork(NamedTuple):
    """Results for markers, see kernels/marker.py."""

    psi: Array = real(Size("numbers of psi"), unit="m, rad")  #: shapes Psi(q), in the order of `Markers.psi`
    rho: Array = real(n_m, 3, unit="m")  #: vector from the frame origin to the marker, body axes
    rho_dot: Array = real(n_m, 3, unit="m/s")  #: rate of rho relative to the body, body axes
    T_left: Array = real(n_m, 3, 3)  #: left Jacobian at the elastic rotation, body axes
    angle: Array = real(n_m, 3, unit="rad")  #: elastic rotation vector, body axes
    angle_dot: Array = real(n_m, 3, unit="rad/s")  #: rate of the elastic rotation vector, body axes
    spin: Array = real(n_m, 3, unit="rad/s")  #: angular velocity relative to the body, T_left angle_dot, body axes
    r: Array = real(n_m, 3, unit="m")  #: position
    A: Array = real(n_m, 3, 3)  #: axes as columns
    v: Array = real(n_m, 3, unit="m/s")
    omega: Array = real(n_m, 3, unit="rad/s")
    wrench: Array = real(n_m, 6, unit="N, N m")  #: force and moment on the marker
    bias: Array = real(n_m, 6, unit="m/s², rad/s²")  #: acceleration and angular acceleration at zero u_dot
    bend_dot: Array = real(6 * n_most, unit="m/s, rad/s")  #: K_P q_dot [6, k] of one marker
    bend_ddot: Array = real(6 * n_most, unit="m/s², rad/s²")  #: K_P q_ddot [6, k] of one marker
    #: acceleration of markers whose acceleration is an input of a law, ground axes
    acceleration: Array = real(n_accelerated, 6, unit="m/s², rad/s²")


class LineWork(NamedTuple):
    """Results for sliding markers on their lines, see kernels/joints/deformed_line.py."""

    s: Array = real(n_lines, unit="m")  #: coordinate of the sliding marker along its line
    s_dot: Array = real(n_lines, unit="m/s")
    slope: Array = real(n_lines)  #: length of the tangent, |r'|
    #: change of s by the displacement of point B along the line, 1/|r'|; 0 if s is prescribed
    by_place: Array = real(n_lines)
    n_0: Array = real(n_lines, 3)  #: unit tangent r'/|r'|
    kappa: Array = real(n_lines, 3, unit="rad/m")  #: rotation of the marker axes per unit of s
    curve: Array = real(n_lines, 3, unit="1/m")  #: second derivative r'' of the line
    slope_dot: Array = real(n_lines, 3, unit="1/s")  #: rate of r' at fixed s
    d: Array = real(n_stations, 3, unit="m")  #: displacement of a station, body axes
    th: Array = real(n_stations, 3, unit="rad")  #: rotation of a station, body axes
    turning: Array = real(n_lines, 3, unit="rad/s²")  #: angular acceleration of the marker axes due to s_dot
    bent: Array = real(n_lines, 6, unit="m/s², rad/s²")  #: `marker.bent_bias` of the line at s


class ConnectionWork(NamedTuple):
    """Residuals of connections, and their derivatives by bodies and wrenches."""

    g: Array = real(n_w, unit="m, rad, kg m")  #: scaled residual of each row
    P: Array = real(n_m, most_rows, 12)  #: derivative of the rows by the marker motion (r, phi, v, omega)
    #: derivative of the rows by the marker acceleration, without the weight c_k
    P_a: Array = real(n_accelerated, most_rows, 6)
    V: Array = real(n_c, most_rows, most_rows)  #: derivative of the rows by their own wrench
    rate: Array = real(n_w, unit="m/s, rad/s")  #: rate of each row's constrained quantity
    bias: Array = real(n_w, unit="m/s², rad/s²")  #: second rate of each row's constrained quantity at zero u_dot


class PairWork(NamedTuple):
    """Results for one spring, bushing or contact, see kernels/connections/pair_force.py; ground axes."""

    d: Array = real(3, unit="m")  #: vector r_B - r_A
    A: Array = real(3, 3)  #: axes of A
    B: Array = real(3, 3)  #: axes of B
    v: Array = real(3, unit="m/s")  #: velocity of B relative to the axes of A
    omega: Array = real(3, unit="rad/s")  #: angular velocity of B relative to A
    F: Array = real(3, unit="N")  #: force on A
    N: Array = real(3, unit="N m")  #: moment N; -N acts on B
    v_0: Array = real(unit="m/s")  #: speed of approach of a contact
    motion: Array = real(12)  #: variation of d, of the rotation of B, of v and of omega, relative to A
    F_change: Array = real(3)  #: change of F by this variation, relative to A
    N_change: Array = real(3)
    v_0_change: Array = real()
    slopes: Array = real(10, 12)  #: derivatives of F, an unused number, N and v_0 by the motion


class SpringWork(NamedTuple):
    """Results for one spring, see kernels/connections/spring_damper.py."""

    length: Array = real(unit="m")
    rate: Array = real(unit="m/s")
    tension_by_length: Array = real(unit="N/m")
    stiffness: Array = real(unit="N/m")  #: stiffness including the slope of the table
    given: Array = real(unit="W")  #: power supplied by the table


class BushingWork(NamedTuple):
    """Results for one bushing, see kernels/connections/bushing.py; in the axes C."""

    C: Array = real(3, 3)  #: axes of the bushing, in ground axes
    xi: Array = real(6, unit="m, rad")  #: deformations e and theta
    xi_dot: Array = real(6, unit="m/s, rad/s")
    force: Array = real(6, unit="N, N m")  #: force f and moment m
    slope: Array = real(6, unit="N/m, N m")  #: slopes of the tables
    v: Array = real(3, unit="m/s")  #: velocity of B relative to the axes of A
    omega: Array = real(3, unit="rad/s")  #: angular velocity of B relative to A
    gamma: Array = real(3, unit="rad/s")  #: angular velocity of C relative to A
    p: Array = real(3, unit="N m")  #: moment f × e
    alpha: Array = real()
    beta: Array = real()
    alpha_1: Array = real()  #: alpha'/t
    beta_1: Array = real()  #: beta'/t
    tau: Array = real()
    tau_1: Array = real()  #: tau'/t
    sigma: Array = real()
    dxi: Array = real(6, unit="m, rad")  #: change of the deformations by a variation of the motion
    dxi_dot: Array = real(6, unit="m/s, rad/s")
    dforce: Array = real(6, unit="N, N m")


class ContactWork(NamedTuple):
    """Results for one contact, see kernels/connections/contact.py."""

    N: Array = real(3)
    rho: Array = real(3, unit="m")
    V: Array = real(3, unit="m/s")  #: velocity of B at the point of contact relative to A
    V_t: Array = real(3, unit="m/s")  #: slip velocity
    slip: Array = real(unit="m/s")  #: regularised slip speed sqrt(|V_t|² + v_s²)
    gap: Array = real(unit="m")
    depth: Array = real(unit="m")
    rate: Array = real(unit="m/s")  #: rate of the gap
    f: Array = real(unit="N")
    f_by_depth: Array = real(unit="N/m")
    f_by_rate: Array = real(unit="N s/m")
    v_0_by_rate: Array = real()


class GapWork(NamedTuple):
    """Gaps at both ends of a step, see kernels/connections/gap.py."""

    start: Array = real(n_gaps, unit="m, rad")  #: gap at the beginning of the step
    end: Array = real(n_gaps, unit="m, rad")  #: gap at the end of the step
    wrench: Array = real(n_m, 6)  #: marker wrenches conjugate to the change of a gap
    step: Array = real(unit="s")  #: allowed size of the next step, or of the repeated one
    shortest: IntArray = integer()  #: gap that determines the step size, -1 for none
    n_closed: IntArray = integer()  #: number of gaps that are closed at the end of the step


class UserWork(NamedTuple):
    """Inputs and results of one user force."""

    inputs: Array = real(n_inputs)  #: time, values and rates of the coordinates, states
    outputs: Array = real(n_outputs)  #: forces, then rates of states
    trial: Array = real(n_outputs)  #: copy of the outputs for difference quotients
    gradients: Array = real(n_gradients)  #: derivatives of the outputs by the inputs, row by row


class LawWork(NamedTuple):
    """Inputs and results of one public element, see kernels/connections/element_law.py."""

    inputs: Array = real(n_law_inputs)  #: time, motion of the markers, states, multipliers
    outputs: Array = real(n_law_outputs)  #: wrenches, rates of states, constraints, outputs
    trial: Array = real(n_law_outputs)  #: results at a point of a difference quotient along the motion
    #: derivatives of all results except outputs by motions, states and multipliers, row by row
    slopes: Array = real(n_law_slopes)


class StateWork(NamedTuple):
    """States of user forces and elements in a step, see kernels/connections/user_force.py."""

    base: Array = real(n_states)  #: known part of the value after the step
    rate_base: Array = real(n_states, unit="1/s")  #: known part of the algorithmic rate after the step
    kappa: Array = real(n_states, unit="s")  #: factor from the rate of a state to its value
    rho: Array = real()


class TapeWork(NamedTuple):
    """Results of one expression."""

    results: Array = real(n_results)  #: results of the operations
    bars: Array = real(n_results)  #: derivatives of the expression's value by its inputs


class Solver(NamedTuple):
    """Data of Newton's correction, see kernels/schur.py."""

    H: Array = real(Size("numbers of H"))  #: tangent of each body, then its LU factors, flat
    pivot: IntArray = integer(n_u)
    J_row: Array = real(12 * n_x)  #: derivative of the marker motion (12) by body unknowns, from index 12 x0
    J_column: Array = real(6 * n_x)  #: derivative of the marker motion (6) by body velocities, from index 6 x0
    X: Array = real(n_x, 6)  #: body motion by a unit wrench, H⁻¹ J_columnᵀ, from row x0
    Z: Array = real(n_pairs, 12, 6)  #: product J_row X for each pair of ends
    J_a: Array = real(6 * n_a)  #: derivative of marker accelerations (6) by body unknowns, times c_k, from index 6 a0
    Z_a: Array = real(Size("accelerated pairs"), 6, 6)  #: product J_a X for each pair whose row marker is accelerated
    blocks: Array = real(Size("numbers of blocks"))  #: block matrix of the connections, flat
    block_pivot: IntArray = integer(n_w)
    panel_row: Array = real(Size("widest panel"))  #: one row of the connections that are eliminated later
    mu: Array = real(n_w)  #: correction of the wrenches, times c_k
    y: Array = real(n_u)  #: correction of the body unknowns
    y_rate: Array = real(n_u)  #: velocity correction of the bodies, divided by c_d/c_k
    #: additional body rotation due to y_rate, beyond the change of the unknowns
    surplus: Array = real(n_b, 3, unit="rad")
    #: velocity gap, divided by c_d/c_k, that the first iteration of the previous step left open
    late_gap: Array = real(n_w)
    late_gap_change: Array = real(n_w)  #: change of late_gap from the step before the previous one
    has_late_gaps: IntArray = integer()  #: whether late_gap belongs to steps of the same kind as the next one
    contraction: Array = real()  #: ratio of the second to the first correction with new factors; negative if unknown
    weight: Array = real(n_u, unit="kg, kg m²")  #: weights of the norm of corrections
    motion: Array = real(12)  #: correction of the motion of one marker
    row: Array = real(12)  #: one row of P in body axes
    c_m: Array = real()  #: weights c_m, c_d, c_k for which H was factorised, zero if never
    c_d: Array = real(unit="s")
    c_k: Array = real(unit="s²")
    t_end: Array = real(unit="s")  #: time at the end of the last step if it converged fast
    is_due: IntArray = integer()  #: whether to factorise at the next iterate
    price: Array = real()  #: cost of new factors, expressed in iterations
    is_law_due: IntArray = integer()  #: whether to renew costly derivatives of laws with the factors of connections
    n_of_new_laws: IntArray = integer()  #: iterations of the last step that began with new ones
    n_steps: IntArray = integer()  #: number of steps with the present factors
    n_spent: Array = real()  #: number of iterations in these steps, plus the cost of the factors


class Counted(NamedTuple):
    """Counters since these arrays were created."""

    evaluations: IntArray = integer()
    factorisations: IntArray = integer()
    no_number: IntArray = integer()  #: 1 + the first connection of a step whose law was not finite, 0 for none
    stopped: IntArray = integer()  #: 1 + the first output of a step that ends the run, 0 for none
    rows: IntArray = integer()  #: number of rows written by the present call


class Past(NamedTuple):
    """The memories after the last steps, if there is space for them (kernels/generalized_alpha.py)."""

    n: IntArray = integer()  #: number of stored memories; the caller resets it to zero
    memory: Memory = stacked(Memory(), n_past)


@tabled
class Work(NamedTuple):
    """The working arrays of a system."""

    state: Iterate = Iterate()
    bodies: BodyWork = BodyWork()
    markers: MarkerWork = MarkerWork()
    lines: LineWork = LineWork()
    connections: ConnectionWork = ConnectionWork()
    pair: PairWork = PairWork()
    spring: SpringWork = SpringWork()
    bushing: BushingWork = BushingWork()
    contact: ContactWork = ContactWork()
    gaps: GapWork = GapWork()
    users: UserWork = UserWork()
    laws: LawWork = LawWork()
    states: StateWork = StateWork()
    tapes: TapeWork = TapeWork()
    solver: Solver = Solver()
    counted: Counted = Counted()
    past: Past = Past()


def vectors_of_end(stored: Array, n_vectors: int, first: int, n: int) -> Array:
    """Return the derivatives of vectors of a marker by the n unknowns of its body, (n_vectors, 3, n).

    stored: `J_row`, `J_column` or `J_a` of the solver; first: x0 or a0 of the marker.
    """
    width = 3 * n_vectors
    return stored[width * first : width * (first + n)].reshape(n_vectors, 3, n)


def sizes_of(model: Model) -> dict[str, int]:
    """Return the sizes of all arrays of a system by name; `ValueError` if those of the model are inconsistent."""
    bodies, markers, elements = model.bodies, model.markers, model.elements
    is_end = (markers.connection >= 0) & (markers.body >= 0)
    n_out = elements.n_forces + elements.n_states
    n_in = 1 + 2 * np.diff(elements.coordinate0) + elements.n_states
    return (
        cast(Tabled, model).sizes
        | state_sizes(model)
        | {
            "n_x": int(sum(6 + bodies.n_q[markers.body[is_end]])),
            "n_most": int(max(bodies.n_q, default=0)),
            "most_rows": int(max(model.connections.size, default=0)),
            "inputs": int(max(n_in, default=0)),
            "outputs": int(max(n_out, default=0)),
            "gradients": int(max(n_in, default=0) * max(n_out, default=0)),
            **law_sizes(model.laws.head),
            **acceleration_sizes(model),
            "results": int(max(np.diff(model.tapes.operation0), default=0)),
            "numbers of H": int(bodies.h0[-1]),
            "numbers of blocks": int(model.elimination.n_store),
            "widest panel": int(max(model.elimination.width, default=0)),
        }
    )


def law_sizes(head: IntArray) -> dict[str, int]:
    """Return the array sizes of a public element that suffice for all elements."""
    n, width, n_z, n_lam, n_seen = head[:, :5].T
    n_out = 6 * n + n_z + n_lam
    return {
        "inputs of a law": int(max(1 + n * width + n_z + n_lam, default=0)),
        "outputs of a law": int(max(n_out + n_seen, default=0)),
        "slopes of a law": int(max(n_out * ((width - 6) * n + n_z + n_lam), default=0)),
    }


def acceleration_sizes(model: Model) -> dict[str, int]:
    """Return the sizes of the arrays of markers whose acceleration is an input of a law."""
    markers = model.markers
    accelerated = markers.accelerated >= 0
    moving = accelerated & (markers.body >= 0)
    return {
        "accelerated markers": int(accelerated.sum()),
        "n_a": int(sum(6 + model.bodies.n_q[markers.body[moving]])),
        "accelerated pairs": len(model.elimination.pair_row) if accelerated.any() else 0,
    }


def new_work(model: Model, n_past: int = 0) -> Work:
    """Return working arrays for a compiled system, with space for the memories after n_past steps of a call."""
    sizes = sizes_of(model)
    remembered = max(sizes["n_u"], sizes["n_w"])
    work = zeros(Work(), sizes | {"n_past": n_past, "n_remembered": remembered})
    work.markers.psi[:] = model.markers.psi
    work.states.base[:] = model.states.start
    work.states.rho[...] = 1.0
    work.solver.is_due[...], work.solver.is_law_due[...] = 1, 1
    n = max(model.bodies.n_q, default=0)
    # `floatframe_step` of the benchmarks measured 2.3 to 3.2 iterations for 8 modes, 3.4 to 4.8 for 20, 3.8 to 6.1 for
    # 50; for few modes the price is lower, because old factors leave errors in the reactions (`test_newton_error`)
    work.solver.price[...] = min(1.0 + n / 8.0, 2.0 + n / 16.0)
    return work
