"""Statements and expressions of a routine, independent of the language.

A term that is used once is written inside the expression that uses it, unless the line becomes too long. All other
terms are named. Parentheses preserve the order of the operations in the graph, so that all languages have the same
rounding.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from floatframe.design.generation.graph import ADD, CONSTANT, COS, DIV, MUL, NEG, SIN, SUB, SYMBOL, Scalar, reachable
from floatframe.design.generation.routines import Routine

__all__ = ["Lines", "lines_of", "needed_inputs", "with_subscript"]

LONGEST = 80  #: largest number of characters of an expression inside another one
SUM, PRODUCT, ATOM = range(3)  #: precedence of an expression
SIGNS = {ADD: "+", SUB: "-", MUL: "*", DIV: "/"}


@dataclass(frozen=True)
class Lines:
    """A routine as text: named terms in order, and its results, output by output, by rows."""

    named: tuple[tuple[str, str], ...]
    turns: tuple[tuple[str, str, str], ...]  #: text of an angle and names of its sine and cosine, if both are needed
    results: tuple[tuple[str, ...], ...]


def with_subscript(name: str) -> str:
    """Return the symbol name[k] as name(k + 1)."""
    stem, _, k = name[:-1].partition("[")
    return f"{stem}({int(k) + 1})"


def needed_inputs(routine: Routine) -> set[str]:
    """Return the names of the inputs that results depend on."""
    return {term.name.partition("[")[0] for term in reachable(routine.values) if term.kind == SYMBOL}


def lines_of(routine: Routine, *, symbol: Callable[[str], str]) -> Lines:
    """Return the text of a routine.

    Parameters
    ----------
    symbol
        Returns the text of an input of the routine.
    """
    order = reachable(routine.values)
    used = Counter(arg.index for term in order for arg in term.args)
    used.update(value.index for value in routine.values)
    turned = {
        term.args[0].index for term in order
        if term.kind == NEG and term.args[0].kind == SUB and used[term.args[0].index] == 1
    }  # fmt: skip
    angles = Counter(term.args[0].index for term in order if term.kind in (SIN, COS))
    written: dict[int, tuple[str, int]] = {}
    named: list[tuple[str, str]] = []

    def text(term: Scalar, at_least: int) -> str:
        out, level = written[term.index]
        return out if level >= at_least else f"({out})"

    def expression(term: Scalar) -> tuple[str, int]:
        kind = term.kind
        if kind == CONSTANT:
            return repr(term.value), ATOM if term.value >= 0 else SUM
        if kind == SYMBOL:
            return symbol(term.name), ATOM
        if kind in (SIN, COS):
            return f"{'sin' if kind == SIN else 'cos'}({text(term.args[0], SUM)})", ATOM
        a = term.args[0]
        if kind == NEG:
            if a.index in turned:
                first, second = a.args[1], a.args[0]
                return f"{text(first, SUM)} - {text(second, PRODUCT)}", SUM
            return f"-{text(a, ATOM)}", SUM
        b = term.args[1]
        level = SUM if kind in (ADD, SUB) else PRODUCT
        return f"{text(a, level)} {SIGNS[kind]} {text(b, level + 1)}", level

    for term in order:
        if term.index in turned:  # its only use is its negative, written as b - a
            continue
        out, level = expression(term)
        is_free = term.kind in (CONSTANT, SYMBOL) or (term.kind == NEG and len(out) < 8)
        is_turn = term.kind in (SIN, COS) and angles[term.args[0].index] == 2
        if not is_free and (used[term.index] > 1 or len(out) > LONGEST or is_turn):
            name = f"t{len(named)}"
            named.append((name, out))
            out, level = name, ATOM
        written[term.index] = out, level
    pairs: dict[int, list[Scalar]] = {}
    for term in order:
        if term.kind in (SIN, COS) and angles[term.args[0].index] == 2:
            pairs.setdefault(term.args[0].index, []).append(term)
    turns = []
    for both in pairs.values():
        sine, cosine = sorted(both, key=lambda term: term.kind)
        turns.append((written[sine.args[0].index][0], written[sine.index][0], written[cosine.index][0]))
    results = tuple(
        tuple(written[value.index][0] for value in output.values.ravel()) for output in routine.outputs
    )  # fmt: skip
    return Lines(tuple(named), tuple(turns), results)
