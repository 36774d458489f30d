"""Recovery rows of a finite element body: motions, stress and strain at nodes, forces in elements."""

from collections.abc import Callable, Iterable

import numpy as np
import scipy.sparse as sp

from cms.errors import RecoveryError
from cms.reduction.basis.node_results import reference_motion
from cms.reduction.recovery.blocks import Block, RowName
from cms.reduction.recovery.places import Places
from cms.reduction.recovery.request import OF_ELEMENTS, OF_MOTION, Rows, motion_dimensions
from fe_models.body.fe_body import FEBody
from fe_models.elements.recovery.element_forces import ElementGroup, element_groups
from fe_models.elements.recovery.strain import nodal_strain
from fe_models.foundation.arrays import MOTION_COMPONENTS, STRESS_COMPONENTS, Array, IntArray
from fe_models.foundation.units import Dimensions
from fe_models.foundation.words import nearest, quoted

__all__ = ["chosen_components", "model_block", "node_rows"]

STRESS, STRAIN = Dimensions(1, -1, -2), Dimensions()
#: number of columns per block; stress is computed at all nodes before the requested nodes are selected
COLUMNS_AT_ONCE = 16


def model_block(body: FEBody, rows: Rows) -> Block:
    """Return the rows of one quantity at nodes or elements of a coupled body.

    Raises
    ------
    RecoveryError
        If the body does not have a place, a component or the quantity.
    """
    if rows.quantity in OF_MOTION:
        block = motion_block(body, rows)
    elif rows.quantity in OF_ELEMENTS:
        block = element_block(body, rows)
    else:
        block = stress_block(body, rows)
    return chosen_components(block, rows, f"body {body.name!r}")


def chosen_components(block: Block, rows: Rows, where: str) -> Block:
    """Return the rows of the requested components; all rows if none are requested."""
    if not rows.components:
        return block
    known = tuple(dict.fromkeys(name.component for name in block.names))
    for component in rows.components:
        if component not in known:
            raise RecoveryError(
                f"{where}: recovery of {rows.quantity}: no component {quoted(component)}{nearest(component, known)}"
            )
    return block.of_rows([k for k, name in enumerate(block.names) if name.component in rows.components])


# Motions --------------------------------------------------------------------------------------------------------------


def motion_block(body: FEBody, rows: Rows) -> Block:
    """Return displacements, velocities or accelerations of nodes and of reference points of interfaces."""
    order = OF_MOTION.index(rows.quantity)
    names: list[RowName] = []
    matrices: list[sp.csr_array] = []
    points: list[Array] = []
    directions: list[Array] = []

    def add(entity: str, number: int, place: str, matrix: sp.csr_array, components: Iterable[int], at: Array) -> None:
        matrices.append(matrix)
        for component in components:
            word = MOTION_COMPONENTS[component]
            names.append(RowName(rows.quantity, entity, number, place, word, motion_dimensions(order, word)))
            points.append(at)
            directions.append(np.eye(3)[component] if component < 3 else np.zeros(3))

    places = Places(body)
    for at in rows.at:
        interface = places.interface(at)
        if interface is not None:
            motion = reference_motion(body, interface)
            n = 6 if motion.has_rotation else 3
            add("interface", -1, interface.name, sp.csr_array(motion.rows[:n]), range(n), motion.point)
            continue
        for node in places.nodes(at).tolist():
            matrix, components = node_rows(body, node)
            if not len(components):
                raise RecoveryError(f"body {body.name!r}: node {places.word(node)} does not move: it has no dofs")
            add("node", places.number(node), places.word(node), matrix, components.tolist(), body.nodes[node])
    stacked = sp.csr_array(sp.vstack(matrices))
    return Block(tuple(names), order, lambda u: np.asarray(stacked @ u), (np.array(points), np.array(directions)))


def node_rows(body: FEBody, node: int) -> tuple[sp.csr_array, IntArray]:
    """Return the motion of a node as rows over the dofs, (n, n_dof), and the components, (n,).

    They come from the mesh if it contains the node, else from the dofs of the body. Rotations that no dof moves are
    left out.
    """
    if body.recovery is not None:
        dofs = body.recovery.dofs
        own = np.flatnonzero((dofs[:, 0] == node) & (dofs[:, 1] >= 0))
        own = own[np.argsort(dofs[own, 1], kind="stable")]
        if len(own):
            matrix = sp.csr_array(body.recovery.matrix[own])
            moves = (dofs[own, 1] < 3) | (np.diff(matrix.indptr) > 0)
            return sp.csr_array(matrix[np.flatnonzero(moves)]), dofs[own, 1][moves]
    own = np.flatnonzero((body.dofs[:, 0] == node) & (body.dofs[:, 1] >= 0))
    own = own[np.argsort(body.dofs[own, 1], kind="stable")]
    matrix = sp.csr_array((np.ones(len(own)), (np.arange(len(own)), own)), shape=(len(own), body.n_dof))
    return matrix, body.dofs[own, 1]


# Stress and strain ----------------------------------------------------------------------------------------------------


def stress_block(body: FEBody, rows: Rows) -> Block:
    """Return stress or strain at nodes, and stress at named points, in mesh axes."""
    model = body.element_model
    places = Places(body)
    is_strain = rows.quantity == "strain"
    dimensions = STRAIN if is_strain else STRESS
    names: list[RowName] = []
    nodes: list[int] = []
    points: list[int] = []
    for at in rows.at:
        if not is_strain and (found := places.points(at)):
            points += found
            continue
        if model is None or not model.has_nodal_stress:
            raise RecoveryError(
                f"body {body.name!r}: recovery of {rows.quantity}: the model has no stress at nodes (bare matrices, "
                "or beams without a skin); ask for forces in its elements"
            )
        nodes += stressed_nodes(body, places, at, places.nodes(at, skin=True)).tolist()
    for node in nodes:
        number, word = places.number(node), places.word(node)
        names += [RowName(rows.quantity, "node", number, word, c, dimensions) for c in STRESS_COMPONENTS]
    for point in points:
        word = places.point_names[point]
        names += [RowName(rows.quantity, "point", -1, word, c, dimensions) for c in STRESS_COMPONENTS]
    rows_of_nodes = np.array(nodes, dtype=np.int64)
    values = strain_values(body, rows_of_nodes) if is_strain else stress_values(body, rows_of_nodes, points)
    if is_strain:
        values(np.zeros((body.n_dof, 1)))  # checks that the strain is known at all nodes
    return Block(tuple(names), 0, values)


def strain_values(body: FEBody, nodes: IntArray) -> Callable[[Array], Array]:
    """Return a function that maps displacement columns to strain, (6 n_nodes, k)."""

    def values(u: Array) -> Array:
        parts = []
        for begin in range(0, u.shape[1], COLUMNS_AT_ONCE):
            mesh = body.mesh_displacement(u[:, begin : begin + COLUMNS_AT_ONCE])
            parts.append(nodal_strain(body, mesh, nodes).reshape(-1, mesh.shape[1]))
        return np.concatenate(parts, axis=1)

    return values


def stress_values(body: FEBody, nodes: IntArray, points: list[int]) -> Callable[[Array], Array]:
    """Return a function that maps displacement columns to stress, (6 (n_nodes + n_points), k)."""
    wanted = np.unique(nodes)

    def values(u: Array) -> Array:
        parts = []
        for begin in range(0, u.shape[1], COLUMNS_AT_ONCE):
            mesh = body.mesh_displacement(u[:, begin : begin + COLUMNS_AT_ONCE])
            stress = np.zeros((0, 6, mesh.shape[1]))
            if len(nodes):
                assert body.element_model is not None
                stress = body.element_model.nodal_stress(mesh, nodes=wanted)[nodes]
            if points:
                assert body.stress_points is not None
                stress = np.concatenate([stress, body.stress_points.stress(mesh)[points]])
            parts.append(stress.reshape(-1, mesh.shape[1]))
        return np.concatenate(parts, axis=1)

    return values


def stressed_nodes(body: FEBody, places: Places, at: str | int, nodes: IntArray) -> IntArray:
    """Return the nodes at which deformation causes stress, without reference nodes and nodes of beam axes.

    Raises
    ------
    RecoveryError
        If no node has stress.
    """
    u = np.random.default_rng(0).standard_normal((body.n_dof, 1))
    assert body.element_model is not None
    on_mesh = np.zeros((len(body.nodes), 6, 1))
    stress = body.element_model.nodal_stress(body.mesh_displacement(u), nodes=np.unique(nodes))
    on_mesh[: len(stress)] = stress
    found = nodes[on_mesh[nodes].any(axis=(1, 2))]
    if not len(found):
        raise RecoveryError(
            f"body {body.name!r}: node {places.word(int(nodes[0]))} ({at!r}) has no stress: it is a reference node "
            "or on the axis of a beam; take a node of the solid or shell, a stress point, or the forces in the beams"
        )
    return found


# Elements -------------------------------------------------------------------------------------------------------------


def element_block(body: FEBody, rows: Rows) -> Block:
    """Return forces, strains or stresses of elements; a place may be the name of a part or a cell type."""
    groups = [group for group in element_groups(body) if group.quantity == rows.quantity]
    if not groups:
        known = tuple(dict.fromkeys(group.quantity for group in element_groups(body)))
        raise RecoveryError(
            f"body {body.name!r}: recovery of {rows.quantity}: it has no such elements"
            + (f"; it has {', '.join(known)}" if known else ": it consists of bare matrices without elements")
        )
    chosen = [(group, elements) for group, elements in elements_of(body, rows, groups) if len(elements)]
    names = [
        RowName(rows.quantity, "element", int(group.numbers[k]), group.names[k], component, dimensions)
        for group, elements in chosen
        for k in elements.tolist()
        for component, dimensions in zip(group.components, group.dimensions, strict=True)
    ]

    def values(u: Array) -> Array:
        mesh = body.mesh_displacement(u)
        return np.concatenate([group.forces(mesh, own).reshape(-1, u.shape[1]) for group, own in chosen])

    return Block(tuple(names), 0, values)


def elements_of(body: FEBody, rows: Rows, groups: list[ElementGroup]) -> list[tuple[ElementGroup, IntArray]]:
    """Return the requested elements of each group, in their order, selected by name, number, set or part.

    If elements have no numbers, a number is an index into the only group.
    """
    if not rows.at:
        return [(group, np.arange(group.count)) for group in groups]
    found: list[tuple[ElementGroup, IntArray]] = []
    for at in rows.at:
        here = [(group, members) for group in groups if len(members := group.members(at, is_only=len(groups) == 1))]
        if not here:
            known = [name for group in groups for name in (*group.groups, group.part, *group.names) if name]
            raise RecoveryError(
                f"body {body.name!r}: recovery of {rows.quantity}: no element, set or part {quoted(str(at))}"
                f"{nearest(str(at), list(dict.fromkeys(known)))}"
            )
        found += here
    return found
