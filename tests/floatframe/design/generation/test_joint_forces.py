"""Springs, dampers and preloads of joints in generated code, beside the engine in absolute coordinates."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.design.generation.generate import generate
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import constant
from tests.floatframe.design.generation.calls import Case, near, python_function
from tests.floatframe.design.identification.robots import random_tree

HELD = (
    ff.JointForce("spring", "joint1", "angle", stiffness=40.0, free=0.3, damping=2.0, preload=1.5),
    ff.JointForce("second", "joint1", "angle", damping=0.7),
    ff.JointForce("strut", "joint3", "distance", stiffness=90.0, free=-0.1, damping=5.0),
)


class Held(Case):
    """A tree of hinges and sliders with springs; the model has none."""

    def __init__(self):
        bare = random_tree(11, 5, "RPP")
        super().__init__(bare)
        self.held = replace(bare, forces=(*bare.forces, *self.springs()))

    def springs(self):
        """A spring and a damper on a hinge, a strut on a slider, along coordinates that the tree has."""
        hinge = next(name for name in self.model.names if name.endswith("/angle"))
        slider = next(name for name in self.model.names if name.endswith("/distance"))
        places = {"angle": hinge, "distance": slider}
        return [replace(each, joint=places[each.coordinate].split("/")[0]) for each in HELD]


@pytest.fixture(scope="module")
def case():
    return Held()


def test_springs_accelerate_bodies_as_in_absolute_coordinates(case):
    """What they add to the velocities' rates of all bodies, from the equations with constraints, and from the code."""
    with_springs, without = (python_function(each, "forward") for each in (case.held, case.system))
    for z, z_dot, _, force in case.motions:
        z = 0.3 * z
        state = case.model.state(z, z_dot)
        absolute = [consistent_motion(each, state).u_dot for each in (case.held, case.system)]
        added = with_springs(z, z_dot, force) - without(z, z_dot, force)
        columns = np.column_stack([case.model.engine_state(z, each).u for each in np.eye(case.model.n_rates)])
        expected = absolute[0] - absolute[1]
        assert np.abs(expected).max() > 1
        assert_allclose(columns @ added, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_forces_residual_and_derivatives_belong_to_the_same_springs(case):
    """Inverse undoes forward; its derivatives are differences of itself; the mass matrix knows of no spring."""
    run = {what: python_function(case.held, what) for what in ("inverse", "forward", "residual", "jacobian", "mass")}
    for z, z_dot, z_ddot, force in case.motions:
        near(run["inverse"](z, z_dot, run["forward"](z, z_dot, force)), force, 1e3)
        near(run["residual"](z, z_dot, z_ddot, force), run["inverse"](z, z_dot, z_ddot) - force)
        near(run["mass"](z), case.model.mass_matrix(z))
        bare = case.model.derivatives(z, z_dot, z_ddot)
        by_z, by_rate, _ = run["jacobian"](z, z_dot, z_ddot)
        stiffness, damping = np.zeros_like(by_z), np.zeros_like(by_z)
        for each in case.springs():
            k = case.model.rate_names.index(f"{each.joint}/{each.coordinate}")
            stiffness[k, k] += each.stiffness
            damping[k, k] += each.damping
        near(by_z, bare.by_z + stiffness)
        near(by_rate, bare.by_z_dot + damping)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"motor": constant(2.0)}, "force 'spring': expected gravity, or joint forces .* got one with a motor"),
        ({"friction": 2.0}, "force 'spring': .* got one with friction; remove it"),
        ({"coordinate": "angel"}, "force 'spring': expected one of the coordinates of the tree, got 'joint.*/angel'"),
    ],
)
def test_forces_that_are_not_linear_are_refused_by_name(case, changes, message):
    spring = replace(case.springs()[0], **changes)
    with pytest.raises(ModelError, match=message):
        generate(replace(case.system, forces=(*case.system.forces, spring)))


def test_elements_of_force_between_bodies_are_refused_by_name(case):
    names = [body.name for body in case.system.bodies]
    strut = ff.SpringDamper("strut", ff.Marker(names[0]), ff.Marker(names[1]), stiffness=1e3)
    with pytest.raises(ModelError, match=r"force 'strut': .* got a SpringDamper; .* in the input force"):
        generate(replace(case.system, forces=(*case.system.forces, strut)))
