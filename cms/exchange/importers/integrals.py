"""Moments of a body from the invariants in files of other programs: P from 3C, S_kl from 4C and 5C (theory.md §5)."""

import numpy as np

from cms.body.invariants import INERTIA_TERMS, Moments
from cms.errors import ForeignBodyError
from fe_models.foundation.arrays import Array

__all__ = ["moments_of_invariants"]

EPSILON = np.cross(np.eye(3)[:, None], np.eye(3)[None])  #: (a × b)_c = EPSILON_abc a_a b_b, (3, 3, 3)
CONSISTENT = 1e-6  #: relative difference between two values of one invariant, up to which it is rounding in the file
ROUGH = 0.1  #: relative difference up to which the value from the mass matrix is used, with a note


def moments_of_invariants(
    where: str,
    m: float,
    S: Array,
    J0: Array,
    C1: Array,
    C2: Array,
    M: Array,
    *,
    C3: Array | None = None,
    C4: Array | None = None,
    C5: Array | None = None,
) -> tuple[Moments, tuple[str, ...]]:
    """Return the moments in a file, and notes on data that the file contains twice.

    (1) R = ½ tr(J0) 1 - J0
    (2) P_k = ½ tr(3C_k) 1 - 3C_kᵀ, its antisymmetric part from 2C
    (3) S_ab,kl: trace from the modal mass, the part antisymmetric in a, b from 4C, the rest from 5C,
        S_lk = M_kl 1 - 5C_kl; the antisymmetric part of 5C_kl is tilde(4C_kl) / 2
    (4) an argument of None marks the term as missing

    Parameters
    ----------
    C1, C2
        Invariants 1C and 2C, (3, n_q) each.
    M
        Modal mass, (n_q, n_q).
    C3, C4, C5
        Invariants 3C, 4C and 5C, (n_q, 3, 3), (n_q, n_q, 3) and (n_q, n_q, 3, 3).

    Raises
    ------
    ForeignBodyError
        If two values of one quantity differ by more than a lumped mass explains.
    """
    n = M.shape[0]
    notes: list[str] = []
    given = {"3C": C3, "4C": C4, "5C": C5}
    for name, shape in {"3C": (n, 3, 3), "4C": (n, n, 3), "5C": (n, n, 3, 3)}.items():
        value = given[name]
        if value is not None and value.shape != shape:
            raise ForeignBodyError(f"{where}: {name}: expected shape {shape}, got {value.shape}")
    P = np.einsum("abc,ck->abk", EPSILON, C2) / 2
    if C3 is not None:  # step (2)
        trace = np.trace(C3, axis1=1, axis2=2) / 2
        whole = np.moveaxis(trace[:, None, None] * np.eye(3) - C3.transpose(0, 2, 1), 0, 2)
        turning = (whole - whole.swapaxes(0, 1)) / 2
        compare(where, notes, "2C and the antisymmetric part of 3C", turning, P, np.abs(whole).max(initial=0.0))
        P = P + (whole + whole.swapaxes(0, 1)) / 2
    S_kl = np.einsum("ab,kl->abkl", np.eye(3), M) / 3  # step (3)
    size = np.abs(M).max(initial=0.0)
    if C4 is not None:
        S_kl -= np.einsum("abc,klc->abkl", EPSILON, C4) / 2
    if C5 is not None:
        if C4 is None:
            raise ForeignBodyError(f"{where}: the file has 5C but not 4C, which is a part of it")
        of_C5 = np.trace(C5, axis1=2, axis2=3) / 2
        compare(where, notes, "the modal mass and the trace of 5C", of_C5, M, size)
        turning = -np.einsum("abc,klc->klab", EPSILON, C4) / 2
        compare(where, notes, "4C and the antisymmetric part of 5C", (C5 - C5.swapaxes(2, 3)) / 2, turning, size)
        lk = of_C5[:, :, None, None] * np.eye(3) - C5  # [k, l, a, b] = S_ab,lk
        even = np.moveaxis((lk + lk.swapaxes(2, 3)) / 2, (0, 1, 2, 3), (3, 2, 0, 1))
        S_kl += even - np.einsum("ab,kl->abkl", np.eye(3), np.einsum("aakl->kl", even)) / 3
    missing = tuple(name for name in INERTIA_TERMS if given[name] is None)
    R = np.trace(J0) / 2 * np.eye(3) - J0
    moments = Moments(m=m, S=S, R=(R + R.T) / 2, C1=C1, P=P, S_kl=symmetric(S_kl), is_exact=not notes, missing=missing)
    return moments, tuple(notes)


def symmetric(S_kl: Array) -> Array:
    """Return S_kl symmetrised to S_ba,lk = S_ab,kl, which holds up to rounding in the file."""
    return np.asarray((S_kl + S_kl.transpose(1, 0, 3, 2)) / 2)


def compare(where: str, notes: list[str], what: str, found: Array, expected: Array, size: float) -> None:
    """Compare two values: note differences beyond rounding, raise `ForeignBodyError` if beyond effects of lumping."""
    defect = float(np.abs(found - expected).max(initial=0.0))
    if not defect <= ROUGH * size:
        raise ForeignBodyError(
            f"{where}: {what} differ by {defect / size if size else np.inf:.1e}: expected equal values; the "
            "order of indices or a sign is different, or the file mixes two models"
        )
    if defect > CONSISTENT * size:
        notes.append(
            f"{what} differ by {defect / size:.1e}: one is from lumped, one from consistent masses; the first is used"
        )
