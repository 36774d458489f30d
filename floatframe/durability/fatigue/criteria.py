"""Criteria: the scalar or the stresses on a critical plane that cause damage, from a stress tensor."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.durability.fatigue.planes import normal_rows, shear_pairs, tensor_rows
from floatframe.errors import FatigueError, ModelError

__all__ = ["CRITERIA", "TENSORS", "Criterion", "largest_size"]

#: description of each criterion, by name
CRITERIA = {
    "signed-von-mises": "von Mises stress with the sign of the principal stress of largest absolute value",
    "principal": "the principal stress of largest absolute value",
    "normal": "normal stress on the plane normal to the surface with the largest damage",
    "shear": "twice the shear stress on the plane normal or at 45 degrees to the surface with the largest damage",
    "findley": "shear amplitude + k times the largest normal stress, on the plane with the largest damage",
}
TENSORS = {"full": "all six components", "surface": "the three components in the tangent plane; the others are zero"}
PLANES = ("normal", "shear", "findley")

#: weights of xx yy zz yz xz xy in the Euclidean norm |sigma|² = sigma : sigma
FROBENIUS = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


@dataclass(frozen=True)
@checked_fields(ModelError)
class Criterion:
    """A criterion. In a bar under tension it equals the axial stress, so that curves measured on bars apply.

    Parameters
    ----------
    name
        One of `CRITERIA`.
    tensor
        "full" or "surface": the components of stress that signed-von-mises and principal use.
    n_planes
        Number of planes over 180 degrees.
    findley_k
        Weight of the normal stress in findley.
    """

    name: str = "signed-von-mises"
    tensor: str = "full"
    n_planes: int = 18
    findley_k: float = 0.3

    def __post_init__(self) -> None:
        for what, name, known in (("criterion", self.name, CRITERIA), ("tensor", self.tensor, TENSORS)):
            if name not in known:
                raise FatigueError(f"fatigue: unknown {what} {quoted(name)}{nearest(name, known)}")
        if self.tensor == "surface" and self.name in PLANES:
            raise FatigueError(f'fatigue: tensor = "surface" is for signed-von-mises and principal, not {self.name}')
        if not 4 <= self.n_planes <= 360:
            raise FatigueError(f"fatigue: planes: expected 4 to 360 angles, got {self.n_planes}")
        if not (math.isfinite(self.findley_k) and 0 <= self.findley_k <= 2):
            raise FatigueError(f"fatigue: findley_k: expected 0 to 2, got {self.findley_k:g}")

    @property
    def needs_surface(self) -> bool:
        """Whether the criterion needs the tangent plane."""
        return self.name in PLANES or self.tensor == "surface"

    @property
    def is_shear(self) -> bool:
        """Whether cycles of shear stress are counted, together with the normal stress."""
        return self.name in ("shear", "findley")

    @property
    def k(self) -> float:
        """Findley's weight of the normal stress; 0 for shear alone."""
        return self.findley_k if self.name == "findley" else 0.0

    @property
    def bound_factor(self) -> float:
        """The factor c with |S| <= c |A sigma| at every instant, with A from `norm_root`."""
        if self.is_shear:  # tau <= |sigma| / sqrt(2), normal stress <= |sigma|, in the Frobenius norm
            return 2 * (math.sqrt(0.5) + self.k) / (self.k + math.sqrt(1 + self.k**2))
        return 1.0

    def rows(self, stress: Array, frames: Array | None) -> Array:
        """Return the rows of the criterion that are linear in the modal coordinates, (n, n_rows, n_q).

        Rows of normal stress follow the rows of shear stress.

        Parameters
        ----------
        stress
            Stress shapes, (n, 6, n_q).
        frames
            Tangents and normals, (n, 3, 3); None if the criterion does not need them.
        """
        if not self.needs_surface:
            return stress
        assert frames is not None
        if self.tensor == "surface":
            rows = tensor_rows(frames)
        elif self.name == "normal":
            rows = normal_rows(frames, self.n_planes)
        else:
            rows = np.concatenate(shear_pairs(frames, self.n_planes), axis=1)
        return np.asarray(rows @ stress)

    def n_rows(self) -> int:
        """Number of rows for each place."""
        if self.is_shear:
            return 10 * self.n_planes
        return self.n_planes if self.name == "normal" else 3 if self.tensor == "surface" else 6

    def scalar(self) -> Callable[[Array, Array], None] | None:
        """Return the kernel from components to the scalar; None if the rows are already scalars."""
        from floatframe.durability.fatigue.kernels import stress_kernels as kernels

        return {
            ("signed-von-mises", "full"): kernels.signed_von_mises,
            ("principal", "full"): kernels.largest_principal,
            ("signed-von-mises", "surface"): kernels.plane_von_mises,
            ("principal", "surface"): kernels.plane_principal,
        }.get((self.name, self.tensor))

    def norm_root(self) -> Array:
        """Return A, (6, 6), which bounds the criterion S of the stress sigma: |S| <= c |A sigma|, c = `bound_factor`.

        |A sigma| is the von Mises stress for that criterion, and the Frobenius norm of the stress for others.
        """
        if self.name == "signed-von-mises" and self.tensor == "full":
            return von_mises_root()
        return np.diag(np.sqrt(FROBENIUS))

    def plane_words(self, plane: int) -> str:
        """Return the description of a plane from its index."""
        if self.name not in PLANES:
            return ""
        n, degrees = self.n_planes, 180.0 / self.n_planes
        if plane < n:
            return f"across the surface at {plane * degrees:g} deg"
        kind = "out of the surface" if plane < 3 * n else "along the surface"
        return f"45 deg to the surface at {(plane - n) % (2 * n) * degrees:g} deg, shear {kind}"


def von_mises_root() -> Array:
    """Return A, (6, 6), such that |A sigma| is the von Mises stress: diag(sqrt(weights)) times the deviator."""
    deviator = np.eye(6)
    deviator[:3, :3] -= 1.0 / 3.0
    return np.asarray(np.sqrt(1.5 * FROBENIUS)[:, None] * deviator)


def largest_size(rows: Array) -> Array:
    """Return the largest singular value of matrices of six rows, (n, 6, r) -> (n,)."""
    gram = rows @ rows.transpose(0, 2, 1)
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[:, -1], 0.0)))
