"""Shapes of the cells: reference nodes, facets, shape functions and quadrature, in the node order of meshio (VTK)."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = [
    "CELL_SHAPES", "SKFEM_ELEMENTS", "CellShape", "cell_jacobians", "collapsed_cube", "facet_tables", "quadrature",
    "shape_values", "skfem_node_order",
]  # fmt: skip


TIP = 1e-14  #: distance below the tip of a pyramid, within which a point counts as the tip


@dataclass(frozen=True)
class CellShape:
    """One cell type: its corners, the corners of its middle nodes, and its polynomial space."""

    name: str  #: meshio name of the cell type
    dim: int  #: dimension: 3 for a solid, 2 for a face
    corners: tuple[tuple[float, ...], ...]  #: reference coordinates of the corner nodes
    middles: tuple[tuple[int, ...], ...]  #: for each further node, the corners whose mean gives its position
    facets: tuple[tuple[int, ...], ...]  #: corner nodes of each facet, anticlockwise from outside
    #: exponents of the monomials of the shape functions; for pyramids in x, y, 1 - z
    exponents: tuple[tuple[int, ...], ...]

    @property
    def is_pyramid(self) -> bool:
        """Whether the shape functions are rational: polynomials in x/(1 - z), y/(1 - z) and 1 - z."""
        return len(self.corners) == 5

    @property
    def nodes(self) -> Array:
        """Reference coordinates of all nodes, (n_nodes, dim)."""
        corners = np.array(self.corners, dtype=float)
        middles = [corners[list(parents)].mean(axis=0) for parents in self.middles]
        return np.vstack([corners, *middles])


def _grid(dim: int, order: int) -> tuple[tuple[int, ...], ...]:
    """Return the exponents of a tensor-product space with each exponent at most `order`."""
    return tuple(tuple(int(i) for i in e) for e in np.ndindex(*(order + 1,) * dim))


def _total(dim: int, order: int) -> tuple[tuple[int, ...], ...]:
    """Return the exponents of a complete polynomial space with sums up to `order`."""
    return tuple(e for e in _grid(dim, order) if sum(e) <= order)


def _serendipity(dim: int) -> tuple[tuple[int, ...], ...]:
    """Return the exponents of the quadratic serendipity space, in which at most one exponent is 2."""
    return tuple(e for e in _grid(dim, 2) if e.count(2) <= 1)


_TRI = ((0, 0), (1, 0), (0, 1))
_QUAD = ((0, 0), (1, 0), (1, 1), (0, 1))
_TET = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_HEX = tuple((x, y, 0) for x, y in _QUAD) + tuple((x, y, 1) for x, y in _QUAD)
_WEDGE = tuple((x, y, 0) for x, y in _TRI) + tuple((x, y, 1) for x, y in _TRI)

_PYRAMID = (*((x, y, 0) for x, y in _QUAD), (0, 0, 1))

_TRI_EDGES = ((0, 1), (1, 2), (2, 0))
_QUAD_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_HEX_EDGES = (*_QUAD_EDGES, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))

_WEDGE_EDGES = (*_TRI_EDGES, (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_WEDGE15 = (*((*e, k) for e in _total(2, 2) for k in (0, 1)), *((*e, 2) for e in _total(2, 1)))

_PYRAMID_EDGES = (*_QUAD_EDGES, (0, 4), (1, 4), (2, 4), (3, 4))

_TET_FACETS = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
_HEX_FACETS = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))  # -x +x -y +y -z +z
_WEDGE_FACETS = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_PYRAMID_FACETS = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
# with w = 1 - z: on the base w = 1, and the space is that of the quad; on each side it is that of the triangle
_PYRAMID5 = (*_total(3, 1), (1, 1, -1))
_PYRAMID13 = (*_total(3, 2), (1, 1, -1), (2, 1, -1), (1, 2, -1))
_HEX_CENTRES = (*_HEX_FACETS, tuple(range(8)))

CELL_SHAPES = {
    shape.name: shape
    for shape in (
        CellShape("triangle", 2, _TRI, (), (), _total(2, 1)),
        CellShape("triangle6", 2, _TRI, _TRI_EDGES, (), _total(2, 2)),
        CellShape("quad", 2, _QUAD, (), (), _grid(2, 1)),
        CellShape("quad8", 2, _QUAD, _QUAD_EDGES, (), _serendipity(2)),
        CellShape("quad9", 2, _QUAD, (*_QUAD_EDGES, (0, 1, 2, 3)), (), _grid(2, 2)),
        CellShape("tetra", 3, _TET, (), _TET_FACETS, _total(3, 1)),
        CellShape("tetra10", 3, _TET, _TET_EDGES, _TET_FACETS, _total(3, 2)),
        CellShape("hexahedron", 3, _HEX, (), _HEX_FACETS, _grid(3, 1)),
        CellShape("hexahedron20", 3, _HEX, _HEX_EDGES, _HEX_FACETS, _serendipity(3)),
        CellShape("hexahedron27", 3, _HEX, (*_HEX_EDGES, *_HEX_CENTRES), _HEX_FACETS, _grid(3, 2)),
        CellShape("wedge", 3, _WEDGE, (), _WEDGE_FACETS, tuple((*e, k) for e in _total(2, 1) for k in (0, 1))),
        CellShape("wedge15", 3, _WEDGE, _WEDGE_EDGES, _WEDGE_FACETS, _WEDGE15),
        CellShape("pyramid", 3, _PYRAMID, (), _PYRAMID_FACETS, _PYRAMID5),
        CellShape("pyramid13", 3, _PYRAMID, _PYRAMID_EDGES, _PYRAMID_FACETS, _PYRAMID13),
    )
}  #: shape of each cell type; reference cells are unit simplex, square, cube, triangle x interval, square with tip


@cache
def facet_tables(kind: str) -> dict[str, IntArray]:
    """Return the local nodes of the facets of a solid cell, (n_facets, nodes per facet), outward, by face type.

    The facets are complete faces in meshio order: corners, then the middles of their edges, then their centre.
    """
    shape = CELL_SHAPES[kind]
    n_corners = len(shape.corners)
    middle = {frozenset(parents): n_corners + k for k, parents in enumerate(shape.middles)}
    tables: dict[str, list[tuple[int, ...]]] = {}
    for facet in shape.facets:
        edges = [frozenset((facet[k], facet[(k + 1) % len(facet)])) for k in range(len(facet))]
        local = (*facet, *(middle[key] for key in (*edges, frozenset(facet)) if key in middle))
        name = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}[len(local)]
        tables.setdefault(name, []).append(local)
    return {name: np.array(rows, dtype=np.int64) for name, rows in tables.items()}


def shape_values(kind: str, points: Array) -> tuple[Array, Array]:
    """Return shape functions and their gradients in reference coordinates, at reference points.

    The functions are the nodal basis of the monomials of the cell: N = p(x) V⁻¹, with V the monomials at the nodes.

    Parameters
    ----------
    kind
        Cell type, a key of `CELL_SHAPES`.
    points
        Reference points, (n_points, dim).

    Returns
    -------
    N, dN
        Shape functions, (n_points, n_nodes), and their gradients, (n_points, n_nodes, dim).
    """
    shape = CELL_SHAPES[kind]
    exponents = np.array(shape.exponents)
    monomials = _collapsed_monomials if shape.is_pyramid else _monomials
    vandermonde = monomials(shape.nodes, exponents)
    columns = [monomials(points, exponents)]
    for axis in range(shape.dim):
        lowered = exponents.copy()
        lowered[:, axis] -= exponents[:, axis] != 0
        sign = -1 if shape.is_pyramid and axis == 2 else 1  # w = 1 - z
        columns.append(sign * exponents[:, axis] * monomials(points, lowered))
    values = [np.linalg.solve(vandermonde.T, column.T).T for column in columns]
    return frozen(values[0]), frozen(np.stack(values[1:], axis=2))


def _monomials(points: Array, exponents: IntArray) -> Array:
    return np.prod(points[:, None, :] ** exponents[None, :, :], axis=2)


def _collapsed_monomials(points: Array, exponents: IntArray) -> Array:
    """Return x^i y^j w^k = (x/w)^i (y/w)^j w^(i+j+k), w = 1 - z; at the tip, x/w and y/w are set to 1/2."""
    w = 1 - points[:, 2:]
    is_tip = w < TIP
    across = np.where(is_tip, 0.5, points[:, :2] / np.where(is_tip, 1.0, w))
    collapsed = np.concatenate([across, np.where(is_tip, 0.0, w)], axis=1)
    return _monomials(collapsed, np.column_stack([exponents[:, :2], exponents.sum(axis=1)]))


@cache
def quadrature(kind: str) -> tuple[Array, Array]:
    """Return reference points, (n_points, dim), and weights, (n_points,), exact for the volume of such a cell.

    The Jacobian determinant has degree <= 5 in each direction of a hexahedron (3 Gauss points each), and total degree 3
    in a quadratic tetrahedron. Simplices use the square collapsed onto them, x = 1 - s, y = s t (Gauss points, Jacobian
    s). Faces use the same rules; their area integrand is smooth, but not a polynomial if the face is curved.
    """
    shape = CELL_SHAPES[kind]
    if kind in ("tetra", "triangle"):  # constant Jacobian and linear shape functions: the centroid is exact
        return frozen(shape.nodes.mean(axis=0)[None]), frozen([1 / 6 if kind == "tetra" else 1 / 2])
    gauss = np.polynomial.legendre.leggauss
    x, w = gauss(4 if kind == "triangle6" else 3)
    x, w = (x + 1) / 2, w / 2
    if len(shape.corners) == 2**shape.dim:
        points = np.stack(np.meshgrid(*[x] * shape.dim, indexing="ij"), -1).reshape(-1, shape.dim)
        weights = np.stack(np.meshgrid(*[w] * shape.dim, indexing="ij"), -1).reshape(-1, shape.dim).prod(axis=1)
        return frozen(points), frozen(weights)
    if shape.is_pyramid:
        return collapsed_cube(4, 4)
    s, t = (a.ravel() for a in np.meshgrid(x, x, indexing="ij"))
    triangle, weight = np.column_stack([1 - s, s * t]), np.outer(w, w).ravel() * s
    if shape.dim == 2:
        return frozen(triangle), frozen(weight)
    if kind in ("wedge", "wedge15"):
        points = np.column_stack([np.repeat(triangle, len(x), axis=0), np.tile(x, len(triangle))])
        return frozen(points), frozen(np.outer(weight, w).ravel())
    points = np.column_stack([np.repeat(1 - x, len(triangle)), np.kron(x[:, None], triangle)])
    return frozen(points), frozen(np.kron(w * x**2, weight))


def collapsed_cube(n_across: int, n_up: int) -> tuple[Array, Array]:
    """Return Gauss points of a pyramid, (n, 3), and weights, (n,): x = w s, y = w t, z = 1 - w, weight w² ds dt dw.

    The rule is exact for polynomials in s, t of degree 2 n_across - 1 each, times polynomials in w of degree 2 n_up -
    3.
    """
    x, a = ((v + i) / 2 for v, i in zip(np.polynomial.legendre.leggauss(n_across), (1, 0), strict=True))
    w, b = ((v + i) / 2 for v, i in zip(np.polynomial.legendre.leggauss(n_up), (1, 0), strict=True))
    s, t, up = (v.ravel() for v in np.meshgrid(x, x, w, indexing="ij"))
    weights = (a[:, None, None] * a[:, None] * (b * w**2)).ravel()
    return frozen(np.column_stack([up * s, up * t, 1 - up])), frozen(weights)


def cell_jacobians(kind: str, coordinates: Array, points: Array) -> Array:
    """Return the Jacobian determinants of solid cells at reference points.

    Parameters
    ----------
    kind
        Solid cell type.
    coordinates
        Node coordinates of the cells, (n_cells, n_nodes, 3) [m].
    points
        Reference points, (n_points, 3).

    Returns
    -------
    Array
        Determinants, (n_cells, n_points) [m³].
    """
    dN = shape_values(kind, points)[1]
    n_points, n_nodes, _ = dN.shape
    gradients = np.ascontiguousarray(dN.transpose(1, 0, 2)).reshape(n_nodes, n_points * 3)
    J = (coordinates.transpose(0, 2, 1) @ gradients).reshape(len(coordinates), 3, n_points, 3)
    a, b, c = J[:, 0], J[:, 1], J[:, 2]
    return np.einsum("epi,epi->ep", a, np.cross(b, c))


# the same cells in scikit-fem -----------------------------------------------------------------------------------------


SKFEM_ELEMENTS = {
    "tetra": "ElementTetP1",
    "tetra10": "ElementTetP2",
    "hexahedron": "ElementHex1",
    "hexahedron20": "ElementHexS2",
    "hexahedron27": "ElementHex2",
    "wedge": "ElementWedge1",
}  #: scikit-fem element with the same nodes, by cell type; other cell types use the monomials of their shapes


def skfem_node_order(kind: str) -> IntArray:
    """Return the local node number in scikit-fem for each meshio node of a cell type, (n_nodes,)."""
    import skfem

    positions = np.asarray(getattr(skfem, SKFEM_ELEMENTS[kind])().doflocs)
    distance = np.abs(CELL_SHAPES[kind].nodes[:, None] - positions[None]).max(axis=2)
    order = distance.argmin(axis=1)
    if (distance.min(axis=1) > 1e-12).any() or np.unique(order).size != len(positions):
        raise MeshError(f"{kind}: the installed scikit-fem places its nodes elsewhere; expected scikit-fem 10 to 12")
    return order
