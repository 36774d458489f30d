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
        "cms/cli/test_commands", "floatframe/engine/structure_preserving/test_every_element",
        "pipeline/test_split_line", "floatframe/machines/test_road_car",
        "floatframe/simulation/test_wrong_motions_are_told", "floatframe/simulation/test_step_watch",
        "campaign/test_campaign", "floatframe/cli/test_commands", "floatframe/design/optimization/test_optimization",
        "floatframe/engine/structure_preserving/test_every_part", "floatframe/components/rails/test_law",
        "cms/test_fleet", "floatframe/simulation/test_switching_functions", "floatframe/laws/test_every_constant",
        "test_groups", "floatframe/general_position/test_driven_and_steady_motions_in_other_units",
        "pipeline/test_line", "floatframe/engine/initial_conditions/test_shared_reactions",
        "floatframe/engine/structure_preserving/test_compiled_steps", "floatframe/simulation/test_lifetime",
        "floatframe/engine/compiling/test_lean_laws", "floatframe/simulation/test_spinning_bodies",
        "floatframe/machines/test_bogie", "floatframe/design/laboratory/test_laboratory",
        "floatframe/simulation/test_jumps_of_laws", "floatframe/design/generation/test_generate",
        "floatframe/cli/test_start_and_parameters", "floatframe/design/gradients/test_sensitivities",
        "floatframe/engine/structure_preserving/test_every_force", "floatframe/design/studies/test_study",
        "floatframe/components/wheels/test_wheels_in_motion", "floatframe/analyses/test_equilibrium_and_modes",
        "cms/jobs/decks/test_abaqus_parameters", "floatframe/machines/test_kart",
        "cms/body/modal_file/test_impossible_content", "cms/linear_algebra/memory/test_budget",
        "floatframe/durability/shaking/test_shake_file", "cms/jobs/decks/test_nastran_fields",
        "floatframe/simulation/test_restart", "floatframe/files/cosimulation/test_fmu",
        "cms/assessment/quality/of_reduction/test_light_frames",
    )
)  # fmt: skip


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Sort whole files: the slowest first, then the notebooks, then the others as they were."""
    ranks = {ROOT / file: rank for rank, file in enumerate(SLOWEST)}
    notebook, other = len(ranks), len(ranks) + 1
    items.sort(key=lambda item: ranks.get(item.path, notebook if item.path.suffix == ".ipynb" else other))
