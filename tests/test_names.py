"""The names of the house: one meaning for a class, and no word that leaves the reader guessing (docs/glossary.md).

Both lists of exceptions only become shorter: who renames one takes it off, and none is added.
"""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.import_graph import modules, statements, tree_of
from tests.root import ROOT

#: names of two or more public classes, from before there was this test
SHARED = set(
    """
    Balance Block BodySection Box BoxSection Bracket Branch Builder Carrier Case Column Columns Connections
    Coordinates Counted Coupling Cut Cylinder DampingSection Drawing Element Elements End Entry
    Equations Evaluated Family Frame FrequencyResponse FullModel Functions Graph Held Kept Kind
    Layout Limits Line Lines Link Load Loads MassSection MaterialSection Mesh MeshError Modes Motion Named
    Observed Output OutputSection Parameter ParameterSection Part Picture Place Placed Places Plane Point
    Progress Quantity Recovery Reference Request Rod RodSection Rows Run Search Section Selection
    ShellSection Signals SolidSection Solver SpectrumRequest Spin Step Structure Superelement Table
    Tangents Taylor Track Tree Trial Tube Wheel Work Wrench Writer
""".split()
)

#: participles, adjectives and everyday words in place of the term of the field
FORBIDDEN = {
    "bend": "geometric stiffness", "blown": "what is done", "far_drives": "what is checked", "kept": "retained",
    "least": "minimum", "mend": "repair", "mended": "repaired", "nearest": "did_you_mean, closest", "seen": "observed",
    "shown": "a noun", "soft": "compliance", "taken": "a noun", "told": "reported", "turned": "rotated",
    "words": "description",
}  # fmt: skip

#: places that still have one, from before there was this test: path of the file, name
EXCEPTIONS = set(
    """
fe_models/body/fe_body.py kept
fe_models/foundation/words.py nearest
fe_models/foundation/words.py words
cms/assessment/compare/comparison.py shown
cms/assessment/compare/comparison.py words
cms/assessment/compare/mode_selection.py words
cms/assessment/compare/pulse.py words
cms/assessment/correlation/update.py least
cms/body/geometric_stiffness.py turned
cms/body/reduced_body.py kept
cms/exchange/exporters/nodes.py words
cms/exchange/programs/sid_fem.py words
cms/jobs/acceptance/acceptance.py words
cms/jobs/acceptance/range_of_use.py words
fe_models/assembly/tables/places.py nearest
cms/jobs/studies/correlation_file.py least
cms/linear_algebra/sparse_cholesky/front_kernels.py words
floatframe/analyses/system_matrices.py soft
floatframe/components/rails/contact_search.py bend
floatframe/design/identification/barycentric.py kept
floatframe/design/identification/base_parameters.py kept
floatframe/design/identification/physical.py least
floatframe/design/laboratory/laboratory.py words
floatframe/design/optimization/design.py least
floatframe/design/optimization/design_file.py least
floatframe/durability/shaking/loads/shock.py words
floatframe/durability/shaking/structure/places.py words
floatframe/engine/kernels/compiler/choice.py words
floatframe/engine/kernels/model.py bend
floatframe/engine/kernels/model.py soft
floatframe/engine/kernels/vector.py turned
floatframe/engine/structure_preserving/kernels/records.py kept
floatframe/engine/structure_preserving/kernels/records.py taken
floatframe/engine/tree/kernels/kinematics.py nearest
floatframe/engine/tree/kernels/tree.py kept
floatframe/files/cosimulation/held_inputs.py words
floatframe/files/cosimulation/interface.py words
floatframe/files/cosimulation/model_description.py words
floatframe/integrators/integrator.py words
floatframe/model/bodies/marker_shape.py bend
floatframe/results/validity.py words
floatframe/simulation/energy_watch.py taken
floatframe/simulation/event_steps.py taken
floatframe/simulation/event_steps.py told
floatframe/simulation/integrate.py kept
floatframe/simulation/step_advice.py words
""".split("\n")
) - {""}


class Names(NamedTuple):
    """The names that a module gives."""

    classes: list[str]  #: public
    all: set[str]  #: of the module, of its functions and methods, and of the fields of its classes


@cache
def given_names() -> dict[Path, Names]:
    """Return the names that each module of the packages gives."""
    trees = ((path, tree_of(path)) for path in modules().values())
    return {path: Names(public_classes(tree), names_of(path, tree)) for path, tree in trees}


def public_classes(tree: ast.Module) -> list[str]:
    return [node.name for node in tree.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_")]


def names_of(path: Path, tree: ast.Module) -> set[str]:
    found = {path.parent.name if path.name == "__init__.py" else path.stem}
    for node in statements(tree):
        if isinstance(node, ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.ClassDef):
            found |= {
                item.target.id
                for item in node.body
                if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
            }
    return {name.strip("_") for name in found}


def test_no_two_public_classes_have_one_name():
    classes = Counter(name for names in given_names().values() for name in names.classes)
    twice = {name for name, count in classes.items() if count > 1}
    assert twice - SHARED == set(), "give the class another name"
    assert SHARED - twice == set(), "take the name off the list of exceptions"


def test_names_are_nouns_and_verbs_of_the_field():
    found = {
        f"{path.relative_to(ROOT)} {name}"
        for path, names in given_names().items()
        for name in names.all & set(FORBIDDEN)
    }
    assert found - EXCEPTIONS == set(), f"expected other words, such as {FORBIDDEN}"
    assert EXCEPTIONS - found == set(), "take the place off the list of exceptions"
