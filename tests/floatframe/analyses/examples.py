"""Systems, bodies and helpers that several tests share: linear sensors, recovery sensors."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FlexibleBody,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    State,
    System,
    UserForce,
    static_equilibrium,
)
from floatframe.analyses import consistent_state, snapshot
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced, in_ground_axes
from floatframe.forces import Bushing
from floatframe.joints import AxialDistance, CoordinateCoupler, JointCoordinate
from floatframe.model.rotations import rotation_matrix
from floatframe.results.sensors.places import PLACE_QUANTITIES, TURNING
from floatframe.sensors import (
    AngleSensor,
    Channel,
    ControlSensor,
    CouplerSensor,
    DisplacementSensor,
    ElongationSensor,
    InterfaceForceSensor,
    ModeSensor,
    MomentumSensor,
    PlaceSensor,
    ReactionSensor,
    SpringSensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
    measured,
)
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

LOADED = ("root", "axle", "stay", "mount")
TURN = np.array([[0.0, -0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, 0.6]])


def flexible(seed=3):
    points, K = random_point_masses(3, seed, softness=0.1), stiffness(3, omega=12.0)
    D = 0.02 * K + 0.1 * np.diag([1.0, 2.0, 3.0])
    reduced = reduced_body(points, K, D=D)
    return replace(reduced, stress=np.random.default_rng(0).normal(size=(40, 6, 3)))


def machine(*forces):
    """A flexible arm on a hinge, a block in a bushing at its end, a wheel on it geared to the hinge, a stay, a link."""
    arm = FlexibleBody("arm", flexible())
    end = arm.reduced.interface("end_a").position
    inertia, middle = np.diag([0.02, 0.03, 0.04]), (0, 0.02, 0)
    block = RigidBody("block", 1.3, inertia, position=end + np.array([0.1, 0.0, -0.05]), center_of_mass=middle)
    overhang = (0.06, 0, 0)  # along its axle, which so carries a moment
    place = end + np.array([0.1, 0.2, -0.05])
    wheel = RigidBody("wheel", 0.4, np.diag([0.01, 0.02, 0.02]), position=place, center_of_mass=overhang)
    joints = [
        RevoluteJoint("root", GROUND, Marker("arm", "end_b"), axis=(0, 1, 0)),
        RevoluteJoint("axle", Marker("block", position=(0, 0.2, 0), triad=TURN), "wheel", axis=(1, 0, 0)),
        CoordinateCoupler("gear", [(JointCoordinate("root", "angle"), 2.0), (JointCoordinate("axle", "angle"), -1.0)]),
    ]
    link = AxialDistance(Marker(GROUND, position=(0.5, -1.5, 0.3)), Marker("block"), (0, 1, 0))
    return System(
        [arm, block, wheel],
        joints,
        [
            Gravity((0, 0, -9.81)),
            JointForce("return", "root", "angle", stiffness=6.0, damping=0.2, preload=0.3),
            Bushing("mount", Marker("arm", "end_a", triad=TURN), Marker("block", position=(-0.1, 0, 0.05)),
                    [400, 500, 600, 9, 8, 7], [3, 2, 4, 0.1, 0.2, 0.1]),
            SpringDamper("stay", Marker(GROUND, position=(0, 3, 2)), Marker("arm", "end_a"), 60.0, 0.7, preload=4.0),
            UserForce("control", {"x": link}, {"x": "-k*(x - 1.0) - c*x_dot + 0.2*x**2"},
                      parameters={"k": 30.0, "c": 1.5}),
            *forces,
        ],
    )  # fmt: skip


def sensors():
    arm = flexible()
    node, other = arm.nodes[5], arm.nodes[7]
    places = [Marker("arm", position=node), Marker("block", position=(0.1, 0.2, 0.3)), Marker("arm", "end_a")]
    return [
        *(PlaceSensor(f"{what} {k}", place, what) for what in PLACE_QUANTITIES for k, place in enumerate(places)
          if k or what not in TURNING),
        *(PlaceSensor(f"seen {what}", places[1], what, places[2]) for what in PLACE_QUANTITIES),
        *(ReactionSensor(f"{of} {axes}", of, axes) for of in LOADED for axes in ("ground", "marker")),
        *(InterfaceForceSensor(f"on {end} {axes}", "arm", end, axes) for end in ("end_a", "end_b")
          for axes in ("ground", "body")),
        SpringSensor("spring", "stay"),
        AngleSensor("angle", places[2], places[1], axis=(0.6, 0, 0.8)),
        ControlSensor("control", "control"), CouplerSensor("gear", "gear"),
        JointCoordinate("root", "angle", "root angle"), JointCoordinate("axle", "angle", "axle angle"),
        DisplacementSensor("bend", places[2]), DisplacementSensor("node", places[0]),
        ElongationSensor("gauge", "arm", node, other), ModeSensor("mode", "arm", 2), MomentumSensor("momentum"),
        StressSensor("stress", "arm", position=node), VonMisesSensor("vm", "arm"),
        StrainGauge("strain", "arm", (0.6, 0, 0.8), 2e3, 0.3, position=node),
        Channel("across", places[1], (0, 0.6, 0.8), rate=2),
        Channel("against", places[2], (1, 0, 0), relative_to=places[1], rate=1),
        JointCoordinate("axle", "angle", "turning", rate=1),
    ]  # fmt: skip


def values_of(system, state, u_dot, w, names, given=None):
    found = measured(system, snapshot(system, state, u_dot, w), sensors() if given is None else given)
    columns = {}
    for sensor, each in found.items():
        for column, value in each.columns.items():
            columns[f"{sensor}.{column}"] = columns[sensor] = value[0]
    return np.array([columns[name] for name in names])


def near(system, about, linear, z, z_dot):
    """The equations of motion solved at a state z, z_dot away: state, accelerations and wrenches."""
    model, at = compiled_system(system).model, about.state
    xi = linear.N @ z
    moved = displaced(model, at, in_ground_axes(model, at, xi))
    u, nu = at.u.copy(), linear.N @ z_dot
    for i, u0 in enumerate(model.bodies.u0[:-1]):
        v, turn = slice(u0, u0 + 3), slice(u0 + 3, u0 + 6)
        omega, R = at.u[turn], rotation_matrix(at.p[i])
        u[v] += R @ (nu[v] + np.cross(omega, xi[v]))
        u[turn] = omega + nu[turn] + np.cross(omega, xi[turn])
        u[u0 + 6 : model.bodies.u0[i + 1]] = nu[u0 + 6 : model.bodies.u0[i + 1]]
    made = consistent_state(system, State(moved.r, moved.p, moved.q, u), known=about.w)
    return made.state, made.u_dot, made.w


def compare(system, about, linear, given=None, *, size=2e-5, tolerance=2e-7, seed=0):
    """y of states on both sides against L z + L_rate z' + L_acceleration z'', z'' by the linear equations."""
    rng = np.random.default_rng(seed)
    for _ in range(2):
        z, z_dot = (size * rng.normal(size=linear.n_z) for _ in range(2))
        z_ddot = -np.linalg.solve(linear.M, linear.C @ z_dot + linear.K @ z)
        terms = [(linear.L, z), (linear.L_rate, z_dot), (linear.L_acceleration, z_ddot)]
        y, scale = (sum(f(L) @ f(x) for L, x in terms) for f in (np.asarray, np.abs))
        slopes, largest = [], 0.0
        for h in (1.0, 0.5):
            states = (near(system, about, linear, s * z, s * z_dot) for s in (h, -h))
            plus, minus = (values_of(system, *state, linear.outputs, given) for state in states)
            slopes.append((plus - minus) / (2 * h))
            largest = max(largest, np.abs(plus).max())
        rounding = 16 * np.finfo(float).eps * largest  # of what is zero, such as the moment about the axis of a hinge
        of_fourth_order = (4 * slopes[1] - slopes[0]) / 3
        error = np.abs(y - of_fourth_order) / (scale + 1e-4 * size + rounding / tolerance)
        worst = int(error.argmax())
        assert error[worst] < tolerance, f"{linear.outputs[worst]}: {error[worst]:.2g}"


def rotor():
    """A hub that turns about z with a flexible blade in a bushing, a ball on a spring and one on a joint."""
    blade = FlexibleBody("blade", flexible(5))
    root = blade.reduced.interface("end_b").position
    hub = RigidBody("hub", 3.0, np.diag([0.2, 0.2, 0.3]))
    ball = RigidBody("ball", 0.2, 0.01 * np.eye(3), position=(0, -0.9, 0.1))
    pin = RigidBody("pin", 0.3, np.diag([0.01, 0.02, 0.03]), position=(0, 0.6, 0), center_of_mass=(0, 0.2, 0))
    joints = [
        RevoluteJoint("main", GROUND, Marker("hub", triad=TURN), axis=(0, 0, 1)),
        RevoluteJoint("knuckle", Marker("hub", position=(0, 0.6, 0), triad=TURN), "pin", axis=(0, 0.8, 0.6)),
    ]
    forces = [
        Bushing(
            "root",
            Marker("hub", position=root, triad=TURN),
            Marker("blade", "end_b"),
            [9e3, 8e3, 7e3, 900, 800, 700],
            [3, 2, 4, 1, 2, 1],
        ),
        Bushing("cage", Marker("hub", position=(0, -0.8, 0.1)), Marker("ball"), [400, 600, 500, 50, 60, 70]),
        SpringDamper(
            "tie", Marker("hub", position=(0.3, 0.2, 0.3)), Marker("pin", position=(0, 0.3, 0)), 40.0, 0.5, 0.4
        ),
    ]
    return System([hub, blade, ball, pin], joints, forces)  # fmt: skip


def held(bar, *forces):
    root, tip = (interface.name for interface in bar.interfaces)
    joint = RevoluteJoint("hinge", GROUND, Marker("bar", root), axis=(0, 1, 0))
    stay = SpringDamper("stay", Marker(GROUND, position=(0.3, 0.2, 2.0)), Marker("bar", tip), 3e4, 20.0)
    return System([FlexibleBody("bar", bar)], [joint], [Gravity((0, 0, -9.81)), stay, *forces])


def slope_at_once(linear):
    """Return the slopes of outputs by inputs while positions and velocities stay."""
    return linear.D + linear.L_acceleration @ np.linalg.solve(linear.M, linear.B)


def assert_slopes(linear, changed, about, s, *, rtol, atol):
    """Compare the slopes by one input, at once and in equilibrium, with differences of systems that have it."""
    found = {True: [], False: []}
    for size in (s, -s):
        other = changed(size)
        made = consistent_state(other, about.state, known=about.w)
        found[True].append(values_of(other, made.state, made.u_dot, made.w, linear.outputs))
        moved = static_equilibrium(other, about.state, tolerance=1e-12)
        found[False].append(values_of(other, moved.state, moved.u_dot, moved.w, linear.outputs))
    for is_at_once, slope in ((True, slope_at_once(linear)), (False, linear.response([0.0])[0].real)):
        plus, minus = found[is_at_once]
        difference = (plus - minus) / (2 * s)
        scale = np.abs(difference).max()
        assert_allclose(slope[:, 0], difference, rtol=rtol, atol=atol * scale)
        assert scale > 1e-3
