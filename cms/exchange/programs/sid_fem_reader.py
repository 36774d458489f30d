"""Standard input data of flexible bodies (SID_FEM): text of Taylor series, in the index orders that programs write."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cms.body.geometric_stiffness import GeometricStiffness
from cms.errors import ForeignBodyError
from cms.exchange.importers.integrals import moments_of_invariants
from cms.exchange.importers.modal_body import ForeignInterface, ModalBody
from fe_models.foundation.arrays import Array

__all__ = ["Taylor", "is_sid_fem", "read_sid_fem", "read_sid_fem_fembeam", "series_of"]

TERMS = ("mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De")
NODE_TERMS = ("origin", "phi", "psi", "AP", "sigma")
LARGEST = 50_000_000  #: largest number of entries of a series that is read
SAME = 1e-6  #: relative difference between two values of one quantity, up to which it is rounding in the file
#: index pairs (a, b) of omega_a omega_b for the columns of Oe
SPIN_COLUMNS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
DIAGONAL, SYMMETRIC, UNIT = 1, 2, 4  #: values of `structure`


@dataclass
class Taylor:
    """Taylor series in the file: sizes, and entries by their indices."""

    line: int
    sizes: dict[str, int] = field(default_factory=dict)  #: values of order, nrow, ncol, nq, nqn, structure
    m0: dict[tuple[int, int], float] = field(default_factory=dict)
    m1: dict[tuple[int, int, int], float] = field(default_factory=dict)


def is_sid_fem(path: Path, head: bytes) -> bool:
    """Return whether a file is text that begins a part with a modal section."""
    text = head.decode("ascii", "replace")
    return bool(re.match(r"\s*\d+\s*\d+", text)) and "part" in text and "new modal" in text


def read_sid_fem(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> ModalBody:
    """Read standard input data; the indices show whether the order is m1(row, q, column) or m1(row, column, q).

    Raises
    ------
    ForeignBodyError
        If the text is truncated, sizes and indices do not fit, the index order cannot be determined, or the terms do
        not belong to one body.
    """
    return read_in_order(files, name, None)


def read_sid_fem_fembeam(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> ModalBody:
    """Read standard input data in the index order m1(row, column, q); errors as in `read_sid_fem`."""
    return read_in_order(files, name, False)


def read_in_order(files: Sequence[Path], name: str, q_second: bool | None) -> ModalBody:
    """Read a file in a given index order.

    (1) mass, mdCM0 = S, Ct0 = 1Cᵀ, Cr0 = 2Cᵀ, J0, Me, Ke, De
    (2) 3C: its symmetric part is J1_k / 2, or follows from Gr0 = [2 3C_k]
    (3) 4C from Ge0 = [2 4C_kl,a]; the part of Cr1 antisymmetric in k, l shows whether its column is 3 l + a or a n + l
    (4) 5C from Gr1 = [2 5C_lk]; if Gr has order 0, 5C is missing, because Oe1 only has its sum with geometric stiffness
    """
    path = files[0]
    if len(files) > 1:
        raise ForeignBodyError(f"{path}: expected one file of standard input data, got {len(files)}")
    text = path.read_text(encoding="latin-1").splitlines()
    header, terms, nodes, mass = series_of(path, text)
    n = terms["Me"].sizes.get("nrow", 0) if "Me" in terms else 0
    if not n or mass is None:
        raise ForeignBodyError(
            f"{path}: expected a mass and the series Me with its rows; the file has no flexible body"
        )
    found = order_of(path, [*terms.values(), *(term for node in nodes.values() for term in node.values())], n, text[0])
    if q_second is None:
        q_second = found
    elif found is not None and found != q_second:
        raise ForeignBodyError(f"{path}: is in index order m1(row, q, column), not m1(row, column, q)")
    if q_second is None:
        raise ForeignBodyError(
            f"{path}: its indices fit both m1(row, q, column) and m1(row, column, q); name the order: --format "
            "sid_fem-fembeam for the second, or write m1=row,q,col on the first line"
        )
    second = q_second

    def m0(key: str, *shape: int) -> Array:
        return values_of(path, key, terms, 0, shape, second)

    def m1(key: str, *shape: int) -> Array | None:
        if key not in terms or terms[key].sizes.get("order", 0) < 1:
            return None
        return values_of(path, key, terms, 1, (*shape, n), second)

    notes = [f"index order of the file: m1({'row, q, column' if second else 'row, column, q'})"]
    M, C1, C2 = m0("Me", n, n), m0("Ct", n, 3).T, m0("Cr", n, 3).T  # step (1)
    is_column = terms["J"].sizes.get("ncol") == 1 if "J" in terms else False
    J0 = square(m0("J", 6, 1)[:, 0]) if is_column else m0("J", 3, 3)
    J1 = m1("J", 6, 1) if is_column else m1("J", 3, 3)
    C3 = None  # step (2)
    even = None if J1 is None else (square(J1[:, 0]) if is_column else J1) / 2
    if even is None and "Gr" in terms:
        C3 = m0("Gr", 3, 3 * n).reshape(3, n, 3).transpose(1, 0, 2) / 2
        even = np.moveaxis((C3 + C3.transpose(0, 2, 1)) / 2, 0, 2)
    if even is not None:
        odd = np.einsum("abc,ck->kab", np.cross(np.eye(3)[:, None], np.eye(3)[None]), C2) / 2  # -2C~ / 2
        C3 = np.moveaxis(even, 2, 0) + odd
    C4 = gyroscopic(path, m0("Ge", n, 3 * n) / 2 if "Ge" in terms else None, m1("Cr", n, 3), notes)  # (3)
    Gr1 = m1("Gr", 3, 3 * n)  # (4)
    C5 = None if Gr1 is None or not Gr1.any() else Gr1.reshape(3, n, 3, n).transpose(3, 1, 0, 2) / 2
    if C5 is None:
        notes.append("5C is not in the file (Gr has no first order)")
    moments, found_notes = moments_of_invariants(
        str(path), mass, m0("mdCM", 3, 1)[:, 0], J0, C1, C2, M, C3=C3, C4=C4, C5=C5 if C4 is not None else None
    )
    numbers = np.array(sorted(nodes), dtype=np.int64)
    sizes = {"origin": 1, "phi": n, "psi": n}
    node_values = [
        [values_of(path, key, nodes[int(k)], 0, (3, size), second) for key, size in sizes.items()] for k in numbers
    ]
    geometric = None
    if C5 is not None:
        node_m1 = [
            np.concatenate([
                values_of(path, key, nodes[int(k)], 1, (3, n, n), second)
                if nodes[int(k)][key].sizes.get("order", 0) > 0 else np.zeros((3, n, n))
                for key in ("phi", "psi")
            ])
            for k in numbers
        ]  # fmt: skip
        geometric = stiffening_of(m1("Ct", n, 3), m1("Cr", n, 3), m1("Oe", n, 6), C5, node_m1)
    return ModalBody(
        name=name,
        M=M,
        K=m0("Ke", n, n),
        D=m0("De", n, n) if "De" in terms else None,
        moments=moments,
        node_numbers=numbers,
        nodes=np.array([each[0][:, 0] for each in node_values]).reshape(-1, 3),
        Phi=np.array([each[1] for each in node_values]).reshape(-1, 3, n),
        rotations=np.array([each[2] for each in node_values]).reshape(-1, 3, n),
        interfaces=tuple(ForeignInterface(f"node {k}", np.array([k])) for k in numbers) if len(numbers) <= 12 else (),
        geometric=geometric,
        program="SID_FEM",
        provenance={
            "source": "standard input data (SID_FEM)",
            "comment of the file": header[:200],
            **{f"note {k + 1}": note for k, note in enumerate([*notes, *found_notes])},
        },
    )


def stiffening_of(
    Ct1: Array | None, Cr1: Array | None, Oe1: Array | None, C5: Array, nodes: list[Array]
) -> GeometricStiffness | None:
    """Return the geometric stiffness from first-order terms; None if there are none.

    Ct1_ka,l = K_t,a,kl; the part of Cr1_ka,l symmetric in k, l is K_r,a,kl;
    Oe1_k,ab,l = -(5C_lk,ab + 5C_lk,ba) + 2 K_ab,kl, on the diagonal half of it; phi1, psi1 of a node: -K_i.
    """
    n = len(C5)
    zero = np.zeros((n, 3, n))
    K_t = (zero if Ct1 is None else Ct1).transpose(1, 0, 2)
    Cr1 = zero if Cr1 is None else Cr1
    K_r = ((Cr1 + Cr1.transpose(2, 1, 0)) / 2).transpose(1, 0, 2)
    spin = np.zeros((6, n, n))
    for column, (a, b) in enumerate(SPIN_COLUMNS):
        pairs = [(a, b)] if a == b else [(a, b), (b, a)]
        inertia = sum(C5[:, :, i, j].T for i, j in pairs)  # [k, l] = 5C_lk,ij
        spin[column] = ((0 if Oe1 is None else Oe1[:, column]) + inertia) / len(pairs)
    interfaces = -np.array(nodes).reshape(-1, 6, n, n)
    parts = (K_t, K_r, interfaces)
    size = np.abs(C5).max(initial=0.0)
    if not any(part.any() for part in parts) and np.abs(spin).max(initial=0.0) <= SAME * size:
        return None
    even = [(part + part.swapaxes(-1, -2)) / 2 for part in (K_t, K_r, spin, interfaces)]
    return GeometricStiffness(translation=even[0], rotation=even[1], spin=even[2], interfaces=even[3])


def gyroscopic(path: Path, Ge: Array | None, Cr1: Array | None, notes: list[str]) -> Array | None:
    """Return 4C from Ge; the part of Cr1 antisymmetric in two modes decides the order of columns."""
    of_Cr = None
    if Cr1 is not None:  # Cr1_ka,l = 4C_kl,a + symmetric
        of_Cr = ((Cr1 - Cr1.transpose(2, 1, 0)) / 2).transpose(0, 2, 1)
    if Ge is None:
        return of_Cr
    n = len(Ge)
    orders = {"3k+axis": Ge.reshape(n, n, 3), "axis*n+k": Ge.reshape(n, 3, n).transpose(0, 2, 1)}
    size = np.abs(Ge).max(initial=0.0)
    antisymmetric = [k for k, x in orders.items() if np.abs(x + x.transpose(1, 0, 2)).max(initial=0.0) <= SAME * size]
    if of_Cr is not None and of_Cr.any():
        antisymmetric = [k for k in orders if np.abs(orders[k] - of_Cr).max() <= SAME * max(size, np.abs(of_Cr).max())]
    if not size:
        antisymmetric = ["3k+axis"]
    if not antisymmetric:
        raise ForeignBodyError(
            f"{path}: Ge fits neither order of its columns (3 k + axis, axis n + k): it does not belong to the modes "
            "of Cr; the file mixes two models, or m1 is in another index order"
        )
    if len(antisymmetric) > 1 and n > 1 and np.abs(orders["3k+axis"] - orders["axis*n+k"]).max() > SAME * size:
        raise ForeignBodyError(f"{path}: the order of the columns of Ge is unknown; Cr of first order would show it")
    notes.append(f"columns of Ge in the file: {antisymmetric[0]}")
    return orders[antisymmetric[0]]


def series_of(path: Path, text: list[str]) -> tuple[str, dict[str, Taylor], dict[int, dict[str, Taylor]], float | None]:
    """Return comment of the first line, series of the body, series of each node, and mass."""
    header = text[0].partition(":")[2].strip() if text else ""
    terms: dict[str, Taylor] = {}
    nodes: dict[int, dict[str, Taylor]] = {}
    node: dict[str, Taylor] | None = None
    current: Taylor | None = None
    name, mass, is_closed = "", None, False
    for number, line in enumerate(text[1:], start=2):
        words = line.strip()
        where = f"{path}, line {number}"
        if not words:
            continue
        if words.startswith("end "):
            ended = words.split()[1]
            if current is not None and ended == name:
                current = None
            elif ended == "node":
                node = None
            is_closed = is_closed or ended == "modal"
            continue
        key, mark, value = (part.strip() for part in words.partition("="))
        if current is not None:
            if not mark:
                raise ForeignBodyError(f"{where}: expected an entry of {name}, got {words[:60]!r}")
            put(where, current, key, value)
        elif key == "new node":
            node = nodes.setdefault(whole(where, value), {})
        elif key == "mass" and mark:
            mass = real(where, value)
        elif key in (*TERMS, *NODE_TERMS) and not mark:
            name, current = key, Taylor(number)
            (terms if node is None else node)[name] = current
    if current is not None or not is_closed:
        raise ForeignBodyError(f"{path}: ends within {name if current else 'the modal section'}; it is truncated")
    return header, terms, nodes, mass


def put(where: str, term: Taylor, key: str, value: str) -> None:
    """Store an entry of a series: a size, m0(i, j) or m1(i, j, k)."""
    found = re.fullmatch(r"m([01n])\s*\(([\s\d,]+)\)", key)
    if found is None:
        term.sizes[key] = whole(where, value)
        return
    index = tuple(int(word) - 1 for word in found[2].split(","))
    if min(index) < 0 or len(index) != (2 if found[1] == "0" else 3):
        raise ForeignBodyError(f"{where}: expected {'two' if found[1] == '0' else 'three'} indices from 1, got {key!r}")
    if found[1] == "0":
        term.m0[index[0], index[1]] = real(where, value)
    elif found[1] == "1":
        term.m1[index[0], index[1], index[2]] = real(where, value)


def order_of(path: Path, terms: list[Taylor], n: int, first: str) -> bool | None:
    """Return whether m1 has the order (row, q, column), from indices that fit only one order and the first line."""
    q_second = any(entry[1] >= term.sizes.get("ncol", 0) for term in terms for entry in term.m1)
    q_third = any(entry[2] >= term.sizes.get("ncol", 0) for term in terms for entry in term.m1)
    if q_second and q_third:
        raise ForeignBodyError(f"{path}: indices of m1 fit neither (row, q, column) nor (row, column, q) in all series")
    if q_second or q_third:
        return q_second
    said = re.search(r"m1\s*=\s*row,\s*(q,\s*col|col\w*,\s*q)", first)
    if said:
        return said[1].startswith("q")
    if n == 1 or not any(term.m1 for term in terms):
        return True  # one index is always 1, so both orders agree, or there are no first-order terms
    return None


def values_of(
    path: Path, key: str, terms: Mapping[str, Taylor], order: int, shape: tuple[int, ...], q_second: bool
) -> Array:
    """Return m0, (nrow, ncol), or m1, (nrow, ncol, nq), of a series; missing entries are zero."""
    if key not in terms:
        raise ForeignBodyError(f"{path}: the series {key} is missing")
    term = terms[key]
    rows, columns = term.sizes.get("nrow", 0), term.sizes.get("ncol", 0)
    where = f"{path}, line {term.line}: {key}"
    if (rows, columns) != shape[:2]:
        raise ForeignBodyError(f"{where}: expected {shape[0]} x {shape[1]}, got {rows} x {columns}")
    if int(np.prod(shape)) > LARGEST:
        raise ForeignBodyError(f"{where}: {shape} numbers are too many for a flexible body")
    values = np.zeros(shape)
    structure = term.sizes.get("structure", 3)
    if order == 0 and structure == UNIT:
        return np.eye(rows, columns)
    entries = term.m0.items() if order == 0 else term.m1.items()
    for index, value in entries:
        at = (index[0], *index[:0:-1]) if order and q_second else index
        if any(i >= size for i, size in zip(at, shape, strict=True)):
            raise ForeignBodyError(f"{where}: m{order}{tuple(i + 1 for i in index)} is outside its sizes {shape}")
        values[at] = value
        if structure == SYMMETRIC:
            values[(at[1], at[0], *at[2:])] = value
        elif structure == DIAGONAL and at[0] != at[1]:
            raise ForeignBodyError(f"{where}: an entry beside the diagonal of a diagonal series")
    return values


def square(column: Array) -> Array:
    """Return the matrix, (3, 3, ...), with tensor components xx, yy, zz, xy, xz, yz, (6, ...)."""
    xx, yy, zz, xy, xz, yz = column
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def whole(where: str, word: str) -> int:
    """Return the integer that a word represents."""
    try:
        return int(word)
    except ValueError:
        raise ForeignBodyError(f"{where}: expected a whole number, got {word[:40]!r}") from None


def real(where: str, word: str) -> float:
    """Return the number that a word with exponent letter E or D represents."""
    try:
        return float(word.replace("D", "E").replace("d", "e"))
    except ValueError:
        raise ForeignBodyError(f"{where}: expected a number, got {word[:40]!r}") from None
