"""Measured modes: points, directions, frequencies, damping and shapes, independent of the file format."""

from dataclasses import dataclass, field, replace

import numpy as np

from cms.assessment.correlation.errors import CorrelationError
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["MeasuredModes", "phase_collinearity", "real_shapes"]


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """Modes of a test, given along the measured directions.

    Raises
    ------
    CorrelationError
        If sizes do not fit, a number is not finite, frequencies are not positive, or a direction has zero length.
    """

    frequencies: Array  #: natural frequencies, (n,) [Hz]
    shapes: Array  #: real shapes, (n_rows, n), arbitrarily scaled
    points: IntArray  #: point number of each row, (n_rows,)
    directions: Array  #: unit vector of each row, in the axes of the test, (n_rows, 3)
    #: position of the point of each row, in the length unit of the model, (n_rows, 3); NaN if the test does not give it
    places: Array
    damping: Array = field(default_factory=lambda: np.zeros(0))  #: damping ratio of each mode, (n,); empty: unknown
    #: phase collinearity of complex shapes, 0 to 1, (n,); empty: real shapes
    collinearity: Array = field(default_factory=lambda: np.zeros(0))
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put, where = object.__setattr__, f"measured modes {self.source}".rstrip()
        for name in ("frequencies", "shapes", "directions", "places", "damping", "collinearity"):
            put(self, name, frozen(getattr(self, name)))
        put(self, "points", frozen(self.points, np.int64))
        n, n_rows = len(self.frequencies), len(self.points)
        if not n or not n_rows:
            raise CorrelationError(f"{where}: expected at least one mode and one point, got {n} and {n_rows}")
        for name, shape in {"shapes": (n_rows, n), "directions": (n_rows, 3), "places": (n_rows, 3)}.items():
            if getattr(self, name).shape != shape:
                raise CorrelationError(f"{where}: {name}: expected {shape}, got {getattr(self, name).shape}")
        for name in ("damping", "collinearity"):
            if getattr(self, name).size not in (0, n):
                raise CorrelationError(f"{where}: {name}: expected one for each of {n} modes")
        if not (np.isfinite(self.frequencies).all() and (self.frequencies > 0).all()):
            raise CorrelationError(f"{where}: frequencies: expected numbers above 0 [Hz], got {self.frequencies}")
        if not np.isfinite(self.shapes).all():
            row = int(np.argwhere(~np.isfinite(self.shapes))[0, 0])
            raise CorrelationError(f"{where}: the shape at point {self.points[row]} is not a number; leave the row out")
        size = np.linalg.norm(self.directions, axis=1)
        if not (np.isfinite(size).all() and (size > 0).all()):
            row = int(np.argmin(np.where(np.isfinite(size), size, -1.0)))
            raise CorrelationError(f"{where}: point {self.points[row]}: the direction has no length")
        put(self, "directions", frozen(self.directions / size[:, None]))
        still = np.linalg.norm(self.shapes, axis=0) == 0
        if still.any():
            raise CorrelationError(f"{where}: mode {int(np.argmax(still)) + 1} moves no point; leave it out")

    @property
    def n_modes(self) -> int:
        """Number of modes."""
        return len(self.frequencies)

    def chosen(self, modes: list[int]) -> "MeasuredModes":
        """Return some of the modes, selected by index from 0."""
        return replace(
            self,
            frequencies=self.frequencies[modes],
            shapes=self.shapes[:, modes],
            damping=self.damping[modes] if self.damping.size else self.damping,
            collinearity=self.collinearity[modes] if self.collinearity.size else self.collinearity,
        )


def phase_collinearity(shapes: np.ndarray) -> Array:
    """Return the modal phase collinearity of complex shapes, (n_rows, n) -> (n,); 1 if all points are in phase.

    With S_ab as products of real and imaginary parts, MPC = ((S_xx - S_yy)² + 4 S_xy²) / (S_xx + S_yy)². This is the
    share of the larger eigenvalue of the 2 x 2 covariance of real and imaginary parts, scaled to 0 ... 1
    (Pappa, Elliott and Schenk 1993).
    """
    x, y = shapes.real, shapes.imag
    xx, yy, xy = (x * x).sum(axis=0), (y * y).sum(axis=0), (x * y).sum(axis=0)
    return np.asarray(((xx - yy) ** 2 + 4 * xy**2) / (xx + yy) ** 2)


def real_shapes(shapes: np.ndarray) -> Array:
    """Rotate each complex shape to the phase that maximises its real part, and return the real part, (n_rows, n)."""
    phase = 0.5 * np.angle((shapes**2).sum(axis=0))
    return np.asarray((shapes * np.exp(-1j * phase)).real)
