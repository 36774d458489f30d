"""The .fem file of the modal joint of MBDyn (masses, nodal modes, invariants, stress stiffening), read and written."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from cms.body.geometric_stiffness import GeometricStiffness
from cms.body.invariants import Moments
from cms.body.reduced_body import BodyFrame, ReducedBody
from cms.errors import ForeignBodyError
from cms.exchange.exporters.nodes import NodeList, all_nodes, interface_nodes
from cms.exchange.exporters.writer import Request, WrittenFiles
from cms.exchange.importers.inertia import moments_in_frame
from cms.exchange.importers.integrals import moments_of_invariants
from cms.exchange.importers.modal_body import ModalBody
from fe_models.foundation.arrays import Array

__all__ = ["is_mbdyn", "make_mbdyn", "read_mbdyn"]


# MBDyn's modal joint: the .fem file with masses, nodal modes, invariants and stress stiffening ------------------------


def make_mbdyn(request: Request) -> WrittenFiles:
    """Return the file with all record groups except 3, 4 (initial state) and 11 (lumped masses).

    Group 11 is left out, because MBDyn would compute invariants from it. With integrals over mass, c and phi in the
    frame of the modal node, and x~ the skew matrix:

        14  Inv3 = int phi_k = 1C                    15  Inv4 = int c × phi_k = 2C
        16  Inv8_k = -int c~ phi_k~ = 3C_k           17  Inv5_jk = int phi_j × phi_k = 4C_kj
        18  Inv9_jk = int phi_j~ phi_k~ = -5C_jk     12  m, centre of mass, inertia about it

    Group 19 holds K_geo for unit values of omega_x², omega_y², omega_z², omega_x omega_y, omega_y omega_z, omega_z
    omega_x (each product appears once, hence twice our K_ab), of the angular acceleration, of acceleration minus
    gravity, and of force and moment at each node in the order of the joint.
    """
    body = request.body
    nodes = interface_nodes(body) if request.nodes != "all" else all_nodes(body)
    text = "\n".join(lines_of(body, nodes, request.header())) + "\n"
    notes = nodes.notes()
    if body.geometric is not None and body.interfaces:
        names = ", ".join(interface.name for interface in body.interfaces)
        notes += (
            f"record group 19 requires all {len(body.interfaces)} interfaces in the modal joint, in this order: "
            f"{names}; it needs `use automatic differentiation`",
        )
    return WrittenFiles({request.path: text.encode("ascii")}, notes)


def lines_of(body: ReducedBody, nodes: NodeList, header: Iterable[str]) -> Iterator[str]:
    """Yield the lines of the file."""
    moments, n = body.moments, body.n_q
    n_nodes = len(nodes.numbers)
    yield "** MBDyn MODAL DATA FILE"
    for line in header:
        yield f"** {line}"
    yield from group(1, "HEADER")
    yield "**   REVISION,  NODE,  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES."
    yield f"      REV0 {n_nodes} {n} 0 0 0"
    yield from group(2, "FINITE ELEMENT NODE LIST")
    yield " ".join(str(number) for number in nodes.numbers)
    for c, axis in enumerate("XYZ"):
        yield from group(5 + c, f"NODAL {axis} COORDINATES")
        yield from rows(nodes.positions[:, c : c + 1])
    yield from group(8, "MODE SHAPES")
    for k in range(n):
        yield f"**    NORMAL MODE SHAPE #  {k + 1}"
        yield from rows(np.hstack([nodes.Phi[:, :, k], nodes.Psi[:, :, k]]))
    yield from group(9, "MODAL MASS MATRIX")
    yield from rows(body.M)
    yield from group(10, "MODAL STIFFNESS MATRIX")
    yield from rows(body.K)
    yield from group(12, "RIGID BODY INERTIA MATRIX")
    center = moments.center_of_mass
    yield from rows(np.array([[moments.m]]))
    yield from rows(center[None])
    yield from rows(moments.J0 - moments.m * (center @ center * np.eye(3) - np.outer(center, center)))
    if np.any(body.D):
        yield from group(13, "MODAL DAMPING MATRIX")
        yield from rows(body.D)
    yield from group(14, "INVARIANT 3")
    yield from rows(moments.C1)
    yield from group(15, "INVARIANT 4")
    yield from rows(moments.C2)
    yield from group(16, "INVARIANT 8")
    yield from rows(moments.C3.transpose(1, 0, 2).reshape(3, 3 * n))
    yield from group(17, "INVARIANT 5")  # row a, column j n + k: int phi_j × phi_k
    yield from rows(moments.C4.transpose(2, 1, 0).reshape(3, n * n))
    yield from group(18, "INVARIANT 9")  # row a, column (j n + k) 3 + b
    yield from rows(-moments.C5.transpose(2, 0, 1, 3).reshape(3, 3 * n * n))
    if body.geometric is not None:
        matrices = stiffening_records(body)
        yield from group(19, "MODAL STRESS STIFFENING MATRIX")
        yield str(len(matrices))
        for index, K in enumerate(matrices):
            yield str(index + 1)
            yield from rows(K)
    yield "**"
    yield "** END OF FILE"


def stiffening_records(body: ReducedBody) -> Array:
    """Return the matrices of record group 19, in its order, (12 + 6 n_interfaces, n_q, n_q)."""
    assert body.geometric is not None
    twice = np.array([1.0, 1, 1, 2, 2, 2])[:, None, None]
    K = body.geometric
    loads = K.interfaces.reshape(-1, body.n_q, body.n_q)
    return np.concatenate([K.spin * twice, K.rotation, K.translation, loads])


def group(number: int, name: str) -> Iterator[str]:
    """Yield the heading of a record group."""
    yield "**"
    yield f"** RECORD GROUP {number}, {name}"


def rows(matrix: Array) -> Iterator[str]:
    """Yield the rows of a matrix as text in full precision."""
    for row in np.asarray(matrix).tolist():
        yield " ".join(f"{value:.17e}" for value in row)


# bodies of MBDyn: the .fem file of its modal joint --------------------------------------------------------------------


GROUP = re.compile(r"\*\*\s*RECORD GROUP\s+(\d+)", re.IGNORECASE)


def is_mbdyn(path: Path, head: bytes) -> bool:
    """Return whether a file is text with the record groups of MBDyn."""
    return path.suffix.lower() == ".fem" and GROUP.search(head.decode("ascii", "replace")) is not None


def read_mbdyn(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> ModalBody:
    """Read a body of MBDyn.

    With int over mass, c and phi in the frame of the modal node:

        14  int phi_k = 1C          15  int c × phi_k = 2C      16  3C_k, three columns per mode
        17  row a, column j n + k: 4C_kj,a        18  row a, column (j n + k) 3 + b: -5C_jk,ab
        11  lumped masses, from which missing invariants are computed

    Raises
    ------
    ForeignBodyError
        If a group is missing or has a wrong number of entries, or the file has no inertia of the modes.
    """
    path = files[0]
    if len(files) > 1:
        raise ForeignBodyError(f"{path}: expected one file of MBDyn, got {len(files)}")
    groups = groups_of(path)
    header = groups.get(1, [])
    if len(header) < 3:
        raise ForeignBodyError(f"{path}: record group 1: expected revision, nodes and modes, got {' '.join(header)!r}")
    n_nodes, n = (whole(path, word) for word in header[1:3])
    if not (0 < n and 0 < n_nodes):
        raise ForeignBodyError(f"{path}: record group 1: expected nodes and modes, got {n_nodes} and {n}")

    def read(group: int, *shape: int) -> Array:
        words = groups.get(group)
        if words is None:
            raise ForeignBodyError(f"{path}: record group {group} is missing")
        if len(words) != int(np.prod(shape)):
            raise ForeignBodyError(
                f"{path}: record group {group}: expected {int(np.prod(shape))} numbers, got {len(words)}"
            )
        try:
            values = np.array([float(word.replace("D", "E").replace("d", "e")) for word in words])
        except ValueError as error:
            raise ForeignBodyError(f"{path}: record group {group}: {error}") from error
        return values.reshape(shape)

    labels = groups.get(2, [])
    if len(labels) != n_nodes:
        raise ForeignBodyError(f"{path}: record group 2: expected {n_nodes} nodes, got {len(labels)}")
    nodes = np.stack([read(group, n_nodes) for group in (5, 6, 7)], axis=1)
    shapes = read(8, n, n_nodes, 6)
    Phi, rotations = np.moveaxis(shapes[:, :, :3], 0, 2), np.moveaxis(shapes[:, :, 3:], 0, 2)
    M = read(9, n, n)
    notes: tuple[str, ...] = ()
    if 14 in groups and 15 in groups and 12 in groups:
        inertia = read(12, 13)
        m, center = float(inertia[0]), inertia[1:4]
        J0 = inertia[4:].reshape(3, 3) + m * (center @ center * np.eye(3) - np.outer(center, center))
        moments, notes = moments_of_invariants(
            str(path),
            m,
            m * center,
            J0,
            read(14, 3, n),
            read(15, 3, n),
            M,
            C3=read(16, 3, n, 3).transpose(1, 0, 2) if 16 in groups else None,
            C4=read(17, 3, n, n).transpose(2, 1, 0) if 17 in groups else None,
            C5=-read(18, 3, n, n, 3).transpose(1, 2, 0, 3) if 18 in groups else None,
        )
    elif 11 in groups:
        moments = moments_of_lumps(read(11, n_nodes, 6), nodes, Phi, rotations, M)
        notes = ("invariants computed from the lumped masses of record group 11; M* is the modal mass",)
    else:
        raise ForeignBodyError(
            f"{path}: neither record groups 12, 14 and 15 (invariants) nor 11 (lumped masses) exist, so the momentum "
            "of the modes is unknown; write one of them"
        )
    geometric = None
    if 19 in groups:
        geometric = stress_stiffening(path, groups[19], n_nodes, n)
        if geometric is None:
            notes += (f"record group 19 is left out: expected the {12 + 6 * n_nodes} matrices of all loads",)
    is_number = all(re.fullmatch(r"\d+", label) for label in labels)
    return ModalBody(
        name=name,
        M=M,
        K=read(10, n, n),
        D=read(13, n, n) if 13 in groups else None,
        moments=moments,
        node_numbers=np.array([int(label) for label in labels]) if is_number else 1 + np.arange(n_nodes),
        nodes=nodes,
        Phi=Phi,
        rotations=rotations,
        geometric=geometric,
        program="MBDyn",
        provenance={
            "source": "MBDyn, FEM data of a modal joint",
            **{f"note {k + 1}": note for k, note in enumerate(notes)},
        },
    )


def stress_stiffening(path: Path, words: list[str], n_nodes: int, n: int) -> GeometricStiffness | None:
    """Return the matrices of record group 19: a count, then a number and entries of each; None if some are missing.

    1 to 6: omega_x², omega_y², omega_z², omega_x omega_y, omega_y omega_z, omega_z omega_x (products once: twice K_ab);
    7 to 9: angular acceleration; 10 to 12: acceleration minus gravity; then force and moment of each node.
    """
    where = f"{path}: record group 19"
    count = whole(path, words[0], where) if words else 0
    if count != 12 + 6 * n_nodes:
        return None
    if len(words) != 1 + count * (1 + n * n):
        raise ForeignBodyError(f"{where}: expected {1 + count * (1 + n * n)} numbers, got {len(words)}")
    try:
        values = np.array([float(word.replace("D", "E")) for word in words[1:]]).reshape(count, 1 + n * n)
    except ValueError as error:
        raise ForeignBodyError(f"{where}: {error}") from error
    if not np.array_equal(values[:, 0], np.arange(1, count + 1)):
        raise ForeignBodyError(f"{where}: expected the matrices in the order of their numbers 1 to {count}")
    K = values[:, 1:].reshape(count, n, n)
    half = np.array([1.0, 1, 1, 0.5, 0.5, 0.5])[:, None, None]
    return GeometricStiffness(
        translation=K[9:12], rotation=K[6:9], spin=K[:6] * half, interfaces=K[12:].reshape(n_nodes, 6, n, n)
    )


def groups_of(path: Path) -> dict[int, list[str]]:
    """Return the words of each record group of a file, without comments."""
    groups: dict[int, list[str]] = {}
    words: list[str] | None = None
    for line in path.read_text(encoding="ascii", errors="replace").splitlines():
        found = GROUP.match(line.strip())
        if found:
            number = int(found[1])
            if number in groups:
                raise ForeignBodyError(f"{path}: record group {number} is there twice")
            words = groups.setdefault(number, [])
        elif words is not None and not line.lstrip().startswith("**"):
            words += line.split()
    return groups


def whole(path: Path, word: str, where: str = "") -> int:
    """Return the integer that a word represents."""
    try:
        return int(word)
    except ValueError:
        where = where or f"{path}: record group 1"
        raise ForeignBodyError(f"{where}: expected a whole number, got {word!r}") from None


def moments_of_lumps(lumps: Array, nodes: Array, Phi: Array, rotations: Array, M: Array) -> Moments:
    """Return the moments of lumped masses (m, m, m, Jx, Jy, Jz at each node); M* is replaced by the modal mass.

    A moment of inertia J adds ∑_f E_ff a_f a_fᵀ with a_f = [0, e_f, theta × e_f] and E = ½ tr(J) 1 - J.
    """
    mass = lumps[:, :3].mean(axis=1)
    if not (np.abs(lumps[:, :3] - mass[:, None]) <= 1e-9 * np.abs(mass).max()).all():
        raise ForeignBodyError("record group 11: expected one mass in all three directions of each node")
    n_nodes, _, n = Phi.shape
    a = np.concatenate([np.ones((n_nodes, 1)), nodes, Phi.reshape(n_nodes, 3 * n)], axis=1)
    gram = a.T @ (mass[:, None] * a)
    E = lumps[:, 3:].sum(axis=1, keepdims=True) / 2 - lumps[:, 3:]
    for f in range(3):
        turned = np.cross(rotations, np.eye(3)[f], axisa=1).transpose(0, 2, 1)  # theta × e_f
        a = np.zeros((n_nodes, 4 + 3 * n))
        a[:, 1 + f], a[:, 4:] = 1.0, turned.reshape(n_nodes, 3 * n)
        gram += a.T @ (E[:, f, None] * a)
    moments = moments_in_frame(gram, BodyFrame("nodal", np.zeros(3)))
    S_kl = moments.S_kl + np.einsum("ab,kl->abkl", np.eye(3), M - moments.M) / 3
    return Moments(moments.m, moments.S, moments.R, moments.C1, moments.P, S_kl, is_exact=False)
