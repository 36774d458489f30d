"""System data for the compiled steps in addition to the model, and the working arrays of the steps.

Sizes are those of `kernels.model` and n_z, the number of unknowns of a step: n_u increments of the bodies (d, theta in
the axes of the body at the beginning of the step, dq), then n_mu multipliers, then changes of states. Blocks are the
bodies, followed by the connections with multipliers or states.
"""

from typing import NamedTuple

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.model import n_angles, n_b, n_c, n_lines, n_m, n_q, n_stations, n_t, n_u, n_w
from floatframe.engine.kernels.records import Size, integer, real, tabled
from floatframe.engine.kernels.work import n_most

__all__ = [
    "CONSERVING", "FILTER", "FREE_TURNING", "N_BLOCKS", "SMALL", "STIFFNESS_FILTER", "TURNED_PRODUCTS", "VARIATIONAL",
    "Discrete", "Pattern", "StepWork",
]  # fmt: skip

CONSERVING, VARIATIONAL = range(2)
#: columns of `Discrete.block0`, one for each constant array: S_ab_T of `bodies.CentralBody`; F, X and E of `Filter`
TURNED_PRODUCTS, FILTER, STIFFNESS_FILTER, FREE_TURNING = range(4)
N_BLOCKS = 4
#: difference step for unknowns, relative to the size of the system, in rad, or relative to the size of the unknown
SMALL = 1e-7

n_mu, n_z, n_blocks = (Size(name) for name in ("n_mu", "n_z", "blocks of unknowns"))


class Pattern(NamedTuple):
    """The sparsity of the residual's derivatives, and the columns that one evaluation can determine together."""

    place: IntArray = integer(n_z)  #: position of each unknown in the elimination order
    block: IntArray = integer(n_z)  #: block of each unknown
    row0: IntArray = integer(n_blocks + 1)  #: index in `row` of the first row that depends on each block
    row: IntArray = integer(Size("rows of blocks"))  #: rows that depend on each block
    #: index in `column` of the first unknown of each group that is varied together
    color0: IntArray = integer(Size("colors") + 1)
    column: IntArray = integer(n_z)  #: unknowns of each group
    below: IntArray = integer()  #: number of entries in a row before its diagonal, in elimination order
    above: IntArray = integer()  #: number of entries in a row after its diagonal, in elimination order


@tabled
class Discrete(NamedTuple):
    """A system in the arrays of the compiled steps."""

    scheme: IntArray = integer()  #: CONSERVING or VARIATIONAL
    is_filtered: IntArray = integer()  #: whether unresolved modes have numerical dissipation
    is_loaded: IntArray = integer()  #: whether forces or drives do work
    blocks: Array = real(Size("numbers of steps"))
    block0: IntArray = integer(n_t, N_BLOCKS)  #: index of each constant array in `blocks`
    turns: IntArray = integer(n_m)  #: whether the marker rotates relative to its body
    psi0: IntArray = integer(n_m)  #: offset of its columns: sum of n over the previous markers
    first: IntArray = integer(n_c + 1)  #: index of the first multiplier of each connection
    row: IntArray = integer(n_mu)  #: row of the model of each multiplier
    is_driven: IntArray = integer(n_mu)  #: whether a multiplier does the work of a prescribed motion
    weight: Array = real(n_u, unit="kg, kg m²")  #: weights of the norm of corrections
    remembered: IntArray = integer(Size("remembered"))  #: rows in which connections remember values between steps
    scale: Array = real(n_z)  #: scale factors of unknowns in the matrix
    row_scale: Array = real(n_z)  #: scale factors of residuals in the matrix
    delta: Array = real(n_z)  #: smallest difference steps of the unknowns
    equation: IntArray = integer(Size("equations of laws"))  #: multipliers of elements that are not constraints
    is_linear: IntArray = integer()  #: whether the equations of motion are linear in reactions
    #: weighted stiffness s K of each body, used to close velocities
    weighted: Array = real(Size("numbers of s K"), unit="kg m²")
    weighted0: IntArray = integer(n_b)  #: index of each body's matrix in `weighted`
    pattern: Pattern = Pattern()


class Clock(NamedTuple):
    """The time, with the same name as in `kernels.work`."""

    time: Array = real(unit="s")


class MarkerPlaces(NamedTuple):
    """Positions and axes of all markers, with the same names as in `kernels.work`."""

    r: Array = real(n_m, 3, unit="m")
    A: Array = real(n_m, 3, 3)


class Configuration(NamedTuple):
    """The configuration, on which the values of constraint rows depend (`kernels.joints.held_rows`)."""

    state: Clock = Clock()
    markers: MarkerPlaces = MarkerPlaces()


@tabled
class StepWork(NamedTuple):
    """Working arrays of a step, in ground axes unless stated otherwise; suffix 0: beginning of the step, 1: end."""

    h: Array = real(unit="s")
    t_0: Array = real(unit="s")
    t_force: Array = real(unit="s")  #: time at which the forces act
    is_still: IntArray = integer()  #: whether forces act at one configuration instead of over an interval
    #: present stage: 0 closes positions, 1 finds forces at the end, 2 closes velocities
    is_closing: IntArray = integer()
    given: Array = real(unit="J")  #: work supplied over the step
    taken: Array = real(unit="J")
    # bodies
    c_0: Array = real(n_b, 3, unit="m")
    p_0: Array = real(n_b, 4)
    R_0: Array = real(n_b, 3, 3)
    q_0: Array = real(n_q)
    w_0: Array = real(n_u)  #: velocities v, omega (body axes) and q_dot
    P_0: Array = real(n_u)  #: momenta m v, Pi (body axes) and Y
    w_1: Array = real(n_u)
    P_1: Array = real(n_u)
    R_1: Array = real(n_b, 3, 3)
    R_m: Array = real(n_b, 3, 3)
    d: Array = real(n_b, 3, unit="m")
    theta_G: Array = real(n_b, 3, unit="rad")  # noqa: N815
    load: Array = real(n_u, unit="N, N m")  #: force, torque about the centre of mass, modal forces
    q_1: Array = real(n_q)
    q_mean: Array = real(n_q)
    dq: Array = real(n_q)
    V: Array = real(9 * n_most, unit="kg m²")  #: products W_ab = S_ab q
    W: Array = real(9 * n_most, unit="kg m²")
    C: Array = real(3 * n_most)  #: derivative of the centre of mass by q, see `kernels.bodies.center`
    C_mean: Array = real(3 * n_q)  #: the same at q_mean, for each body
    C_interval: Array = real(3 * n_most)  #: the same in the middle of a variational step
    middle: Array = real(n_most)  #: modal coordinates in the middle of a variational step
    force: Array = real(n_most)
    vector: Array = real(n_most)
    matrix: Array = real(n_most, n_most)
    pivot: IntArray = integer(n_most)
    s_0: Array = real(n_b, 3, unit="m")  #: centre of mass in the body frame
    s_1: Array = real(n_b, 3, unit="m")
    s_mean: Array = real(n_b, 3, unit="m")  #: centre of mass at q_mean
    # markers
    arm_0: Array = real(n_m, 3, unit="m")
    th_0: Array = real(n_m, 3, unit="rad")  #: elastic rotation vector
    E_0: Array = real(n_m, 3, 3)  #: axes of the marker in the body frame
    x_0: Array = real(n_m, 3, unit="m")
    A_0: Array = real(n_m, 3, 3)
    end: Configuration = Configuration()
    #: end of the force interval: end of the step, or x_0 if forces act at one configuration
    x_f: Array = real(n_m, 3, unit="m")
    A_f: Array = real(n_m, 3, 3)
    E_mean: Array = real(n_m, 3, 3)  #: mean axes of the marker in the body frame
    lever: Array = real(n_m, 3, unit="m")
    dx: Array = real(n_m, 3, unit="m")
    Gamma: Array = real(n_m, 3, 3)
    dpsi: Array = real(n_m, 3, unit="rad")  #: change of the elastic rotation, body axes
    psi: Array = real(Size("6 n of markers"))  #: shapes Psi_sigma and Psi_r [6, k] at q_mean, from index 6 psi0
    shape: Array = real(6 * n_most)  #: shapes of one marker
    F: Array = real(2, n_m, 3, unit="N")  #: loads of all forces, and loads of one force whose work is needed
    T: Array = real(2, n_m, 3, unit="N m")
    m: Array = real(2, n_m, 3, unit="N m")  #: moment conjugate to the elastic rotation, body axes
    is_unit: IntArray = integer()  #: whether loads are added to the second set of loads
    # deformed lines
    #: displacements of the stations at both ends of the step, and their means, body axes
    station_d: Array = real(3, n_stations, 3, unit="m")
    #: rotations of the stations at both ends of the step, and their means, body axes
    station_th: Array = real(3, n_stations, 3, unit="rad")
    line_s: Array = real(n_lines, 2, unit="m")  #: coordinates s at both ends of the step
    line_t: Array = real(n_lines, 3)  #: displacement of the sliding marker per unit of s
    #: rotation of the sliding marker's axes per unit of s, body axes
    line_kappa: Array = real(n_lines, 3, unit="rad/m")
    line_end: Array = real(n_lines, 3)  #: tangent r' at the end of the step
    # markers of public elements
    r_law: Array = real(n_m, 3, unit="m")  #: marker position in the middle of the step
    A_law: Array = real(n_m, 3, 3)  #: marker axes in the middle of the step
    d_law: Array = real(n_m, 3, unit="m")  #: displacement of the marker over the step
    turn: Array = real(n_m, 3, unit="rad")  #: Cayley vector of the marker's rotation over the step
    wrench: Array = real(n_m, 6, unit="N, N m")
    way: Array = real(n_m, 6, unit="m, m² rad")  #: direction of the correction for exact work
    # connections
    known: Array = real(n_w)  #: values that connections remember, in their rows
    #: counted angles predicted at t_force; the counted rotations are those nearest to them
    angle: Array = real(n_angles, unit="rad")
    xi: Array = real(6, unit="m, rad")  #: mean deformations of a bushing
    dxi: Array = real(6, unit="m, rad")  #: changes of the deformations over the step
    xi_force: Array = real(6, unit="N, N m")  #: forces for these deformations
    # unknowns
    z: Array = real(n_z)
    residual: Array = real(n_z)
    base: Array = real(n_z)  #: residual at the base point of differences
    center: Array = real(n_z)  #: unknowns at the base point of differences
    delta: Array = real(n_z)  #: differences of the unknowns
    right: Array = real(n_z)
    f: Array = real(n_mu, unit="N, N m")  #: multipliers
    change: Array = real(n_mu)  #: changes of rows due to the motion over the step
    kept: Array = real(n_mu, unit="N, N m")
    elastic: Array = real(n_u, unit="N m")  #: modal forces in the middle of a variational step
    f_kept: Array = real(n_mu, unit="N, N m")  #: multipliers of the last step
    #: typical sizes of multipliers that are not constraints, from previous steps
    f_size: Array = real(n_mu, unit="N, N m")
    band: Array = real(2, n_z, Size("width"))  #: factors of the matrices of both stages
    band_pivot: IntArray = integer(2, n_z)
    is_due: IntArray = integer(2)  #: whether to factorise at the next iterate
    n_iterations: IntArray = integer()
    n_factors: IntArray = integer()
    excess: Array = real()
    state_change: Array = real()  #: largest relative correction of a state in the last iteration
    #: acceleration for Newton's initial guess: change of w over the last step divided by h, v in body axes
    acceleration: Array = real(n_u)
