"""Bodies from mass and stiffness matrices of another program, given as arrays or as an .npz file."""

import logging
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.body.fe_body import FEBody, Interface, NoNodalRotations, put_translations
from fe_models.body.freedom import rigid_forces
from fe_models.body.held_causes import mistake_description, support_description
from fe_models.body.positive_mass import DENSE, negative_mass, positive_mass
from fe_models.body.rigid_motion import MassLoads
from fe_models.body.unit_check import BodyNumbers, hull_volume, implausible_numbers
from fe_models.elements.solids.body import scalar_mass_gram
from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.paths import file_digest
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.numbering import Numbering

__all__ = ["ScalarMassModel", "body_from_matrices", "body_from_npz", "scalar_mass_of"]

log = logging.getLogger(__name__)

PATTERN_TOLERANCE = 1e-10  #: largest |M - M_s ⊗ 1₃| / |M| that is a rounding error of the other program
INTERFACE_KEYS = ("kind", "nodes", "reference", "triad", "weights")


@dataclass(frozen=True, eq=False)
class ScalarMassModel(NoNodalRotations):
    """Exact mass integrals of a body with M = M_s ⊗ 1₃; an `fe_models.body.fe_body.ElementModel`."""

    name: str
    M_s: sp.csr_array  #: scalar mass, (n_nodes, n_nodes) [kg]
    nodes: Array  #: node positions, (n_nodes, 3) [m]
    dofs: IntArray  #: (node, component) of each dof, (n_dof, 2)

    @property
    def has_nodal_stress(self) -> bool:
        """Return False, because elements of bare matrices are unknown."""
        return False

    def mass_gram(self, u: Array) -> Array:
        """Return ∫ a aᵀ dm with a = [1, c, u_x, u_y, u_z], (4 + 3 k, 4 + 3 k); u is (n_dof, k)."""
        translations = np.zeros((len(self.nodes), 3, u.shape[1]))
        put_translations(translations, self.dofs, u)
        n_nodes = len(self.nodes)
        return scalar_mass_gram(SymmetricProduct(self.M_s), self.nodes, translations.reshape(n_nodes, -1), n_nodes)

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Raise `BodyError`, because elements of bare matrices are unknown."""
        raise BodyError(
            f"body {self.name!r}: it came as bare matrices, which know no stress; build it from its mesh "
            f"(fe_models.elements.solids.body.solid_body) for stresses"
        )

    @property
    def has_geometric_stiffness(self) -> bool:
        """Return False, because elements of bare matrices are unknown."""
        return False

    def mass_forces(self, loads: MassLoads) -> Array:
        """Raise `BodyError`; callers must check `has_geometric_stiffness` first."""
        raise self._no_elements()

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Raise `BodyError`, because elements of bare matrices are unknown."""
        raise self._no_elements()

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Raise `BodyError`, because elements of bare matrices are unknown."""
        raise self._no_elements()

    def _no_elements(self) -> BodyError:
        return BodyError(
            f"body {self.name!r}: it came as bare matrices, which know no geometric stiffness; build it from its mesh "
            f"(fe_models.elements.solids.body.solid_body), or reduce it without"
        )


def body_from_matrices(
    M: Any,
    K: Any,
    nodes: Any,
    dofs: Any,
    *,
    name: str,
    units: Units,
    interfaces: Iterable[Interface] = (),
    D: Any = None,
    surface: Any = None,
    provenance: Mapping[str, str] | None = None,
    held: bool = False,
    repair_mass: bool = False,
    accept: Iterable[str] = (),
    numbering: Numbering | None = None,
) -> FEBody:
    """Return a body from the mass and stiffness matrices of any program.

    If M is M_s ⊗ 1₃ on the translations and zero elsewhere (solid elements, lumped masses), the body gets an element
    model that gives every mass integral exactly. Otherwise it has no element model, and approximate results are
    labelled as such.

    Parameters
    ----------
    M, K, D
        Mass, stiffness and optional viscous damping, dense or sparse, with both triangles, (n_dof, n_dof).
    nodes
        Positions of the nodes, (n_nodes, 3) [m].
    dofs
        Node and component (0-2 translation, 3-5 rotation, mesh axes) of every row of the matrices, in any order,
        (n_dof, 2).
    name, units, interfaces, surface, provenance
        As in `FEBody`.
    held
        Whether the body is intentionally held to the ground, by springs, supports or removed rows. The body is then
        labelled (`FEBody.is_held`). It can be checked, reduced, compared and exported, but a floating frame rejects it.
    repair_mass
        Whether to set slightly negative eigenvalues of M, as some programs write them, to zero (`positive_mass`).
    accept
        Findings to accept: "units" accepts an implausible size, density or wave speed.
    numbering
        The user's numbers of nodes and elements, for messages and results; None: indices.

    Raises
    ------
    BodyError
        If shapes do not fit, a matrix is not symmetric or finite, a component is not 0 to 5, or two rows are the same
        dof; if K resists rigid-body motion although `held` is false; if K does so because of a mistake (rows in another
        order, exchanged nodes, a penalty on the diagonal); if `held` is true but the body is free; if M is indefinite;
        or if the size, density or wave speed is implausible in these units.
    """
    where = f"body {name!r}"
    nodes, dofs = np.asarray(nodes, dtype=float), np.asarray(dofs)
    if not (dofs.dtype.kind in "iu" or (dofs.dtype.kind == "f" and np.array_equal(dofs, np.rint(dofs)))):
        raise BodyError(f"{where}: dofs: expected whole numbers (node, component), got {dofs.dtype}")
    matrices = {"M": M, "K": K} | ({} if D is None else {"D": D})
    sparse = {key: sp.csc_array(matrix, dtype=float) for key, matrix in matrices.items()}
    for key, matrix in sparse.items():
        require_both_triangles(f"{where}: {key}", matrix)
    if dofs.ndim == 2 and dofs.shape[1] == 2 and len(dofs) and (dofs[:, 1] < 0).any():
        raise BodyError(
            f"{where}: dofs: expected components 0 to 5, got {int(dofs[:, 1].min())} in row "
            f"{int(np.argmin(dofs[:, 1]))}; remove the rows of multipliers and of other dofs without displacement"
        )
    record = dict(provenance or {}) | {"mesh": (provenance or {}).get("mesh", "matrices")}
    body = FEBody(
        name=name,
        M=sparse["M"],
        K=sparse["K"],
        D=sparse.get("D"),
        nodes=nodes,
        dofs=dofs.astype(np.int64),
        interfaces=tuple(interfaces),
        units=units,
        surface=np.zeros((0, 3), np.int64) if surface is None else surface,
        numbering=numbering or Numbering(),
    )
    unique, count = np.unique(body.dofs, axis=0, return_counts=True)
    if len(unique) < len(body.dofs):
        node, component = unique[count > 1][0]
        raise BodyError(f"{where}: dofs: component {component} of node {node} is listed {count.max()} times")
    require_freedom(body, held=held)
    require_units(body, accept=tuple(accept))
    if repair_mass:
        body = positive_mass(body)
        record |= {key: value for key, value in body.provenance.items() if key == "mass mended"}
    else:
        require_positive_mass(body)
    M_s = scalar_mass_of(body)
    record["mass moments"] = "approximate: M is not M_s ⊗ 1" if M_s is None else "exact: M = M_s ⊗ 1"
    model = None if M_s is None else ScalarMassModel(name, M_s, body.nodes, body.dofs)
    if held:
        record["held"] = "to the ground, as declared"
    return replace(body, element_model=model, provenance=record, is_held=held)


def require_freedom(body: FEBody, *, held: bool) -> None:
    """Raise `BodyError` unless the body is free, or fixed as declared and not by a mistake."""
    where = f"body {body.name!r}"
    forces = rigid_forces(body.K, body.M, body.nodes, body.dofs)
    mass = np.diag(forces.mass)[:3]
    if not mass.max() > 0:
        raise BodyError(f"{where}: M: expected a positive mass, got {mass.max():.4g}")
    if forces.is_free:
        if held:
            raise BodyError(f"{where}: held: K answers no rigid-body motion, so the body is free; remove held")
        return
    called = body.numbering.called
    mistake = mistake_description(body.K, body.M, body.nodes, body.dofs, forces, with_rows=not held, called=called)
    if mistake is not None:
        raise BodyError(f"{where}: these are not the matrices of a free body: {mistake}")
    words = support_description(forces, body.dofs, body.units.time, called=called)
    if not held:
        raise BodyError(
            f"{where}: these are not the matrices of a free body: {words}. Release it; or if it is meant to be held "
            "(springs to the ground, supports), say so: held = true in the [body] of a job or in the file, "
            "held=True in "
            "Python. A held body can be reduced, checked and compared, but no floating frame can take it"
        )
    if n_free := forces.n_free:
        raise BodyError(
            f"{where}: held: {n_free} of the rigid-body motions stay free while others are held ({words}); expected a "
            "body that is held in all of them, or free in all"
        )


def require_positive_mass(body: FEBody) -> None:
    """Raise `BodyError` if M is indefinite beyond rounding; the eigensolver checks large matrices."""
    if body.n_dof > DENSE:
        return
    values, _ = negative_mass(body.M, body.dofs)
    if len(values):
        raise BodyError(
            f"body {body.name!r}: M is indefinite: {len(values)} eigenvalues below zero, down to {values[0]:.1e} of "
            "the "
            "largest (translations and rotations scaled alike): motions with negative kinetic energy. If that is the "
            "rounding of another program, repair_mass = true in the [body] of a job (repair_mass=True in Python) sets "
            "them to zero and tells what that changes; else repair the matrix"
        )


def require_units(body: FEBody, *, accept: tuple[str, ...]) -> None:
    """Raise `BodyError` if size, density or wave speed is impossible in these units; warn if one is doubtful."""
    if unknown := set(accept) - {"units"}:
        raise BodyError(f"body {body.name!r}: accept: unknown {unknown.pop()!r}; expected 'units'")
    mass = float(np.diag(rigid_forces(body.K, body.M, body.nodes, body.dofs).mass)[:3].max())
    speeds = wave_speeds(body)
    numbers = BodyNumbers(
        size=float(np.linalg.norm(np.ptp(body.nodes, axis=0))),
        hull=hull_volume(body.nodes),
        mass=mass,
        meshed_speed=float(np.median(speeds)) if len(speeds) else None,
    )
    for is_error, text in implausible_numbers(body.units, numbers):
        if is_error and "units" not in accept:
            raise BodyError(f'body {body.name!r}: {text}; or confirm the values by accept = ["units"]')
        log.warning("body %r: %s", body.name, text)


def wave_speeds(body: FEBody) -> Array:
    """Return sqrt(K_kk / M_kk) times the distance to the closest node, for translations with mass, (k,).

    In a fine mesh this is the wave speed times a factor between 1 and 10.
    """
    used = np.unique(body.dofs[:, 0])
    if len(used) < 2:
        return np.zeros(0)
    distance = np.zeros(len(body.nodes))
    distance[used] = cKDTree(body.nodes[used]).query(body.nodes[used], k=2)[0][:, 1]
    K, M = body.K.diagonal(), body.M.diagonal()
    rows = np.flatnonzero((body.dofs[:, 1] < 3) & (M > 0) & (K > 0))
    speed = np.sqrt(K[rows] / M[rows]) * distance[body.dofs[rows, 0]]
    return np.asarray(speed[speed > 0])


def scalar_mass_of(body: FEBody) -> sp.csr_array | None:
    """Return M_s, (n_nodes, n_nodes), if M is M_s ⊗ 1₃ for translations and zero elsewhere; otherwise None.

    None means that rotations have mass, that directions differ or are coupled, or that a node lacks a direction.
    """
    M = sp.coo_array(body.M)
    node, component = body.dofs[M.row, 0], body.dofs[M.row, 1]
    node_2, component_2 = body.dofs[M.col, 0], body.dofs[M.col, 1]
    largest = np.abs(M.data).max(initial=0.0)
    in_pattern = (component == component_2) & (component >= 0) & (component < 3)
    if largest == 0 or np.abs(M.data[~in_pattern]).max(initial=0.0) > PATTERN_TOLERANCE * largest:
        return None
    shape = 2 * (len(body.nodes),)
    directions = [
        sp.csr_array((M.data[at], (node[at], node_2[at])), shape=shape)
        for at in (in_pattern & (component == c) for c in range(3))
    ]
    for other in directions[1:]:
        difference = (directions[0] - other).data
        if np.abs(difference).max(initial=0.0) > PATTERN_TOLERANCE * largest:
            return None
    return directions[0]


def require_both_triangles(where: str, matrix: sp.csc_array) -> None:
    """Raise `BodyError` if a square matrix has entries in only one triangle."""
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        return  # `FEBody` raises the error with the expected shape
    column = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    below = np.count_nonzero(matrix.data[matrix.indices > column])
    above = np.count_nonzero(matrix.data[matrix.indices < column])
    if max(below, above) > 0 and min(below, above) == 0:
        raise BodyError(
            f"{where}: expected both triangles, got the {'lower' if below else 'upper'} one only; "
            f"pass A + A.T - diag(A)"
        )


def body_from_npz(
    path: str | Path,
    *,
    name: str | None = None,
    units: Units | None = None,
    held: bool = False,
    repair_mass: bool = False,
    accept: Iterable[str] = (),
) -> FEBody:
    """Read a body from an .npz archive of plain arrays (`numpy.savez`); pickled objects are rejected.

    =================================  ==============================================================================
    key                                array
    =================================  ==============================================================================
    M, K, D (optional)                 dense, (n_dof, n_dof); or instead the parts of a sparse matrix:
    M_row, M_col, M_data               triplets, numbered from 0, duplicates added; or
    M_indptr, M_indices, M_data        compressed columns or rows (equal, because the matrix is symmetric)
    nodes                              (n_nodes, 3)
    dofs                               (n_dof, 2): node, from 0, and component, 0-2 translation and 3-5 rotation
    units (or the argument `units`)    name of the unit system, such as "mm-t-s"
    held (optional)                    1: the body is meant to be held to the ground
    surface (optional)                 triangles of nodes for drawing, (n_tri, 3)
    interface/<name>/nodes             members; and for the same <name>, optional:
    interface/<name>/kind              "rigid" (default), "distributing" or "nodes"
    interface/<name>/reference         (3,), default: the mean of the members
    interface/<name>/triad             (3, 3), axes as columns, default: mesh axes
    interface/<name>/weights           (n_members,), default: equal
    =================================  ==============================================================================

    Parameters
    ----------
    path
        Path of the archive.
    name
        Name of the body; None: the name of the file without its suffix.
    units
        Unit system of the arrays; None: the one that the file names.
    held, repair_mass, accept
        As for `body_from_matrices`. The key `held` of the file also declares the body held.

    Raises
    ------
    MeshError
        If the file is missing, is not such an archive, lacks a key, has unknown keys, or names no unit system.
    BodyError
        If the arrays do not make a valid body.
    """
    path = Path(path)
    arrays = read_arrays(path)
    known = {"nodes", "dofs", "units", "surface", "held"}
    known |= {key + part for key in "MKD" for part in ("", "_row", "_col", "_data", "_indptr", "_indices")}
    for key in arrays:
        if key not in known and not key.startswith("interface/"):
            raise MeshError(f"{path}: unknown array {quoted(key)}{nearest(key, known)}")
    for key in ("nodes", "dofs"):
        require_key(path, arrays, key)
    nodes = arrays["nodes"]
    if nodes.ndim != 2 or nodes.shape[1] != 3 or nodes.dtype.kind not in "fiu":
        raise MeshError(f"{path}: nodes: expected numbers (n_nodes, 3), got {nodes.dtype} {nodes.shape}")
    n_dof = len(arrays["dofs"]) if arrays["dofs"].ndim else 0
    has_damping = any(key == "D" or key.startswith("D_") for key in arrays)
    return body_from_matrices(
        sparse_of(path, arrays, "M", n_dof),
        sparse_of(path, arrays, "K", n_dof),
        nodes,
        arrays["dofs"],
        name=name or path.stem,
        units=units_of(path, arrays, units),
        interfaces=interfaces_of(path, arrays),
        D=sparse_of(path, arrays, "D", n_dof) if has_damping else None,
        surface=arrays.get("surface"),
        provenance={"mesh": str(path), "mesh sha256": file_digest(path)},
        held=held or is_held(path, arrays),
        repair_mass=repair_mass,
        accept=accept,
    )


def is_held(path: Path, arrays: Mapping[str, np.ndarray]) -> bool:
    """Return the value of the key `held`; False if the file has no such key."""
    if "held" not in arrays:
        return False
    value = arrays["held"]
    if value.size != 1 or value.dtype.kind not in "biu" or value.item() not in (0, 1):
        raise MeshError(f"{path}: held: expected one number, 0 or 1, got {value.dtype} {value.shape}")
    return bool(value.item())


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read all arrays of the archive."""
    if not path.is_file():
        raise MeshError(f"{path}: no such file; expected an .npz archive of matrices")
    try:
        # np.load leaves the file open if the archive is broken, so the file is opened and closed here
        with path.open("rb") as stream:
            archive = np.load(stream, allow_pickle=False)
            arrays = {} if isinstance(archive, np.ndarray) else {key: archive[key] for key in archive.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, NotImplementedError) as error:
        raise MeshError(
            f"{path}: not a readable .npz archive of plain arrays ({error}); write it with "
            f"numpy.savez(path, M=..., K=..., nodes=..., dofs=..., units=...)"
        ) from error
    if isinstance(archive, np.ndarray):
        raise MeshError(f"{path}: expected an .npz archive with M, K, nodes and dofs, got a single array")
    return arrays


def require_key(path: Path, arrays: Mapping[str, np.ndarray], key: str) -> None:
    """Raise `MeshError` unless the archive has the key."""
    if key not in arrays:
        raise MeshError(f"{path}: the array {key!r} is missing; got {', '.join(arrays) or 'none'}")


def sparse_of(path: Path, arrays: Mapping[str, np.ndarray], key: str, n_dof: int) -> sp.csc_array:
    """Return a matrix from its dense array, its triplets or its compressed columns."""
    parts = [part for part in ("data", "row", "col", "indptr", "indices") if f"{key}_{part}" in arrays]
    forms = {"triplets": {"data", "row", "col"}, "compressed": {"data", "indptr", "indices"}}
    form = next((form for form, needed in forms.items() if set(parts) == needed), "dense" if not parts else "")
    if (parts and key in arrays) or (key not in arrays and form not in forms):
        raise MeshError(
            f"{path}: {key}: expected {key} alone, or {key}_row, {key}_col, {key}_data, or {key}_indptr, "
            f"{key}_indices, {key}_data; got "
            f"{', '.join(name for name in arrays if name.split('_')[0] == key) or 'none of these'}"
        )
    try:
        if form == "dense":
            return sp.csc_array(arrays[key], dtype=float)
        data = np.asarray(arrays[f"{key}_data"], dtype=float)
        if form == "triplets":
            place = (arrays[f"{key}_row"], arrays[f"{key}_col"])
            return sp.csc_array(sp.coo_array((data, place), shape=(n_dof, n_dof)))
        matrix = sp.csc_array((data, arrays[f"{key}_indices"], arrays[f"{key}_indptr"]), shape=(n_dof, n_dof))
        matrix.check_format(full_check=True)
        return matrix
    except (ValueError, TypeError, IndexError) as error:
        raise MeshError(f"{path}: {key}: the {form} parts do not make a matrix of {n_dof} dofs: {error}") from error


def units_of(path: Path, arrays: Mapping[str, np.ndarray], units: Units | None) -> Units:
    """Return the given unit system, or that of the file; raise `MeshError` if both differ or are missing."""
    if "units" not in arrays:
        if units is None:
            raise MeshError(f"{path}: the file names no units; pass units=unit_system(...) or add a key 'units'")
        return units
    named = unit_system(str(arrays["units"].item() if arrays["units"].size == 1 else arrays["units"]))
    if units is not None and units != named:
        raise MeshError(f"{path}: the file is in {named.name}, but {units.name} was asked for")
    return named


def interfaces_of(path: Path, arrays: Mapping[str, np.ndarray]) -> list[Interface]:
    """Return the interfaces of the archive, in the order of its keys."""
    groups: dict[str, dict[str, np.ndarray]] = {}
    for key in arrays:
        if key.startswith("interface/"):
            name, _, part = key.removeprefix("interface/").rpartition("/")
            if not name or part not in INTERFACE_KEYS:
                raise MeshError(
                    f"{path}: {quoted(key)}: expected interface/<name>/<part>{nearest(part, INTERFACE_KEYS)}"
                )
            groups.setdefault(name, {})[part] = arrays[key]
    interfaces = []
    for name, parts in groups.items():
        require_key(path, arrays, f"interface/{name}/nodes")
        members = parts["nodes"]
        if members.dtype.kind not in "iu" or members.ndim != 1 or not members.size:
            raise MeshError(
                f"{path}: interface/{name}/nodes: expected node numbers, (n_members,), got {members.dtype} "
                f"{members.shape}"
            )
        if members.min() < 0 or members.max() >= len(arrays["nodes"]):
            raise MeshError(
                f"{path}: interface/{name}/nodes: expected 0..{len(arrays['nodes']) - 1}, got "
                f"{members.min()}..{members.max()}"
            )
        interfaces.append(
            Interface(
                name=name,
                kind=str(parts["kind"].item()) if "kind" in parts and parts["kind"].size == 1 else "rigid",
                nodes=members,
                reference=parts.get("reference", arrays["nodes"][members].mean(axis=0)),
                triad=parts.get("triad", np.eye(3)),
                weights=parts.get("weights"),
            )
        )
    return interfaces
