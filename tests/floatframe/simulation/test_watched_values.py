"""What events take straight from a run against the sensors; memories that a run keeps against runs that end there."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.compiler.structure import n_words, table_of_numbers
from floatframe.engine.kernels.entry import Order
from floatframe.engine.kernels.records import filled, zeros
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ConvergenceError
from floatframe.integrators import EnergyMomentum, Variational
from floatframe.integrators.integrator import memory_of_past
from floatframe.integrators.relative import RelativeGeneralizedAlpha
from floatframe.joints import JointCoordinate
from floatframe.simulation import Event
from floatframe.simulation.passage import direct_values
from floatframe.simulation.restart import restart_record
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness
from tests.floatframe.simulation.examples import double_pendulum, falling

METHODS = [GeneralizedAlpha(), GeneralizedAlpha(error_tolerance=1e-6), RelativeGeneralizedAlpha(), EnergyMomentum(),
           Variational()]  # fmt: skip


@pytest.mark.parametrize("method", METHODS[2:4])
@pytest.mark.parametrize("joint", ["hinge", "knee"])
def test_an_angle_of_the_run_is_that_of_the_sensor(method, joint):
    """Through full turns, of a joint to the ground and one between two bodies."""
    system = double_pendulum(forces=[JointForce("drive", "hinge", "angle", preload=60.0)])
    watched = direct_values(system, Event("e", f"{joint}.angle", stop=True))
    motion = integrate(system, method, 3.0, 0.01)
    rows = type("Rows", (), {"angle": motion.source.read("angle")})
    assert watched is not None
    expected = JointCoordinate(joint, "angle").measure(system, motion).value
    assert np.abs(expected).max() > (np.pi if joint == "hinge" else 1.0)
    assert_allclose(watched(rows), expected, rtol=0, atol=1e-12)


def test_a_first_step_that_fails_under_a_watched_event_is_told_as_such():
    """No row of results exists then; the search for passed levels found its largest value among none."""
    system = double_pendulum(forces=[JointForce("drive", "hinge", "angle", preload=1e9)])
    system = replace(system, events=[Event("far", "hinge.angle", level=1e6, stop=True)])
    with pytest.raises(ConvergenceError, match="step"):
        integrate(system, GeneralizedAlpha(), 3.0, 0.5, output_every=3)


def test_what_a_run_does_not_count_is_left_to_the_sensors():
    """Distances, rates, angles at a flexible body, which turns by its modes besides."""
    assert direct_values(falling(), Event("e", "guide.distance", stop=True)) is None
    assert direct_values(double_pendulum(), Event("e", "knee.angle", column="rate", stop=True)) is None
    reduced = reduced_body(random_point_masses(3, 5), stiffness(3, omega=300.0), name="wheel")
    hub = Marker("wheel", reduced.interfaces[0].name)
    bent = System([FlexibleBody("wheel", reduced)], [RevoluteJoint("axle", GROUND, hub, axis=(0, 0, 1))])
    assert direct_values(bent, Event("e", "axle.angle", stop=True)) is None


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_a_memory_of_the_past_is_that_of_a_run_that_ends_there(method):
    """Bit for bit, whatever it remembers."""
    system = double_pendulum()
    model = compiled_system(system).model

    def run(n_steps):
        work = new_work(model, 20)
        memory, _ = method.observe(system, 0.0, method.start(system, 0.0), work)
        memory, *_ = method.advance(system, memory, work, t0=0.0, h=0.01, first=0, n_steps=n_steps, every=1)
        return memory, work

    end, work = run(20)
    for k in (0, 7, 19):
        expected, found = restart_record(run(k + 1)[0], 0), restart_record(memory_of_past(work, end, k), 0)
        for name, value in expected.items():
            assert_array_equal(found[name], value, err_msg=name)


def test_a_table_of_numbers_is_that_of_their_arrays():
    values = {"what": 4, "h": 0.25, "n_steps": 17, "h_min": -3.5}
    table, numbers = table_of_numbers(Order(), values)
    expected = filled(Order(), **(zeros(Order(), {})._asdict() | values))
    assert len(table) == n_words(Order())
    assert_array_equal(table, numbers.ctypes.data + 8 * np.arange(len(table)))
    for k, array in enumerate(expected):
        assert numbers[k : k + 1].view(array.dtype)[0] == array
    with pytest.raises(TypeError, match="no numbers hh"):
        table_of_numbers(Order(), {"hh": 1.0})


def test_results_between_events_are_not_needed_to_find_them():
    """A wheel, angles alone: the same events and results as where a sensor asks for results of every step."""
    wheel = RigidBody("wheel", 1.0, np.diag([1.0, 2.0, 3.0]), omega_B=(0, 0, 5.0))
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("wheel"), axis=(0, 0, 1))
    mark = Event("mark", "hinge.angle", 4.5 * np.pi, record=True)
    never = Event("never", "speed", 100.0, column="rate", record=True)
    plain = System([wheel], [hinge], events=[mark])
    full = System([wheel], [hinge], events=[mark, never], sensors=[JointCoordinate("hinge", "angle", "speed")])
    motions = [integrate(system, GeneralizedAlpha(), 5.0, 0.01, output_every=7) for system in (plain, full)]
    assert len(motions[0].head.summary["events"]) == 1
    assert motions[0].head.summary["events"] == motions[1].head.summary["events"]
    for name in ("t", "position", "u", "w", "angle"):
        assert_array_equal(*(motion.source.read(name) for motion in motions))
