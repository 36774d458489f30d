"""Operations beside SymPy's common subexpressions; text that another language than C reads otherwise."""

import floatframe as ff
from tests.floatframe.design.generation.calls import puma
from tests.floatframe.design.generation.sympy_count import sympy_operations


def test_no_more_operations_than_common_subexpressions_of_sympy():
    """Of the same recursion by SymPy's cse, which takes sums and products apart before it looks for common ones."""
    count = ff.design.generate(puma()).operations
    additions, multiplications = sympy_operations(puma())
    assert count.additions <= additions
    assert count.multiplications <= multiplications
