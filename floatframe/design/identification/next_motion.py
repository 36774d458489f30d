"""A more informative motion, within the range of the measured one, and its expected accuracy."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.design.identification.base_parameters import form_rows, typical_coordinates
from floatframe.design.identification.estimation import Estimate
from floatframe.design.identification.excitation import ExcitingMotion, MotionLimits, exciting_motion

__all__ = ["NextMotion", "next_motion"]

N_HARMONICS, N_INSTANTS, N_STARTS, MOST = 5, 40, 12, 8
LEAST = 1e-3  #: range below which a coordinate hardly moved [rad], or relative to the size of the system


@dataclass(frozen=True, eq=False)
class NextMotion:
    """A motion, and the standard deviations that it would give for the base parameters."""

    motion: ExcitingMotion
    deviations: Array  #: deviations for the same number of rows and noise, (n_base,)
    #: condition number of these rows divided by the noise, columns of length one; compare `Estimate.condition`
    condition: float


def next_motion(made: Estimate, *, seed: int = 0) -> NextMotion | None:
    """Return an exciting motion within the positions, rates and accelerations of the measured motion.

    It is None if no tried motion has a lower condition number than the measured one.

    It has the duration of the measured motion, and its accuracy is computed for the same number of rows and the same
    noise. Torques are not limited, because with limited accelerations they remain near the measured torques.

    Raises
    ------
    ModelError
        If loops cannot be closed during the motion.
    """
    form, samples = made.base.form, made.measured.samples
    own = slice(None) if form.independent is None else form.independent
    x, rate, acceleration = (getattr(samples, name)[:, own] for name in ("x", "rate", "acceleration"))
    t = made.measured.times
    n = len(t)
    duration = float(t[-1] - t[0]) * n / (n - 1)
    w = 2 * np.pi / duration
    limits = {}
    shares = LEAST * typical_coordinates(form, form.columns)
    for k, (column, least) in enumerate(zip(form.columns, shares, strict=True)):
        low, high = float(x[:, k].min()), float(x[:, k].max())
        spare = max(least - (high - low), 0.0)
        limits[column.name] = MotionLimits(
            low - spare, high + spare, max(float(np.abs(rate[:, k]).max()), least * w),
            max(float(np.abs(acceleration[:, k]).max()), least * w**2),
        )  # fmt: skip
    motion = exciting_motion(
        made.base, limits, period=duration, n_harmonics=N_HARMONICS, n_instants=N_INSTANTS, n_starts=N_STARTS,
        max_iterations=MOST, seed=seed,
    )  # fmt: skip
    moved = form.samples(*motion.at(np.arange(n) * duration / n))
    rows = made.base.rows(form_rows(form, moved, made.base.source)).reshape(n, -1, len(made.values))
    A = (rows / made.sigma[:, None]).reshape(-1, len(made.values))
    size = np.linalg.norm(A, axis=0)
    s, Vt = la.svd(A / size, full_matrices=False)[1:]
    deviations = np.linalg.norm(Vt.T / s, axis=1) / size
    condition = float(s[0] / s[-1])
    return NextMotion(motion, deviations, condition) if condition < made.condition else None
