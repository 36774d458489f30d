"""The transient of a whole model: against modal steps that are exact, and against itself in a frame that moves."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.assessment.quality.reference.transient import interface_forces, transient
from cms.modes.families.families import Families
from floatframe.design.laboratory.full_transient import FrameAcceleration, full_transient
from floatframe.errors import ModelError
from tests.bodies import STEEL, bar

LENGTH = 1.0


@pytest.fixture(scope="module")
def body():
    return cms.couple(bar(nx=6))


def pulse(t, duration):
    """sin² over a duration, (n_t,)."""
    return np.where(t < duration, np.sin(np.pi * t / duration) ** 2, 0.0)


def translation(t):
    """A smooth way of 1 mm, and its second rate."""
    s = np.clip(t / 0.02, 0, 1)
    return 1e-3 * s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3), np.where(
        s < 1, 1e-3 * (420 * s**2 - 1680 * s**3 + 2100 * s**4 - 840 * s**5) / 0.02**2, 0.0
    )


def test_a_held_bar_follows_its_modes_with_second_order(body):
    """Lowest frequency held 33 Hz; a force across the free end for 10 ms."""
    port = body.interface("right").dofs
    errors = []
    for n in (201, 401):
        t = np.linspace(0, 0.03, n)
        force = np.zeros((n, 6))
        force[:, 2] = 100 * pulse(t, 0.01)
        with Families(body) as families:
            exact = transient(families, interface_forces(body, {"right": force.T}, t), cutoff=4e3, held=["left"])
        found = full_transient(
            body, t, motions={"left": np.zeros((n, 6))}, wrenches={"right": force}, rows=np.eye(body.n_dof)[port]
        )
        errors.append(np.abs(found.u[:, 2] - exact.u[port[2]]).max() / np.abs(exact.u[port[2]]).max())
    assert errors[1] < 1e-3
    assert 3.3 < errors[0] / errors[1] < 4.7


def test_the_base_moves_or_the_frame_does(body):
    """u = s(t) + w: the same motion seen from the ground, and from a frame that goes with the base."""
    t = np.linspace(0, 0.04, 401)
    s, s_ddot = translation(t)
    motion, turned = np.zeros((401, 6)), np.zeros((401, 6))
    motion[:, 2], turned[:, 4] = s, s  # along z; about y through the left end: z = -s x
    rows = np.eye(body.n_dof)[body.interface("right").dofs]
    still, zero = np.zeros((401, 6)), np.zeros((401, 3))
    for given, rigid, rates in (
        (motion, s, {"acceleration": np.outer(s_ddot, [0, 0, 1]), "alpha": zero}),
        (turned, -LENGTH * s, {"acceleration": zero, "alpha": np.outer(s_ddot, [0, 1, 0])}),
    ):
        seen = full_transient(body, t, motions={"left": given}, rows=rows)
        frame = FrameAcceleration(omega=zero, origin=np.array([0, 0.025, 0.02]), **rates)
        relative = full_transient(body, t, motions={"left": still}, frame=frame, rows=rows)
        size = np.abs(relative.u[:, 2]).max()
        assert_allclose(seen.u[:, 2] - rigid, relative.u[:, 2], rtol=0, atol=2e-3 * size)
        force = seen.forces["left"]
        assert_allclose(force, relative.forces["left"], rtol=0, atol=5e-3 * np.abs(force).max())


def test_a_spinning_bar_is_longer():
    """Preloaded by the spin about one end: it stretches by rho omega² L³ / 3 E (nu = 0), pulled by m omega² L / 2."""
    body = cms.couple(bar(nx=6, material=replace(STEEL, nu=0.0)))
    omega = 300.0
    t = np.linspace(0, 0.01, 11)
    zero = np.zeros((11, 3))
    frame = FrameAcceleration(zero, np.tile([0, 0, omega], (11, 1)), zero, origin=np.array([0, 0.025, 0.02]))
    rows = np.eye(body.n_dof)[body.interface("right").dofs]
    found = full_transient(body, t, motions={"left": np.zeros((11, 6))}, frame=frame, rows=rows, is_preloaded=True)
    assert_allclose(found.u[:, 0], STEEL.rho * omega**2 * LENGTH**3 / (3 * STEEL.E), rtol=1e-6)
    mass = STEEL.rho * 0.05 * 0.04 * LENGTH
    assert_allclose(found.forces["left"][:, 0], -mass * omega**2 * LENGTH / 2, rtol=1e-6)


def test_products_of_two_angular_velocities_count_twice(body):
    """The centrifugal field is -omega × (omega × c) whatever the axes: the resultant at the held end says so."""
    omega = np.array([40.0, -70.0, 90.0])
    t = np.linspace(0, 1e-3, 5)
    zero = np.zeros((5, 3))
    origin = np.array([0, 0.025, 0.02])
    frame = FrameAcceleration(zero, np.tile(omega, (5, 1)), zero, origin=origin)
    found = full_transient(body, t, motions={"left": np.zeros((5, 6))}, frame=frame, is_preloaded=True)
    mass = STEEL.rho * 0.05 * 0.04 * LENGTH
    expected = mass * np.cross(omega, np.cross(omega, np.array([0.5, 0, 0])))
    assert_allclose(found.forces["left"][0, :3], expected, rtol=1e-9)


def test_a_free_bar_and_its_distributing_end(body):
    """Without anything held the centre of mass follows the force; a distributing end carries it the same way."""
    t = np.linspace(0, 0.01, 101)
    force = np.zeros((101, 6))
    force[:, 0] = 1000 * pulse(t, 0.005)
    mass = STEEL.rho * 0.05 * 0.04 * LENGTH
    impulse = np.concatenate([[0], np.cumsum((force[1:, 0] + force[:-1, 0]) / 2 * 1e-4)])
    loose = bar(nx=6)
    loose = cms.couple(replace(loose, interfaces=tuple(replace(i, kind="distributing") for i in loose.interfaces)))
    for each in (body, loose):
        x = each.dofs[:, 1] == 0
        rigid = np.zeros(each.n_dof)
        rigid[x] = 1.0
        rows = (each.M @ rigid)[None] / mass
        found = full_transient(each, t, wrenches={"right": force}, rows=rows)
        assert_allclose(found.u_dot[:, 0], impulse / mass, rtol=0, atol=2e-3 * impulse[-1] / mass)


def test_what_is_refused(body):
    t = np.linspace(0, 0.01, 11)
    still = np.zeros((11, 6))
    with pytest.raises(ModelError, match="evenly spaced"):
        full_transient(body, np.array([0, 1.0, 3.0]))
    with pytest.raises(ModelError, match="expected a motion or a wrench, got both"):
        full_transient(body, t, motions={"left": still}, wrenches={"left": still})
    with pytest.raises(ModelError, match=r"motion of 'left': expected \(11, 6\)"):
        full_transient(body, t, motions={"left": still[:5]})
    with pytest.raises(ModelError, match="no load case wind; it has none"):
        full_transient(body, t, loads={"wind": np.zeros(11)})
    with pytest.raises(ModelError, match="do not hold the body"):
        full_transient(body, t, wrenches={"left": still}, is_preloaded=True)
    with pytest.raises(ModelError, match="GB; give rows"):
        full_transient(body, np.linspace(0, 1, 1_000_000))


def test_every_other_time_is_what_it_is_with_all(body):
    t = np.linspace(0, 0.005, 12)
    force = np.zeros((12, 6))
    force[:, 1] = 50 * pulse(t, 0.004)
    given = {"motions": {"left": np.zeros((12, 6))}, "wrenches": {"right": force}}
    whole, some = full_transient(body, t, **given), full_transient(body, t, **given, every=3)
    assert_allclose(some.t, t[::3])
    assert_allclose(some.u, whole.u[::3])
    assert_allclose(some.forces["left"], whole.forces["left"][::3])
