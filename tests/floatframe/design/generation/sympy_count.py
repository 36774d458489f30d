"""Operations that SymPy's common subexpressions leave of generated inverse dynamics."""

import pytest

import floatframe as ff


def sympy_operations(system):
    """Return additions and multiplications of the generated Python text after `sympy.cse`, which takes it apart."""
    sympy = pytest.importorskip("sympy")
    lines = ff.design.generate(system, language="python", name="f").files["f.py"].splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("    t0 = "))
    end = next(k for k, line in enumerate(lines) if line.startswith("    return stacked(force"))
    n = ff.analyses.relative_model(system).n_z
    space = {name: sympy.symbols(f"{name}:{n}") for name in ("z", "z_dot", "z_ddot")}
    space |= {"sin": sympy.sin, "cos": sympy.cos}
    exec("\n".join(line[4:] for line in lines[start:end]), space)
    named, results = sympy.cse(space["force"])
    additions = multiplications = 0
    for expression in (*(each for _, each in named), *results):
        for node in sympy.preorder_traversal(expression):
            if node.is_Add:
                additions += len(node.args) - 1
            elif node.is_Mul:
                multiplications += len([each for each in node.args if each != -1]) - 1
            elif node.is_Pow:
                multiplications += abs(int(node.exp)) - 1
    return additions, multiplications
