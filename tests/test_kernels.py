"""Compiled loops: what would make numba compile for seconds, but no kernel needs."""

import ast

from tests.root import ROOT

NUMBERS = (ast.Constant, ast.UnaryOp)


def slow_copies(source: str) -> list[str]:
    """The lines that assign an array to a slice in the functions with a decorator `jit` or `jit_...`."""
    found = []
    for function in ast.parse(source).body:
        if not isinstance(function, ast.FunctionDef):
            continue
        if not any(isinstance(each, ast.Name) and each.id.startswith("jit") for each in function.decorator_list):
            continue
        for line in ast.walk(function):
            if isinstance(line, ast.Assign) and not isinstance(line.value, NUMBERS):
                index = [each.slice for each in line.targets if isinstance(each, ast.Subscript)]
                if any(isinstance(each, ast.Slice) for one in index for each in ast.walk(one)):
                    found.append(ast.unparse(line))
    return found


def test_kernels_copy_arrays_in_loops():
    """Numba compiles its message of the shapes, two to five seconds, for an assignment of an array to a slice."""
    assert slow_copies("@jit\ndef f(a, b):\n    a[0, 1:] = b\n    a[:] = 0.0\n    a[1] = b[2:]\n") == ["a[0, 1:] = b"]
    kernels = [path for package in ("fe_models", "cms", "floatframe") for path in sorted((ROOT / package).rglob("*.py"))
               if "kernels.jit import" in path.read_text()]  # fmt: skip
    assert len(kernels) > 5
    slow = {str(path.relative_to(ROOT)): lines for path in kernels if (lines := slow_copies(path.read_text()))}
    assert slow == {}
