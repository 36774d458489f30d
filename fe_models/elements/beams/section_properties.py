"""Cross-section data of a beam element, and the map from section forces to stress at its points."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.errors import SectionError
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["SectionProperties", "normal_stress"]

#: components of the section force at the centroid, on the face with normal +x
FORCES = ("N", "Vy", "Vz", "Mx", "My", "Mz")


@dataclass(frozen=True, eq=False)
class SectionProperties:
    """Homogeneous cross-section in its principal axes y, z through the centroid; x is along the beam.

    Raises
    ------
    SectionError
        Unless A, Iy, Iz, J and the shear areas are positive (shear areas may be infinite).
    """

    A: float  #: area [m²]
    Iy: float  #: ∫ z² dA, bending in the x-z plane [m⁴]
    Iz: float  #: ∫ y² dA, bending in the x-y plane [m⁴]
    J: float  #: Saint-Venant torsion constant [m⁴]
    A_sy: float  #: shear area along y, kappa_y A [m²]; infinite: no shear deformation
    A_sz: float  #: shear area along z, kappa_z A [m²]
    points: Array  #: stress recovery points (y, z), which are also the vertices of the outline, (n_points, 2) [m]
    stress: Array  #: (sigma_xx, tau_xy, tau_xz) at the points for unit `FORCES`, (n_points, 3, 6) [1/m², 1/m³]
    #: outline: point indices of the outer loop, anticlockwise in (y, z), then of the holes
    loops: tuple[IntArray, ...] = ()
    cap: IntArray = field(default_factory=lambda: np.zeros((0, 3), np.int64))  #: triangles of the face with normal +x
    shear_center: tuple[float, float] = (0.0, 0.0)  #: (y, z) of the shear centre [m]
    shows_shear: bool = True  #: whether `stress` includes shear stress due to shear forces and torsion
    is_outline_known: bool = True  #: whether the points are on the true section; False: on an assumed rectangle

    def __post_init__(self) -> None:
        for name in ("A", "Iy", "Iz", "J", "A_sy", "A_sz"):
            value = float(getattr(self, name))
            object.__setattr__(self, name, value)
            if not (value > 0 and (np.isfinite(value) or name in ("A_sy", "A_sz"))):
                raise SectionError(f"section: {name}: expected a number above zero, got {value:g}")
        object.__setattr__(self, "points", frozen(self.points))
        object.__setattr__(self, "stress", frozen(self.stress))
        object.__setattr__(self, "loops", tuple(frozen(loop, np.int64) for loop in self.loops))
        object.__setattr__(self, "cap", frozen(self.cap, np.int64))
        n = len(self.points)
        if self.points.shape != (n, 2) or self.stress.shape != (n, 3, 6):
            raise SectionError(
                f"section: expected points (n, 2) and stress (n, 3, 6), got {self.points.shape} and {self.stress.shape}"
            )

    @property
    def J_polar(self) -> float:
        """Polar second moment of area Iy + Iz, which determines the rotary inertia about x [m⁴]."""
        return self.Iy + self.Iz


def normal_stress(points: Array, A: float, Iy: float, Iz: float) -> Array:
    """Return coefficients of sigma_xx = N/A + My z/Iy - Mz y/Iz, (n, 3, 6); the shear rows are zero."""
    y, z = np.asarray(points).T
    stress = np.zeros((len(y), 3, 6))
    stress[:, 0, 0] = 1 / A
    stress[:, 0, 4] = z / Iy
    stress[:, 0, 5] = -y / Iz
    return stress
