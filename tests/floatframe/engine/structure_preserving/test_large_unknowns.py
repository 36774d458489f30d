"""Elements whose multipliers and states are of any size, also where their typical sizes are not given.

The oracle is the built-in spring. Between two points the wrench of an element that names its energy acts along the mean
of the line and does the work of the potential, which are the two properties that the force of the spring has.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, Marker, System, integrate
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.model.elements import Element, ElementLaw
from tests.floatframe.engine.structure_preserving.examples import CASES, A, B, pair, tied

CONSERVING = {"momentum": EnergyMomentum(), "decaying": EnergyDecaying(0.5)}


@njit
def piston_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
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


N_STEPS = 40


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
