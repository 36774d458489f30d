"""One root of all errors, and everything that callers caught before is still caught."""

import builtins
import importlib
import re

import pytest

from cms.errors import CmsError
from fe_models.errors import FeModelsError
from fe_models.foundation.errors import ReportedError
from floatframe.errors import FloatframeError

#: package of the error -> name -> what callers caught it by from the beginning
CAUGHT = {
    "cms.errors": {
        "BodyError": (CmsError, ValueError),
        "UnitsError": (CmsError, ValueError),
        "ModeSetError": (CmsError, ValueError),
        "FactorizationError": (CmsError, RuntimeError),
        "CompareError": (CmsError, ValueError),
        "EigenError": (CmsError, RuntimeError),
        "ModalFileError": (CmsError, ValueError),
        "JobError": (CmsError, ValueError),
    },
    "fe_models.errors": {
        name: (FeModelsError, ValueError)
        for name in (
            "MeshError", "MaterialError", "SectionError", "BeamError", "ShellError", "InterfaceError", "LoadError",
            "MatrixError",
        )
    },
    "floatframe.errors": {
        "ModelError": (FloatframeError, ValueError),
        "SystemFileError": (FloatframeError, ValueError),
        "ResultsError": (FloatframeError, ValueError),
        "ConvergenceError": (FloatframeError, RuntimeError),
    },
}  # fmt: skip


@pytest.mark.parametrize(("module", "name"), [(module, name) for module, names in CAUGHT.items() for name in names])
def test_what_callers_catch_today_stays_caught(module, name):
    error = getattr(importlib.import_module(module), name)
    for base in (*CAUGHT[module][name], ReportedError):
        assert issubclass(error, base), f"{name} is no longer a {base.__name__}"


@pytest.mark.parametrize(
    "module", ["cms.errors", "fe_models.errors", "floatframe.errors", "fe_models.foundation.errors"]
)
def test_every_error_has_the_one_root(module):
    listed = importlib.import_module(module)
    for name in listed.__all__:
        assert issubclass(getattr(listed, name), ReportedError)


#: caught where they are raised for, never seen outside
INNER = (
    "fe_models/foundation/records.py: MismatchError",
    "floatframe/engine/kernels/compiler/lean.py: NotLeanError",
    "floatframe/engine/compiling/callbacks/law_source.py: NoKeyError",
    "floatframe/engine/kernels/compiler/stored.py: UnknownKindError",
)


def test_no_error_is_raised_that_is_not_reported():
    """Errors of the packages all derive from the root; classes of errors elsewhere in them too."""
    import ast

    from tests.import_graph import modules, statements, tree_of

    known = {name for name in dir(builtins) if name.endswith("Error") or name == "Exception"}
    strays = []
    for path in modules().values():
        has_error = re.search(r"^ *class \w+Error\b", path.read_text(encoding="utf-8"), re.MULTILINE)
        for node in statements(tree_of(path)) if has_error else ():
            if isinstance(node, ast.ClassDef) and node.name.endswith("Error"):
                bases = {ast.unparse(base) for base in node.bases}
                if bases & known and bases <= known and node.name != "ReportedError":
                    strays.append(f"{path}: {node.name}")
    assert [name for name in strays if not name.endswith(INNER)] == []
