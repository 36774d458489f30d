"""Nothing outlives the objects that a user drops: models and working arrays are large."""

import copy
import gc
import pickle
import weakref

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import floatframe as ff
import floatframe.engine.tree.kernels.entry  # it has a record of its own
from floatframe.components.mechanisms import double_pendulum
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.records import Tabled
from floatframe.engine.kernels.work import new_work
from floatframe.integrators import RelativeGeneralizedAlpha, RelativeOde


def swing(method):
    """Run a motion."""
    return lambda system: ff.integrate(system, method, 0.02, 0.01)


def tree(system):
    """Evaluate the equations of a tree."""
    model = ff.analyses.relative_model(system)
    model.mass_matrix(np.zeros(model.n_z))


def sensitivity(system):
    """Differentiate a motion by a mass."""
    name = system.joints[0].name
    ff.design.sensitivities(
        system, [f"{name}.angle value"], [f"bodies.{system.bodies[0].name}.mass"], t_end=0.02, h=0.01
    )


CASES = {
    "absolute": swing(ff.GeneralizedAlpha(0.8)),
    "relative": swing(RelativeGeneralizedAlpha(0.8)),
    "ode": swing(RelativeOde()),
    "energy-momentum": swing(ff.integrators.EnergyMomentum()),
    "variational": swing(ff.integrators.Variational()),
    "tree": tree,
    "sensitivity": sensitivity,
}


def n_records():
    """Return the number of records, models and working arrays, that live."""
    gc.collect()
    return sum(issubclass(type(each), Tabled) for each in gc.get_objects())  # isinstance asks what a proxy stands for


@pytest.mark.parametrize("case", CASES)
def test_a_dropped_system_is_collected(case):
    """With the records of its own, and those of other systems that the analysis has made."""
    n_before = n_records()
    system = double_pendulum()
    CASES[case](system)
    model = compiled_system(system).model
    work = new_work(model)
    ends = [weakref.ref(each) for each in (model.bodies.kind, work.state.r, compiled_system(system))]
    assert model.table is model.table
    del system, model, work
    assert n_records() <= n_before
    assert [end() is None for end in ends] == [True] * 3


def test_a_copy_of_a_record_has_a_table_of_its_own():
    work = new_work(compiled_system(double_pendulum()).model)
    first = work.table.copy()
    for each in (copy.deepcopy(work), pickle.loads(pickle.dumps(work)), work._replace(state=work.state)):
        assert each.table is not work.table
        assert each.table[0] == each.state.r.ctypes.data
    assert_array_equal(work.table, first)
