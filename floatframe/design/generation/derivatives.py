"""Derivatives of terms, as terms of the same graph."""

from collections.abc import Mapping, Sequence

import numpy as np

from floatframe.design.generation.graph import (
    ADD,
    COS,
    DIV,
    MUL,
    NEG,
    SIN,
    STUMPFF,
    SUB,
    Graph,
    Scalar,
    Terms,
    reachable,
)
from floatframe.design.generation.links import TreeTerms
from floatframe.engine.tree.recursion.nodes import ROTATION

__all__ = ["derivative", "jacobian", "position_seeds", "seeds_of"]


def derivative(graph: Graph, terms: Sequence[Scalar], seed: Mapping[Scalar, Scalar]) -> dict[int, Scalar]:
    """Return the derivatives that do not vanish, by the index of their term; terms stand after their arguments.

    seed: those of symbols.
    """
    dot: dict[int, Scalar] = {symbol.index: change for symbol, change in seed.items()}
    for term in terms:
        moved = [dot.get(arg.index) for arg in term.args]
        if term.index in dot or not any(moved):
            continue
        changes = [graph.zero if each is None else each for each in moved]
        a, da = term.args[0], changes[0]
        b, db = (term.args[1], changes[1]) if len(changes) > 1 else (graph.zero, graph.zero)
        if term.kind == ADD:
            change = da + db
        elif term.kind == SUB:
            change = da - db
        elif term.kind == MUL:
            change = da * b + a * db
        elif term.kind == DIV:
            change = (da - term * db) / b
        elif term.kind == NEG:
            change = -da
        elif term.kind == SIN:
            change = graph.cos(a) * da
        elif term.kind == STUMPFF:  # dc_k/dx = (k c_k+2 - c_k+1) / 2
            k = int(term.value)
            change = 0.5 * (k * graph.stumpff(k + 2, a) - graph.stumpff(k + 1, a)) * da
        else:
            assert term.kind == COS
            change = -(graph.sin(a) * da)
        if not change.is_constant(0.0):
            dot[term.index] = change
    return dot


def jacobian(graph: Graph, outputs: Terms, seeds: Sequence[Mapping[Scalar, Scalar]]) -> Terms:
    """Return the derivatives of outputs, (m,), along seeds, (m, n)."""
    order = reachable(outputs)
    out = np.full((len(outputs), len(seeds)), graph.zero, dtype=object)
    for j, seed in enumerate(seeds):
        dot = derivative(graph, order, seed)
        for i, term in enumerate(outputs):
            out[i, j] = dot.get(term.index, graph.zero)
    return out


def seeds_of(graph: Graph, symbols: Sequence[Scalar]) -> list[dict[Scalar, Scalar]]:
    """Return the seeds of derivatives by symbols."""
    return [{symbol: graph.one} for symbol in symbols]


def position_seeds(tree: TreeTerms) -> list[dict[Scalar, Scalar]]:
    """Return the seeds of derivatives by positions along the rates: rotations turn by R exp(dz), p' = p (0, e) / 2."""
    graph = tree.graph
    seeds: list[dict[Scalar, Scalar]] = [{} for _ in tree.v]
    for link in tree.links:
        x = tree.x[link.x0 :]
        if link.kind == ROTATION:
            w, p_x, p_y, p_z = x[:4]
            for j, row in enumerate(((-p_x, w, p_z, -p_y), (-p_y, -p_z, w, p_x), (-p_z, p_y, -p_x, w))):
                seeds[link.v0 + j] = {x[i]: 0.5 * change for i, change in enumerate(row)}
        else:
            for j in range(link.n_z):
                seeds[link.v0 + j] = {x[j]: graph.one}
        if link.modes is not None:
            for j in range(link.modes.n):
                seeds[link.modes.v0 + j] = {tree.x[link.modes.x0 + j]: graph.one}
    return seeds
