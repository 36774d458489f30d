"""State spaces in named states, for other programs; a loop closed by python-control and by the motion itself."""

from dataclasses import replace

import control
import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import loadmat
from scipy.linalg import block_diag

import cms
import fe_models as fm
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    State,
    System,
    UserForce,
    integrate,
    linearize,
)
from floatframe.analyses import consistent_state, named_state_space, write_state_space
from floatframe.components.mechanisms import double_pendulum, pendulum
from floatframe.errors import ModelError
from floatframe.integrators import trapezoidal
from floatframe.joints import AxialDistance, JointCoordinate, UniversalJoint
from floatframe.model.bodies.mode_choice import with_modes
from floatframe.model.rotations import euler_parameters, euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.sensors import Channel, ControlSensor, measured

LENGTH = 1.2


@pytest.fixture(scope="module")
def rod():
    """A slender beam with its two lowest bending modes in the plane of the mechanism."""
    line = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), 6)
    ends = [fm.beams.line_interface(line, end, fm.selections.NodeSet(end)) for end in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.006, 0.04), fm.Material("rod", 70e9, 0.3, 2700.0))
    body = fm.couple(fm.beam_body(line, section, name="rod", units=fm.unit_system("m-kg-s"), interfaces=ends))
    return with_modes(cms.reduce(body, cms.craig_bampton(body, n_modes=1), frame=cms.TisserandFrame()), [0, 1])


@pytest.fixture(scope="module")
def linear(rod):
    """An arm in weightlessness: torque at its hinge, its angle and the place of its tip across it."""
    arm = pendulum(rod=rod, length=LENGTH, gravity=0.0)
    outputs = [JointCoordinate("hinge 1", "angle", "angle", rate=0), Channel("tip", Marker("rod 1", "end"), (0, 1, 0))]
    return arm, linearize(arm, inputs=[JointCoordinate("hinge 1", "angle", "torque", rate=0)], outputs=outputs)


def test_states_are_joint_coordinates_and_modes_with_units(linear):
    space = named_state_space(linear[1])
    assert space.states[:3] == ("hinge 1.angle", "rod 1 mode 1", "rod 1 mode 2")
    assert space.states[3:] == tuple(f"{name} rate" for name in space.states[:3])
    assert space.state_units == ("rad", "kg^(1/2) m", "kg^(1/2) m", "rad/s", "kg^(1/2) m/s", "kg^(1/2) m/s")
    assert_allclose(space.C[0], [1, 0, 0, 0, 0, 0], rtol=0, atol=1e-9)  # the angle is a state


def test_transfer_functions_are_those_of_the_matrices(linear):
    """C (s - A)⁻¹ B + D against L (K + s C + s² M)⁻¹ B, gravity and two rods included."""
    heavy = double_pendulum(angles=(-1.0, -1.2))
    other = linearize(
        heavy,
        inputs=[JointCoordinate("hinge 1", "angle", "torque", rate=0)],
        outputs=[JointCoordinate("hinge 2", "angle", "rate", rate=1)],
    )
    assert set(named_state_space(other).states[:2]) == {"hinge 1.angle", "hinge 2.angle"}
    for each in (linear[1], other):
        space = named_state_space(each)
        for f in (0.3, 20.0):
            s = 2j * np.pi * f
            found = space.C @ np.linalg.solve(s * np.eye(len(space.A)) - space.A, space.B) + space.D
            expected = each.response([f])[0]
            assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("units", ["m-kg-s", "mm-t-s", "in-slinch-s"])
def test_slow_motions_are_right_beside_modes_a_million_times_as_fast(units):
    """A stiff beam with a block at its end turns on a hinge as a rigid body: rate per torque 1 / (s I)."""
    unit, e = fm.unit_system(units), np.array([0.0, 0.6, 0.8])

    def of(value, length=0, mass=0, time=0):
        return value / unit.to_si(length=length, mass=mass, time=time)

    EI, J, J_block = of(1e9, 3, 1, -2), of(1e-3, 1, 1), of(np.diag([0.02, 0.03, 0.04]), 2, 1)
    line = fm.beams.BeamLine(of(1.0, 1), of(1.0, -1, 1), of(1e12, 1, 1, -2), EI, 1.5 * EI, EI, J, J)
    beam = cms.reduction.beam_from_assumed_modes(line, name="beam", units=unit, n_axial=1, n_bending=2, n_torsion=1)
    bodies = [FlexibleBody("beam", beam), RigidBody("block", of(2.0, 0, 1), J_block, position=(of(1.0, 1), 0, 0))]
    at_hinge, at_block = Marker(GROUND, position=np.zeros(3)), Marker("block", position=np.zeros(3))
    joints = [RevoluteJoint("hinge", at_hinge, Marker("beam", "start"), axis=e),
              FixedJoint("weld", Marker("beam", "end"), at_block)]  # fmt: skip
    ends = [JointCoordinate("hinge", "angle", "torque", rate=0)], [JointCoordinate("hinge", "angle", "rate", rate=1)]
    linear = linearize(System(bodies, joints, (), unit), inputs=ends[0], outputs=ends[1])
    space, s = named_state_space(linear), 2j * np.pi * of(0.01, time=-1)
    inertia = e @ J_block @ e + of(2.0 + 1 / 3 + 1e-3, 2, 1)  # of block and beam about the hinge
    for found in (space.C @ np.linalg.solve(s * np.eye(len(space.A)) - space.A, space.B) + space.D,
                  linear.response([of(0.01, time=-1)])[0]):  # fmt: skip
        assert_allclose(found * s * inertia, 1.0, rtol=1e-8, atol=0)


@pytest.mark.parametrize(("apart", "off"), [(1.0, 0.0), (1.0, 1e4), (1e-3, 1e4), (1e-8, 0.0)])
def test_joint_coordinates_of_a_held_body_are_no_states(apart, off):
    """A body spins on two points, and holds another one, whose universal joint to the ground moves by rounding alone.

    Closed form: I phi'' + c phi' + k phi = e · (r × f) of a force f at r, I about the axis e. States of rounding had
    entries of 1e15.
    """
    R = rotation_matrix(euler_parameters_of_rotation_vector(np.array([0.3, -0.5, 0.8])))
    place, m, J, k, c = off * np.array([0.6, 0.8, -0.3]), 2.0, np.diag([0.1, 0.12, 0.14]), 30.0, 0.1
    at_A, at_B = (place + R @ np.array(x) for x in ((0.1, 0.2, 0.05), (0.1, -0.2, 0.3)))
    bodies = [RigidBody("A", m, J, position=at_A), RigidBody("B", 1.0, J, position=at_B)]

    def marker(name, *x):
        begin = {"A": at_A, "B": at_B, GROUND: np.zeros(3)}[name]
        return Marker(name, position=place + R @ np.array(x) - begin)

    joints = [
        UniversalJoint("cross", marker(GROUND, 0, 0, 0), marker("B", 0, 0, 0), axis=R[:, 0], axis_b=R[:, 1]),
        SphericalJoint("low", marker(GROUND, 0, 0, 0), marker("A", 0, 0, 0)),
        SphericalJoint("high", marker(GROUND, 0, 0, apart), marker("A", 0, 0, apart)),
        RevoluteJoint("hinge", marker("A", 0, 0, 0.3), marker("B", 0, 0, 0.3), axis=R[:, 2]),
    ]
    spring = JointForce("spring", "hinge", "angle", stiffness=k, damping=c)
    system = System(bodies, joints, [spring], redundant="minimum-norm")
    push, angle = Channel("push", marker("A", 0.3, 0.1, 0.2), R[:, 1]), JointCoordinate("hinge", "angle", rate=0)
    space = named_state_space(linearize(system, inputs=[push], outputs=[angle]))
    assert space.states == ("hinge.angle", "hinge.angle rate")
    e, r = R[:, 2], R @ np.array([0.1, 0.2, 0.05])
    inertia = e @ J @ e + m * (r @ r - (e @ r) ** 2)
    close = 1e-9 + 10 * np.finfo(float).eps * max(off, 1.0) / apart  # rounding of places turns the axis
    assert_allclose(space.A, [[0, 1], [-k / inertia, -c / inertia]], rtol=close, atol=0)
    assert_allclose(space.B[1], -0.3 / inertia, rtol=close)  # the angle is that of B relative to A
    assert_allclose(space.C, [[1, 0]], rtol=0, atol=close)


def test_python_control_and_scipy_get_the_same_system(linear):
    space = named_state_space(linear[1])
    system = space.control()
    assert system.state_labels[:2] == ["hinge 1 angle", "rod 1 mode 1"]
    assert (system.input_labels, system.output_labels) == (["torque"], ["angle", "tip"])
    for name in "ABCD":
        assert_allclose(getattr(system, name), getattr(space.scipy(), name), rtol=0, atol=0)


def test_files_hold_matrices_names_and_units(linear, tmp_path):
    space = named_state_space(linear[1])
    for ending in (".npz", ".mat", ".h5"):
        write_state_space(linear[1], tmp_path / f"arm{ending}")
    archive = np.load(tmp_path / "arm.npz")
    mat = loadmat(tmp_path / "arm.mat")
    with h5py.File(tmp_path / "arm.h5") as file:
        tree = {name: file[name][()] for name in "ABCD"} | {"states": list(file.attrs["states"])}
    for name in "ABCD":
        for found in (archive, mat, tree):
            assert_allclose(found[name], getattr(space, name), rtol=0, atol=0)
    assert tuple(archive["states"]) == tuple(tree["states"]) == space.states
    assert tuple(str(each[0]) for each in mat["states"].ravel()) == space.states
    assert tuple(archive["state_units"]) == space.state_units
    with pytest.raises(ModelError, match=r"arm\.txt: expected a file name that ends in \.npz, \.mat, \.h5"):
        write_state_space(linear[1], tmp_path / "arm.txt")


def controller(linear):
    """Return a regulator with an observer (LQG) for the plant, of angle and tip, as a python-control system."""
    plant = named_state_space(linear).control()
    wanted = 1e3 * plant.C.T @ plant.C + 0.5 * np.diag([0] * 3 + [1] * 3)
    K, _, _ = control.lqr(plant.A, plant.B, (wanted + wanted.T) / 2, np.eye(1))
    L, _, _ = control.lqe(plant.A, plant.B, plant.C, np.eye(1), 1e-5 * np.eye(2))
    return plant, control.ss(plant.A - plant.B @ K - L @ plant.C, L, -K, np.zeros((1, 2)))


def as_user_force(regulator, z):
    """Return the regulator as a user force, its states beginning at z."""
    names = [f"z{k}" for k in range(len(z))]

    def words(row, of):
        return " + ".join(f"({float(c)!r})*{name}" for c, name in zip(row, of, strict=True))

    rows = np.hstack([regulator.A, regulator.B])
    rates = {name: words(row, [*names, "phi", "y"]) for name, row in zip(names, rows, strict=True)}
    seen = {
        "phi": JointCoordinate("hinge 1", "angle"),
        "y": AxialDistance(Marker(GROUND), Marker("rod 1", "end"), (0, 1, 0)),
    }
    states = dict(zip(names, map(float, z), strict=True))
    return UserForce("regulator", seen, {"phi": words(regulator.C[0], names)}, rates, states)


def closed_loop_states(arm, regulator, start, h, n_steps):
    """Return the states of plant and regulator over a motion from small states x, y, z of the order of 1e-6."""
    angle, q, omega, q_dot, z = start
    loop = replace(arm, forces=[*arm.forces, as_user_force(regulator, z)], sensors=[ControlSensor("r", "regulator")])
    rest = consistent_state(arm).state
    turn = rotation_matrix(np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)]))
    state = State(
        r=(turn @ rest.r[0])[None],
        p=euler_parameters(turn @ rotation_matrix(rest.p[0]))[None],
        q=q,
        u=np.array([0, 0, 0, 0, 0, omega, *q_dot]),
    )
    motion = integrate(loop, trapezoidal(), n_steps * h, h, state=state)
    found, hinge, body = (
        measured(loop, motion)["r"].columns,
        JointCoordinate("hinge 1", "angle").measure(loop, motion),
        motion.body("rod 1"),
    )
    seen = [found[f"z{k}"] for k in range(len(z))]
    return np.column_stack([hinge.value, body.q, hinge.rate, body.q_dot, *seen])


def eigenvalues_of_the_motion(arm, regulator, h, span=4e-3):
    """Return those of the map from the states at `span` to those at twice the span, in the order of their sizes."""
    n, scale = 12, 1e-6
    first, last = [], []
    for seed in range(n):
        x = scale * np.random.default_rng(seed).standard_normal(n)
        start = x[0], x[1:3] * 0.02, 10 * x[3], x[4:6], x[6:]
        found = closed_loop_states(arm, regulator, start, h, 2 * round(span / h))
        first.append(found[round(span / h)])
        last.append(found[-1])
    X, Y = np.array(first).T, np.array(last).T
    size = np.abs(X).max(axis=1)[:, None]
    steps = np.linalg.eigvals(np.linalg.solve((X / size).T, (Y / size).T).T)
    return np.log(steps.astype(complex)) / span


def test_the_loop_closed_in_the_motion_has_the_eigenvalues_that_python_control_predicts(linear):
    """A regulator with observer turns the flexible arm; errors of h² are taken out by two step sizes."""
    arm, system = linear
    plant, regulator = controller(system)
    closed = np.block([[plant.A, plant.B @ regulator.C], [regulator.B @ plant.C, regulator.A]])
    assert_allclose(
        np.sort_complex(control.feedback(plant, regulator, sign=1).poles()), np.sort_complex(np.linalg.eigvals(closed)),
        rtol=1e-6,
    )  # fmt: skip
    predicted = np.linalg.eigvals(closed)
    assert predicted.real.max() < 0
    assert np.linalg.eigvals(block_diag(plant.A, regulator.A)).real.max() > -1e-3  # without the loop it is not stable
    coarse, fine = (eigenvalues_of_the_motion(arm, regulator, h) for h in (2e-4, 1e-4))
    slow = predicted[np.abs(predicted) < 200]
    assert len(slow) >= 4
    for value in slow:
        a, b = (each[np.argmin(np.abs(each - value))] for each in (coarse, fine))
        assert abs(b - value) < abs(a - value)
        assert abs((4 * b - a) / 3 - value) < 1e-5 * abs(value)
