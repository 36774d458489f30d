"""Every joint, drive, coupler and body by every scheme: it moves as by generalized-alpha, or is refused by name.

Each cell of the table in docs/integrators.md is a test, here and in the files beside.
"""

import pytest

from floatframe.integrators.registry import CLASSES
from floatframe.model.joints import JOINTS
from tests.floatframe.engine.structure_preserving.compared import ALL, BY_IDA, assert_runs_or_is_refused, cells
from tests.floatframe.engine.structure_preserving.part_table import PAGE, REFUSED, table
from tests.floatframe.engine.structure_preserving.parts import FORCES, METHODS, PARTS


@pytest.mark.parametrize(("name", "part"), cells([part for part in PARTS if part not in FORCES]))
def test_a_part_moves_as_by_generalized_alpha_or_is_refused_by_name(name, part):
    assert_runs_or_is_refused(name, part)


def test_every_joint_and_scheme_has_its_cells():
    assert {f"joint {kind}" for kind in JOINTS} <= set(PARTS)
    assert set(CLASSES) <= {type(method).__name__ for method in METHODS.values()}
    assert set(BY_IDA) <= ALL.keys() - REFUSED["`Ida`"].keys()


def test_the_page_says_what_every_scheme_takes():
    """`python -m tests.floatframe.engine.structure_preserving.part_table` writes it anew."""
    assert table() in PAGE.read_text()
    assert set(REFUSED) <= set(METHODS)
