"""MBDyn's modal joint: the .fem file with masses, nodal modes, invariants and stress stiffening."""

from collections.abc import Iterable, Iterator

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.exchange.exporters.nodes import NodeList, all_nodes, interface_nodes
from cms.exchange.exporters.writer import Made, Request
from fe_models.foundation.arrays import Array

__all__ = ["make_mbdyn"]


def make_mbdyn(request: Request) -> Made:
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
            f"record group 19 counts on all {len(body.interfaces)} interfaces in the modal joint, in this order: "
            f"{names}; it needs `use automatic differentiation`",
        )
    return Made({request.path: text.encode("ascii")}, notes)


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
        matrices = stress_stiffening(body)
        yield from group(19, "MODAL STRESS STIFFENING MATRIX")
        yield str(len(matrices))
        for index, K in enumerate(matrices):
            yield str(index + 1)
            yield from rows(K)
    yield "**"
    yield "** END OF FILE"


def stress_stiffening(body: ReducedBody) -> Array:
    """Return the matrices of record group 19 in their order, (12 + 6 n_interfaces, n_q, n_q)."""
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
    """Yield the rows of a matrix in full precision."""
    for row in np.asarray(matrix).tolist():
        yield " ".join(f"{value:.17e}" for value in row)
