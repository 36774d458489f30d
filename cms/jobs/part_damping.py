"""Damping of the parts of a body such that the joined body keeps the damping ratios of its modes.

Ratios need D = M Phi diag(2 zeta omega) Phiᵀ M, which couples nodes of different parts. A part can only damp its own
strain. Phi_p are the modes of the whole body in part p. The matrices H_p = Lambda^-1/2 Phi_pᵀ K_p Phi_p Lambda^-1/2 of
all parts add up to 1. With H_p = R_pᵀ R_p, the columns of S_p = Phi_p Lambda^-1/2 R_p⁺ are strain patterns of unit
energy, and

    D_p = beta K_p + K_p S_p (Y_p - beta) S_pᵀ K_p
    phi_iᵀ D phi_j = omega_i omega_j (Σ_p R_pᵀ Y_p R_p)_ij,    wanted: diag(c), c_k = 2 zeta_k / omega_k

Symmetric matrices Y_p with eigenvalues from beta to `MOST` max(c) are sought such that (Σ_p R_pᵀ Y_p R_p)_kk = c_k.
Strain of a part outside the patterns is damped by beta, half of the smallest c.

(1) condense each part to its cuts and its lowest modes with fixed cuts (Craig-Bampton), and join the parts
(2) compute the modes of the joined body, fixed where its nodal frame is attached, and their required ratios
(3) H_p and R_p
(4) start from Y_p = Z Zᵀ, Z = R_p⁺ᵀ diag(sqrt(c)) R_pᵀ. It is exact in all terms i, j, but can be large where the
    strains of modes are similar in a part; clip its eigenvalues to the bounds
(5) fit the terms i = j with accelerated projected gradients
(6) if there is no solution, the strains of some modes are too similar in all parts: omit the highest mode and continue
    from the best Y_p so far
(7) compute the ratios of the joined body from its complex eigenvalues with all its coordinates
(8) damping couples these modes with higher ones, which lowers their ratios by up to a few percent: correct c, fit again

Because of the bound, the strain of no part is damped more than `MOST` times as much as the mode with the largest c
needs. Without the bound, the solution damps the higher modes so strongly that they restrain the lower ones and change
their ratios.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from cms.modes.families.families import Families
from cms.reduction.basis.node_results import reference_motion
from cms.reduction.basis.strain_damping import StrainDamping
from fe_models.body.fe_body import MULTIPLIER, FEBody, Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.split import cut_name

__all__ = ["ModeInParts", "PartsDamping", "damping_of_parts"]

BAND = 6.0  #: modes keep their damping ratios up to this multiple of the first frequency of the whole body
FEWEST_MODES, MOST_MODES = 6, 12  #: smallest and largest number of modes that keep their damping ratios
PAIR = 1.01  #: frequency ratio below which modes form a pair, such as the bending modes of a square section
FIXED_MODES = 30  #: number of fixed-cut modes of each part
MOST = 2.0  #: largest strain damping of a part, divided by the largest that a mode needs
LEAST = 0.5  #: strain damping outside the patterns, divided by the smallest that a mode needs
EXACT = 1e-4  #: largest relative error of a modal damping
ROUNDS = 6  #: largest number of corrections by the ratios of the joined body
STEPS = 3000  #: largest number of gradient steps
PATIENCE = 300  #: number of gradient steps in which the error must fall by a tenth
SMALL = 0.01  #: damping of a mode divided by the largest one; below it, errors are relative to this threshold
N_RIGID = 6  #: number of interface dofs that can support a frame
SAME_MOTION = 1e-8  #: momentum of a rigid-body motion divided by that of others, below which it is dependent
SAME_STRAIN = 1e-10  #: energy share of a strain pattern in a part divided by the largest; below it, it is dropped
NO_MASS = 1e-12  #: 1/omega² of a mode divided by the largest one, below which the mode has no mass


@dataclass(frozen=True)
class ModeInParts:
    """Mode of the whole body, and its damping in the joined parts."""

    frequency: float  #: undamped frequency of the joined parts [1/time]
    wanted: float  #: damping ratio that the job requires
    ratio: float  #: damping ratio of the joined parts


@dataclass(frozen=True)
class PartsDamping:
    """Damping of each part, and the 6 to 12 modes up to `BAND` times the first frequency."""

    parts: tuple[StrainDamping, ...]
    modes: tuple[ModeInParts, ...]
    n_exact: int  #: number of lowest modes with exact damping phi_kᵀ D phi_k
    held: str | None  #: interface that is fixed in the modes; None: the modes are free


@dataclass(frozen=True, eq=False)
class JoinedParts:
    """Parts condensed to their cuts and fixed-cut modes, then joined."""

    columns: tuple[Array, ...]  #: displacement columns of each part, (n_dof, n_p)
    stiffness: tuple[Array, ...]  #: stiffness of each part over its columns, (n_p, n_p)
    follows: tuple[Array, ...]  #: columns of each part in coordinates of the joined body, (n_p, n)
    M: Array  #: mass of the joined body, (n, n)
    K: Array  #: stiffness of the joined body, (n, n)
    momenta: Array  #: M times the rigid-body motions, (n, 6); (n, 0) if the body is fixed

    def shares(self, p: int, omega: Array, Phi: Array) -> Array:
        """Return the matrix H_p of modes, (k, k); its diagonal is the strain energy share of part p in each mode."""
        phi = self.follows[p] @ Phi / omega
        return np.asarray(phi.T @ self.stiffness[p] @ phi)


def damping_of_parts(
    bodies: Sequence[FEBody],
    ratios: Callable[[Array], Array],
    *,
    held: str | None = None,
    solver: str | None = None,
) -> PartsDamping | None:
    """Return the damping of the parts of a body, or None if all ratios are zero.

    Parameters
    ----------
    bodies
        Coupled parts; cut k is an interface of parts k and k + 1.
    ratios
        Function that returns the damping ratios of modes from their ω² [1/time²].
    held
        Interface to which the frame of the whole body is attached. If it is None or has more than six dofs, free modes
        are used.
    solver
        Name of the solver.
    """
    at = [interface for body in bodies for interface in body.interfaces if interface.name == held]
    if not at or len(dofs_of(at[0])) > N_RIGID:
        held = None
    joined = joined_parts(bodies, held, solver)  # (1)
    omega, Phi = modes_of(joined)  # (2)
    n = min(max(int(np.count_nonzero(omega <= BAND * omega[0])), FEWEST_MODES), MOST_MODES, len(omega))
    while n < len(omega) and omega[n] < PAIR * omega[n - 1]:
        n += 1
    c = 2 * ratios(omega**2)[:n] / omega[:n]
    if not c.any():
        return None
    R = [root(joined.shares(p, omega[:n], Phi[:, :n])) for p in range(len(bodies))]  # (3)
    X = [T @ (Phi[:, :n] / omega[:n]) @ la.pinv(r) for T, r in zip(joined.follows, R, strict=True)]  # S_p
    G = [x.T @ k @ (T @ Phi) for x, k, T in zip(X, joined.stiffness, joined.follows, strict=True)]

    def ratios_with(Y: Sequence[Array]) -> Array:  # (7)
        D = least * np.diag(omega**2) + sum(g.T @ (y - least * np.eye(len(y))) @ g for g, y in zip(G, Y, strict=True))
        return complex_ratios(omega, D, n)

    least, most = LEAST * float(c.min()), MOST * float(c.max())
    Y, n_exact = [clipped(y, least, most) for y in exact_start(R, c)], n + 1  # (4)
    error = np.inf
    while error > EXACT and n_exact > 1:
        n_exact -= 1  # (6)
        Y, error = fitted(R, c, Y, n_exact, least, most)  # (5)
    wanted, found, target = c * omega[:n] / 2, ratios_with(Y), c
    for _ in range(ROUNDS):  # (8)
        target = np.where(np.arange(n) < n_exact, target * wanted / np.maximum(found, wanted / 2), target)
        better, _ = fitted(R, target, Y, n_exact, least, most)
        ratio = ratios_with(better)
        if worst(ratio, wanted, n_exact) >= worst(found, wanted, n_exact):
            break
        Y, found = better, ratio
    parts = []
    for body, columns, x, y in zip(bodies, joined.columns, X, Y, strict=True):
        d, Z = la.eigh(y)
        parts.append(StrainDamping.of_body(body, least, np.maximum(d - least, 0.0), body.K @ (columns @ (x @ Z))))
    modes = tuple(
        ModeInParts(float(w / (2 * np.pi)), float(a), float(b))
        for w, a, b in zip(omega[:n], wanted, found, strict=True)
    )
    return PartsDamping(tuple(parts), modes, n_exact, held)


def worst(found: Array, wanted: Array, n: int) -> float:
    """Return the largest relative error of the first n damping ratios."""
    return float(np.abs(found[:n] - wanted[:n]).max() / wanted[:n].max())


def joined_parts(bodies: Sequence[FEBody], held: str | None, solver: str | None) -> JoinedParts:
    """Condense each part to its cuts, fixed interface and fixed-cut modes, and join the parts at the cuts.

    The coordinates of the joined body are a basis of the motions in which the reference points at each cut move
    together and the fixed interface does not move.
    """
    center = np.mean([body.nodes.mean(axis=0) for body in bodies], axis=0)
    columns, stiffness, masses, rigid, omega2 = [], [], [], [], []
    at: dict[str, list[tuple[int, Array]]] = {}  # for each interface, the parts and the motions of their columns
    for p, body in enumerate(bodies):
        wanted = {cut_name(p), cut_name(p + 1), held}
        part = replace(
            body, interfaces=tuple(each for each in body.interfaces if each.name in wanted), load_cases=()
        )  # nodes of other interfaces become ordinary nodes
        with Families(part, announce=False, solver=solver) as families:
            fixed = families.fixed_modes(min(FIXED_MODES, n_fixed_modes(part, families.h)))
            V = np.hstack([families.Psi_C, fixed.Phi])
            motion = np.zeros((V.shape[1], 6))
            motion[: len(families.h)] = rigid_motion_of_dofs(part.nodes, part.dofs[families.h], center)
        columns.append(V)
        rigid.append(motion)
        stiffness.append(V.T @ (part.K @ V))
        masses.append(V.T @ (part.M @ V))
        omega2 += fixed.omega2.tolist()
        for each in part.interfaces:
            at.setdefault(each.name, []).append((p, reference_motion(part, each)[0] @ V))
    M, K, x_rigid = la.block_diag(*masses), la.block_diag(*stiffness), np.concatenate(rigid)
    s = 1 / np.sqrt(np.maximum(K.diagonal(), 0.0) + min(omega2) * M.diagonal())
    first = np.cumsum([0, *(V.shape[1] for V in columns)])
    conditions = []
    for motions in at.values():
        rows = np.zeros((6, len(s)))
        for sign, (p, motion) in zip((1, -1), motions, strict=False):
            rows[:, first[p] : first[p + 1]] = sign * motion
        rows *= s
        size = np.linalg.norm(rows, axis=1)
        conditions.append(rows[size > 0] / size[size > 0, None])
    T = s[:, None] * la.null_space(np.concatenate(conditions))
    momenta = T.T @ (M @ x_rigid) if held is None else np.zeros((T.shape[1], 0))
    return JoinedParts(
        tuple(columns), tuple(stiffness), tuple(np.split(T, first[1:-1])), T.T @ M @ T, T.T @ K @ T, momenta
    )


def modes_of(joined: JoinedParts) -> tuple[Array, Array]:
    """Return omega, ascending, (k,), and shapes with Phiᵀ M Phi = 1, (n, k), for elastic modes with mass.

    They are found among the motions without momentum.
    """
    Q = np.eye(len(joined.K))
    size = np.linalg.norm(joined.momenta, axis=0)
    if size.any():
        U, singular, _ = la.svd(joined.momenta[:, size > 0] / size[size > 0])
        Q = U[:, np.count_nonzero(singular > SAME_MOTION * singular[0]) :]
    inverse, X = la.eigh(Q.T @ joined.M @ Q, Q.T @ joined.K @ Q)  # 1 / omega²
    inverse, X = inverse[::-1], X[:, ::-1]
    has_mass = inverse > NO_MASS * inverse[0]
    return 1 / np.sqrt(inverse[has_mass]), Q @ X[:, has_mass] / np.sqrt(inverse[has_mass])


def dofs_of(interface: Interface) -> IntArray:
    """Return the boundary dofs of an interface of a coupled body."""
    return np.zeros(0, np.int64) if interface.dofs is None else interface.dofs


def n_fixed_modes(body: FEBody, h: IntArray) -> int:
    """Return the number of modes with mass if the dofs h are fixed; only an upper bound if many dofs have mass."""
    i = np.setdiff1d(np.arange(body.n_dof), h)
    n = len(i) - 2 * int((body.dofs[:, 1] == MULTIPLIER).sum())
    mass = body.M.diagonal()[i]
    has_mass = i[mass > 0]
    if len(has_mass) > 4 * FIXED_MODES:
        return n
    s = 1 / np.sqrt(mass[mass > 0])
    M = body.M[has_mass][:, has_mass].toarray()
    return max(0, min(n, int(np.linalg.matrix_rank(s[:, None] * M * s, hermitian=True))))


def root(H: Array) -> Array:
    """Return R with Rᵀ R = H, (r, k), without directions of zero energy."""
    e, V = la.eigh((H + H.T) / 2)
    some = e > SAME_STRAIN * e[-1]
    return np.asarray(np.sqrt(e[some])[:, None] * V[:, some].T)


def exact_start(R: Sequence[Array], c: Array) -> list[Array]:
    """Return Y_p = Z Zᵀ with Σ_p R_pᵀ Y_p R_p = diag(c)."""
    roots = [la.pinv(r).T @ (np.sqrt(c)[:, None] * r.T) for r in R]
    return [Z @ Z.T for Z in roots]


def clipped(Y: Array, least: float, most: float) -> Array:
    """Return the closest matrix with eigenvalues within the bounds."""
    d, Z = np.linalg.eigh((Y + Y.T) / 2)  # scipy's takes three times as long for small matrices
    return np.asarray((Z * np.clip(d, least, most)) @ Z.T)


def fitted(
    R: Sequence[Array], c: Array, Y: list[Array], n_exact: int, least: float, most: float
) -> tuple[list[Array], float]:
    """Return matrices near Y with eigenvalues within bounds and (Σ_p R_pᵀ Y_p R_p)_kk = c_k for k < n_exact.

    Also return the largest relative error of these modes. If c_k is smaller than `SMALL` times the largest c, its error
    is relative to that value. The gradient step is 1/L, where L is the largest eigenvalue of the map from errors to
    gradients and back to errors.
    """
    scale = np.maximum(c, SMALL * c.max())[:n_exact]
    columns = [r[:, :n_exact] / np.sqrt(scale) for r in R]
    wanted = c[:n_exact] / scale
    L = float(la.eigvalsh(sum((r.T @ r) ** 2 for r in columns))[-1])

    def errors(Ys: Sequence[Array]) -> Array:
        return np.asarray(sum(np.sum(r * (y @ r), axis=0) for r, y in zip(columns, Ys, strict=True)) - wanted)

    ahead, t, checked = Y, 1.0, np.inf
    for step in range(STEPS):
        if step % PATIENCE == 0:
            error = float(np.abs(errors(Y)).max())
            if error <= EXACT or error > 0.9 * checked:
                return Y, error
            checked = error
        e = errors(ahead)
        new = [clipped(y - (r * e) @ r.T / L, least, most) for y, r in zip(ahead, columns, strict=True)]
        t_new = (1 + np.sqrt(1 + 4 * t * t)) / 2
        ahead = [a + (t - 1) / t_new * (a - b) for a, b in zip(new, Y, strict=True)]
        Y, t = new, t_new
    return Y, float(np.abs(errors(Y)).max())


def complex_ratios(omega: Array, D: Array, n: int) -> Array:
    """Return damping ratios of the first n modes of x'' + D x' + omega² x = 0, identified by largest share, (n,)."""
    k = len(omega)
    s, V = la.eig(np.block([[np.zeros((k, k)), np.diag(omega)], [-np.diag(omega), -D]]))
    shares = np.abs(V[:k]) ** 2 / np.sum(np.abs(V) ** 2, axis=0)
    own = shares[:n].argmax(axis=1)
    return np.asarray(-s[own].real / np.abs(s[own]))
