"""The compiled system as a record of records, so that the kernels are compiled once for all systems.

Sizes: n_b bodies, n_t types of bodies (instances share one), n_m markers, n_c connections (joints, spring-dampers and
all other parts with rows), n_w wrench components, as many as rows. All bodies together have n_q modes and
n_u = 6 n_b + n_q velocities. The velocities of body i, u[u0[i]:u0[i + 1]], are v_GO in ground axes (3), omega_B (3) and
q_dot. Fields whose name ends in 0 contain the first index of each item's part; most have one more entry, the end.
"""

from typing import NamedTuple

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.records import Size, integer, real, tabled

__all__ = [
    "BUSHING",
    "C1",
    "C2",
    "C3",
    "C4",
    "CONTACT",
    "COUPLER",
    "DAMPING",
    "ELEMENT",
    "JOINT",
    "K_ROTATION",
    "K_TRANSLATION",
    "MASS",
    "N_BLOCKS",
    "SPRING",
    "STIFFNESS",
    "S_AB",
    "USER_FORCE",
    "Angles",
    "Bodies",
    "BodyLoads",
    "BodyTypes",
    "Bushings",
    "Connections",
    "Contacts",
    "Coordinates",
    "Elements",
    "Elimination",
    "Functions",
    "Gaps",
    "JointForces",
    "JointRows",
    "Laws",
    "Lines",
    "Loads",
    "Markers",
    "Model",
    "Springs",
    "States",
    "Stations",
    "Tapes",
    "marker_shapes",
]

JOINT, SPRING, BUSHING, CONTACT, COUPLER, USER_FORCE, ELEMENT = range(7)  #: values of `Connections.law`
C1, C2, C3, S_AB, C4, MASS, STIFFNESS, DAMPING, K_TRANSLATION, K_ROTATION = range(10)  #: columns of `BodyTypes.block0`
N_BLOCKS = 10

n_b, n_t, n_m, n_c, n_w, n_ends, n_pairs = (Size(name) for name in ("n_b", "n_t", "n_m", "n_c", "n_w", "ends", "pairs"))
n_functions, n_pieces, n_springs, n_bushings = (Size(name) for name in ("functions", "pieces", "springs", "bushings"))
n_contacts, n_forces, n_elements, n_x = (Size(name) for name in ("contacts", "joint forces", "elements", "coordinates"))
n_lines, n_stations, n_states = (Size(name) for name in ("lines", "stations", "states"))
n_tapes, n_operations, n_loads, n_body_loads = (Size(name) for name in ("tapes", "operations", "loads", "body loads"))
n_angles, n_laws, n_gaps, n_q, n_u = (Size(name) for name in ("angles", "laws", "gaps", "n_q", "n_u"))


class Bodies(NamedTuple):
    """Bodies, and the positions of their parts in vectors and matrices."""

    kind: IntArray = integer(n_b)  #: index of its body type
    n_q: IntArray = integer(n_b)  #: number of its modes
    q0: IntArray = integer(n_b + 1)  #: index of its first mode in q
    u0: IntArray = integer(n_b + 1)  #: index of its first velocity in u
    h0: IntArray = integer(n_b + 1)  #: index of its matrix in the flat array of matrices
    size: Array = real(n_b, unit="m")  #: size of the group of connected bodies, the reference for errors of its motion
    end0: IntArray = integer(n_b + 1)  #: index of its first entry in `ends`
    ends: IntArray = integer(n_ends)  #: markers of each body that are ends of connections
    load0: IntArray = integer(n_b + 1)  #: index of its first entry in `loaded`
    loaded: IntArray = integer(Size("loaded"))  #: markers of each body that carry loads


class BodyTypes(NamedTuple):
    """Data shared by all bodies of one type, in the body frame."""

    mass: Array = real(n_t, unit="kg")
    S: Array = real(n_t, 3, unit="kg m")  #: first moment
    J0: Array = real(n_t, 3, 3, unit="kg m²")  #: inertia about the frame origin, undeformed
    axis: Array = real(n_t, 3)  #: symmetry axis of the inertia about the centre of mass; zero if there is none
    #: C1 [a,k], C2 [a,k], C3 [ab,k], S_ab [l,ab,k], C4 [l,a,k], M, K, D; for stiffened types (with larger S_ab, see
    #: compiling/stiffening.py) also K_t [l,a,k], K_r [l,a,k]; all types in one flat array
    blocks: Array = real(Size("numbers of types"), unit="kg m^n, K: N/m, D: N s/m")
    block0: IntArray = integer(n_t, N_BLOCKS)  #: index of each of these arrays in `blocks`
    is_diagonal: IntArray = integer(n_t, 3)  #: whether M, K, D are stored as diagonals
    #: whether K_t or K_r, geometric stiffness of unit loads, is not zero; in mean axes both are
    has_unit_loads: IntArray = integer(n_t)


class Markers(NamedTuple):
    """Markers; in the list of each body, markers of connections come first."""

    body: IntArray = integer(n_m)  #: index of its body, -1 for the ground
    position: Array = real(n_m, 3, unit="m")  #: position on the undeformed body, body frame
    triad: Array = real(n_m, 3, 3)  #: axes on the undeformed body as columns, body frame
    psi0: IntArray = integer(n_m)  #: index of its shapes Psi [6, n_q] in `psi`, -1 for none
    psi: Array = real(Size("numbers of psi"), unit="m, rad")
    bend0: IntArray = integer(n_m)  #: index of its matrices K_P [l, 6, k] in `bend`, -1 for none
    bend: Array = real(Size("numbers of bend"), unit="m, rad")
    same: IntArray = integer(n_m)  #: earlier marker with the same place and shapes in the same body, -1 for none
    connection: IntArray = integer(n_m)  #: connection of which the marker is an end, -1 for none
    sign: Array = real(n_m)  #: sign of the wrench: +1 at end A, -1 at end B
    force: IntArray = integer(n_m)  #: index of the marker's force in the wrench of its connection, -1 for none
    moment: IntArray = integer(n_m)  #: index of the marker's moment in the wrench of its connection, -1 for none
    is_follower: IntArray = integer(n_m)  #: whether the wrench rotates with the marker
    x0: IntArray = integer(n_m)  #: offset of its columns: sum of 6 + n_q over the previous ends
    line: IntArray = integer(n_m)  #: line along which the marker slides, -1 for none
    #: number of the marker among those whose acceleration is an input of a law, or -1
    accelerated: IntArray = integer(n_m)
    #: offset of its acceleration columns: sum of 6 + n_q over the previous accelerated ends
    a0: IntArray = integer(n_m)


class Connections(NamedTuple):
    """Joints, spring-dampers, bushings, contacts, couplers, user forces, elements: all parts with rows and unknowns."""

    size: IntArray = integer(n_c)  #: number of wrench components, equal to the number of rows
    w0: IntArray = integer(n_c + 1)  #: index of the first wrench component and row
    a: IntArray = integer(n_c)  #: marker A
    b: IntArray = integer(n_c)  #: marker B
    law: IntArray = integer(n_c)  #: JOINT, SPRING, BUSHING, CONTACT, COUPLER, USER_FORCE or ELEMENT
    item: IntArray = integer(n_c)  #: number among the connections with the same law
    has_rates: IntArray = integer(n_c)  #: whether the rows of the connection depend on velocities


class JointRows(NamedTuple):
    """Rows of joints, see joints/rows/kinds.py."""

    kind: IntArray = integer(n_w)
    holds: IntArray = integer(n_w)  #: NOTHING, POSITION or VELOCITY
    is_length: IntArray = integer(n_w)  #: whether the constrained quantity is a length
    is_angle: IntArray = integer(n_w)  #: whether the coordinate of the row is an angle
    is_loaded: IntArray = integer(n_w)  #: whether forces act along the coordinate of the row
    x: Array = real(n_w, 3)
    y: Array = real(n_w, 3)
    z: Array = real(n_w, 3)
    u: Array = real(n_w, 3)
    c: Array = real(n_w, unit="m or rad")
    part: IntArray = integer(n_w)  #: index of the wrench component that the row defines
    motion: IntArray = integer(n_w)  #: number of the function of time in the row, -1 for none
    #: compliance divided by c_k, nonzero only for redundant constraints
    soft: Array = real(n_w, unit="1/kg or 1/(kg m²)")
    force0: IntArray = integer(n_w)  #: index of the first force along the row's coordinate
    force1: IntArray = integer(n_w)  #: index after the last force along the row's coordinate


class JointForces(NamedTuple):
    """Forces along coordinates of joints, sorted by row, see kernels/joints/coordinate_force.py."""

    stiffness: Array = real(n_forces, unit="N/m or N m")
    free: Array = real(n_forces, unit="m or rad")
    damping: Array = real(n_forces, unit="N s/m or N m s")
    preload: Array = real(n_forces, unit="N or N m")
    friction: Array = real(n_forces, unit="N or N m")
    coefficient: Array = real(n_forces, unit="1 or m")  #: coefficient of friction that depends on the normal force
    speed: Array = real(n_forces, unit="m/s or rad/s")  #: speed at which friction is 76 % of its value
    motor: IntArray = integer(n_forces)  #: function of time of the motor force, -1 for none
    table: IntArray = integer(n_forces)  #: function of the coordinate for a tabulated force, -1 for none


class Functions(NamedTuple):
    """Functions of time and of coordinates, in pieces, see functions/time_functions.py."""

    piece0: IntArray = integer(n_functions + 1)
    begin: Array = real(n_pieces, unit="s, or that of the coordinate")  #: time or coordinate at which each piece begins
    piece: Array = real(n_pieces, 9, unit="that of the value")  #: coefficients of each piece


class Springs(NamedTuple):
    """Spring-dampers."""

    stiffness: Array = real(n_springs, unit="N/m")
    damping: Array = real(n_springs, unit="N s/m")
    free_length: Array = real(n_springs, unit="m")
    preload: Array = real(n_springs, unit="N")
    table: IntArray = integer(n_springs)  #: function that gives tension by elongation, -1 for none


class Bushings(NamedTuple):
    """Bushings with six deformations: three distances and three angles."""

    stiffness: Array = real(n_bushings, 6, 6, unit="N/m, N, N m")
    damping: Array = real(n_bushings, 6, 6, unit="N s/m, N s, N m s")
    preload: Array = real(n_bushings, 6, unit="N, N m")
    #: function that gives force by deformation for each direction, -1 for none
    table: IntArray = integer(n_bushings, 6)
    #: fraction of the relative rotation in the bushing axes: 0 for axes of A, 1 for axes of B
    share: Array = real(n_bushings)
    angle: IntArray = integer(n_bushings)  #: index of the first of three counted angles of the bushing, -1 for none


class Contacts(NamedTuple):
    """Contacts of a sphere on B with a plane or a sphere on A."""

    is_sphere: IntArray = integer(n_contacts)  #: whether the surface on A is a sphere
    radius_a: Array = real(n_contacts, unit="m")
    radius_b: Array = real(n_contacts, unit="m")
    stiffness: Array = real(n_contacts, unit="N/m^n")  #: stiffness k
    exponent: Array = real(n_contacts)  #: exponent n of the depth
    dissipation: Array = real(n_contacts)  #: dissipation factor h
    friction: Array = real(n_contacts)  #: coefficient of friction mu
    slip_speed: Array = real(n_contacts, unit="m/s")  #: regularisation speed v_s of friction
    slow: Array = real(n_contacts, unit="m/s")  #: smallest approach speed used in the damping law


class Gaps(NamedTuple):
    """Gaps between bodies that can touch, see kernels/connections/gap.py."""

    connection: IntArray = integer(n_gaps)  #: contact or element to which the gap belongs
    output: IntArray = integer(n_gaps)  #: element output that gives the gap, -1 for a contact
    stiffness: Array = real(n_gaps, unit="N/m^n, N m/rad^n")  #: stiffness k of the contact
    exponent: Array = real(n_gaps)  #: exponent n of the depth


class Elements(NamedTuple):
    """Couplers, then user forces: connections that act along coordinates, see connections/coordinate.py."""

    coordinate0: IntArray = integer(n_elements + 1)
    core: IntArray = integer(n_elements)  #: row of the multiplier of a coupler, or of the first force of a user force
    n_forces: IntArray = integer(n_elements)  #: forces of a user force, 0 for a coupler
    n_states: IntArray = integer(n_elements)
    address: IntArray = integer(n_elements)  #: address of the user's C function, 0 if the force is made of expressions
    #: index of the first expression of a user force: forces come first, then rates of the states
    tape0: IntArray = integer(n_elements)
    state0: IntArray = integer(n_elements + 1)  #: index of the first state


class Coordinates(NamedTuple):
    """Coordinates of couplers and user forces, and the forces along them."""

    a: IntArray = integer(n_x)  #: marker A
    b: IntArray = integer(n_x)  #: marker B
    #: row of the coordinate's value, of kind PUSH, TWIST or SPAN; the row of its rate follows
    row: IntArray = integer(n_x)
    force: IntArray = integer(n_x)  #: first of three rows of the force or torque, -1 for none
    arm: IntArray = integer(n_x)  #: first of three rows of the moment on A, -1 for none
    #: coefficient of the coordinate in its coupler
    factor: Array = real(n_x, unit="that of the coupler by that of the coordinate")
    core: IntArray = integer(n_x)  #: row of the unknown force, or of the multiplier of the coupler
    size: Array = real(n_x, unit="m, rad")  #: range of the coordinate over which the function of a user force changes
    speed: Array = real(n_x, unit="m/s, rad/s")  #: range of the rate over which the function of a user force changes


class Lines(NamedTuple):
    """Deformed lines with a marker that slides, see kernels/joints/deformed_line.py."""

    marker: IntArray = integer(n_lines)  #: sliding marker, whose stored position belongs to s = 0
    other: IntArray = integer(n_lines)  #: marker B, on the other body
    row: IntArray = integer(n_lines)  #: row that prescribes s, -1 for none
    axis: Array = real(n_lines, 3)  #: unit vector along the line, body axes
    station0: IntArray = integer(n_lines + 1)


class Stations(NamedTuple):
    """Stations of deformed lines."""

    s: Array = real(n_stations, unit="m")  #: coordinate of the station along the line
    marker: IntArray = integer(n_stations)


class Laws(NamedTuple):
    """Public elements: laws that are called by address, see connections/element_law.py."""

    address: IntArray = integer(n_laws)  #: address of the C function of the values
    tangent: IntArray = integer(n_laws)  #: address of the C function of the derivatives
    #: whether the derivatives take an evaluation of the law for each input
    is_costly: IntArray = integer(n_laws)
    #: numbers of markers, inputs of each marker, states, multipliers, outputs, data and moving markers, then 0
    head: IntArray = integer(n_laws, 8)
    data0: IntArray = integer(n_laws + 1)  #: index of the first data entry of each law
    #: data of each law, followed by the sizes of its inputs, see law_templates.py
    data: Array = real(Size("numbers of laws"))
    row0: IntArray = integer(n_laws + 1)  #: index of the first wrench row of each law in `source` and `factor`
    #: index of the wrench component in the results of the function
    source: IntArray = integer(Size("wrench rows of laws"))
    factor: Array = real(Size("wrench rows of laws"))  #: sign between the result and the unknown of the row, 1 or -1
    state0: IntArray = integer(n_laws + 1)  #: index of the first state of each law among all states
    equation: IntArray = integer(Size("equations of laws"))  #: multiplier rows that are not constraints
    #: typical size of the multiplier
    equation_size: Array = real(Size("equations of laws"), unit="that of the multiplier")
    length: Array = real(n_laws, unit="m")  #: length over which the law changes
    time: Array = real(n_laws, unit="s")  #: time over which the law changes by explicit dependence on time; 0: unknown
    #: index of the outputs for stored energy, supplied power and dissipated power, -1 for none
    energy: IntArray = integer(n_laws)
    given: IntArray = integer(n_laws)
    lost: IntArray = integer(n_laws)
    stop0: IntArray = integer(n_laws + 1)  #: index of the first entry in `stop` of each law
    stop: IntArray = integer(Size("stops of laws"))  #: numbers of the outputs that end a run when they are above zero


class States(NamedTuple):
    """States of user forces and elements."""

    row: IntArray = integer(n_states)  #: row of the state's value; the rows of its rate and algorithmic rate follow
    start: Array = real(n_states, unit="that of the state")  #: initial value of the state
    size: Array = real(n_states, unit="that of the state")  #: typical size of the state, the reference for convergence


class Tapes(NamedTuple):
    """Expressions as lists of operations, see floatframe/model/functions/expressions.py."""

    operation0: IntArray = integer(n_tapes + 1)
    op: IntArray = integer(n_operations)  #: code of the operation
    a: IntArray = integer(n_operations)  #: first operand
    b: IntArray = integer(n_operations)  #: second operand
    c: Array = real(n_operations)  #: constant of the operation


class Loads(NamedTuple):
    """Forces and torques on markers."""

    marker: IntArray = integer(n_loads)
    factor: IntArray = integer(n_loads)  #: function of time that multiplies the load, -1 for none
    force: Array = real(n_loads, 3, unit="N")
    torque: Array = real(n_loads, 3, unit="N m")


class BodyLoads(NamedTuple):
    """Load cases on bodies."""

    body: IntArray = integer(n_body_loads)
    factor: IntArray = integer(n_body_loads)  #: function of time that multiplies the load case
    value0: IntArray = integer(n_body_loads)  #: index in `values` of force (3), torque (3) and modal forces
    values: Array = real(Size("numbers of body loads"), unit="N, N m, N")


class Elimination(NamedTuple):
    """Block elimination of the connections, see kernels/schur.py: storage and order of the blocks."""

    order: IntArray = integer(n_c)  #: connections in the order of elimination
    diagonal: IntArray = integer(n_c)  #: index of each diagonal block in the array of blocks
    upper: IntArray = integer(n_c)  #: index of the blocks right of the diagonal block, one matrix with `width` columns
    lower: IntArray = integer(n_c)  #: index of the blocks below the diagonal block, one matrix with `width` rows
    width: IntArray = integer(n_c)  #: number of rows of all neighbours that are eliminated later
    n_store: IntArray = integer()  #: length of the array of blocks
    pair0: IntArray = integer(n_b + 1)  #: pairs of ends on body i are pair0[i]:pair0[i + 1]
    pair_row: IntArray = integer(n_pairs)  #: for each pair: marker whose connection has the rows
    pair_column: IntArray = integer(n_pairs)  #: marker whose connection has the wrench
    pair_block: IntArray = integer(n_pairs)  #: index of the block in the array of blocks
    pair_stride: IntArray = integer(n_pairs)  #: distance of its rows in the array of blocks
    after0: IntArray = integer(n_c + 1)  #: neighbours eliminated later than order[k] are after0[k]:after0[k + 1]
    after: IntArray = integer(Size("neighbours"))  #: neighbour i of each elimination step
    #: an elimination changes rows of each of its neighbours: first of the runs of columns that it changes
    run0: IntArray = integer(Size("neighbours and one"))
    run: IntArray = integer(Size("runs"))  #: index of each run of columns in the array of blocks
    run_stride: IntArray = integer(Size("runs"))  #: distance of its rows in the array of blocks
    run_length: IntArray = integer(Size("runs"))  #: number of its columns


class Angles(NamedTuple):
    """Angles between bodies whose turns are counted, see kernels/turns.py; directions in the frames of their bodies."""

    holder: IntArray = integer(n_angles)  #: body that carries the axis of rotation, -1 for the ground
    other: IntArray = integer(n_angles)  #: body that rotates about this axis, -1 for the ground
    x: Array = real(n_angles, 3)  #: direction fixed in the holder, normal to its axis x × z
    z: Array = real(n_angles, 3)  #: direction fixed in the holder; a positive angle rotates y from z towards -x
    y: Array = real(n_angles, 3)  #: direction fixed in the other body
    sign: Array = real(n_angles)  #: -1 if the angle is counted in the opposite sense
    #: component 0, 1 or 2 of a rotation vector, with y the axis of this number in B; -1 for a single angle
    part: IntArray = integer(n_angles)


@tabled
class Model(NamedTuple):
    """A compiled system."""

    gravity: Array = real(3, unit="m/s²")
    bodies: Bodies = Bodies()
    body_types: BodyTypes = BodyTypes()
    markers: Markers = Markers()
    connections: Connections = Connections()
    rows: JointRows = JointRows()
    joint_forces: JointForces = JointForces()
    functions: Functions = Functions()
    springs: Springs = Springs()
    bushings: Bushings = Bushings()
    contacts: Contacts = Contacts()
    gaps: Gaps = Gaps()
    elements: Elements = Elements()
    coordinates: Coordinates = Coordinates()
    lines: Lines = Lines()
    stations: Stations = Stations()
    laws: Laws = Laws()
    states: States = States()
    tapes: Tapes = Tapes()
    loads: Loads = Loads()
    body_loads: BodyLoads = BodyLoads()
    angles: Angles = Angles()
    elimination: Elimination = Elimination()


def marker_shapes(model: Model, psi: Array, m: int) -> Array:
    """Return the shapes of marker m, (6, n_q); psi: of all markers, undeformed or of an iterate."""
    n, first = int(model.bodies.n_q[model.markers.body[m]]), int(model.markers.psi0[m])
    return psi[first : first + 6 * n].reshape(6, n)
