"""The working arrays of the kernels: the iterate and everything that follows from it, overwritten by every evaluation.

Sizes as in `kernels.model`, and n_most: most modes of a body, most_rows: most rows of a connection, n_x: Σ (6 + n_q)
over the ends of connections. Vectors are in ground axes where nothing else is said.
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
]

n_x, n_most, most_rows = (Size(name) for name in ("n_x", "n_most", "most_rows"))
n_inputs, n_outputs, n_gradients, n_results = (Size(name) for name in ("inputs", "outputs", "gradients", "results"))
n_accelerated, n_a = Size("accelerated markers"), Size("n_a")
n_past = Size("n_past")
n_law_inputs, n_law_outputs, n_law_slopes = (Size(f"{name} of a law") for name in ("inputs", "outputs", "slopes"))


class Iterate(NamedTuple):
    """The iterate."""

    r: Array = real(n_b, 3, unit="m")  #: position of the frame origins
    R: Array = real(n_b, 3, 3)  #: R_GB
    q: Array = real(n_q)
    u: Array = real(n_u, unit="m/s, rad/s, 1/s")  #: velocities
    u_dot: Array = real(n_u, unit="m/s², rad/s², 1/s²")  #: accelerations
    theta: Array = real(n_b, 3, unit="rad")  #: rotation since the beginning of the step, body axes
    spins: IntArray = integer(n_b)  #: whether the step integrates the spin about the axis of symmetry separately
    w: Array = real(n_w, unit="N, N m")  #: wrenches of the connections on their markers A
    w_start: Array = real(n_w, unit="N, N m")  #: the same at the beginning of the step
    time: Array = real(unit="s")
    #: counted angles predicted by their rates; the counted rotations are those nearest to them
    angle: Array = real(n_angles, unit="rad")


class BodyWork(NamedTuple):
    """Bodies, see kernels/body.py; body axes."""

    a_B: Array = real(n_b, 3, unit="m/s²")  # noqa: N815  #: acceleration of the frame origin minus gravity
    s: Array = real(n_b, 3, unit="kg m")  #: s(q)
    J: Array = real(n_b, 3, 3, unit="kg m²")  #: J(q)
    D_q_dot: Array = real(n_b, 3, 3, unit="kg m²/s")  #: Σ q_dot_k D_k
    C1: Array = real(3 * n_q, unit="kg m")  #: 1C(q) = ds/dq [a, k] of each body
    K_t_q_dot: Array = real(3 * n_q, unit="kg m/s")  #: [a, k] of stiffened bodies
    K_r_q_dot: Array = real(3 * n_q, unit="kg m²/s")  #: [a, k] of stiffened bodies
    W: Array = real(9 * n_q, unit="kg m²")  #: S_ab q [ab, k] of each body
    Y: Array = real(3 * n_q, unit="kg m²/s")  #: Σ_l 4C_kl q_dot_l [a, k] of each body
    residual: Array = real(n_u, unit="N, N m, N m")  #: inertia and elastic minus applied and reaction forces
    T_right: Array = real(n_b, 3, 3)  #: right Jacobian at theta: rotation of the body by its unknown
    by_turn: Array = real(n_u, 3, unit="N/rad, N m/rad")  #: derivative of the residual by the rotation of its body
    velocity: Array = real(n_most + 6, unit="m/s, rad/s, 1/s")  #: u of one body
    momentum: Array = real(n_most + 6, unit="kg m/s, kg m²/s")  #: M u of one body
    modal: Array = real(n_most, unit="N m")  #: M q_ddot, K q or D q_dot of one body


class MarkerWork(NamedTuple):
    """Markers, see kernels/marker.py."""

    psi: Array = real(Size("numbers of psi"), unit="m, rad")  #: Psi(q), laid out as `Markers.psi`
    rho: Array = real(n_m, 3, unit="m")  #: from the frame origin, body axes
    rho_dot: Array = real(n_m, 3, unit="m/s")  #: its rate in the body, body axes
    T_left: Array = real(n_m, 3, 3)  #: left Jacobian at the elastic rotation, body axes
    angle: Array = real(n_m, 3, unit="rad")  #: elastic rotation vector, body axes
    angle_dot: Array = real(n_m, 3, unit="rad/s")  #: body axes
    spin: Array = real(n_m, 3, unit="rad/s")  #: T_left angle_dot, body axes
    r: Array = real(n_m, 3, unit="m")  #: position
    A: Array = real(n_m, 3, 3)  #: axes as columns
    v: Array = real(n_m, 3, unit="m/s")
    omega: Array = real(n_m, 3, unit="rad/s")
    wrench: Array = real(n_m, 6, unit="N, N m")  #: force and moment on the marker
    bias: Array = real(n_m, 6, unit="m/s², rad/s²")  #: acceleration and angular acceleration at zero u_dot
    bend_dot: Array = real(6 * n_most, unit="m/s, rad/s")  #: K_P q_dot [6, k] of one marker
    bend_ddot: Array = real(6 * n_most, unit="m/s², rad/s²")  #: K_P q_ddot [6, k] of one marker
    acceleration: Array = real(n_accelerated, 6, unit="m/s², rad/s²")  #: of those that are inputs of a law, ground axes


class LineWork(NamedTuple):
    """Sliding markers on their lines, see kernels/joints/deformed_line.py."""

    s: Array = real(n_lines, unit="m")  #: place
    s_dot: Array = real(n_lines, unit="m/s")
    slope: Array = real(n_lines)  #: |r'|
    by_place: Array = real(n_lines)  #: 1/|r'|: factor with which s follows the point of B; 0 if s is prescribed
    n_0: Array = real(n_lines, 3)  #: r'/|r'|
    kappa: Array = real(n_lines, 3, unit="rad/m")  #: rotation of the axes by s
    curve: Array = real(n_lines, 3, unit="1/m")  #: r''
    slope_dot: Array = real(n_lines, 3, unit="1/s")  #: rate of r' at a place
    d: Array = real(n_stations, 3, unit="m")  #: displacement of a station, body axes
    th: Array = real(n_stations, 3, unit="rad")  #: its rotation
    turning: Array = real(n_lines, 3, unit="rad/s²")  #: angular acceleration of the axes by s_dot
    bent: Array = real(n_lines, 6, unit="m/s², rad/s²")  #: `marker.bent_bias` of the line at the place


class ConnectionWork(NamedTuple):
    """Rows of connections, and their dependence on bodies and wrenches."""

    g: Array = real(n_w, unit="m, rad, kg m")  #: residual of the rows, scaled
    P: Array = real(n_m, most_rows, 12)  #: derivative of the rows by the motion of a marker (r, phi, v, omega)
    #: derivative by the acceleration of a marker, without the weight c_k
    P_a: Array = real(n_accelerated, most_rows, 6)
    V: Array = real(n_c, most_rows, most_rows)  #: derivative of the rows by their own wrench
    rate: Array = real(n_w, unit="m/s, rad/s")  #: of what the rows hold
    bias: Array = real(n_w, unit="m/s², rad/s²")  #: its second rate at zero u_dot


class PairWork(NamedTuple):
    """One spring, bushing or contact, see kernels/connections/pair_force.py; ground axes."""

    d: Array = real(3, unit="m")  #: r_B - r_A
    A: Array = real(3, 3)  #: axes of A
    B: Array = real(3, 3)  #: axes of B
    v: Array = real(3, unit="m/s")  #: velocity of B seen from A
    omega: Array = real(3, unit="rad/s")  #: of B less that of A
    F: Array = real(3, unit="N")  #: on A
    N: Array = real(3, unit="N m")  #: -N on B
    v_0: Array = real(unit="m/s")  #: speed of approach of a contact
    motion: Array = real(12)  #: variation of d, of the rotation of B, of v and omega, seen from A
    F_change: Array = real(3)  #: changes by it, seen from A
    N_change: Array = real(3)
    v_0_change: Array = real()
    slopes: Array = real(10, 12)  #: of F, nothing, N and v_0 by unit variations


class SpringWork(NamedTuple):
    """One spring, see kernels/connections/spring_damper.py."""

    length: Array = real(unit="m")
    rate: Array = real(unit="m/s")
    tension_by_length: Array = real(unit="N/m")
    stiffness: Array = real(unit="N/m")  #: with the slope of the table
    given: Array = real(unit="W")  #: power that enters by the table


class BushingWork(NamedTuple):
    """One bushing, see kernels/connections/bushing.py; axes of C."""

    C: Array = real(3, 3)  #: its axes, in ground axes
    xi: Array = real(6, unit="m, rad")  #: e, theta
    xi_dot: Array = real(6, unit="m/s, rad/s")
    force: Array = real(6, unit="N, N m")  #: f, m
    slope: Array = real(6, unit="N/m, N m")  #: of the tables
    v: Array = real(3, unit="m/s")  #: of B seen from A
    omega: Array = real(3, unit="rad/s")  #: of B less that of A
    gamma: Array = real(3, unit="rad/s")  #: angular velocity of C seen from A
    p: Array = real(3, unit="N m")  #: f × e
    alpha: Array = real()
    beta: Array = real()
    alpha_1: Array = real()  #: alpha'/t
    beta_1: Array = real()  #: beta'/t
    tau: Array = real()
    tau_1: Array = real()  #: tau'/t
    sigma: Array = real()
    dxi: Array = real(6, unit="m, rad")  #: changes by a variation
    dxi_dot: Array = real(6, unit="m/s, rad/s")
    dforce: Array = real(6, unit="N, N m")


class ContactWork(NamedTuple):
    """One contact, see kernels/connections/contact.py."""

    N: Array = real(3)
    rho: Array = real(3, unit="m")
    V: Array = real(3, unit="m/s")  #: velocity of B at the point of contact relative to A
    V_t: Array = real(3, unit="m/s")  #: slip
    slip: Array = real(unit="m/s")  #: sqrt(|V_t|² + v_s²)
    gap: Array = real(unit="m")
    depth: Array = real(unit="m")
    rate: Array = real(unit="m/s")  #: of the gap
    f: Array = real(unit="N")
    f_by_depth: Array = real(unit="N/m")
    f_by_rate: Array = real(unit="N s/m")
    v_0_by_rate: Array = real()


class GapWork(NamedTuple):
    """Gaps over a step, see kernels/connections/gap.py."""

    start: Array = real(n_gaps, unit="m, rad")  #: at its beginning
    end: Array = real(n_gaps, unit="m, rad")  #: at its end
    wrench: Array = real(n_m, 6)  #: on markers, conjugate to the change of a gap
    step: Array = real(unit="s")  #: allowed size of the next step, or of the repeated one
    shortest: IntArray = integer()  #: gap that determines it, -1 for none
    n_closed: IntArray = integer()  #: number of gaps that are closed at its end


class UserWork(NamedTuple):
    """One user force."""

    inputs: Array = real(n_inputs)  #: t, values and rates of the coordinates, states
    outputs: Array = real(n_outputs)  #: forces, rates of states
    trial: Array = real(n_outputs)  #: copy for differences
    gradients: Array = real(n_gradients)  #: of the outputs by the inputs, row by row


class LawWork(NamedTuple):
    """One public element, see kernels/connections/element_law.py."""

    inputs: Array = real(n_law_inputs)  #: t, motion of its markers, states, multipliers
    outputs: Array = real(n_law_outputs)  #: wrenches, rates of states, held quantities, outputs
    trial: Array = real(n_law_outputs)  #: the same along the motion
    slopes: Array = real(n_law_slopes)  #: derivatives of all results except outputs by the variations, row by row


class StateWork(NamedTuple):
    """States of user forces and elements in a step, see kernels/connections/user_force.py."""

    base: Array = real(n_states)  #: known part of the value after the step
    rate_base: Array = real(n_states, unit="1/s")  #: known part of its algorithmic rate
    kappa: Array = real(n_states, unit="s")  #: factor from its rate to its value
    rho: Array = real()


class TapeWork(NamedTuple):
    """One expression."""

    results: Array = real(n_results)  #: of its operations
    bars: Array = real(n_results)  #: derivatives of its value by its inputs


class Solver(NamedTuple):
    """Newton's correction, see kernels/schur.py."""

    H: Array = real(Size("numbers of H"))  #: tangent of each body, then its LU factors, flat
    pivot: IntArray = integer(n_u)
    J_row: Array = real(12 * n_x)  #: marker motion (12) by body unknowns, at 12 x0
    J_column: Array = real(6 * n_x)  #: marker motion (6) by body velocities, at 6 x0
    X: Array = real(6 * n_x)  #: H⁻¹ J_columnᵀ [unknown, 6], at 6 x0
    Z: Array = real(n_pairs, 12, 6)  #: J_row X for each pair of ends
    J_a: Array = real(6 * n_a)  #: acceleration (6) of accelerated markers by body unknowns, times c_k, at 6 a0
    Z_a: Array = real(Size("accelerated pairs"), 6, 6)  #: J_a X for each pair whose row marker is accelerated
    blocks: Array = real(Size("numbers of blocks"))  #: block matrix of the connections, flat
    block_pivot: IntArray = integer(n_w)
    mu: Array = real(n_w)  #: correction of the wrenches, times c_k
    y: Array = real(n_u)  #: correction of the bodies
    y_rate: Array = real(n_u)  #: velocity correction of the bodies only, divided by c_d/c_k
    surplus: Array = real(n_b, 3, unit="rad")  #: additional rotation of the bodies due to it, beyond their unknowns
    late_gap: Array = real(n_w)  #: of velocities, over c_d/c_k, that the first iteration of the step before left open
    late_gap_change: Array = real(n_w)  #: by how much that was more than in the step before it
    has_late_gaps: IntArray = integer()  #: whether they are of steps like the next one
    contraction: Array = real()  #: the second correction over the first when the factors were new, negative: not known
    weight: Array = real(n_u, unit="kg, kg m²")  #: of the norm of corrections
    motion: Array = real(12)  #: correction of the motion of one marker
    row: Array = real(12)  #: one row of P in body axes
    c_m: Array = real()  #: coefficients for which H was factorised, zero if never
    c_d: Array = real(unit="s")
    c_k: Array = real(unit="s²")
    is_due: IntArray = integer()  #: whether to factorise at the next iterate
    price: Array = real()  #: cost of new factors, in iterations
    n_steps: IntArray = integer()  #: number of steps with the present factors
    n_spent: Array = real()  #: iterations of these steps, plus the cost of the factors


class Counted(NamedTuple):
    """Counts since these arrays were made."""

    evaluations: IntArray = integer()
    factorisations: IntArray = integer()
    no_number: IntArray = integer()  #: 1 + the first connection of a step whose law was not finite, 0 for none
    stopped: IntArray = integer()  #: 1 + the first output of a step that ends the run, 0 for none
    rows: IntArray = integer()  #: rows written into the results of the present call


class Past(NamedTuple):
    """The memories after each of the last steps, if there is space for them; see kernels/past.py."""

    n: IntArray = integer()  #: number stored so far; the caller resets it to zero
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


def sizes_of(model: Model) -> dict[str, int]:
    """Return the sizes of all arrays of a system by name; `ValueError` if those of the model are inconsistent."""
    bodies, markers, users = model.bodies, model.markers, model.users
    is_end = (markers.connection >= 0) & (markers.body >= 0)
    n_coordinates = np.diff(model.elements.coordinate0)[len(model.elements.core) - len(users.n_states) :]
    n_in, n_out = 1 + 2 * n_coordinates + users.n_states, users.n_forces + users.n_states
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
        }
    )


def law_sizes(head: IntArray) -> dict[str, int]:
    """Return the sizes of the arrays of a public element that suffice for all elements."""
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
    """Return working arrays for a compiled system, with room for the memories after n_past steps of a call."""
    sizes = sizes_of(model)
    remembered = max(sizes["n_u"], sizes["n_w"])
    work = zeros(Work(), sizes | {"n_past": n_past, "n_remembered": remembered})
    work.markers.psi[:] = model.markers.psi
    work.states.base[:] = model.states.start
    work.states.rho[...] = 1.0
    work.solver.is_due[...] = 1
    work.solver.price[...] = 1.0 + max(model.bodies.n_q, default=0) / 8.0
    return work
