"""The slow test files, and a plugin of pytest that starts them first: `-p tests.slowest`.

Begun last, a slow file would keep one worker busy while the others are idle. The order of the arguments of pytest does
not do it: a file inside a folder that is an argument too is collected with the folder.
"""

import pytest

from tests.root import ROOT

__all__ = ["SLOWEST"]

#: files that take nearly ten seconds of a processor or more, the longest first
SLOWEST = tuple(
    f"tests/{name}.py"
    for name in (
        "floatframe/engine/structure_preserving/test_every_element", "docs/test_getting_started",
        "docs/test_tutorials", "docs/test_neighbouring_programs",
        "cms/cli/test_commands", "pipeline/test_split_line", "floatframe/engine/structure_preserving/test_every_part",
        "floatframe/test_own_kinds", "floatframe/laws/test_every_constant",
        "floatframe/engine/kernels/compiler/test_interpreted",
        "floatframe/engine/compiling/test_lean_laws", "floatframe/machines/test_road_car",
        "floatframe/design/laboratory/test_laboratory",
        "floatframe/design/generation/test_generate", "test_groups",
        "floatframe/engine/structure_preserving/test_compiled_steps", "floatframe/simulation/test_step_watch",
        "campaign/test_campaign", "floatframe/results/test_left_out",
        "floatframe/cli/test_commands", "floatframe/design/optimization/test_optimization",
        "floatframe/engine/structure_preserving/test_every_force", "floatframe/machines/test_bogie",
        "floatframe/design/gradients/test_sensitivities", "fe_models/foundation/tasks/test_dask_tasks",
        "floatframe/general_position/test_driven_and_steady_motions_in_other_units", "pipeline/test_line",
    )
)  # fmt: skip


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Sort whole files: the slowest first, then the notebooks, then the others as they were."""
    ranks = {ROOT / file: rank for rank, file in enumerate(SLOWEST)}
    notebook, other = len(ranks), len(ranks) + 1
    items.sort(key=lambda item: ranks.get(item.path, notebook if item.path.parent.name == "notebooks" else other))
