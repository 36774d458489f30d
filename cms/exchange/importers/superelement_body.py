"""Conversion of a superelement to a reduced body: interfaces, removal of rigid motion, diagonal modes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.body.invariants import INERTIA_TERMS, Moments
from cms.body.recovery_table import RecoveryTable
from cms.body.reduced_body import BodyFrame, ReducedBody
from cms.errors import ForeignBodyError
from cms.exchange.importers.inertia import Inertia, completed, moments_of_masses
from cms.exchange.importers.superelement import RecoveryRows, Superelement, listed
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.damping import Damping
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import Frame, TisserandFrame, frame_condition
from cms.reduction.recovery.interface_rows import PartOfTable
from cms.reduction.recovery.load_columns import LoadColumns
from cms.reduction.recovery.matrices import table_of
from cms.reduction.reduction import assembled
from fe_models.body.fe_body import FEBody, Interface, Recovery
from fe_models.body.load_cases import LoadCase
from fe_models.body.positive_mass import positive_mass
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.files.matrices.foreign_matrices import pair_keys
from fe_models.files.matrices.given import require_freedom, require_positive_mass, require_units
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.meshes.numbering import Numbering

__all__ = ["ImportOptions", "body_of_superelement", "fe_body_of_superelement"]

#: largest error of recovered nodes in a rigid motion, relative to the motion, due to the limited digits of the file
RIGID = 1e-5
UNCOUPLED = 1e-9  #: scaled coupling between modal coordinates and boundary in K, below which it is rounding
ROUNDING = 1e-13  #: stiffness of a boundary dof relative to the largest entry, below which it is rounding
COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class ImportOptions:
    """Data that the files of another program lack, and requested properties of the body."""

    units: Units  #: units of all numbers in the files
    #: boundary nodes of each interface; None: one interface for each node with six dofs
    interfaces: Mapping[str, Sequence[int]] | None = None
    inertia: Inertia | None = None  #: inertia that the reduced mass lacks; None: it remains missing
    frame: Frame | None = None  #: body frame; None: Tisserand
    damping: Damping | None = None  #: damping added to that of the files
    repair_mass: bool = False  #: set slightly negative eigenvalues of the mass to zero
    accept: tuple[str, ...] = ()  #: findings that the user accepts, such as "units"


def body_of_superelement(element: Superelement, options: ImportOptions) -> ReducedBody:
    """Reduce a superelement to a body in a floating frame.

    (1) make an `FEBody` of its matrices: boundary dofs, modal coordinates as dofs without position, recovered nodes
    (2) check it like bare matrices: free, positive mass, plausible units; recovered nodes must follow a rigid motion
    (3) take its unit columns as a mode set, and apply the finishing step: frame, rank, M-orthonormal, K-diagonal
        (theory.md §3)
    (4) compute m, S, R, 1C, 2C, M* from the reduced mass; 3C, 4C, 5C from additional data, otherwise they are missing
        (theory.md §5)

    Raises
    ------
    ForeignBodyError
        If the superelement is inconsistent, or additional data belong to another body.
    BodyError
        If it is held, a mechanism, or its mass is indefinite.
    """
    body = fe_body_of_superelement(element, options)  # step (1)
    require_freedom(body, held=False)  # (2)
    require_units(body, accept=options.accept)
    if options.repair_mass:
        body = positive_mass(body)
    else:
        require_positive_mass(body)
    require_rigid_recovery(body, element)
    modes = ModeSet(  # step (3)
        "superelement",
        np.eye(body.n_dof),
        tuple(label_of(node, component, k) for k, (node, component) in enumerate(element.dofs)),
        np.full(body.n_dof, np.nan),
        {"program": element.program or "unknown"},
    )
    condition = frame_condition(body, options.frame or TisserandFrame())
    finished = finish(body, modes, condition)
    moments = known_moments(body, finished.Phi, finished.M, condition.frame)  # (4)
    record = {"inertia": f"of the reduced mass alone; missing: {', '.join(INERTIA_TERMS)}"}
    if options.inertia is not None:
        places = {int(number): place for number, place in zip(element.node_numbers, body.nodes, strict=True)}
        shapes = RecoveredShapes(body, element, finished.Phi)
        other, words = moments_of_masses(options.inertia, shapes, places, options.units, condition.frame)
        moments, difference = completed(moments, other, words)
        record = {"inertia": f"3C, 4C, 5C by {words}, which differ from the reduced mass by: {difference}"}
    reduced = assembled(
        body, modes, finished, condition, kept=np.arange(len(body.nodes)), moments=moments, damping=options.damping
    )
    return replace(
        reduced,
        node_ids=element.node_numbers,
        recovery=tables_of(element, body, finished.Phi, reduced),
        provenance=dict(reduced.provenance) | record | {"node ids": f"numbers of {element.program or 'the files'}"},
    )


def tables_of(element: Superelement, body: FEBody, Phi: Array, reduced: ReducedBody) -> dict[str, RecoveryTable]:
    """Return the additional rows of a superelement over z = (d, theta, q); they are exact in its span.

    The rows in the files refer to x = T x', where x' are the dofs of the body (`static_part`).
    """
    tables: dict[str, RecoveryTable] = {}
    if not element.tables:
        return tables
    frame = reduced.frame
    Psi_B = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin) @ np.kron(np.eye(2), frame.axes)
    motion = static_part(element, f"superelement {element.name!r}") @ np.hstack([Psi_B, Phi])
    none = LoadColumns((), np.zeros((0, 3)), np.zeros(0, dtype=bool))
    for name, rows in element.tables.items():
        dynamic = np.zeros((3, len(rows.names), motion.shape[1]))
        dynamic[0] = rows.matrix @ motion
        part = PartOfTable(rows.names, dynamic, np.zeros((len(rows.names), 0)))
        tables[name] = table_of(reduced, name, [part], none, f"{rows.about}; nothing beyond what the files leave out")
    return tables


def fe_body_of_superelement(element: Superelement, options: ImportOptions) -> FEBody:
    """Return the body of a superelement: its matrices in Craig-Bampton form, its nodes, interfaces and loads.

    If the stiffness couples modal coordinates to the boundary, they are measured relative to their static response,
    x_q = x_q' - K_qq⁻¹ K_qb u_b. A rigid motion of the boundary then is a rigid motion of the body.
    """
    where = f"superelement {element.name!r}"
    node = np.zeros(len(element.dofs), np.int64)
    physical = ~element.is_modal
    if not physical.any():
        raise ForeignBodyError(f"{where}: expected dofs of boundary nodes, got only modal coordinates")
    node[physical] = element.places(element.dofs[physical, 0])
    node[element.is_modal] = node[physical][0]
    dofs = np.stack([node, element.dofs[:, 1]], axis=1)
    T = static_part(element, where)
    K, M = T.T @ without_rounding(element) @ T, T.T @ element.M @ T
    D = None if element.D is None else T.T @ element.D @ T
    own = np.flatnonzero(physical)
    rows, matrix = [dofs[own]], [np.eye(len(dofs))[own]]
    if element.recovery is not None:
        further = further_rows(element, where)
        rows.append(np.stack([element.places(further.dofs[:, 0]), further.dofs[:, 1]], axis=1))
        matrix.append(further.matrix @ T)
    body = FEBody(
        name=element.name,
        M=sp.csc_array((M + M.T) / 2),
        K=sp.csc_array((K + K.T) / 2),
        D=None if D is None else sp.csc_array((D + D.T) / 2),
        nodes=element.nodes,
        dofs=dofs,
        units=options.units,
        recovery=Recovery(sp.csr_array(np.concatenate(matrix)), np.concatenate(rows)),
        load_cases=tuple(LoadCase(name, "force", T.T @ load) for name, load in element.loads.items()),
        numbering=Numbering(nodes=element.node_numbers),
        kept=np.unique(np.concatenate([table[table[:, 1] >= 3, 0] for table in rows])),
        provenance=element.provenance,
    )
    return replace(body, interfaces=interfaces_of(body, element, options.interfaces))


def without_rounding(element: Superelement) -> Array:
    """Return the stiffness with zero rows where it is only rounding, such as at the only interface of a free body."""
    K = np.array(element.K)
    length = float(np.linalg.norm(np.ptp(element.nodes, axis=0))) or 1.0
    size = np.where(element.dofs[:, 1] >= 3, length, 1.0)
    scaled = np.abs(K) / np.outer(size, size)
    nothing = ~element.is_modal & (scaled.max(axis=1) <= ROUNDING * scaled.max())
    K[nothing], K[:, nothing] = 0.0, 0.0
    return K


def static_part(element: Superelement, where: str) -> Array:
    """Return T in x = T x' that removes the coupling of modal coordinates and boundary from the stiffness.

    T is the identity if there is no such coupling.
    """
    q = np.flatnonzero(element.is_modal)
    T = np.eye(len(element.dofs))
    if not len(q):
        return T
    b = np.flatnonzero(~element.is_modal)
    K_qq, K_qb = np.asarray(element.K)[np.ix_(q, q)], np.asarray(element.K)[np.ix_(q, b)]
    size = np.sqrt(np.abs(np.diag(element.K)))
    scale = np.outer(size[q], size[b])
    if (np.abs(K_qb) <= UNCOUPLED * np.where(scale > 0, scale, np.inf)).all() and not K_qb[scale == 0].any():
        return T
    values = la.eigvalsh(K_qq / np.outer(size[q], size[q])) if (size[q] > 0).all() else np.zeros(1)
    if not values[0] > 1e-10:
        raise ForeignBodyError(
            f"{where}: stiffness couples modal coordinates to the boundary, but some of them have no stiffness "
            "themselves; expected modes with the boundary held (Craig-Bampton), or other modes with strain energy"
        )
    T[np.ix_(q, b)] = -np.linalg.solve(K_qq, K_qb)
    return T


def further_rows(element: Superelement, where: str) -> RecoveryRows:
    """Return the recovery rows of internal dofs; rows of boundary dofs must equal the dof itself."""
    recovery = element.recovery
    assert recovery is not None
    keys, own = pair_keys(recovery.dofs), pair_keys(element.dofs)
    is_own = np.isin(keys, own[~element.is_modal])
    order = np.argsort(own)
    for row in np.flatnonzero(is_own):
        k = int(order[np.searchsorted(own[order], keys[row])])
        expected = np.zeros(len(own))
        expected[k] = 1.0
        if np.abs(recovery.matrix[row] - expected).max() > RIGID:
            raise ForeignBodyError(
                f"{where}: recovery: node {recovery.dofs[row, 0]} is a boundary node, and its row for component "
                f"{recovery.dofs[row, 1]} is not that dof; expected recovery rows in the order and axes of the matrices"
            )
    if len(np.unique(keys)) != len(keys):
        raise ForeignBodyError(f"{where}: recovery: a dof has two rows")
    taken = ~is_own & ~has_no_rotation(recovery)
    return RecoveryRows(recovery.dofs[taken], recovery.matrix[taken])


def has_no_rotation(recovery: RecoveryRows) -> np.ndarray:
    """Return whether a row is a rotation of a node with zero rotations, such as a node of solid elements.

    A node that has rotations rotates in a rigid motion of the boundary, so none of its rows is zero.
    """
    rotation = recovery.dofs[:, 1] >= 3
    moving = np.unique(recovery.dofs[rotation & recovery.matrix.any(axis=1), 0])
    return np.asarray(rotation & ~np.isin(recovery.dofs[:, 0], moving))


def interfaces_of(
    body: FEBody, element: Superelement, wanted: Mapping[str, Sequence[int]] | None
) -> tuple[Interface, ...]:
    """Return the interfaces of boundary nodes, already coupled.

    By default each node with six dofs is an interface, named "node 11", and all nodes with translations form one
    interface, "boundary". Each boundary dof must belong to an interface; otherwise it could not be joined, and could
    not be distinguished from a modal coordinate.
    """
    where = f"superelement {element.name!r}"
    boundary = np.unique(element.dofs[~element.is_modal, 0])
    rows = {int(number): np.flatnonzero((element.dofs[:, 0] == number) & ~element.is_modal) for number in boundary}
    if wanted is None:
        full = [number for number, own in rows.items() if len(own) == 6]
        groups: dict[str, Sequence[int]] = {f"node {number}": [number] for number in full}
        rest = [number for number, own in rows.items() if len(own) != 6]
        if rest:
            groups["boundary"] = rest
    else:
        groups = dict(wanted)
    interfaces, taken = [], set[int]()
    for name, numbers in groups.items():
        if not len(numbers):
            raise ForeignBodyError(f"{where}: interface {name!r}: expected node numbers, got none")
        for number in numbers:
            if int(number) not in rows:
                raise ForeignBodyError(
                    f"{where}: interface {name!r}: node {number} is no boundary node; they are {listed(boundary, 12)}"
                )
            if int(number) in taken:
                raise ForeignBodyError(f"{where}: interface {name!r}: node {number} is in another interface or twice")
            taken.add(int(number))
        own = np.concatenate([rows[int(n)][np.argsort(element.dofs[rows[int(n)], 1])] for n in numbers])
        nodes = element.places(np.array(numbers, dtype=np.int64))
        if set(range(3)) - set(element.dofs[own, 1]):
            raise ForeignBodyError(
                f"{where}: interface {name!r}: expected nodes with three translations, got components "
                f"{sorted({COMPONENTS[c] for c in element.dofs[own, 1]})}"
            )
        interfaces.append(Interface(name, "nodes", nodes, body.nodes[nodes].mean(axis=0), dofs=own))
    return tuple(interfaces)


def require_rigid_recovery(body: FEBody, element: Superelement) -> None:
    """Raise `ForeignBodyError` unless recovered nodes move rigidly when the boundary moves rigidly."""
    assert body.recovery is not None
    center = body.nodes.mean(axis=0)
    length = body.length
    scale = np.array([1.0, 1, 1, 1 / length, 1 / length, 1 / length])
    found = body.recovery.matrix @ (rigid_motion_of_dofs(body.nodes, body.dofs, center) * scale)
    expected = rigid_motion_of_dofs(body.nodes, body.recovery.dofs, center) * scale
    rotations = body.recovery.dofs[:, 1] >= 3
    defect = np.abs(found - expected) * np.where(rotations, length, 1.0)[:, None]
    row = int(np.argmax(defect.max(axis=1)))
    if not defect.max() <= RIGID:
        number, component = element.node_numbers[body.recovery.dofs[row, 0]], body.recovery.dofs[row, 1]
        raise ForeignBodyError(
            f"superelement {element.name!r}: recovery: node {number}, {COMPONENTS[component]}, misses a rigid "
            f"motion of the boundary by {defect.max():.1e} of it; expected rows in basic axes and the correct position"
        )


def known_moments(body: FEBody, Phi: Array, M: Array, frame: BodyFrame) -> Moments:
    """Return the moments in B that follow from a reduced mass matrix: m, S, R, 1C, 2C and M*."""
    axes = np.kron(np.eye(2), frame.axes)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin) @ axes
    M_Psi_R = body.M @ Psi_R
    rigid_mass = Psi_R.T @ M_Psi_R
    J, lower = rigid_mass[3:, 3:], rigid_mass[:3, 3:]  # lower block: -S~
    S = np.array([lower[1, 2] - lower[2, 1], lower[2, 0] - lower[0, 2], lower[0, 1] - lower[1, 0]]) / 2
    Y = M_Psi_R.T @ Phi
    epsilon = np.cross(np.eye(3)[:, None], np.eye(3)[None])
    return Moments(
        m=float(np.trace(rigid_mass[:3, :3]) / 3),
        S=S,
        R=np.trace(J) / 2 * np.eye(3) - J,
        C1=Y[:3],
        P=np.einsum("abc,ck->abk", epsilon, Y[3:]) / 2,
        S_kl=np.einsum("ab,kl->abkl", np.eye(3), M) / 3,
        missing=INERTIA_TERMS,
    )


@dataclass(frozen=True, eq=False)
class RecoveredShapes:
    """Shapes of a superelement at all dofs that it can recover, in basic axes."""

    body: FEBody
    element: Superelement
    Phi: Array  #: shapes over the dofs of the body, without rigid motion, (n_dof, n_q)

    def __call__(self, dofs: IntArray) -> Array:
        """Return the shapes at dofs (node number, component), (n, n_q); raise `ForeignBodyError` for unknown dofs."""
        assert self.body.recovery is not None
        known = self.body.recovery.dofs
        keys = pair_keys(np.stack([self.element.node_numbers[known[:, 0]], known[:, 1]], axis=1))
        order = np.argsort(keys)
        wanted = pair_keys(dofs)
        at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
        is_there = keys[order][at] == wanted
        if not is_there.all():
            lost = np.unique(dofs[~is_there, 0])
            raise ForeignBodyError(
                f"superelement {self.element.name!r}: nodes {listed(lost)} have mass, but the files have no recovery "
                "rows for them (Nastran: displacements of all nodes in mug1); write these rows in the other program, "
                "or give masses at nodes that it recovers"
            )
        return np.asarray((self.body.recovery.matrix @ self.Phi)[order[at]])


def label_of(node: int, component: int, k: int) -> str:
    """Return the label of a dof as a column of a mode set."""
    return f"boundary {node} {COMPONENTS[component]}" if component >= 0 else f"modal coordinate {k + 1}"
