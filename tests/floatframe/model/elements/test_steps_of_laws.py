"""Steps of differences go by the length and the time of a law, never by the distance from the origin or by units."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe import GROUND, GeneralizedAlpha, Marker, RigidBody, System, UserForce, integrate
from floatframe.analyses import consistent_state
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.integrators import RelativeOde
from floatframe.joints import AxialDistance
from floatframe.model.elements import POSITION, VELOCITY, Element, ElementLaw

DIRECTION = np.array([2.0, -1.0, 2.0]) / 3


@njit
def held_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Hold the place or the speed along a direction at a sin(w t + phi), about a place far away."""
    value = -data[0] * np.sin(data[1] * t + data[2])
    at = 12 if data[3] > 0.0 else 0
    for k in range(3):
        value += data[4 + k] * (x[0, at + k] - (0.0 if data[3] > 0.0 else data[7 + k]))
        wrench[0, k] = lam[0] * data[4 + k]
    g[0] = value


@dataclass(frozen=True)
class Held(Element):
    name: str
    marker: Marker
    a: float
    w: float
    phi: float
    origin: tuple
    holds: int = POSITION
    time: float | None = None

    def law(self, placed):
        numbers = [self.a, self.w, self.phi, float(self.holds == VELOCITY), *DIRECTION, *self.origin]
        return ElementLaw(function=held_law, data=numbers, multipliers=["f"], acts=["force"], holds=[self.holds],
                          time=self.time)  # fmt: skip


@pytest.mark.parametrize("hz", [0.1, 1.0, 50.0, 200.0, 5000.0])
@pytest.mark.parametrize("units", ["m-kg-s", "mm-kg-ms"])
@pytest.mark.parametrize("is_told", [False, True])
def test_held_rates_of_a_law_that_depends_on_time(hz, units, is_told):
    """x = a sin(w t + phi) 5 km away, at three phases, also where the motion stands: v and a by hand."""
    u = unit_system(units)
    w, a, far = 2 * np.pi * hz * u.time, 1e-3 / u.length, 5e3 / u.length
    for phi in (0.0, 0.4, np.pi / 2):
        origin = far * np.array([0.6, 0.0, -0.8])
        body = RigidBody("b", 1.0 / u.mass, 0.01 / u.mass / u.length**2 * np.eye(3),
                         position=origin + a * np.sin(phi) * DIRECTION)  # fmt: skip
        held = Held("h", Marker("b", position=np.zeros(3)), a, w, phi, tuple(origin), time=1 / w if is_told else None)
        found = consistent_state(System([body], elements=[held], units=u))
        assert_allclose(found.state.u[:3], a * w * np.cos(phi) * DIRECTION, rtol=0, atol=1e-4 * a * w)
        assert_allclose(found.u_dot[:3], -a * w**2 * np.sin(phi) * DIRECTION, rtol=0, atol=1e-2 * a * w**2)


def test_held_rates_of_a_speed_that_depends_on_time():
    """v = a sin(w t + phi) at 300 Hz: its acceleration is a w cos(w t + phi)."""
    a, w, phi = 0.2, 2 * np.pi * 300, 0.4
    held = Held("h", Marker("b"), a, w, phi, (0.0, 0.0, 0.0), holds=VELOCITY)
    body = RigidBody("b", 1.0, np.eye(3), velocity=a * np.sin(phi) * DIRECTION)
    found = consistent_state(System([body], elements=[held]))
    assert_allclose(found.u_dot[:3], a * w * np.cos(phi) * DIRECTION, rtol=0, atol=1e-6 * a * w)


def test_a_law_that_does_not_know_the_time_says_so():
    assert ElementLaw(function=held_law, time=math.inf).time == math.inf


@pytest.mark.parametrize(("method", "formulation"), [(GeneralizedAlpha(0.8), None), (RelativeOde(), "relative")])
def test_a_motion_that_a_law_holds_at_50_hz(method, formulation):
    a, w = 1e-3, 2 * np.pi * 50
    held = Held("h", Marker("b", position=np.zeros(3)), a, w, 0.0, (300.0, 0.0, -400.0))
    body = RigidBody("b", 1.0, np.eye(3), position=(300.0, 0.0, -400.0))
    motion = integrate(System([body], elements=[held]), method, 0.037, 2.5e-4, formulation=formulation)
    along = (motion.body("b").r - [300.0, 0.0, -400.0]) @ DIRECTION
    assert_allclose(along, a * np.sin(w * motion.t), rtol=0, atol=1e-6 * a)
    assert_allclose(motion.body("b").v @ DIRECTION, a * w * np.cos(w * motion.t), rtol=0, atol=5e-3 * a * w)


@njit
def wall_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    depth = x[0, 0] - data[1]
    if depth > 0.0:
        wrench[0, 0] = -data[0] * depth * np.sqrt(depth) - data[2] * np.tanh((x[0, 12] - data[3]) / data[4])


@dataclass(frozen=True)
class Wall(Element):
    name: str
    marker: Marker
    numbers: tuple  #: stiffness, place, friction, speed of the wall, speed of the friction
    length: float | None = None
    time: float | None = None

    def law(self, placed):
        return ElementLaw(function=wall_law, data=self.numbers, acts=["force"], length=self.length, time=self.time)


def slopes_of(system):
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    set_iterate(work, compiled.placed)
    return linearized(compiled.model, work, 0.0, 0.0, 1.0), linearized(compiled.model, work, 0.0, 1.0, 1.0)


@pytest.mark.parametrize("far", [0.0, 100.0, 5e3, 1e6])
@pytest.mark.parametrize("kind", ["element", "python element", "user force"])
def test_a_contact_has_its_stiffness_however_far_it_is(far, kind):
    """d/dx k x^1.5 = 1.5 k sqrt(x) at a depth of 0.1 mm, of 10 cm; at 1000 km rounded."""
    depth, k = 2.0**-13, 1e9
    exact = 1.5 * k * np.sqrt(depth)
    body = RigidBody("b", 1.0, np.eye(3) * 0.01, position=(far + depth, 0, 0))
    if kind == "user force":

        def function(t, x, v, z, Q, z_dot):
            Q[0] = -k * max(x[0] - far, 0.0) ** 1.5

        x = {"x": AxialDistance(Marker(GROUND, position=np.zeros(3)), Marker("b"), axis=(1, 0, 0))}
        system = System([body], [], [UserForce("u", x, ["x"], function=function, length=0.1)])
    else:
        wall = Wall("w", Marker("b", position=np.zeros(3)), (k, far, 0.0, 0.0, 1.0), length=1e-2)
        if kind == "python element":
            object.__setattr__(wall, "law", lambda placed: ElementLaw(
                function=wall_law.py_func, data=wall.numbers, acts=["force"], length=1e-2))  # fmt: skip
        system = System([body], elements=[wall])
    stiffness, _ = slopes_of(system)
    found = np.abs(stiffness.G.toarray()).max() if kind != "user force" else stiffness_of_user_force(system)
    assert_allclose(found, exact, rtol=2e-4 if far < 1e6 else 2e-2)


def stiffness_of_user_force(system):
    """Of -dQ/dx, by the solution of its linear equations: K x = 1 for a unit load."""
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    set_iterate(work, compiled.placed)
    parts = linearized(compiled.model, work, 0.0, 0.0, 1.0)
    V = parts.V.toarray() if hasattr(parts.V, "toarray") else np.asarray(parts.V)
    P = parts.G.toarray()
    return float(np.abs(np.linalg.solve(V, P)).max())


@pytest.mark.parametrize("speed", [0.0, 300.0, 7e3])
def test_friction_has_its_slope_however_fast_its_ground_moves(speed):
    """d/dv F tanh(v/v_0) = F/v_0 where nothing slips, of a body that travels with its wall at 7 km/s."""
    F, v_0 = 50.0, 1e-3
    body = RigidBody("b", 1.0, np.eye(3) * 0.01, position=(1e-4, 0, 0), velocity=(speed, 0, 0))
    wall = Wall("w", Marker("b", position=np.zeros(3)), (0.0, 0.0, F, speed, v_0), length=1e-2, time=10.0)
    _, damping = slopes_of(System([body], elements=[wall]))
    assert_allclose(np.abs(damping.G.toarray()).max(), F / v_0, rtol=1e-4)
