"""The language of expressions: its meaning against Python's, its refusals."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import ModelError
from floatframe.model.elements.expressions import tape_at, tape_numbers
from floatframe.model.functions.expressions import FUNCTIONS, compile_expression
from floatframe.model.functions.time_switches import time_parts
from tests.floatframe.model.functions.examples import EXPRESSIONS


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_a_tape_has_an_operation_for_every_node(text):
    tape = compile_expression("f", text, ["x", "y", "z"], parameters={"k": 2.5})
    assert len(tape.op) == len(tape.a) == len(tape.b) == len(tape.c) > 0
    assert all(a <= k and b <= k for k, (a, b) in enumerate(zip(tape.a, tape.b, strict=True)) if tape.op[k] > 1)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_values_over_time_and_in_laws_of_elements_are_those_of_python(text):
    motion = {"x": lambda t: 1.3 + np.sin(7 * t), "y": lambda t: 2 * np.cos(5 * t), "z": lambda t: 3 * t - 0.4}
    own = {name: getattr(math, name) for name in FUNCTIONS if hasattr(math, name)}
    own |= {"abs": abs, "min": min, "max": max, "sign": lambda x: (x > 0) - (x < 0), "pi": math.pi, "k": 2.5}
    times = np.linspace(0.0, 0.28, 41)  # y is above zero, for x ** y
    rows = np.array([function(times) for function in motion.values()]).T
    exact = [eval(text.replace("^", "**"), own | dict(zip(motion, map(float, row), strict=True))) for row in rows]
    tape = compile_expression("f", text, list(motion), parameters={"k": 2.5})
    value = time_parts(tape, dict(enumerate(motion.values())), []).value
    assert_allclose(value(times), exact, rtol=1e-14, atol=1e-14)
    data, results = np.array(tape_numbers(tape, [])), np.empty(len(tape.op))
    assert_allclose([tape_at(data, 0, row, results) for row in rows], exact, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2 *", r"'2 \*' is not an expression"),
        ("x + phi", "unknown name 'phi' at column 5 of 'x . phi'"),
        ("x + yy", "unknown name 'yy' at column 5 of .*; did you mean 'y'"),
        ("sni(x)", "unknown function 'sni' at column 1 of .*; did you mean 'sin'"),
        ("sin(x, y)", "sin takes 1 argument, got 2"),
        ("atan2(x)", "atan2 takes 2 arguments, got 1"),
        ("sin", r"'sin' is a function; expected sin\(...\)"),
        ("x.real", "'x.real' does not belong to the language"),
        ("__import__('os').system('ls')", "not belong to the language"),
        ("[x for x in y]", "not belong to the language"),
        ("x and y", "not belong to the language"),
        ("'text'", "expected a number, got 'text'"),
        ("True", "expected a number, got True"),
        ("1 if x else 2", "expected one comparison"),
        ("1 if x == y else 2", "expected one of < <= > >="),
        ("+".join(["x"] * 400), "expected up to 500 operations"),
        (3.0, "is not an expression"),
        ("(" * 300 + "x" + ")" * 300, "is not an expression"),
        ("-" * 3000 + "x", "nested too deeply"),
        ("+".join(["x"] * 3000), "nested too deeply"),
        ("x" * 20_000, "expected up to 10000 characters, got 20000"),
        ("1" + "0" * 400 + " * x", "expected a number below"),
        ("1e400 * x", "expected a number below"),
        ("x * \0", "is not an expression"),
        ("long" * 500, "unknown name"),
    ],
)
def test_what_is_no_expression_is_refused(text, words):
    with pytest.raises(ModelError, match=words) as error:
        compile_expression("f", text, ["x", "y", "z"])
    assert len(str(error.value)) < 400


def test_what_only_reads_oddly_is_taken_without_a_warning():
    assert compile_expression("f", "1if x<1else 2", ["x"]).op
