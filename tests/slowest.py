"""The slow test files, and a plugin of pytest that starts them first: `-p tests.slowest`.

Begun last, a slow file would keep one worker busy while the others are idle. The order of the arguments of pytest does
not do it: a file inside a folder that is an argument too is collected with the folder.
"""

import pytest

from tests.root import ROOT

__all__ = ["SLOWEST"]

#: files that take more than ten seconds of a processor, the longest first
SLOWEST = tuple(
    f"tests/{name}.py"
    for name in (
        "floatframe/engine/structure_preserving/test_every_element",
        "floatframe/design/generation/units/test_generated_unit",
        "floatframe/engine/structure_preserving/test_every_part",
        "floatframe/engine/structure_preserving/test_connections",
        "floatframe/engine/structure_preserving/test_every_force", "floatframe/simulation/test_jumps_of_laws",
        "floatframe/simulation/test_wrong_motions_are_told", "floatframe/design/optimization/test_optimization",
        "floatframe/design/gradients/test_sensitivities", "floatframe/general_position/test_every_part_in_other_units",
        "floatframe/model/elements/test_element_faults", "fe_models/elements/shells/test_geometric",
        "pipeline/test_line", "floatframe/cli/test_commands", "floatframe/design/laboratory/test_laboratory",
        "floatframe/design/generation/test_generate", "floatframe/files/cosimulation/test_fmu",
        "pipeline/test_split_line", "floatframe/components/clearances/test_clearances",
        "cms/assessment/rendering/test_render", "floatframe/machines/test_bogie",
        "floatframe/design/studies/test_study", "floatframe/components/rails/test_wheelset",
        "floatframe/machines/test_bogie_steady", "floatframe/machines/test_flexible_arm",
    )
)  # fmt: skip


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Sort whole files: the slowest first, then the notebooks, then the others as they were."""
    ranks = {ROOT / file: rank for rank, file in enumerate(SLOWEST)}
    notebook, other = len(ranks), len(ranks) + 1
    items.sort(key=lambda item: ranks.get(item.path, notebook if item.path.suffix == ".ipynb" else other))
