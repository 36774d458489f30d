"""Couplers, bushings, contacts, user forces and rolling in the discrete schemes: balances, order, what is remembered.

Energies and momenta are those of the compiled diagnostics, motions those of generalized-alpha in small steps, none of
whose formulas are those of the discrete schemes.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, System, integrate
from floatframe.errors import ModelError
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.simulation import Event
from tests.floatframe.engine.structure_preserving.systems import (
    CONNECTED,
    CONTACTS,
    HELD_BY_ELEMENTS,
    POTENTIALS,
    ROLLING,
    geared,
)
from tests.floatframe.integrators.examples import SCHEMES, energy_defect, floating_pair, momentum_defects


@pytest.mark.parametrize("kind", CONNECTED)
def test_energy_and_momenta_balance_in_long_steps(kind):
    """What potentials hold, what is given and what is taken, to the tolerance of Newton's method; momenta exactly."""
    motion = integrate(CONNECTED[kind](), EnergyMomentum(), 0.5, 0.05)
    energies = motion.energies
    assert np.ptp(energies.kinetic) > 1e-3 * energies.kinetic[0]
    assert energy_defect(motion) < 1e-11
    assert max(momentum_defects(motion)) < 1e-11
    if kind in POTENTIALS or kind in ROLLING:
        assert energies.work[-1] == 0
        assert energies.dissipated[-1] == 0
    if kind in HELD_BY_ELEMENTS:
        assert abs(energies.work[-1]) < 1e-11 * energies.kinetic[0]
    if kind in CONTACTS and "elastic" not in kind:
        assert energies.dissipated[-1] > 0.01 * energies.kinetic[0]
        assert np.diff(energies.dissipated).min() >= 0


FALLING = (*POTENTIALS, *CONTACTS, *ROLLING, *HELD_BY_ELEMENTS, "damped bushing", "damped element")


@pytest.mark.parametrize("kind", FALLING)
def test_energy_of_the_decaying_scheme_never_rises(kind):
    motion = integrate(CONNECTED[kind](), EnergyDecaying(0.3), 0.5, 0.05)
    given = 0.0 if kind != "damped bushing" else motion.energies.work  # by its tables
    total = motion.energies.total - given
    assert np.diff(total).max() <= 1e-11 * total[0]
    assert max(momentum_defects(motion)) < 1e-11


#: what is no part of `test_every_part`, `test_every_force` and `test_every_element`, which compare all others so
NO_PARTS = (
    "bushing", "bushing half way", "damped bushing", "element between bodies that bend",
    "user force about the axis of B", "body on a line that bends its interfaces", "driven point on a line",
)  # fmt: skip


@pytest.mark.parametrize("kind", NO_PARTS)
@pytest.mark.parametrize("name", SCHEMES)
def test_motion_converges_with_second_order_to_that_of_generalized_alpha(kind, name):
    system, end = CONNECTED[kind](), 0.1

    def places(method, n_steps):
        motion = integrate(system, method, end, end / n_steps, output_every=n_steps)
        return np.concatenate([[*motion.body(b.name).r[-1], *motion.body(b.name).p[-1]] for b in system.bodies])

    fine = places(GeneralizedAlpha(0.9, 1e-11), 400)
    errors = [np.abs(places(SCHEMES[name], n) - fine).max() for n in (20, 40)]
    assert 3 < errors[0] / errors[1] < 5.5, errors
    assert errors[1] < 5e-3


@pytest.mark.parametrize("name", SCHEMES)
def test_a_gear_turns_on_beyond_a_full_turn(name):
    """The sum of the angles, counted, stays where it was."""
    motion = integrate(geared(), SCHEMES[name], 3.0, 0.02)
    angles = [JointCoordinate(joint, "angle").measure(geared(), motion).value for joint in ("joint", "hinge")]
    assert np.ptp(angles[1]) > 4 * np.pi
    held = 3 * angles[0] - angles[1]
    assert_allclose(held, held[0], rtol=0, atol=1e-10)


@pytest.mark.parametrize("kind", ["user force", "contact with a plane", "gear"])
@pytest.mark.parametrize("name", SCHEMES)
def test_outputs_do_not_change_the_motion(kind, name):
    """States, angles and speeds of approach are what the steps left, not what the results say."""
    often = integrate(CONNECTED[kind](), SCHEMES[name], 0.4, 0.02)
    seldom = integrate(CONNECTED[kind](), SCHEMES[name], 0.4, 0.02, output_every=20)
    for body in often.body_names:
        assert_allclose(often.body(body).r[-1], seldom.body(body).r[-1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_latch_catches_in_the_midst_of_a_motion(name):
    """An event closes the joint of the pair by an impulse: momenta go on, the angle stays."""
    pair = floating_pair("revolute")
    latch = CoordinateCoupler("latch", [(JointCoordinate("joint", "angle"), 1.0)], engaged=False)
    caught = Event("caught", "joint.angle", level=0.05, direction="rising", switch_on=("latch",))
    system = System(pair.bodies, pair.joints, pair.forces, couplers=[latch], events=[caught])
    motion = integrate(system, SCHEMES[name], 0.3, 0.01)
    (event,) = motion.head.summary["events"]
    angle = JointCoordinate("joint", "angle").measure(system, motion).value
    assert 0.005 < event["t"] < 0.2
    assert angle[0] < 0.01
    assert_allclose(angle[motion.t > event["t"]], 0.05, rtol=0, atol=1e-9)
    assert max(momentum_defects(motion)) < 1e-9


def test_rolling_is_refused_by_the_variational_scheme():
    with pytest.raises(ModelError, match="Variational: joint 'roll' has nonholonomic constraints"):
        integrate(CONNECTED["rolling disc"](), Variational(), 1.0, 0.1)
