"""Products of a panel with a few columns in vector registers, as LLVM code; solves spend most of their time here.

A tile is eight rows of a panel, column after column: entry (i, j) is tile[8 j + i]. Right-hand sides lie in rows of
`width` numbers, in one or two vectors of 512 bits, which LLVM splits if the processor has shorter vectors. The numbers
of a tile are read consecutively from memory and serve `width` products each, so memory bandwidth is the limit.

Kernels call them with addresses and a count n; `parts` is a tuple with as many numbers as a row has vectors:

    subtract_tile(parts, Z, T, Y, n)               Z[:8] -= T Y by n columns of the tile T
    subtract_transposed_tile(parts, Y, T, Z, n)    Y[:n] -= Tᵀ Z[:8]
    solve_tile(parts, Z, L)                        Z[:8] = L⁻¹ Z of a square tile L, whose diagonal holds reciprocals
    solve_transposed_tile(parts, Z, L)             Z[:8] = L⁻ᵀ Z
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["LANES", "ROWS", "solve_tile", "solve_transposed_tile", "subtract_tile", "subtract_transposed_tile"]

ROWS = 8  #: number of rows in a tile
LANES = 8  #: numbers in a vector
AHEAD = 32  #: number of columns that are prefetched in advance
double, integer = ir.DoubleType(), ir.IntType(64)
vector = ir.VectorType(double, LANES)


class Columns:
    """LLVM instructions of one function on rows with `width` columns."""

    def __init__(self, builder: ir.IRBuilder, width: int) -> None:
        self.builder, self.width = builder, width
        self.parts = range(width // LANES)

    def place(self, address: Any, row: Any, part: int) -> Any:
        """Return the address of vector `part` of a row."""
        b = self.builder
        at = b.add(b.mul(number(row), number(self.width)), number(part * LANES))
        base = b.inttoptr(address, double.as_pointer())
        return b.bitcast(b.gep(base, [at]), vector.as_pointer())

    def load(self, address: Any, row: Any) -> list[Any]:
        """Return the vectors of a row."""
        return [self.builder.load(self.place(address, row, part), align=8) for part in self.parts]

    def store(self, row_values: list[Any], address: Any, row: Any) -> None:
        """Write the vectors of a row."""
        for part in self.parts:
            self.builder.store(row_values[part], self.place(address, row, part), align=8)

    def entry(self, tile: Any, i: int, j: Any) -> Any:
        """Return entry (i, j) of a tile, repeated in all lanes of a vector."""
        b = self.builder
        at = b.add(b.mul(number(j), number(ROWS)), number(i))
        value = b.load(b.gep(b.inttoptr(tile, double.as_pointer()), [at]))
        one = b.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return b.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)

    def fetch(self, tile: Any, j: Any) -> None:
        """Prefetch data that is needed soon; automatic prefetching by processors is too late."""
        b = self.builder
        at = b.add(b.mul(number(j), number(ROWS)), number(AHEAD * ROWS))
        byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        place = b.bitcast(b.gep(b.inttoptr(tile, double.as_pointer()), [at]), byte)
        kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
        ask = cgutils.get_or_insert_function(b.module, kind, "llvm.prefetch.p0i8")
        b.call(ask, [place, *(ir.Constant(word, value) for value in (0, 3, 1))])  # for reading, into all caches, data

    def less(self, c: list[Any], a: Any, y: list[Any]) -> list[Any]:
        """Return c - a y with a single rounding."""
        b = self.builder
        of_vectors = ir.FunctionType(vector, [vector] * 3)
        fma = cgutils.get_or_insert_function(b.module, of_vectors, f"llvm.fma.v{LANES}f64")
        minus = b.fneg(a)
        return [b.call(fma, [minus, y[part], c[part]]) for part in self.parts]


def number(value: Any) -> Any:
    """Return an integer as a constant; return the result of an instruction unchanged."""
    return ir.Constant(integer, value) if isinstance(value, int) else value


def subtract(columns: Columns, Z: Any, tile: Any, Y: Any, n: Any) -> None:
    """Compute Z[:8] -= T Y: eight rows stay in registers while n columns of the tile are read."""
    b = columns.builder
    held = [[cgutils.alloca_once(b, vector) for _ in columns.parts] for _ in range(ROWS)]
    for i in range(ROWS):
        for place, value in zip(held[i], columns.load(Z, i), strict=True):
            b.store(value, place)
    with cgutils.for_range(b, n) as loop:
        columns.fetch(tile, loop.index)
        y = columns.load(Y, loop.index)
        for i in range(ROWS):
            row = columns.less([b.load(place) for place in held[i]], columns.entry(tile, i, loop.index), y)
            for place, value in zip(held[i], row, strict=True):
                b.store(value, place)
    for i in range(ROWS):
        columns.store([b.load(place) for place in held[i]], Z, i)


def subtract_transposed(columns: Columns, Y: Any, tile: Any, Z: Any, n: Any) -> None:
    """Compute Y[:n] -= Tᵀ Z: the same eight rows stay in registers while the rows of Y are read."""
    z = [columns.load(Z, i) for i in range(ROWS)]
    with cgutils.for_range(columns.builder, n) as loop:
        columns.fetch(tile, loop.index)
        y = columns.load(Y, loop.index)
        for i in range(ROWS):
            y = columns.less(y, columns.entry(tile, i, loop.index), z[i])
        columns.store(y, Y, loop.index)


def solve(columns: Columns, Z: Any, tile: Any) -> None:
    """Compute Z[:8] = L⁻¹ Z, from the first row to the last."""
    z = [columns.load(Z, i) for i in range(ROWS)]
    for j in range(ROWS):
        reciprocal = columns.entry(tile, j, j)
        z[j] = [columns.builder.fmul(reciprocal, part) for part in z[j]]
        columns.store(z[j], Z, j)
        for i in range(j + 1, ROWS):
            z[i] = columns.less(z[i], columns.entry(tile, i, j), z[j])


def solve_transposed(columns: Columns, Z: Any, tile: Any) -> None:
    """Compute Z[:8] = L⁻ᵀ Z, from the last row to the first."""
    z = [columns.load(Z, i) for i in range(ROWS)]
    for j in reversed(range(ROWS)):
        reciprocal = columns.entry(tile, j, j)
        z[j] = [columns.builder.fmul(reciprocal, part) for part in z[j]]
        columns.store(z[j], Z, j)
        for i in range(j):
            z[i] = columns.less(z[i], columns.entry(tile, j, i), z[j])


def on_tile_and_rows(emit: Callable[..., None]) -> Any:
    """Return the intrinsic for one of these functions in kernels; its first argument is `parts`."""

    def function(typing_context, parts, Z, tile, Y, n):
        def code(context, builder, signature, values):
            emit(Columns(builder, LANES * parts.count), *values[1:])
            return context.get_dummy_value()

        return types.void(parts, types.intp, types.intp, types.intp, types.intp), code

    return intrinsic(function)


def on_tile(emit: Callable[..., None]) -> Any:
    """Return the intrinsic for a function that needs only the rows of its tile."""

    def function(typing_context, parts, Z, tile):
        def code(context, builder, signature, values):
            emit(Columns(builder, LANES * parts.count), *values[1:])
            return context.get_dummy_value()

        return types.void(parts, types.intp, types.intp), code

    return intrinsic(function)


subtract_tile: Any = on_tile_and_rows(subtract)
subtract_transposed_tile: Any = on_tile_and_rows(subtract_transposed)
solve_tile: Any = on_tile(solve)
solve_transposed_tile: Any = on_tile(solve_transposed)
