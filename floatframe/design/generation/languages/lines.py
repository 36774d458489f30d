"""Statements and expressions of a routine, in what all languages have in common.

A term that is needed once stands where it is needed, as long as lines stay readable; all others are given a name.
Parentheses keep the order in which the graph computes, so that all languages round alike.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from floatframe.design.generation.graph import ADD, CONSTANT, COS, DIV, MUL, NEG, SIN, SUB, SYMBOL, Scalar, reachable
from floatframe.design.generation.routines import Routine

__all__ = ["Lines", "lines_of", "needed_inputs", "with_subscript"]

LONGEST = 80  #: characters of an expression that stands inside another
SUM, PRODUCT, ATOM = range(3)  #: how tightly an expression holds together
SIGNS = {ADD: "+", SUB: "-", MUL: "*", DIV: "/"}


@dataclass(frozen=True)
class Lines:
    """A routine as text: named terms in their order, and its results, output by output, rows first."""

    named: tuple[tuple[str, str], ...]
    turns: tuple[tuple[str, str, str], ...]  #: text of an angle, names of its sine and cosine, where both are needed
    results: tuple[tuple[str, ...], ...]


def with_subscript(name: str, first: int, brackets: str) -> str:
    """Return the symbol name[k] with other brackets and a first index of its own."""
    stem, _, k = name[:-1].partition("[")
    return f"{stem}{brackets[0]}{int(k) + first}{brackets[1]}"


def needed_inputs(routine: Routine) -> set[str]:
    """Return the names of the inputs that results depend on."""
    return {term.name.partition("[")[0] for term in reachable(routine.values) if term.kind == SYMBOL}


def lines_of(routine: Routine, *, symbol: Callable[[str], str]) -> Lines:
    """Return the text of a routine; symbol: writes one of its inputs."""
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
        if term.index in turned:  # written by its negative, b - a
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
