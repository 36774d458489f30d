"""The language of expressions: its meaning against Python's, its refusals."""

import pytest

from floatframe.errors import ModelError
from floatframe.model.functions.expressions import compile_expression

EXPRESSIONS = [  # also used with their gradients in test_user_forces
    "2 * x - y / 3 + 4",
    "-x ** 2 + y ^ 3 - (-z)",
    "sin(x) * cos(y) - tan(x / 3) + asin(x / 9) + acos(y / 9) + atan(z)",
    "sinh(x / 2) + cosh(y) * tanh(z) - exp(-x) + log(x + 2) + sqrt(y + 5)",
    "atan2(x, y) + abs(z) * sign(y) + min(x, y) - max(z, 2 * x)",
    "pi * x if x < y else 3 * y ** 2",
    "(1 if x >= z else 0) * x + (2 if x > 5 else 3) * y + (x <= z) * y",
    "x ** y",
    "k * x",
]


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_a_tape_has_an_operation_for_every_node(text):
    tape = compile_expression("f", text, ["x", "y", "z"], parameters={"k": 2.5})
    assert len(tape.op) == len(tape.a) == len(tape.b) == len(tape.c) > 0
    assert all(a <= k and b <= k for k, (a, b) in enumerate(zip(tape.a, tape.b, strict=True)) if tape.op[k] > 1)


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
        ("x.real", "'x.real' is no part of the language"),
        ("__import__('os').system('ls')", "no part of the language"),
        ("[x for x in y]", "no part of the language"),
        ("x and y", "no part of the language"),
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
