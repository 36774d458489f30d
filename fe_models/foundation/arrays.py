"""Arrays of the frozen types: float64, C order, finite, read-only; names of their components."""

from dataclasses import field
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_models.foundation.errors import BodyError

__all__ = [
    "MOTION_COMPONENTS",
    "STRESS_COMPONENTS",
    "Array",
    "GivenArray",
    "GivenArrayOrNone",
    "IntArray",
    "axial",
    "frozen",
    "given",
    "require_finite",
    "require_rows",
    "require_shape",
    "symmetric_csc",
    "symmetric_part",
    "tilde",
]

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Types of the fields of records that take lists, tuples or arrays and hold arrays. A type checker learns both from the
# two methods. It takes them into account only for fields with a value, so required fields are written `= given()`.
if TYPE_CHECKING:
    import scipy.sparse as sp

    class GivenArray:
        """A field that takes anything array-like and holds an array."""

        def __get__(self, record: object, kind: object = None) -> Array: ...
        def __set__(self, record: object, value: ArrayLike) -> None: ...

    class GivenArrayOrNone:
        """A field that takes anything array-like, or None, and holds an array or None."""

        def __get__(self, record: object, kind: object = None) -> Array | None: ...
        def __set__(self, record: object, value: ArrayLike | None) -> None: ...

else:
    GivenArray, GivenArrayOrNone = Array, Array | None


def given(*default: ArrayLike | None) -> Any:
    """Return the field of a record of the type `GivenArray` or `GivenArrayOrNone`, with its default if it has one."""
    if not default or default[0] is None:
        return field(default=None) if default else field()
    return field(default_factory=lambda: np.array(default[0], dtype=np.float64))


#: components of a node or interface: translations, then rotations; component k of `FEBody.dofs`
MOTION_COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")

STRESS_COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")  #: components of a symmetric tensor, in Voigt's order

SYMMETRY_DEFECT = 1e-8  #: largest |A - A.T| / |A| that counts as rounding


@overload
def frozen(values: Any) -> Array: ...
@overload
def frozen(values: Any, kind: type[np.int64]) -> IntArray: ...
@overload
def frozen(values: Any, kind: type[Any]) -> Any: ...
def frozen(values: Any, kind: type[Any] = np.float64) -> Any:
    """Return a read-only array of this type in C order; values are copied only if necessary."""
    array = np.ascontiguousarray(values, dtype=kind)
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array


def require_finite(where: str, array: Array, error: type[Exception] = BodyError) -> None:
    """Raise an error that names `where` if the array contains a NaN or an infinity."""
    bad = ~np.isfinite(array)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0])
        raise error(f"{where}: expected finite numbers, got {int(bad.sum())} NaN or infinite, first at {first}")


def require_shape(where: str, array: Array | IntArray, shape: tuple[int, ...]) -> None:
    """Raise `BodyError` that names `where` unless the array has this shape."""
    if array.shape != shape:
        raise BodyError(f"{where}: expected shape {shape}, got {array.shape}")


def require_rows(where: str, u: Any, n_rows: int) -> None:
    """Raise `BodyError` unless u is two-dimensional with this number of rows."""
    if np.ndim(u) != 2 or np.shape(u)[0] != n_rows:
        raise BodyError(f"{where}: u: expected columns over {n_rows} dofs, got {np.shape(u)}")


def symmetric_csc(where: str, matrix: Any, n: int) -> "sp.csc_array":
    """Return the matrix as CSC, (n, n), with sorted indices, after checks of shape, finiteness and symmetry."""
    import scipy.sparse as sp  # not above: drawing processes have no matrices

    # for a symmetric matrix, compressed rows equal compressed columns
    csc = sp.csc_array(matrix.T if sp.issparse(matrix) and matrix.format == "csr" else matrix)
    require_shape(where, csc, (n, n))
    if not csc.has_canonical_format:
        csc = csc.copy()
        csc.sum_duplicates()
    csc.data = np.asarray(csc.data, dtype=np.float64)
    require_finite(where, csc.data)
    defect = symmetry_defect(csc)
    if defect > SYMMETRY_DEFECT:
        raise BodyError(f"{where}: expected a symmetric matrix, got |A - A.T| = {defect:.2e} |A|")
    return csc


def symmetric_part(A: Array) -> Array:
    """Return (A + Aᵀ)/2, for matrices that are symmetric except for rounding errors."""
    return np.asarray((A + A.T) / 2)


def symmetry_defect(csc: "sp.csc_array") -> float:
    """Return max |(A - A.T) x| / max |A| for a fixed random vector x.

    Two products avoid a transposed copy, which takes a gigabyte for the stiffness of a million dofs.
    """
    if csc.nnz == 0:
        return 0.0
    scale = max(csc.data.max(), -csc.data.min())  # the largest magnitude, without an array of magnitudes
    x = np.random.default_rng(0).uniform(0.5, 1.5, csc.shape[0])
    defect = np.abs(csc @ x - csc.T @ x).max()
    return float(defect / scale) if scale else 0.0


def tilde(a: Array) -> Array:
    """Return the matrices of the cross product, (..., 3, 3), for vectors a, (..., 3): tilde(a) @ b = a × b."""
    a = np.asarray(a)
    S = np.zeros((*a.shape, 3), np.result_type(a, float))
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = a[..., 0], a[..., 1], a[..., 2]
    return S - np.swapaxes(S, -1, -2)


def axial(V: Array) -> Array:
    """Return Σ o × f, (..., 3), from V = Σ f oᵀ, (..., 3, 3); this is twice a if V = tilde(a)."""
    return np.stack([V[..., 2, 1] - V[..., 1, 2], V[..., 0, 2] - V[..., 2, 0], V[..., 1, 0] - V[..., 0, 1]], axis=-1)
