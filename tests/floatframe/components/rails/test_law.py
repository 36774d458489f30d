"""The compiled law of a wheelset: eigenvalues, exact derivatives, energy, curves, defects, both sides alike."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eig

from floatframe.components.rails.assembly import ContactLaws, Wheel, law_numbers, output_names
from floatframe.components.rails.contact_search import rigid_contacts
from floatframe.components.rails.irregularities import Irregularities
from floatframe.components.rails.law import CONTACT_OUTPUTS, WHEEL_OUTPUTS, wheels_on_rails
from floatframe.components.rails.tangent import tangent_of_wheels
from floatframe.components.rails.track import Track, curve
from floatframe.engine.compiling.callbacks.law_functions import callback, called_law
from floatframe.model.rotations import rotation_exp
from tests.floatframe.components.rails.examples import CONE, NEW
from tests.floatframe.components.rails.linear_wheelset import Suspended, eigenvalues

LOAD = 6e4


def wheels_of(pair):
    half = 0.5 * pair.running_circles
    return (Wheel(1, half, pair), Wheel(-1, -half, pair))


class Law:
    """The law of a wheelset as the engine compiles it, called with the motion of its axle."""

    def __init__(self, pair=CONE, track=None, spin_inertia=0.0, **laws):
        self.wheels = wheels_of(pair)
        self.data = law_numbers(self.wheels, track or Track(), ContactLaws(**laws), spin_inertia)
        self.names = output_names(self.wheels, WHEEL_OUTPUTS, CONTACT_OUTPUTS)[0]
        self.n_lam = 2 if laws.get("normal") == "constraint" else 0
        self.n_z = 1 if spin_inertia else 0
        self.head = (1, 18, self.n_z, self.n_lam, len(self.names), len(self.data), 1, 0)

    def outputs(self, function, kind, motion, n_out):
        r, A, v, omega, *unknowns = motion
        inputs = np.concatenate([[0.0], r, np.ravel(A), v, omega, *unknowns])
        function = callback("wheels", function, kind, self.head)
        return called_law(function.address, self.head, self.data, inputs[None], n_out)[0]

    def __call__(self, *motion):
        """Return wrench, with the rate of the spin, what is held and what is seen."""
        n_out = 6 + self.n_z + self.n_lam
        values = self.outputs(wheels_on_rails, "value", motion, n_out + len(self.names))
        return np.split(values, [6 + self.n_z, n_out])

    def slopes(self, *motion, function=tangent_of_wheels, kind="given"):
        """Return the derivatives of wrench, rate and what is held, by dr, dphi, dv, domega, spin and multipliers."""
        n_out, n_columns = 6 + self.n_z + self.n_lam, 12 + self.n_z + self.n_lam
        return self.outputs(function, kind, motion, n_out * n_columns).reshape(n_out, n_columns)

    def seen(self, *motion):
        return dict(zip(self.names, self(*motion)[2], strict=True))


def height(law, load=LOAD, y=0.0, V=10.0):
    """Of a centred wheelset that presses on both rails with this force: bisection."""
    low, high = 0.455, 0.462
    for _ in range(60):
        z = 0.5 * (low + high)
        seen = law.seen([0, y, z], np.eye(3), [V, 0, 0], [0, V / 0.46, 0])
        low, high = (z, high) if seen["left_Q"] + seen["right_Q"] > 2 * load else (low, z)
    return z


def test_wheels_of_different_pairs_find_the_tables_that_they_have_alone():
    """Four wheels of three pairs; the place of a table is the fifth number of a wheel, behind a head of 21."""
    pairs = [CONE, replace(CONE, radius=0.5), CONE, replace(CONE, radius=0.4)]
    wheels = [Wheel(1, 0.75, pair) for pair in pairs]
    together = law_numbers(wheels, Track(), ContactLaws())
    ends = [21 + 6 * len(wheels) + Track().cells.size]
    for k, wheel in enumerate(wheels):
        alone = law_numbers([wheel], Track(), ContactLaws())
        table = alone[int(alone[21 + 4]) :]
        first = int(together[21 + 6 * k + 4])
        assert first in ends
        assert_array_equal(together[first : first + len(table)], table)
        ends.append(first + len(table))
    assert max(ends) == len(together)


def test_eigenvalues_of_a_suspended_wheelset_are_those_of_the_textbook():
    """The tangent of the law, treads held on the rails, in a pencil with the inertia of a spinning wheelset.

    Ground axes: d omega = dphi' + dphi × omega; L = I_t omega + (I_y - I_t)(a·omega) a. The independent model has y
    and yaw alone.
    """
    nominal = rigid_contacts(CONE, 0.0)[0]  # not quite at the running circle
    p = Suspended(a=0.75 + nominal.s, r=nominal.radius)
    law = Law(normal="constraint", creep="kalker")
    worst = 0.0
    for V in (5.0, 20.0, 40.0, 60.0, 90.0):
        omega = np.array([0, V / p.r, 0])
        z, lam = 0.46, np.full(2, p.load)
        for _ in range(
            30
        ):  # the height at which the treads touch, the multipliers that carry the load, the speed without slip
            wrench, g, seen = law([0, 0, z], np.eye(3), [V, 0, 0], omega, lam)
            z -= g.mean()
            lam = lam + (2 * p.load - wrench[2]) / 2
            omega[1] += seen[law.names.index("left_tread_xi")] * V / p.r
        slopes = law.slopes([0, 0, z], np.eye(3), [V, 0, 0], omega, lam)
        by_q, by_v, by_lam = slopes[:6, :6].copy(), slopes[:6, 6:12].copy(), slopes[:6, 12:]
        turn = np.array([[0, omega[2], -omega[1]], [-omega[2], 0, omega[0]], [omega[1], -omega[0], 0]])  # dphi × omega
        by_q[:, 3:] += by_v[:, 3:] @ turn
        # moments about the centre: d(L)/dt = I_t dphi'' + I_y Omega (a' terms) + ...; roll and yaw of a spinning rotor
        M = np.diag([p.mass] * 3 + [p.I_x, p.I_y, p.I_x])
        gyroscopic = np.zeros((6, 6))
        gyroscopic[3, 5], gyroscopic[5, 3] = -p.I_y * omega[1], p.I_y * omega[1]
        K, C = -by_q, gyroscopic - by_v
        K[1, 1] += p.k_y
        K[5, 5] += p.k_psi
        n = 14
        E, A = np.zeros((n, n)), np.zeros((n, n))
        E[:6, :6], E[6:12, 6:12] = np.eye(6), M
        A[:6, 6:12] = np.eye(6)
        A[6:12, :6], A[6:12, 6:12], A[6:12, 12:] = -K, -C, by_lam
        A[12:, :6] = slopes[6:, :6]
        found = eig(A, E, right=False)
        found = found[np.isfinite(found) & (np.abs(found) < 1e6)]
        for wanted in eigenvalues(p, V):
            nearest = found[np.argmin(np.abs(found - wanted))]
            worst = max(worst, abs(nearest - wanted) / abs(wanted))
    assert worst < 5e-4


def tilted(theta):
    """Axes of a wheelset turned by a rotation vector."""
    return rotation_exp(np.asarray(theta, dtype=float))


@pytest.mark.parametrize("creep", ["fastsim", "polach", "kalker-saturated"])
def test_left_and_right_are_mirror_images(creep):
    law = Law(NEW, creep=creep)
    r, v, omega = np.array([3.0, 3e-3, 0.4595]), np.array([20.0, 0.1, 0.02]), np.array([0.02, 43.3, 0.05])
    flip, turn = np.array([1, -1, 1]), np.array([-1, 1, -1])
    one = law(r, tilted([2e-4, 0, 5e-3]) @ tilted([0, 0.4, 0]), v, omega)
    other = law(r * flip, tilted([-2e-4, 0, -5e-3]) @ tilted([0, 0.4, 0]), v * flip, omega * turn)
    assert_allclose(other[0], one[0] * np.concatenate([flip, turn]), rtol=1e-9, atol=1e-6 * LOAD)
    seen = dict(zip(law.names, one[2], strict=True))
    mirrored = dict(zip(law.names, other[2], strict=True))
    assert seen["left_tread_N"] > 0
    assert_allclose(mirrored["right_Y_over_Q"], seen["left_Y_over_Q"], rtol=1e-9)
    assert_allclose(mirrored["right_tread_eta"], -seen["left_tread_eta"], rtol=1e-9)


@pytest.mark.parametrize(("creep", "normal"), [("fastsim", "hertz"), ("polach", "constraint"), ("kalker", "hertz")])
def test_the_tangent_is_that_of_differences(creep, normal):
    """In a transition curve with irregular rails, with flange contact on the left."""
    s = np.arange(0, 60.5, 0.5)
    rng = np.random.default_rng(2)
    rails = Irregularities(s, *(1e-3 * rng.normal(size=(4, len(s)))))
    law = Law(
        NEW,
        Track(curve(300.0, 40.0, transition=30.0, cant=0.1, before=10.0), rails),
        creep=creep,
        normal=normal,
        damping=1e-3,
    )
    track = Track(curve(300.0, 40.0, transition=30.0, cant=0.1, before=10.0))
    frame = track.frame(33.0)
    r = frame.origin + frame.axes @ np.array([0, 6.5e-3, 0.4607])
    A, v, omega = (
        frame.axes @ tilted([1e-3, 0.3, 4e-3]),
        frame.axes @ np.array([15.0, 0.02, -0.01]),
        frame.axes @ np.array([0.01, 32.6, 0.04]),
    )
    lam = np.array([6e4, 5.5e4])[: law.n_lam]

    def value(dr, dphi, dv, domega, dlam):
        return np.concatenate(law(r + dr, tilted(dphi) @ A, v + dv, omega + domega, lam + dlam)[:2])

    assert dict(zip(law.names, law(r, A, v, omega, lam)[2], strict=True))["left_flange_N"] > 1e3
    exact = law.slopes(r, A, v, omega, lam)
    scale = np.abs(value(*np.zeros((4, 3)), 0 * lam)[:6]).max()
    sizes = np.concatenate([np.fmax(np.abs(r), 1e-3), np.ones(3), np.fmax(np.abs([*v, *omega, *lam]), 1e-2)])
    for k, (size, column) in enumerate(zip(sizes, exact.T, strict=True)):
        h = 1e-7 * size
        step = np.split(h * np.eye(len(sizes))[k], [3, 6, 9, 12])
        by_differences = (value(*step) - value(*(-each for each in step))) / (2 * h)
        assert_allclose(
            column[:6], by_differences[:6], rtol=2e-4, atol=max(1e-4 * np.abs(column[:6]).max(), 1e-6 * scale)
        )
        assert_allclose(column[6:], by_differences[6:], rtol=0, atol=1e-6)  # metres of gap per metre or radian


@pytest.mark.parametrize(
    ("creep", "normal", "inertia"),
    [
        ("fastsim", "hertz", 112.0),
        ("fastsim", "constraint", 0.0),
        ("polach", "constraint", 60.0),
        ("kalker-saturated", "hertz", 0.0),
        ("kalker", "constraint", 112.0),
    ],
)
def test_the_tangent_is_that_of_imaginary_steps(creep, normal, inertia):
    """Anywhere on a curved, canted, irregular track, forward and backward, with and without contact of each part."""
    s = np.arange(0, 100.5, 0.5)
    rng = np.random.default_rng(2)
    track = Track(
        curve(300.0, 30.0, transition=24.0, cant=0.1, before=10.0, after=20.0),
        Irregularities(s, *(1e-3 * rng.normal(size=(4, len(s))))),
        start=(3.0, -2.0, 0.7),
        heading=0.6,
    )
    laws = {"creep": creep, "normal": normal, "damping": 1e-3, "low_speed": 0.2, "polach": (0.8, 0.6, 0.5, 0.3)}
    law = Law(NEW, track, inertia, **laws)
    contacts = set()
    for _ in range(40):
        frame, V = track.frame(rng.uniform(2, 95)), rng.uniform(-20, 20)
        Q, spin = frame.axes, V / 0.46 * rng.uniform(0.98, 1.02)
        y = rng.uniform(-9e-3, 9e-3)
        z = 0.4597 + 1e-4 * rng.uniform(-3, 1) + (1e-3 * rng.uniform(0, 1.5) if abs(y) > 5e-3 else 0.0)
        turn = tilted(rng.normal(size=3) * [3e-3, 0, 8e-3]) @ tilted([0, rng.uniform(-3, 3), 0])
        motion = [
            frame.origin + Q @ [0, y, z],
            Q @ turn,
            Q @ [V, *0.05 * rng.normal(size=2)],
            Q @ [0.05 * rng.normal(), spin, 0.05 * rng.normal()],
            np.full(law.n_z, 1.01 * spin),
            rng.uniform(-2e4, 9e4, law.n_lam),
        ]
        wanted = law.slopes(*motion, function=wheels_on_rails, kind="complex")
        sizes = np.abs(wanted).max(axis=1, keepdims=True)
        if inertia:  # the rate of the spin is a moment about the axle divided by the inertia
            sizes[6] = sizes[3:6].max() / inertia
        of_columns = np.maximum(np.abs(wanted / np.maximum(sizes, 1e-30)).max(axis=0), 1e-9)
        assert (np.abs(law.slopes(*motion) - wanted) <= 1e-10 * sizes * of_columns).all()
        names = [f"{side}_{part}_N" for side in ("left", "right") for part in ("tread", "flange")]
        seen = law.seen(*motion)
        contacts.add(tuple(np.sign(seen[name]) for name in names))
    assert {1} < {each[0] for each in contacts}
    assert {1} < {each[3] for each in contacts}


def test_elastic_forces_at_rest_are_the_slope_of_the_stored_energy():
    """Without motion no creep: work against the wheels is stored.

    The stiffness of the ellipse changes along the profile, which the energy 2/5 N d forgets: hence the tolerance of the
    lateral and roll parts.
    """
    law = Law(NEW)
    r, theta = np.array([0.0, 1e-3, 0.4597]), np.array([1e-4, 0.0, 0.0])

    def energy(dr, dtheta):
        return law.seen(r + dr, tilted(theta + dtheta), np.zeros(3), np.zeros(3))["energy"]

    wrench = law(r, tilted(theta), np.zeros(3), np.zeros(3))[0]
    h = 1e-7
    slopes = [(energy(h * e, 0) - energy(-h * e, 0)) / (2 * h) for e in np.eye(3)[1:]]
    slopes.append((energy(0, h * np.eye(3)[0]) - energy(0, -h * np.eye(3)[0])) / (2 * h))
    assert_allclose(wrench[2], -slopes[1], rtol=2e-3)
    assert_allclose(wrench[1], -slopes[0], rtol=0, atol=0.02 * abs(wrench[2]))
    assert_allclose(wrench[3], -slopes[2], rtol=0, atol=0.02 * abs(wrench[2]))


def test_a_wheelset_sees_the_same_everywhere_along_a_circle():
    track = Track(curve(-400.0, 300.0, transition=40.0, cant=0.12, before=5.0), start=(10.0, -5.0, 2.0), heading=0.7)
    law = Law(NEW, track)
    expected = None
    for s in (60.0, 137.3, 300.0):
        frame = track.frame(s)
        Q = frame.axes
        wrench, _, seen = law(
            frame.origin + Q @ [0, 4e-3, 0.4598],
            Q @ tilted([2e-4, 0, 3e-3]),
            Q @ [18.0, 0.01, 0],
            Q @ [0.0, 39.1, 18 * frame.curvature],
        )
        local = np.concatenate([Q.T @ wrench[:3], Q.T @ wrench[3:]])
        assert_allclose(seen[law.names.index("left_s")], s, rtol=0, atol=0.05)
        if expected is not None:
            assert_allclose(local, expected, rtol=1e-7, atol=1e-5 * LOAD)
        expected = local
    assert np.abs(expected[1]) > 100


def test_irregular_rails_move_the_contact_and_tilt_its_force():
    s = np.arange(0, 20.01, 0.1)
    slope = 2e-3
    law_flat = Law(NEW, low_speed=1e3)
    up = Irregularities(s, 0 * s, slope * (s - 10), 0 * s, slope * (s - 10))
    law = Law(NEW, Track((), up), low_speed=1e3)  # no creep forces to speak of
    z = height(law_flat)
    flat = law_flat([10.0, 0, z], np.eye(3), [0, 0, 0], [0, 0, 0])[0]
    ramp = law([10.0, 0, z], np.eye(3), [0, 0, 0], [0, 0, 0])[0]
    assert_allclose(ramp[2], flat[2], rtol=1e-6)
    assert_allclose(ramp[0], -slope * flat[2], rtol=1e-3)
    assert_allclose(law([13.0, 0, z + 3 * slope], np.eye(3), [0, 0, 0], [0, 0, 0])[0], ramp, rtol=1e-3, atol=1.0)
    aside = Irregularities(s, 0 * s + 2e-3, 0 * s, 0 * s + 2e-3, 0 * s)
    moved = Law(NEW, Track((), aside))([10.0, 2e-3 + 1e-3, z], np.eye(3), [0, 0, 0], [0, 0, 0])[0]
    assert_allclose(moved[:5], Law(NEW)([10.0, 1e-3, z], np.eye(3), [0, 0, 0], [0, 0, 0])[0][:5], rtol=1e-6, atol=200.0)


def test_rolling_backward_is_the_mirror_image_of_rolling_forward():
    """Turned by half a turn about the vertical, the track looks the same: x and y change their signs."""
    law = Law(NEW)
    z, flip = height(law), np.array([-1, -1, 1])
    one = law([2.0, 2e-3, z], tilted([0, 0, 2e-3]), [12.0, 0.05, 0], [0.0, 26.1, 0.02])[0]
    half_turn = np.diag([-1.0, -1.0, 1.0]) @ tilted([0, 0, 2e-3]) @ np.diag([-1.0, -1.0, 1.0])
    other = law([-2.0, -2e-3, z], half_turn, [-12.0, -0.05, 0], [0.0, -26.1, 0.02])[0]
    assert_allclose(other[:3], one[:3] * flip, rtol=1e-8, atol=1e-3)
    assert_allclose(other[3:], one[3:] * flip, rtol=1e-8, atol=1e-3)


def test_friction_only_takes_power():
    law = Law(NEW)
    z = height(law)
    rng = np.random.default_rng(4)
    for _ in range(20):
        y, yaw, v_y, slip = rng.normal(size=4) * [2e-3, 3e-3, 0.05, 0.2]
        seen = law.seen([0, y, z], tilted([0, 0, yaw]), [20, v_y, 0], [0, 20 / 0.46 + slip, 0])
        assert seen["power_lost"] >= 0
        assert_allclose(seen["power_lost"], (seen["left_wear"] + seen["right_wear"]) * 20, rtol=1e-4)


def test_wherever_a_wheel_is_pushed_its_forces_are_numbers():
    """Deep in the rail, beside it, rolled and yawed beyond the table: what Newton's method may try."""
    law = Law(NEW, strips=6)
    rng = np.random.default_rng(0)
    for _ in range(3000):
        y, roll, yaw, z, slip, spin = rng.uniform([-0.02, -0.02, -0.02, -0.02, -1, -2], [0.02, 0.02, 0.02, 0.01, 1, 2])
        motion = [0, y, 0.46 + z], tilted([roll, 0, yaw]), [30, slip, 0.1], [0.1, 65 + spin, 0.2]
        wrench, _, seen = law(*motion)
        assert np.isfinite(wrench).all()
        assert np.isfinite(seen).all()
