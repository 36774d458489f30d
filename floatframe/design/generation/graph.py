"""Scalar expressions as a graph without duplicate terms, simplified during construction.

(1) constants are folded; x + 0, 1 x, 0 x and x - x are simplified
(2) signs are moved outwards: (-a) b = -(a b), a + (-b) = a - b, b - a = -(a - b), sin(-a) = -sin a, so that terms that
    differ only by their sign are one term
(3) multiples of one term are collected: 2 x + 3 x = 5 x
(4) an operation is created only if the graph does not contain it yet, so that common terms are shared

The cost of an expression is its number of operations. The graph also counts all requested operations, which is the cost
of a routine without simplification.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias, Union

import numpy as np

from floatframe.errors import ModelError

__all__ = [
    "ADD", "CONSTANT", "COS", "DIV", "MUL", "NEG", "SIN", "STUMPFF", "SUB", "SYMBOL",
    "Graph", "Number", "Operations", "Scalar", "Terms", "operations", "reachable", "terms",
]  # fmt: skip

CONSTANT, SYMBOL, ADD, SUB, MUL, DIV, NEG, SIN, COS, STUMPFF = range(10)  #: kinds of terms

Number = Union["Scalar", float]
Terms: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.object_]]  #: arrays of terms


@dataclass(frozen=True)
class Operations:
    """Numbers of operations of terms; a shared term counts once."""

    additions: int = 0  #: including subtractions
    multiplications: int = 0
    divisions: int = 0
    functions: int = 0  #: sines and cosines
    signs: int = 0  #: sign changes that are not part of a subtraction

    @property
    def total(self) -> int:
        """Additions and multiplications."""
        return self.additions + self.multiplications


class Scalar:
    """One term of a graph, created by operators; operations on arrays of terms are elementwise."""

    __slots__ = ("args", "graph", "index", "kind", "name", "value")

    def __init__(self, graph: "Graph", kind: int, args: tuple["Scalar", ...], name: str, value: float) -> None:
        self.graph, self.kind, self.args, self.name, self.value = graph, kind, args, name, value
        self.index = len(graph.terms)

    def __add__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.add(self, self.graph.scalar(other))

    def __radd__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.add(self.graph.scalar(other), self)

    def __sub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.sub(self, self.graph.scalar(other))

    def __rsub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.sub(self.graph.scalar(other), self)

    def __mul__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.mul(self, self.graph.scalar(other))

    def __rmul__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.mul(self.graph.scalar(other), self)

    def __truediv__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.div(self, self.graph.scalar(other))

    def __rtruediv__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.div(self.graph.scalar(other), self)

    def __neg__(self) -> "Scalar":
        return self.graph.neg(self)

    def __repr__(self) -> str:
        if self.kind == CONSTANT:
            return repr(self.value)
        return self.name or f"term {self.index}"

    def is_constant(self, value: float) -> bool:
        """Whether the term is the given constant."""
        return self.kind == CONSTANT and self.value == value


class Graph:
    """Terms in the order of creation, in which arguments precede the terms that use them."""

    def __init__(self) -> None:
        self.terms: list[Scalar] = []
        self.known: dict[tuple, Scalar] = {}
        self.asked = [0, 0]  #: requested additions and multiplications, including simplified ones
        self.zero, self.one = self.constant(0.0), self.constant(1.0)

    def constant(self, value: float) -> Scalar:
        """Return a number as a term; `ModelError` unless it is finite."""
        if not math.isfinite(value):
            raise ModelError(f"generate: expected finite numbers, got {value} among the constants of an expression")
        return self.made(CONSTANT, (), "", float(value) + 0.0)

    def symbol(self, name: str) -> Scalar:
        """Return the symbol with a name."""
        return self.made(SYMBOL, (), name)

    def scalar(self, value: Number) -> Scalar:
        """Return a number or a term of this graph as a term."""
        return value if isinstance(value, Scalar) else self.constant(value)

    def made(self, kind: int, args: tuple[Scalar, ...], name: str = "", value: float = 0.0) -> Scalar:
        """Return the term with these arguments; it is created only if it does not exist (4)."""
        key = (kind, tuple(arg.index for arg in args), name, value)
        found = self.known.get(key)
        if found is None:
            found = self.known[key] = Scalar(self, kind, args, name, value)
            self.terms.append(found)
        return found

    def neg(self, a: Scalar) -> Scalar:
        """Return -a."""
        if a.kind == CONSTANT:
            return self.constant(-a.value)
        return a.args[0] if a.kind == NEG else self.made(NEG, (a,))

    def add(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a + b."""
        self.asked[0] += 1
        if a.kind == CONSTANT and b.kind == CONSTANT:
            return self.constant(a.value + b.value)
        if a.is_constant(0.0) or b.is_constant(0.0):
            return b if a.is_constant(0.0) else a
        if a.kind == NEG and b.kind == NEG:
            return self.neg(self.summed(a.args[0], b.args[0]))
        if a.kind == NEG or b.kind == NEG:
            return self.subtracted(b, a.args[0]) if a.kind == NEG else self.subtracted(a, b.args[0])
        return self.summed(a, b)

    def sub(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a - b."""
        return self.add(a, self.neg(b))

    def summed(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a + b for terms without signs."""
        (n, x), (m, y) = multiple(a), multiple(b)
        if x is y:
            return self.times(n + m, x)
        if a.kind == CONSTANT and a.value < 0:
            return self.subtracted(b, self.constant(-a.value))
        if b.kind == CONSTANT and b.value < 0:
            return self.subtracted(a, self.constant(-b.value))
        return self.made(ADD, (a, b) if a.index < b.index else (b, a))

    def subtracted(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a - b for terms without signs, with the older term first (2)."""
        (n, x), (m, y) = multiple(a), multiple(b)
        if x is y:
            return self.times(n - m, x)
        if b.kind == CONSTANT and b.value < 0:
            return self.summed(a, self.constant(-b.value))
        if a.kind == CONSTANT and a.value < 0:
            return self.neg(self.summed(self.constant(-a.value), b))
        for one, other in (a.args, a.args[::-1]) if a.kind == ADD else ():
            if other is b:
                return one
        return self.made(SUB, (a, b)) if a.index < b.index else self.neg(self.made(SUB, (b, a)))

    def times(self, n: float, x: Scalar) -> Scalar:
        """Return n x."""
        return self.product(self.constant(n), x)

    def mul(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a b."""
        self.asked[1] += 1
        return self.product(a, b)

    def product(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a b, with signs moved outwards (2)."""
        if b.kind == CONSTANT:
            a, b = b, a
        if a.kind == CONSTANT:
            if b.kind == CONSTANT:
                return self.constant(a.value * b.value)
            if a.value == 0.0:
                return self.zero
            if a.value == 1.0:
                return b
            if a.value < 0.0:
                return self.neg(self.product(self.constant(-a.value), b))
            n, x = multiple(b)
            if n != 1.0:
                return self.product(self.constant(a.value * n), x)
        if a.kind == NEG or b.kind == NEG:
            x, y = (each.args[0] if each.kind == NEG else each for each in (a, b))
            term = self.product(x, y)
            return term if a.kind == b.kind else self.neg(term)
        return self.made(MUL, (a, b) if a.index < b.index else (b, a))

    def div(self, a: Scalar, b: Scalar) -> Scalar:
        """Return a / b."""
        if b.kind == CONSTANT:
            if b.value == 0.0:
                raise ModelError("generate: expected nonzero divisors, got a term divided by zero")
            return self.mul(self.constant(1.0 / b.value), a)
        if a.is_constant(0.0):
            return self.zero
        if a is b:
            return self.one
        if a.kind == NEG or b.kind == NEG:
            x, y = (each.args[0] if each.kind == NEG else each for each in (a, b))
            term = self.div(x, y)
            return term if a.kind == b.kind else self.neg(term)
        return self.made(DIV, (a, b))

    def sin(self, a: Scalar) -> Scalar:
        """Return sin a."""
        if a.kind == CONSTANT:
            return self.constant(math.sin(a.value))
        return self.neg(self.sin(a.args[0])) if a.kind == NEG else self.made(SIN, (a,))

    def cos(self, a: Scalar) -> Scalar:
        """Return cos a."""
        if a.kind == CONSTANT:
            return self.constant(math.cos(a.value))
        return self.cos(a.args[0]) if a.kind == NEG else self.made(COS, (a,))

    def stumpff(self, k: int, x: Scalar) -> Scalar:
        """Return c_k(x) = Σ (-x)^j / (2 j + k)!, which is expanded at the end (`rotation_series`)."""
        if x.is_constant(0.0):
            return self.constant(1.0 / math.factorial(k))
        return self.made(STUMPFF, (x,), "", float(k))


def terms(graph: Graph, numbers: Any) -> Terms:
    """Return an array of numbers and terms as an array of terms."""
    out: Terms = np.array(numbers, dtype=object)
    for place, value in np.ndenumerate(out):
        out[place] = graph.scalar(value)
    return out


def multiple(a: Scalar) -> tuple[float, Scalar]:
    """Return n and x with a = n x, where n is a number (3)."""
    if a.kind == NEG:
        n, x = multiple(a.args[0])
        return -n, x
    if a.kind == MUL and a.args[0].kind == CONSTANT:
        return a.args[0].value, a.args[1]
    if a.kind == MUL and a.args[1].kind == CONSTANT:
        return a.args[1].value, a.args[0]
    return 1.0, a


def reachable(outputs: Iterable[Scalar]) -> list[Scalar]:
    """Return all terms that outputs depend on, including the outputs, with arguments first."""
    found: dict[int, Scalar] = {}
    waiting = list(outputs)
    while waiting:
        term = waiting.pop()
        if term.index not in found:
            found[term.index] = term
            waiting.extend(term.args)
    return [found[index] for index in sorted(found)]


def operations(outputs: Iterable[Scalar]) -> Operations:
    """Return the operations that outputs require."""
    terms = reachable(outputs)
    count = [0] * (STUMPFF + 1)
    for term in terms:
        count[term.kind] += 1
    only_negative = {term.args[0].index for term in terms if term.kind == NEG and term.args[0].kind == SUB}
    for term in terms:
        if term.kind != NEG:
            only_negative -= {arg.index for arg in term.args}
    signs = count[NEG] - len(only_negative)
    return Operations(count[ADD] + count[SUB], count[MUL], count[DIV], count[SIN] + count[COS], signs)
