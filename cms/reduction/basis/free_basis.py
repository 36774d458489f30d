"""Free-free modes in the span of a mode set, over all dofs: for comparisons with the full model and estimates."""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import BodyFrame
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.linear_algebra.independent import Products, gram_in_blocks, independent_basis
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.finishing import FinishedBasis, finish
from cms.reduction.basis.frames import FrameCondition
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.tall.columns import combine, dots, gram, inner, of_this_process

__all__ = ["FreeBasis", "ShapeRounding", "basis_of_finished", "free_basis", "ritz_basis", "shape_rounding"]


@dataclass(frozen=True, eq=False)
class ShapeRounding:
    """Rounding errors of shapes due to rounding of the columns of their mode set, in three norms.

    The rounding error of a shape phi = sum_k a_k v_k is sum_k |a_k| eps |v_k|. It is large for nearly dependent
    columns, because their coefficients a_k are large.
    """

    motion: Array  #: error in the norm of the displacement, rotations times body length, (n,)
    mass: Array  #: error in the norm of the diagonal of M, (n,)
    stiffness: Array  #: error in the norm of the diagonal of K, (n,)

    def __post_init__(self) -> None:
        for name in ("motion", "mass", "stiffness"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def of_combinations(self, Z: Array) -> "ShapeRounding":
        """Return the rounding errors of the shapes Phi Z."""
        return ShapeRounding(*(np.abs(Z).T @ each for each in (self.motion, self.mass, self.stiffness)))


def shape_rounding(body: FEBody, V: Array, A: Array) -> ShapeRounding:
    """Return the rounding errors of the shapes V A."""
    motion = np.where(body.dofs[:, 1] < 3, 1.0, body.length**2)
    diagonals = (motion, np.abs(body.M.diagonal()), np.abs(body.K.diagonal()))
    of_columns = ShapeRounding(*(np.finfo(float).eps * np.sqrt(dots(V, V, each)) for each in diagonals))
    return of_columns.of_combinations(A)


@dataclass(frozen=True, eq=False)
class FreeBasis:
    """The span of [Psi_R, mode set] with M- and K-orthogonal columns: rigid motions N and elastic shapes Phi."""

    Phi: Array  #: elastic shapes, (n_dof, n), ascending omega2, massless ones last; Nᵀ M Phi = 0
    omega2: Array  #: Phiᵀ K Phi, (n,): squared frequencies of shapes with mass [1/s²]
    is_massive: np.ndarray  #: True where Phiᵀ M Phi = 1, False where it is 0, (n,) bool
    N: Array  #: M-orthonormal rigid-body motions, (n_dof, n_r)
    dropped: tuple[str, ...] = ()  #: labels of redundant columns
    rounding: ShapeRounding | None = None  #: rounding errors of Phi, if the columns are known

    def __post_init__(self) -> None:
        for name in ("Phi", "omega2", "N"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def frequencies(self, time: float = 1.0) -> Array:
        """Return the elastic free-free frequencies of the reduced body, ascending [Hz]; `time` is its time unit [s]."""
        return np.sqrt(np.maximum(self.omega2[self.is_massive], 0.0)) / (2 * np.pi) / time

    @property
    def vibrating(self) -> Array:
        """Shapes with mass, (n_dof, n_massive)."""
        return self.Phi[:, self.is_massive]


def free_basis(body: FEBody, modes: ModeSet, families: Families) -> FreeBasis:
    """Return the free-free modes in the span of a mode set, in mean axes, independent of the frame of the file.

    Parameters
    ----------
    families
        Mode families of the body; only the rigid-body motions are used.

    Raises
    ------
    ModeSetError, BodyError
        If the finishing step of `reduce` would fail.
    """
    N, M_N = families.free.N, families.free.M_N
    condition = FrameCondition(
        BodyFrame("tisserand", np.zeros(3)),
        lambda columns: inner(M_N, columns),
        Psi_R=N,
        M_Psi_R=M_N,
        W=M_N,
        center=np.zeros(3),
    )
    finished = finish(body, modes, condition)
    is_massive = np.diag(finished.M) > 0.5
    order = np.lexsort((np.diag(finished.K), np.logical_not(is_massive)))
    Phi = of_this_process(finished.Phi[:, order])
    assert finished.A is not None
    rounding = shape_rounding(body, modes.columns, finished.A[:, order])
    return FreeBasis(Phi, np.diag(finished.K)[order], is_massive[order], N, dropped=finished.dropped, rounding=rounding)


def basis_of_finished(families: Families, finished: FinishedBasis) -> FreeBasis:
    """Return the free-free modes in the span of shapes that were finished in any frame.

    Parameters
    ----------
    families
        Mode families of the body; only the rigid-body motions are used.
    """
    N, M_N = families.free.N, families.free.M_N
    Phi, K = of_this_process(finished.Phi), finished.K
    C = inner(M_N, Phi)
    has_mass = np.diag(finished.M) > 0
    Z, is_massive = elastic_eigenvectors(K, finished.M - C.T @ C, float(np.diag(K)[has_mass].min(initial=1.0)))
    omega2 = dots(Z, K @ Z)
    order = np.lexsort((omega2, np.logical_not(is_massive)))
    Z = Z[:, order]
    return FreeBasis(combine(Phi, Z) - combine(N, C @ Z), omega2[order], is_massive[order], N)


def ritz_basis(body: FEBody, X: Array, N: Array) -> FreeBasis:
    """Apply the Rayleigh-Ritz method to the span of columns, without rigid-body motion.

    (1) find W-orthonormal columns Q, W = K + omega_1² M, and drop redundant columns; then subtract rigid-body motion,
        which rounding leaves in nearly redundant columns
    (2) solve Qᵀ K Q z = omega² Qᵀ M Q z; static shapes are last

    Parameters
    ----------
    X
        Elastic columns, (n_dof, k), with Nᵀ M X = 0.
    N
        M-orthonormal rigid-body motions, (n_dof, n_r).
    """
    products = Products.of_body(body)
    G_K, G_M = gram_in_blocks(X, products.K), gram_in_blocks(X, products.M)
    stiffness, mass = np.diag(G_K), np.diag(G_M)
    has_mass = mass > 0
    omega2_1 = float((stiffness[has_mass] / mass[has_mass]).min())
    basis, _ = independent_basis(X, G_K, G_M, products, body, omega2_1)  # (1)
    Q = basis.columns(products)
    E = Q.X - combine(N, inner(N, Q.MX))
    G_K, G_M = gram(E, Q.KX), gram_in_blocks(E, products.M)
    Z, is_massive = elastic_eigenvectors(G_K, G_M, omega2_1)  # (2)
    return FreeBasis(combine(E, Z), dots(Z, G_K @ Z), is_massive, N)
