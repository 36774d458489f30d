"""Standard input data of flexible bodies (SID_FEM): every term of the equations of motion as a Taylor series in q."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.exchange.exporters.nodes import NodeList, all_nodes, interface_nodes
from cms.exchange.exporters.writer import Request, WrittenFiles
from fe_models.foundation.arrays import Array

__all__ = ["DIALECTS", "Dialect", "Taylor", "make_sid_fem", "terms_of"]

#: values of `structure`; unit (4) and one triangle (2) are not used, because readers interpret them differently
DIAGONAL, GENERAL, EMPTY = 1, 3, 0
LONGEST_COMMENT = 200  #: largest length of a comment; line buffers of readers differ
#: index pairs (a, b) of omega_a omega_b for the columns of Oe
SPIN_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True)
class Dialect:
    """Order of indices in the files of a group of programs."""

    words: str  #: text for the first line of the file
    column_last: bool  #: True: m1(row, q, column); False: m1(row, column, q)
    j_is_matrix: bool  #: True: J is (3, 3); False: (6, 1): xx, yy, zz, xy, xz, yz


DIALECTS = {
    "sid_fem": Dialect("m1=row,q,col J=6x1 Ge=3k+axis", True, False),
    "sid_fem-fembeam": Dialect("m1=row,col,q J=3x3 Ge=3k+axis", False, True),
}  #: dialect of each format


@dataclass(frozen=True, eq=False)
class Taylor:
    """Taylor series of a matrix, m0 + Σ_l q_l m1_l."""

    m0: Array  #: constant term, (n_row, n_col)
    #: linear terms, (n_row, n_col, n_q); empty for a series of order 0
    m1: Array = field(default_factory=lambda: np.zeros(0))


def make_sid_fem(request: Request, *, dialect: str) -> WrittenFiles:
    """Return the file; its nodes are the interfaces, unless the request includes all nodes."""
    body, order = request.body, DIALECTS[dialect]
    nodes = interface_nodes(body) if request.nodes != "all" else all_nodes(body)
    lines = list(lines_of(body, nodes, order))
    comment = "; ".join([order.words, *request.header()])[:LONGEST_COMMENT]
    first = f"{len(nodes.numbers):5d}{body.n_q:4d}  :{comment}"
    return WrittenFiles({request.path: ("\n".join([first, *lines]) + "\n").encode("ascii")}, nodes.notes())


def terms_of(body: ReducedBody) -> dict[str, Taylor]:
    """Return the terms by name, with J as a matrix.

    The equations of motion of the standard, in axes of B, where a is acceleration minus gravity, are

        m a + mdCM~ᵀ alpha + Ctᵀ q_ddot + ...                          mdCM = S + 1C q
        mdCM~ a + J alpha + Crᵀ q_ddot + Gr(q_dot) omega + ...         J = J0 + sum_l q_l (3C_l + 3C_lᵀ)
        Ct a + Cr alpha + Me q_ddot + Ge(q_dot) omega + Oe Omega + ...

    Ct_ka = 1C_ak + sum_l q_l K_t,a,kl; Cr_ka = 2C_ak + sum_l q_l (4C_kl,a + K_r,a,kl). Gr has three columns 2 (3C_k +
    sum_l q_l 5C_lk) for each k. Ge has 2 4C_kl,a in row k, column 3 l + a. Oe has -(D_k,ab + D_k,ba) + 2 K_ab q in row
    k, column ab (without the factor two on the diagonal), with D_k = 3C_k + sum_l q_l 5C_lk.
    """
    moments, n, K = body.moments, body.n_q, body.geometric
    C3, C4, C5 = moments.C3, moments.C4, moments.C5
    J1 = np.moveaxis(C3 + C3.transpose(0, 2, 1), 0, 2)
    Ct1 = np.zeros((n, 3, n)) if K is None else K.translation.transpose(1, 0, 2)
    Cr1 = C4.transpose(0, 2, 1) + (0 if K is None else K.rotation.transpose(1, 0, 2))
    Oe0, Oe1 = np.zeros((n, 6)), np.zeros((n, 6, n))
    D1 = C5.transpose(1, 2, 3, 0)  # [k, a, b, l] = 5C_lk,ab
    for column, (a, b) in enumerate(SPIN_PAIRS):
        pairs = [(a, b)] if a == b else [(a, b), (b, a)]
        Oe0[:, column] = -sum(C3[:, i, j] for i, j in pairs)
        Oe1[:, column] = -sum(D1[:, i, j] for i, j in pairs)
        if K is not None:  # columns xz and zx are equal
            Oe1[:, column] += len(pairs) * K.spin[column]
    return {
        "mdCM": Taylor(moments.S[:, None], moments.C1[:, None, :]),
        "J": Taylor(moments.J0, J1),
        "Ct": Taylor(moments.C1.T, Ct1),
        "Cr": Taylor(moments.C2.T, Cr1),
        "Me": Taylor(body.M),
        "Gr": Taylor(2 * C3.transpose(1, 0, 2).reshape(3, 3 * n), 2 * D1.transpose(1, 0, 2, 3).reshape(3, 3 * n, n)),
        "Ge": Taylor(2 * C4.reshape(n, 3 * n)),
        "Oe": Taylor(Oe0, Oe1),
        "ksigma": Taylor(np.zeros((n, 1))),
        "Ke": Taylor(body.K),
        "De": Taylor(body.D),
    }


def lines_of(body: ReducedBody, nodes: NodeList, order: Dialect) -> Iterator[str]:
    """Yield the lines after the first line."""
    yield " part"
    yield entry(6, "new modal", "")
    yield f"{'':11}refmod"
    yield entry(16, "mass", fortran(body.moments.m))
    yield entry(16, "nelastq", f"{body.n_q:4d}")
    for k, frequency in enumerate(body.frequencies / body.units.time):
        yield entry(16, f"ielastq ({k + 1:4d})", f"Eigen Mode {k + 1:4d} :{frequency:13.3f} Hz")
    yield f"{'':11}end refmod"
    yield f"{'':11}frame"
    for row in range(len(nodes.numbers)):
        yield entry(16, "new node", f"{nodes.numbers[row]:9d}")
        yield entry(21, "rframe", " body ref")
        for name, term in node_terms(body, nodes, row).items():
            yield from taylor_lines(21, name, term, body.n_q, order)
        yield f"{'':16}end node"
    yield f"{'':11}end frame"
    for name, term in terms_of(body).items():
        whole = as_column(term) if name == "J" and not order.j_is_matrix else term
        yield from taylor_lines(11, name, whole, body.n_q, order)
    yield f"{'':6}end modal"
    yield " end part"


def node_terms(body: ReducedBody, nodes: NodeList, row: int) -> dict[str, Taylor]:
    """Return the terms of a node; its axes are those of B.

    A force at an interface stiffens the body. Therefore the first-order terms of phi and psi are -K_i, the second-order
    displacement.
    """
    Phi, Psi = nodes.Phi[row], nodes.Psi[row]
    turned = np.array([np.cross(np.eye(3), Psi[:, k]) for k in range(body.n_q)])  # psi~: rows e_a × psi
    terms = {
        "origin": Taylor(nodes.positions[row][:, None], Phi[:, None, :]),
        "phi": Taylor(Phi),
        "psi": Taylor(Psi),
        "AP": Taylor(np.eye(3), np.moveaxis(turned.reshape(-1, 3, 3), 0, 2)),
    }
    at = [name for name, where in nodes.of_interface.items() if where == row]
    if body.geometric is not None and at:
        K = body.geometric.of_interface([each.name for each in body.interfaces].index(at[0]))
        terms["phi"], terms["psi"] = replace(terms["phi"], m1=-K[:3]), replace(terms["psi"], m1=-K[3:])
    return terms


def as_column(term: Taylor) -> Taylor:
    """Return a symmetric (3, 3) matrix as (6, 1): xx, yy, zz, xy, xz, yz."""
    a, b = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
    return Taylor(term.m0[a, b][:, None], term.m1[a, b][:, None, :])


def taylor_lines(indent: int, name: str, term: Taylor, n_q: int, order: Dialect) -> Iterator[str]:
    """Yield one Taylor series; zero entries are omitted, as is usual in the format."""
    n_row, n_col = term.m0.shape
    is_diagonal = not term.m1.size and n_row == n_col and not np.any(term.m0 - np.diag(np.diag(term.m0)))
    is_empty = not np.any(term.m0) and not np.any(term.m1)
    put = partial(entry, indent + 5)
    yield f"{'':{indent}}{name}"
    yield put("order", f"{int(term.m1.size > 0):4d}")
    yield put("nrow", f"{n_row:4d}")
    yield put("ncol", f"{n_col:4d}")
    yield put("nq", f"{n_q:4d}")
    yield put("nqn", f"{0:4d}")
    yield put("structure", f"{EMPTY if is_empty else DIAGONAL if is_diagonal else GENERAL:4d}")
    for i, j in np.argwhere(term.m0):
        yield put(f"m0({i + 1:2d},{j + 1:2d})", fortran(term.m0[i, j]))
    if term.m1.size:
        for i, j, k in np.argwhere(term.m1):
            at = (i, k, j) if order.column_last else (i, j, k)
            yield put(f"m1({at[0] + 1:2d},{at[1] + 1:2d},{at[2] + 1:2d})", fortran(term.m1[i, j, k]))
    yield f"{'':{indent}}end {name}"


def entry(indent: int, name: str, value: str) -> str:
    """Return a line 'name = value' with the equals sign in column 49."""
    return f"{'':{indent}}{name:{48 - indent}}={value}"


def fortran(value: float) -> str:
    """Return a number in full precision, with the exponent letter of Fortran's double precision."""
    return f"{value:24.16e}".replace("e", "D")
