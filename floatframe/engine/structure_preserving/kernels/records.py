"""Data of a system for the compiled steps in addition to its model, and their working arrays.

Sizes as in `kernels.model`, and n_z: unknowns of a step, n_u increments of the bodies (d, theta in the axes of the body
at the beginning of the step, dq), then n_mu multipliers, then changes of states. Blocks are the bodies and then the
connections with multipliers or states.
"""

from typing import NamedTuple

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.model import n_angles, n_b, n_c, n_lines, n_m, n_q, n_stations, n_t, n_u, n_w
from floatframe.engine.kernels.records import Size, integer, real, tabled
from floatframe.engine.kernels.work import n_most

__all__ = [
    "BENT", "C1", "C2", "CONSERVING", "DAMPING", "FILTER", "FREE_TURNING", "INERTIA", "MASS", "N_BLOCKS", "PRODUCTS",
    "SMALL", "STIFFNESS", "STIFFNESS_FILTER", "TURNED_PRODUCTS", "VARIATIONAL", "Discrete", "Pattern", "StepWork",
]  # fmt: skip

CONSERVING, VARIATIONAL = range(2)
#: columns of `Discrete.block0`: those of `bodies.CentralBody` by name, and the filters of dissipation
(
    C1, BENT, C2, INERTIA, PRODUCTS, TURNED_PRODUCTS, MASS, STIFFNESS, DAMPING, FILTER, STIFFNESS_FILTER, FREE_TURNING,
) = range(12)  # fmt: skip
N_BLOCKS = 12
#: changes of unknowns for derivatives, relative to the size of the system, in rad, or relative to their own size
SMALL = 1e-7

n_mu, n_z, n_blocks = (Size(name) for name in ("n_mu", "n_z", "blocks of unknowns"))


class Pattern(NamedTuple):
    """The sparsity of the derivatives of the residual, and the columns that one evaluation determines."""

    place: IntArray = integer(n_z)  #: number of each unknown in the elimination order
    block: IntArray = integer(n_z)  #: block of each unknown
    row0: IntArray = integer(n_blocks + 1)  #: rows that depend on a block
    row: IntArray = integer(Size("rows of blocks"))  #: their numbers
    color0: IntArray = integer(Size("colors") + 1)  #: unknowns that are changed together
    column: IntArray = integer(n_z)  #: their numbers
    below: IntArray = integer()  #: number of entries in a row before its diagonal, in elimination order
    above: IntArray = integer()  #: and after it


@tabled
class Discrete(NamedTuple):
    """A system in the arrays of the steps."""

    scheme: IntArray = integer()  #: CONSERVING or VARIATIONAL
    center: Array = real(n_t, 3, unit="m")  #: undeformed centre of mass in the frame
    is_bent: IntArray = integer(n_t)  #: whether 1C depends on q
    is_filtered: IntArray = integer()  #: whether unresolved modes dissipate
    is_loaded: IntArray = integer()  #: whether forces or drives do work
    blocks: Array = real(Size("numbers of steps"))
    block0: IntArray = integer(n_t, N_BLOCKS)  #: where they begin
    turns: IntArray = integer(n_m)  #: whether a marker rotates in its body
    psi0: IntArray = integer(n_m)  #: Σ n over the previous markers
    first: IntArray = integer(n_c + 1)  #: multipliers of a connection
    row: IntArray = integer(n_mu)  #: row of the model of each multiplier
    is_driven: IntArray = integer(n_mu)  #: whether a multiplier does the work of a prescribed motion
    weight: Array = real(n_u, unit="kg, kg m²")  #: of the norm of corrections
    remembered: IntArray = integer(Size("remembered"))  #: rows of the memory of connections
    scale: Array = real(n_z)  #: scale factors of unknowns in the matrix
    row_scale: Array = real(n_z)  #: and residuals
    delta: Array = real(n_z)  #: smallest changes of unknowns for derivatives
    equation: IntArray = integer(Size("equations of laws"))  #: multipliers of elements without constraints
    is_linear: IntArray = integer()  #: whether the equations of motion are linear in reactions
    weighted: Array = real(Size("numbers of s K"), unit="kg m²")  #: s K of each body, used to close velocities
    weighted0: IntArray = integer(n_b)  #: where it begins
    pattern: Pattern = Pattern()


class Clock(NamedTuple):
    """The time, as `kernels.work` has it."""

    time: Array = real(unit="s")


class MarkerPlaces(NamedTuple):
    """Positions and axes of all markers, as `kernels.work` has them."""

    r: Array = real(n_m, 3, unit="m")
    A: Array = real(n_m, 3, 3)


class Configuration(NamedTuple):
    """All that the values of constraint rows depend on (`kernels.joints.held_rows`)."""

    state: Clock = Clock()
    markers: MarkerPlaces = MarkerPlaces()


@tabled
class StepWork(NamedTuple):
    """Working arrays of a step, ground axes where nothing else is said; 0 at its beginning, 1 at its end."""

    h: Array = real(unit="s")
    t_0: Array = real(unit="s")
    t_force: Array = real(unit="s")  #: time of the forces
    is_still: IntArray = integer()  #: whether forces act at one configuration
    is_closing: IntArray = integer()  #: 0 while positions are closed, 1 for forces at the end, 2 for velocities
    given: Array = real(unit="J")  #: work over the step
    taken: Array = real(unit="J")
    # bodies
    c_0: Array = real(n_b, 3, unit="m")
    p_0: Array = real(n_b, 4)
    R_0: Array = real(n_b, 3, 3)
    q_0: Array = real(n_q)
    w_0: Array = real(n_u)  #: v, omega (body axes), q_dot
    P_0: Array = real(n_u)  #: m v, Pi (body axes), Y
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
    V: Array = real(9 * n_most, unit="kg m²")  #: `CentralBody.products`
    W: Array = real(9 * n_most, unit="kg m²")
    C: Array = real(3 * n_most)  #: `CentralBody.shapes`
    C_mean: Array = real(3 * n_q)  #: values at q_mean, of each body
    C_interval: Array = real(3 * n_most)  #: values in the middle of a variational step
    middle: Array = real(n_most)  #: q there
    force: Array = real(n_most)
    vector: Array = real(n_most)
    matrix: Array = real(n_most, n_most)
    pivot: IntArray = integer(n_most)
    s_0: Array = real(n_b, 3, unit="m")  #: centre of mass in the body
    s_1: Array = real(n_b, 3, unit="m")
    s_mean: Array = real(n_b, 3, unit="m")  #: that of q_mean
    # markers
    arm_0: Array = real(n_m, 3, unit="m")
    th_0: Array = real(n_m, 3, unit="rad")  #: elastic rotation
    E_0: Array = real(n_m, 3, 3)  #: axes in the body
    x_0: Array = real(n_m, 3, unit="m")
    A_0: Array = real(n_m, 3, 3)
    end: Configuration = Configuration()
    x_f: Array = real(n_m, 3, unit="m")  #: end of the force interval: that of the step, or x_0 if still
    A_f: Array = real(n_m, 3, 3)
    E_mean: Array = real(n_m, 3, 3)  #: mean axes in the body
    lever: Array = real(n_m, 3, unit="m")
    dx: Array = real(n_m, 3, unit="m")
    Gamma: Array = real(n_m, 3, 3)
    dpsi: Array = real(n_m, 3, unit="rad")  #: body axes
    psi: Array = real(Size("6 n of markers"))  #: Psi_sigma, Psi_r [6, k] at q_mean, at 6 psi0
    shape: Array = real(6 * n_most)  #: those of one marker
    F: Array = real(2, n_m, 3, unit="N")  #: loads of all forces, and of one alone whose work is asked for
    T: Array = real(2, n_m, 3, unit="N m")
    m: Array = real(2, n_m, 3, unit="N m")  #: on the elastic rotation, body axes
    is_unit: IntArray = integer()  #: whether loads are added to the second set
    # deformed lines
    station_d: Array = real(3, n_stations, 3, unit="m")  #: displacements of stations at both ends, and means, body axes
    station_th: Array = real(3, n_stations, 3, unit="rad")  #: and rotations
    line_s: Array = real(n_lines, 2, unit="m")  #: places at both ends
    line_t: Array = real(n_lines, 3)  #: displacement of the sliding marker by its place
    line_kappa: Array = real(n_lines, 3, unit="rad/m")  #: rotation of its axes by its place, body axes
    line_end: Array = real(n_lines, 3)  #: r' at the end of the step
    # markers of public elements
    r_law: Array = real(n_m, 3, unit="m")  #: in the middle of the step
    A_law: Array = real(n_m, 3, 3)  #: there
    d_law: Array = real(n_m, 3, unit="m")  #: way over the step
    turn: Array = real(n_m, 3, unit="rad")  #: Cayley vector of the rotation over the step
    wrench: Array = real(n_m, 6, unit="N, N m")
    way: Array = real(n_m, 6, unit="m, m² rad")  #: direction of the correction of the potential
    # connections
    known: Array = real(n_w)  #: memory of connections, in its rows
    #: counted angles predicted at t_force; the counted rotations are those nearest to them
    angle: Array = real(n_angles, unit="rad")
    xi: Array = real(6, unit="m, rad")  #: mean deformations of a bushing
    dxi: Array = real(6, unit="m, rad")  #: their changes,
    xi_force: Array = real(6, unit="N, N m")  #: forces for these deformations
    # unknowns
    z: Array = real(n_z)
    residual: Array = real(n_z)
    base: Array = real(n_z)  #: residual at the base point of differences
    center: Array = real(n_z)  #: unknowns there,
    delta: Array = real(n_z)  #: changes of unknowns
    right: Array = real(n_z)
    f: Array = real(n_mu, unit="N, N m")  #: multipliers
    change: Array = real(n_mu)  #: changes of rows due to the motion over the step
    kept: Array = real(n_mu, unit="N, N m")
    elastic: Array = real(n_u, unit="N m")  #: modal forces in the middle of a variational step
    f_kept: Array = real(n_mu, unit="N, N m")  #: those of the last step
    f_size: Array = real(n_mu, unit="N, N m")  #: typical sizes of multipliers without constraints, from previous steps
    band: Array = real(2, n_z, Size("width"))  #: factors of the matrices of both stages
    band_pivot: IntArray = integer(2, n_z)
    is_due: IntArray = integer(2)  #: whether to factorise at the next iterate
    n_iterations: IntArray = integer()
    n_factors: IntArray = integer()
    excess: Array = real()
    state_change: Array = real()  #: largest relative correction of a state
    #: change of w over the last step divided by h, v in body axes; for the initial guess of Newton's method
    acceleration: Array = real(n_u)
