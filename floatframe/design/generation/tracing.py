"""Kernels called with terms: what they compute becomes expressions of the graph.

A kernel is a function of Python that numba compiles. Without numba it accepts arrays of any objects; here it calls
other kernels without numba as well, and functions of `math` that accept terms.
"""

from collections.abc import Callable, Mapping
from types import FunctionType, SimpleNamespace
from typing import Any

from floatframe.design.generation.graph import Graph

__all__ = ["Traced"]


class Traced:
    """The kernels of a graph; `given` replaces kernels by their names, wherever they are called."""

    def __init__(self, graph: Graph, given: Mapping[str, Callable]) -> None:
        self.given = given
        self.known: dict[Callable, Callable] = {}
        self.math = SimpleNamespace(sin=lambda x: graph.sin(graph.scalar(x)), cos=lambda x: graph.cos(graph.scalar(x)))

    def __call__(self, kernel: Any) -> Callable:
        """Return a kernel as a function of Python that accepts terms."""
        source = kernel.py_func
        if source.__name__ in self.given:
            return self.given[source.__name__]
        if source not in self.known:
            space: dict[str, Any] = {"math": self.math}
            self.known[source] = FunctionType(source.__code__, space)
            for name in source.__code__.co_names:
                value = source.__globals__.get(name)
                if name != "math" and value is not None:
                    space[name] = self(value) if hasattr(value, "py_func") else value
        return self.known[source]
