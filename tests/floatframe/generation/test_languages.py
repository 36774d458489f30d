"""MATLAB text read by a small reader of these tests; operations beside SymPy's common subexpressions."""

import math
import re

import numpy as np
import pytest

import floatframe as ff
from tests.floatframe.generation.sympy_count import sympy_operations
from tests.floatframe.generation.test_generate import SYSTEMS, Case, near, puma


def matlab_function(text):
    """Return a generated MATLAB function as one of Python: indices from 1, matrices of rows."""
    lines = [line for line in text.splitlines() if not line.startswith("%")]
    outs, arguments = re.fullmatch(r"function \[(.*)\] = \w+\((.*)\)", lines[0]).groups()
    assert lines[-1] == "end"
    names = "|".join(arguments.split(", "))
    statements, rows = [], None
    for line in lines[1:-1]:
        line = re.sub(rf"\b({names})\((\d+)\)", lambda found: f"{found[1]}[{int(found[2]) - 1}]", line.strip())
        assert line.endswith((";", "["))
        if line.endswith("= ["):
            name, rows = line.split()[0], []
        elif line == "];":
            statements.append(f"{name} = [{', '.join(rows)}]")
        elif line.startswith("("):
            rows.append(f"[{line[:-1]}]")
        else:
            statements.append(line[:-1])

    def run(*values):
        space = dict(zip(arguments.split(", "), values, strict=True)) | {"sin": math.sin, "cos": math.cos}
        for statement in statements:
            exec(statement, space)
        return [np.array(space[name]) for name in outs.split(", ")]

    return run


@pytest.mark.parametrize("system", SYSTEMS)
def test_matlab_text_has_the_numbers_of_the_model(system):
    case = Case(SYSTEMS[system]())
    force = matlab_function(ff.generate(case.system, language="matlab", name="f").files["f.m"])
    expected = case.model.inverse_dynamics(case.z, case.z_dot, case.z_ddot)
    near(force(case.z, case.z_dot, case.z_ddot)[0].ravel(), expected)
    mass = matlab_function(ff.generate(case.system, what="mass", language="matlab", name="f").files["f.m"])
    near(mass(case.z)[0], case.model.mass_matrix(case.z))


def test_no_more_operations_than_common_subexpressions_of_sympy():
    """Of the same recursion by SymPy's cse, which takes sums and products apart before it looks for common ones."""
    count = ff.generate(puma()).operations
    additions, multiplications = sympy_operations(puma())
    assert count.additions <= additions
    assert count.multiplications <= multiplications
