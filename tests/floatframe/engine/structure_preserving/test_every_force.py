"""Every force by every scheme, see `test_every_part`."""

import pytest

import floatframe.model.forces as forces
from tests.floatframe.engine.structure_preserving.compared import assert_runs_or_is_refused, cells, system_of
from tests.floatframe.engine.structure_preserving.parts import FORCES


@pytest.mark.parametrize(("name", "part"), cells(FORCES))
def test_a_force_acts_as_by_generalized_alpha_or_is_refused_by_name(name, part):
    assert_runs_or_is_refused(name, part)


def test_every_force_has_its_cells():
    known = {
        cls for cls in vars(forces).values() if isinstance(cls, type) and cls.__module__.startswith(forces.__name__)
    }
    assert known <= {type(force) for part in FORCES for force in system_of(part).forces}
