"""Damping of strain patterns: damping of a part of a body with which the whole body keeps its damping ratios.

D = beta K + Σ_k d_k (K s_k)(K s_k)ᵀ, with patterns s_k of unit energy, s_kᵀ K s_l = 1 if k = l, else 0. Pattern k is
damped as by (beta + d_k) K, all other strain as by beta K. D does not damp rigid-body motion u, because K u = 0, and D
is positive semidefinite, because no coefficient is negative. `cms split` writes this damping (`cms.jobs.part_damping`).
"""

import hashlib
import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cms.errors import ModeSetError
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.tall.columns import inner

__all__ = ["StrainDamping", "read_strain_damping", "strain_damping_bytes"]

KEYS = ("beta", "coefficients", "forces", "positions", "components", "units")
SAME_PLACE = 1e-9  #: largest distance between a node and its position in the file, relative to the body length


@dataclass(frozen=True, eq=False)
class StrainDamping:
    """Damping of strain patterns of one coupled body. Positions and components identify its dofs.

    Parameters
    ----------
    beta
        Coefficient of K, 0 or more [time].
    coefficients
        d_k, 0 or more, in addition to beta, (n,) [time].
    forces
        K s_k over the dofs of the body, (n_dof, n).
    positions
        Position of the node of each dof, mesh axes, (n_dof, 3) [length].
    components
        Component of each dof, as in `FEBody.dofs`, (n_dof,).
    units
        Name of the unit system of all numbers.
    where
        Name of the file, for messages.
    """

    beta: float
    coefficients: Array
    forces: Array
    positions: Array
    components: IntArray
    units: str
    where: str = "damping"

    def __post_init__(self) -> None:
        for name in ("coefficients", "forces", "positions"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        object.__setattr__(self, "components", frozen(self.components, np.int64))
        n_dof, n = len(self.components), len(self.coefficients)
        if self.coefficients.shape != (n,) or self.forces.shape != (n_dof, n) or self.positions.shape != (n_dof, 3):
            raise ModeSetError(
                f"{self.where}: expected {n} coefficients, forces {(n_dof, n)} and positions {(n_dof, 3)}, got "
                f"{self.coefficients.shape}, {self.forces.shape} and {self.positions.shape}; run cms split again"
            )
        numbers = np.concatenate([[self.beta], self.coefficients])
        if not (np.isfinite(numbers).all() and np.isfinite(self.forces).all() and (numbers >= 0).all()):
            raise ModeSetError(
                f"{self.where}: expected finite forces, and coefficients of 0 or more, got {numbers.min():g}; run cms "
                "split again"
            )

    def __str__(self) -> str:
        digest = hashlib.sha256(strain_damping_bytes(self)).hexdigest()[:12]
        return f"strain patterns {digest} ({len(self.coefficients)}, beta = {self.beta:.6g})"

    @classmethod
    def of_body(cls, body: FEBody, beta: float, coefficients: Array, forces: Array) -> "StrainDamping":
        """Return the damping of a coupled body."""
        return cls(beta, coefficients, forces, body.nodes[body.dofs[:, 0]], body.dofs[:, 1], body.units.name)

    def reduced(self, body: FEBody, Phi: Array, K: Array) -> Array:
        """Return Phiᵀ D Phi, (n_q, n_q).

        Parameters
        ----------
        body
            Coupled body with the same dofs as the damping.
        Phi
            Shapes, (n_dof, n_q).
        K
            Phiᵀ K Phi, (n_q, n_q).

        Raises
        ------
        ModeSetError
            If the body has other dofs, another order of nodes or another unit system.
        """
        own = len(self.components)
        if body.units.name != self.units:
            problem = f"its units are {self.units}, those of the body {body.units.name}"
        elif body.n_dof != own:
            problem = f"it has {own} dofs, the body {body.n_dof}"
        elif not np.array_equal(body.dofs[:, 1], self.components):
            problem = "its dofs have other components, or another order"
        elif np.abs(body.nodes[body.dofs[:, 0]] - self.positions).max() > SAME_PLACE * body.length:
            problem = "its nodes have other positions, or another order"
        else:
            G = inner(self.forces, Phi)
            return np.asarray(self.beta * K + (G.T * self.coefficients) @ G)
        raise ModeSetError(
            f"{self.where}: belongs to another body than {body.name!r}: {problem}; mesh, cuts and interfaces must be "
            "those of cms split: run it again"
        )


def strain_damping_bytes(damping: StrainDamping) -> bytes:
    """Return the content of the .npz file of a strain damping."""
    buffer = io.BytesIO()
    arrays = {key: np.asarray(getattr(damping, key)) for key in KEYS}
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def read_strain_damping(path: Path) -> StrainDamping:
    """Read a strain damping from its file.

    Raises
    ------
    ModeSetError
        If it is not such a file.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            read = {key: archive[key] for key in KEYS}
        return StrainDamping(
            float(read["beta"]), read["coefficients"], read["forces"], read["positions"], read["components"],
            str(read["units"]), f"damping {path.name}",
        )  # fmt: skip
    except (OSError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        raise ModeSetError(f"damping {path}: expected a file that cms split wrote, got {error}") from error
    except ModeSetError:
        raise
    except ValueError as error:
        raise ModeSetError(f"damping {path}: expected a file that cms split wrote, got {error}") from error
