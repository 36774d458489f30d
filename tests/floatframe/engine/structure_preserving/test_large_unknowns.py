"""Elements whose multipliers and states are of any size, also where their typical sizes are not given.

The oracle is the built-in spring. Between two points the wrench of an element that names its energy acts along the mean
of the line and does the work of the potential, which are the two properties that the force of the spring has.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from floatframe import (
    EnergyDecaying,
    EnergyMomentum,
    GeneralizedAlpha,
    Marker,
    RigidBody,
    SpringDamper,
    System,
    Variational,
    integrate,
)
from floatframe.model.elements import NOTHING, Element, ElementLaw

CONSERVING = {"momentum": EnergyMomentum(), "decaying": EnergyDecaying(0.5)}
MASS = 1000.0


@njit
def tie_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Pull by lam between two points, 0 = lam - k (L - L0)."""
    k, free = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    g[0] = lam[0] - k * (length - free)
    f = lam[0] / length
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2
    seen[0] = 0.5 * k * (length - free) ** 2


@dataclass(frozen=True, eq=False)
class Tie(Element):
    """A spring whose tension is an unknown of its own equation."""

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float
    free: float
    sizes: tuple[float, ...] = ()

    def law(self, placed):
        return ElementLaw(
            function=tie_law,
            data=[self.stiffness, self.free],
            multipliers=("N",),
            multiplier_units=("N",),
            multiplier_sizes=self.sizes,
            holds=(NOTHING,),
            outputs=("energy",),
            output_units=("J",),
            acts=("force", "force"),
            is_opposite=True,
            tangent="complex",
            length=1e-3 * self.free,  # the potential is made up for in short ways too
            energy="energy",
        )


@njit
def piston_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Pull by A p between two points, p' = B L'."""
    area, modulus = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    f = area * z[0] / length
    v0, v1, v2 = x[1, 12] - x[0, 12], x[1, 13] - x[0, 13], x[1, 14] - x[0, 14]
    z_dot[0] = modulus * (v0 * d0 + v1 * d1 + v2 * d2) / length
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2


@dataclass(frozen=True, eq=False)
class Piston(Element):
    """A spring whose tension is a pressure on an area; its power counts as work."""

    name: str
    marker_a: Marker
    marker_b: Marker
    area: float
    modulus: float
    start: float
    sizes: tuple[float, ...] = ()

    def law(self, placed):
        return ElementLaw(
            function=piston_law,
            data=[self.area, self.modulus],
            states=("p",),
            start=(self.start,),
            state_units=("Pa",),
            state_sizes=self.sizes,
            acts=("force", "force"),
            is_opposite=True,
            tangent="complex",
        )


A, B = Marker("a", position=(0, 0.1, 0)), Marker("b", position=(0, 0, 0.1))


def pair(length, omega):
    """Return two bodies that turn about each other and fly."""
    spin = np.array([0, 0, omega])
    return [
        RigidBody(name, MASS, MASS * np.diag([0.3, 0.4, 0.5]), position=(side * length, 0, 0),
                  velocity=np.cross(spin, (side * length, 0, 0)) + np.array([0.3, 0.1, 0.4 * side]), omega_B=spin)
        for name, side in (("a", -0.5), ("b", 0.5))
    ]  # fmt: skip


def distance(length):
    """Return the distance of the points at the beginning."""
    return float(np.linalg.norm([length, -0.1, 0.1]))


#: stiffness, distance of the bodies, what the free length lacks to that of the points, turning of the pair, step
CASES = {
    "stiff": (1e8, 1.0, 1e-2, 10.0, 1e-3),
    "stiff, far too long steps": (1e8, 1.0, 1e-2, 10.0, 2e-2),
    "stiff, short steps": (1e8, 1.0, 1e-2, 10.0, 1e-5),
    "stiff, free at the beginning": (1e8, 1.0, 0.0, 40.0, 2e-3),
    "soft": (1e5, 20.0, 10.0, 5.0, 5e-3),
    "soft, long steps": (1e5, 20.0, 10.0, 5.0, 0.05),
    "soft, free at the beginning": (1e5, 20.0, 0.0, 10.0, 5e-3),
}
N_STEPS = 40


def tied(case, sizes=None):
    """Return the pair with a tie, or with a spring where no sizes are given."""
    k, length, less, omega, _ = CASES[case]
    free = distance(length) - less
    if sizes is None:
        return System(pair(length, omega), [], [SpringDamper("tie", A, B, k, free_length=free)])
    return System(pair(length, omega), elements=[Tie("tie", A, B, k, free, sizes)])


def places(motion):
    """Return the places of both bodies at all output times."""
    return np.concatenate([motion.body(name).r for name in "ab"], axis=1)


@pytest.mark.parametrize("sizes", [(), (1.0,), (1e6,)])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", CONSERVING)
def test_a_tension_that_is_an_unknown_moves_bodies_as_a_spring_does(name, case, sizes):
    h = CASES[case][-1]
    spring, tie = (integrate(tied(case, each), CONSERVING[name], N_STEPS * h, h) for each in (None, sizes))
    way = np.ptp(places(spring), axis=0).max()
    assert_allclose(places(tie), places(spring), rtol=0, atol=1e-8 * way)
    energies = tie.energies
    assert np.ptp(energies.total) < 1e-11 * energies.total[0]
    assert tie.head.summary["n_iterations"] < 1.5 * spring.head.summary["n_iterations"]


@pytest.mark.parametrize("case", ["stiff", "soft"])
def test_a_tension_that_is_an_unknown_moves_bodies_as_generalized_alpha_says(case):
    """Small steps of both: the difference falls with the square of the step."""
    h, system = CASES[case][-1], tied(case, ())
    fine = places(integrate(system, GeneralizedAlpha(0.9, 1e-11), 10 * h, h / 20))[-1]
    for method in CONSERVING.values():
        errors = [np.abs(places(integrate(system, method, 10 * h, h / n))[-1] - fine).max() for n in (2, 4)]
        assert 3.5 < errors[0] / errors[1] < 4.5, errors


@pytest.mark.parametrize("start", [0.0, 1e6])
@pytest.mark.parametrize("sizes", [(), (1.0,)])
@pytest.mark.parametrize("method", [*CONSERVING.values(), Variational()], ids=[*CONSERVING, "variational"])
def test_a_pressure_moves_bodies_as_one_whose_size_is_known(method, sizes, start):
    def moved(sizes):
        piston = Piston("piston", A, B, 1.0, 1e8, start, sizes)
        return integrate(System(pair(1.0, 10.0), elements=[piston]), method, 0.04, 1e-3)

    wanted, found = moved((1e6,)), moved(sizes)
    assert_allclose(places(found), places(wanted), rtol=0, atol=1e-9)
    assert found.head.summary["n_iterations"] < 1.2 * wanted.head.summary["n_iterations"]
