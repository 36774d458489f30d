"""Reference elements of the solids: shape functions of scikit-fem in the node order of meshio, with quadrature.

The orders are chosen so that, on an isoparametric (curved) element,

- the consistent mass ∫ rho N_a N_b is exact: its integrand is a polynomial in the reference coordinates;
- ∫ grad N_a is exact, so that a constant stress is in equilibrium to roundoff (patch test) on a distorted mesh;
- ∫ (grad N_a)(grad N_b)ᵀ is exact wherever the Jacobian is constant.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.cell_shapes import CELL_SHAPES, SKFEM_ELEMENTS, collapsed_cube, shape_values, skfem_node_order
from fe_models.meshes.mesh import SOLID_TYPES

__all__ = [
    "INTEGRATIONS", "MASSES", "ReferenceElement", "ShapeTable", "reference_centre", "reference_element", "shape_table",
]  # fmt: skip

#: polynomial degree; for wedges degrees in triangle and line; for pyramids numbers of points across and up
Degree = int | tuple[int, int]

# scikit-fem 12 labels its tetrahedron tables 5 to 8 one degree too high (measured; a test checks the tables used here),
# so label 8 gives degree 7. Degrees are (stiffness, mass): one per direction for hexahedra, (triangle, line) for
# wedges.
RULES: dict[str, tuple[str, Degree, Degree]] = {
    "tetra": ("tet", 1, 2),  # mass: N N = 2
    "tetra10": ("tet", 5, 8),  # stiffness: 14 positive weights, degree 4; mass: 2 + 2 + 3 for the Jacobian = 7
    "hexahedron": ("hex", 3, 5),  # mass: 1 + 1 + 2 = 4
    "hexahedron20": ("hex", 5, 9),  # mass: 2 + 2 + 5 = 9
    "hexahedron27": ("hex", 5, 9),
    "wedge": ("wedge", (2, 3), (3, 5)),  # mass: triangle 1 + 1 + 1 = 3, line 1 + 1 + 2 = 4
    # wedge15, stiffness: triangle degree 4 covers 2 (1 + 1) and 3 (0 + 2, along the line), line 2 + 2; mass: triangle 2
    # + 2 + 3, line 9
    "wedge15": ("wedge", (4, 5), (8, 9)),
    # Pyramids use polynomials of x/w, y/w and w = 1 - z, with numbers of points across and up. Gradients of the shape
    # functions have degree 1 and 0, or 2 and 1. The Jacobian contains three of them, and the weight contains w².
    "pyramid": ("pyramid", (2, 2), (3, 3)),  # stiffness: 3 across, 0 + 2 up; mass: 2 + 3 across, 2 + 0 + 2 up
    "pyramid13": ("pyramid", (4, 3), (6, 5)),  # stiffness: 6 across, 3 + 2 up; mass: 4 + 6 across, 4 + 3 + 2 up
}
REDUCED: dict[str, tuple[str, Degree]] = {
    "tetra": ("tet", 1),  # 1 point
    "tetra10": ("tet", 2),  # 4
    "hexahedron": ("hex", 3),  # 8; with fewer points some motions would have no strain energy
    "hexahedron20": ("hex", 3),  # 8, as C3D20R
    "hexahedron27": ("hex", 3),
    "wedge": ("wedge", (1, 3)),  # 1 x 2
    "wedge15": ("wedge", (2, 5)),  # 3 x 3
    "pyramid": ("pyramid", (2, 2)),  # 8
    "pyramid13": ("pyramid", (2, 2)),  # 8
}  #: fewest points that programs use; straight-edged cells other than wedges and bricks have the full stiffness
INTEGRATIONS = ("full", "reduced")  #: rules for the integration of the stiffness
#: consistent; with the points of the reduced stiffness; 14 points for 20-node bricks (others consistent); diagonal
MASSES = ("consistent", "reduced", "14-point", "lumped")
# Stress is sampled where it is most accurate (at the points of reduced integration for quadratic elements). It is
# extrapolated to the nodes by the shape functions of the low-order element, which interpolate those points exactly.
STRESS_RULES: dict[str, tuple[tuple[str, Degree], str | None]] = {
    "tetra": (("tet", 1), None),
    "tetra10": (("tet", 2), "tetra"),
    "hexahedron": (("hex", 3), "hexahedron"),
    "hexahedron20": (("hex", 3), "hexahedron"),
    "hexahedron27": (("hex", 3), "hexahedron"),
    "wedge": (("wedge", (2, 3)), "wedge"),
    "wedge15": (("wedge", (2, 3)), "wedge"),
    "pyramid": (("pyramid", (2, 2)), "pyramid"),  # 8 points for 5 functions: least-squares fit
    "pyramid13": (("pyramid", (2, 2)), "pyramid"),
}


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Shape functions at the points of a quadrature rule in the reference cell."""

    points: Array  #: quadrature points in reference coordinates, (n_points, 3)
    weights: Array  #: quadrature weights, (n_points,); their sum is the volume of the reference cell
    values: Array  #: shape functions N_a, (n_points, n_nodes)
    gradients: Array  #: derivatives ∂N_a/∂xi_j with respect to reference coordinates, (n_points, n_nodes, 3)


@dataclass(frozen=True, eq=False)
class ReferenceElement:
    """Tables of one cell type for assembly and stress recovery."""

    kind: str  #: cell type, a name in `SOLID_TYPES`
    stiffness: ShapeTable
    mass: ShapeTable
    stress: ShapeTable  #: shape functions at the sampling points of the stress
    extrapolation: Array  #: matrix from the sampling points to the nodes, (n_nodes, n_points)


def quadrature(cell: str, degree: Degree) -> tuple[Array, Array]:
    """Return points (n_points, 3) and weights (n_points,) of a rule on "tet", "hex", "wedge" or "pyramid".

    The wedge is a product of triangle and line made here. scikit-fem 12 repeats the triangle's points with products of
    its weights, which gives half of the volume. It has no pyramid, so the pyramid uses Gauss points across and up.
    """
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex, RefLine, RefTet, RefTri

    if cell == "pyramid":
        across, up = degree  # type: ignore[misc]
        points, weights = collapsed_cube(across, up)
        return points.copy(), weights.copy()
    if cell == "wedge":
        degree_triangle, degree_line = degree  # type: ignore[misc]
        triangle, w_triangle = get_quadrature(RefTri, degree_triangle)
        if degree_triangle == 1:  # one point suffices; scikit-fem uses three
            triangle, w_triangle = np.full((2, 1), 1 / 3), np.array([1 / 2])
        line, w_line = get_quadrature(RefLine, degree_line)
        points = np.vstack([np.repeat(triangle, line.size, axis=1), np.tile(line, triangle.shape[1])])
        return points.T.copy(), np.outer(w_triangle, w_line).ravel()
    points, weights = get_quadrature({"tet": RefTet, "hex": RefHex}[cell], degree)
    return points.T.copy(), weights


def fourteen_points() -> tuple[Array, Array]:
    """Return the 14-point rule on the unit cube, exact to degree 5, which ANSYS uses for its bricks.

    On -1..1 it has six points ±a e_i with weight w_a and eight points (±b, ±b, ±b) with weight w_b. Exactness for 1,
    x², x⁴ and x² y² requires 6 w_a + 8 w_b = 8, 2 w_a a² + 8 w_b b² = 8/3, 2 w_a a⁴ + 8 w_b b⁴ = 8/5, 8 w_b b⁴ = 8/9.
    Hence w_a a⁴ = 16/45, b⁴ = 1/(9 w_b), and a² = 19/30, b² = 19/33.
    """
    a, b = np.sqrt(19 / 30), np.sqrt(19 / 33)
    w_a, w_b = 16 / 45 / a**4, 1 / 9 / b**4
    corners = np.stack([axis.ravel() for axis in np.meshgrid(*3 * [[-b, b]], indexing="ij")], axis=1)
    points = np.concatenate([a * np.eye(3), -a * np.eye(3), corners])
    return (points + 1) / 2, np.concatenate([np.full(6, w_a), np.full(8, w_b)]) / 8


def shape_table(kind: str, points: Array, weights: Array) -> ShapeTable:
    """Evaluate the shape functions of a cell type, in node order of meshio, at points, (n_points, 3)."""
    import skfem

    if kind not in SKFEM_ELEMENTS:
        return ShapeTable(frozen(points), frozen(weights), *shape_values(kind, points))
    element = getattr(skfem, SKFEM_ELEMENTS[kind])()
    order = skfem_node_order(kind)
    values = [element.lbasis(points.T, int(i)) for i in order]
    N = np.stack([np.broadcast_to(value, len(points)) for value, _ in values], axis=1)
    dN = np.stack([np.broadcast_to(gradient, (3, len(points))).T for _, gradient in values], axis=1)
    return ShapeTable(frozen(points), frozen(weights), frozen(N), frozen(dN))


@cache
def reference_centre(kind: str) -> Array:
    """Return the gradients of the shape functions at the centroid of a reference cell, (n_corners, 3)."""
    points, weights = quadrature(*RULES[kind][:2])
    centroid = weights @ points / weights.sum()
    return frozen(shape_table(kind, centroid[None], np.ones(1)).gradients[0])


@cache
def reference_element(kind: str, integration: str = "full", mass: str = "consistent") -> ReferenceElement:
    """Return the reference element of a cell type of `SOLID_TYPES`.

    Parameters
    ----------
    kind
        Cell type.
    integration, mass
        Names in `INTEGRATIONS` and `MASSES`, which choose the points for stiffness and mass. Lumping is done elsewhere.

    Raises
    ------
    MeshError
        If the cell type is not a supported solid.
    """
    if kind not in SOLID_TYPES:
        raise MeshError(f"solid elements: unknown cell type {quoted(kind)}{nearest(kind, SOLID_TYPES)}")
    cell, degree_stiffness, degree_mass = RULES[kind]
    if integration == "reduced":
        degree_stiffness = REDUCED[kind][1]
    has_fourteen = mass == "14-point" and kind == "hexahedron20"
    if mass == "reduced":
        degree_mass = REDUCED[kind][1]
    (stress_cell, stress_degree), low_order = STRESS_RULES[kind]
    stress_points, stress_weights = quadrature(stress_cell, stress_degree)
    if low_order is None:
        extrapolation = np.ones((len(CELL_SHAPES[kind].nodes), len(stress_points)))
    else:
        nodes = CELL_SHAPES[kind].nodes
        at_nodes = shape_table(low_order, nodes, np.ones(len(nodes))).values
        extrapolation = at_nodes @ np.linalg.pinv(shape_table(low_order, stress_points, stress_weights).values)
    return ReferenceElement(
        kind=kind,
        stiffness=shape_table(kind, *quadrature(cell, degree_stiffness)),
        mass=shape_table(kind, *(fourteen_points() if has_fourteen else quadrature(cell, degree_mass))),
        stress=shape_table(kind, stress_points, stress_weights),
        extrapolation=frozen(extrapolation),
    )
