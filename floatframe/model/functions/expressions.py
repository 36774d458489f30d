"""A small language for forces and control, such as `-k*phi - c*phi_dot + table(t)`, compiled to a list of operations.

It has numbers, names, + - * / ** (or ^), comparisons < <= > >=, `a if x < b else c`, and the functions of `FUNCTIONS`.
The text is parsed by Python's own parser and never executed; nothing beyond this list is allowed. The kernels evaluate
the tape and its exact gradient (kernels/connections/user_force.py), so a new expression needs no compilation.
"""

import ast
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from fe_models.foundation.words import nearest, quoted, shortened
from floatframe.errors import ModelError

__all__ = ["CONSTANTS", "FUNCTIONS", "Tape", "compile_expression"]

#: codes of the operations in the kernels: without operand, with one operand, with two operands
CONSTANT, INPUT, CALL, SELECT = range(4)
NEGATIVE, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, EXP, LOG, SQRT, ABS, SIGN = range(4, 19)
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, ATAN2, LESS, MIN, MAX = range(19, 28)

FUNCTIONS = {  # code and number of arguments, by name
    "sin": (SIN, 1), "cos": (COS, 1), "tan": (TAN, 1), "asin": (ASIN, 1), "acos": (ACOS, 1), "atan": (ATAN, 1),
    "sinh": (SINH, 1), "cosh": (COSH, 1), "tanh": (TANH, 1), "exp": (EXP, 1), "log": (LOG, 1), "sqrt": (SQRT, 1),
    "abs": (ABS, 1), "sign": (SIGN, 1), "atan2": (ATAN2, 2), "min": (MIN, 2), "max": (MAX, 2),
}  # fmt: skip
CONSTANTS = {"pi": math.pi}
OPERATORS: dict[type, int] = {
    ast.Add: ADD, ast.Sub: SUBTRACT, ast.Mult: MULTIPLY, ast.Div: DIVIDE, ast.Pow: POWER, ast.BitXor: POWER,
}  # fmt: skip
MOST_OPERATIONS = 500
LONGEST_TEXT = 10_000  #: largest number of characters


@dataclass
class Tape:
    """Operations in order, each with code, operands (indices of earlier operations or inputs) and constant."""

    op: list[int] = field(default_factory=list)
    a: list[int] = field(default_factory=list)
    b: list[int] = field(default_factory=list)
    c: list[float] = field(default_factory=list)

    def add(self, op: int, a: int = 0, b: int = 0, c: float = 0.0) -> int:
        """Append an operation; return its index."""
        self.op.append(op)
        self.a.append(a)
        self.b.append(b)
        self.c.append(c)
        return len(self.op) - 1


def compile_expression(
    where: str,
    text: str,
    inputs: Sequence[str],
    *,
    parameters: Mapping[str, float] | None = None,
    functions: Mapping[str, int] | None = None,
    switches: Mapping[str, str] | None = None,
) -> Tape:
    """Return the compiled operations of an expression.

    Parameters
    ----------
    where
        Name of the expression, for messages.
    text
        The expression.
    inputs
        Names of its input variables, in order.
    parameters
        Names with constant values.
    functions
        Names of functions of one variable (tables), with their indices in the kernels.
    switches
        Names of expressions whose sign is used: 1 at zero and above, else -1.

    Raises
    ------
    ModelError
        With the token and its column, if the text is not an expression or uses unknown names.
    """
    if isinstance(text, str) and len(text) > LONGEST_TEXT:
        raise ModelError(f"{where}: expected up to {LONGEST_TEXT} characters, got {len(text)}: {quoted(text)}")
    try:
        tree = parsed(text)
        known = dict(parameters or {}), dict(functions or {}), dict(switches or {})
        writer = Writer(where, text, tuple(inputs), *known, Tape())
        writer.write(tree)
    except (SyntaxError, AttributeError, ValueError) as problem:
        if isinstance(problem, ModelError):
            raise
        column = getattr(problem, "offset", None)
        place = f" at column {column}" if column else ""
        raise ModelError(f"{where}: {quoted(text)} is not an expression{place}; see docs/system_file.md") from None
    except (RecursionError, MemoryError):  # the parser's own limits
        raise ModelError(f"{where}: {quoted(text)} is nested too deeply; use fewer operations and brackets") from None
    if len(writer.tape.op) > MOST_OPERATIONS:
        raise ModelError(f"{where}: expected up to {MOST_OPERATIONS} operations, got {len(writer.tape.op)}")
    return writer.tape


def parsed(text: str) -> ast.expr:
    """Return the syntax tree of an expression."""
    with warnings.catch_warnings():  # the parser warns about odd text such as 1if x<1else 2
        warnings.simplefilter("ignore", SyntaxWarning)
        warnings.simplefilter("ignore", DeprecationWarning)
        return ast.parse(text.strip().replace("^", "**"), mode="eval").body


@dataclass
class Writer:
    """Writes the nodes of a syntax tree on a tape."""

    where: str
    text: str
    inputs: tuple[str, ...]
    parameters: dict[str, float]
    functions: dict[str, int]
    switches: dict[str, str]
    tape: Tape

    def refuse(self, node: ast.AST, words: str, hint: str = "") -> ModelError:
        """Return the error about a node of the syntax tree."""
        column = getattr(node, "col_offset", 0) + 1
        return ModelError(f"{self.where}: {words} at column {column} of {quoted(self.text)}{hint}")

    def write(self, node: ast.AST) -> int:
        """Write a node; return the index of its operation."""
        if isinstance(node, ast.Constant):
            return self.number(node)
        if isinstance(node, ast.Name):
            return self.name(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            operand = self.write(node.operand)
            return self.tape.add(NEGATIVE, operand) if isinstance(node.op, ast.USub) else operand
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            a, b = self.write(node.left), self.write(node.right)
            return self.tape.add(OPERATORS[type(node.op)], a, b)
        if isinstance(node, ast.Call):
            return self.call(node)
        if isinstance(node, ast.Compare):
            return self.compare(node)
        if isinstance(node, ast.IfExp):
            yes, no = self.write(node.body), self.write(node.orelse)
            self.compare(node.test)
            return self.tape.add(SELECT, yes, no)
        raise self.refuse(
            node, f"{quoted(ast.unparse(node))} does not belong to the language (see docs/system_file.md)"
        )

    def number(self, node: ast.Constant) -> int:
        """Write a number."""
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            raise self.refuse(node, f"expected a number, got {shortened(ast.unparse(node))}")
        try:
            value = float(node.value)
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise self.refuse(node, "expected a number below 1.8e308")
        return self.tape.add(CONSTANT, c=value)

    def name(self, node: ast.Name) -> int:
        """Write an input, a parameter or a constant."""
        if node.id in self.inputs:
            return self.tape.add(INPUT, self.inputs.index(node.id))
        known = {**CONSTANTS, **self.parameters}
        if node.id in known:
            return self.tape.add(CONSTANT, c=float(known[node.id]))
        if node.id in self.switches:
            text = self.switches[node.id]
            return replace(self, text=text, switches={}).write(parsed(f"-1 if ({text}) < 0 else 1"))
        if node.id in self.functions or node.id in FUNCTIONS:
            raise self.refuse(node, f"{node.id!r} is a function; expected {node.id}(...)")
        choices = [*self.inputs, *known, *self.switches]
        raise self.refuse(node, f"unknown name {quoted(node.id)}", nearest(node.id, choices))

    def call(self, node: ast.Call) -> int:
        """Write a call of a function."""
        if not isinstance(node.func, ast.Name) or node.keywords:
            raise self.refuse(node, f"{quoted(ast.unparse(node))} does not belong to the language")
        name, n = node.func.id, len(node.args)
        if name in self.functions:
            if n != 1:
                raise self.refuse(node, f"{name} takes one argument, got {n}")
            return self.tape.add(CALL, self.write(node.args[0]), self.functions[name])
        if name not in FUNCTIONS:
            choices = [*FUNCTIONS, *self.functions]
            raise self.refuse(node, f"unknown function {quoted(name)}", nearest(name, choices))
        code, expected = FUNCTIONS[name]
        if n != expected:
            raise self.refuse(node, f"{name} takes {expected} argument{'s' * (expected > 1)}, got {n}")
        operands = [self.write(argument) for argument in node.args]
        return self.tape.add(code, *operands)

    def compare(self, node: ast.AST) -> int:
        """Write a comparison, whose value is 1 if it is true, else 0."""
        if not isinstance(node, ast.Compare) or len(node.ops) != 1:
            raise self.refuse(node, f"expected one comparison such as x < 1, got {quoted(ast.unparse(node))}")
        a, b = self.write(node.left), self.write(node.comparators[0])
        kind = type(node.ops[0])
        if kind is ast.Lt:
            return self.tape.add(LESS, a, b)
        if kind is ast.Gt:
            return self.tape.add(LESS, b, a)
        if kind not in (ast.LtE, ast.GtE):
            raise self.refuse(node, "expected one of < <= > >=")
        less = self.tape.add(LESS, b, a) if kind is ast.LtE else self.tape.add(LESS, a, b)
        one = self.tape.add(CONSTANT, c=1.0)
        return self.tape.add(SUBTRACT, one, less)
