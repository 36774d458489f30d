"""Damage from spectra of modal coordinates: spectral moments of each place, then a distribution of amplitudes.

A stress that is linear in q, s = a · S q, has the moments (a S) M_m (a S).T, with M_m from `modal_moments`. Von Mises
stress is not linear. Preumont & Piéfort (1994) replace it by a Gaussian stress with the same mean square and the
spectrum G(f) = trace(Q S G(f) S.T), where sigma_vM² = sigma.T Q sigma; its moments are trace(Q S M_m S.T).
"""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.history_damage import Counted, Progress
from floatframe.durability.fatigue.mean_stress import GERBER, LINE, NO_CORRECTION, NONE, MeanStress
from floatframe.durability.fatigue.planes import shear_pairs
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.durability.fatigue.spectral.spectra import ModalSpectra, modal_moments
from floatframe.durability.fatigue.spectral.spectral_methods import SPECTRAL_METHODS, damage_rates
from floatframe.errors import FatigueError

__all__ = ["count_spectra", "mean_factor", "stress_moments"]

CHUNK_SIZE = 2_000_000  #: largest number of entries of rows in memory


def count_spectra(
    stress: Array,
    spectra: Sequence[ModalSpectra],
    curve: SNCurve,
    *,
    method: str = "dirlik",
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    frames: Array | None = None,
    progress: Progress | None = None,
) -> Counted:
    """Return the damage of places with stress shapes (n, 6, n_q) [Pa per unit of q]; all places are counted.

    `beyond` of the result is the fraction of the damage beyond the largest amplitude of the curve; `largest` is three
    standard deviations of the stress plus the mean, the largest over the spectra.

    Raises
    ------
    FatigueError
        If spectra, shapes, criterion, correction and method do not fit together.
    """
    check(stress, spectra, curve, criterion, mean_stress, method)
    n, n_q = stress.shape[0], stress.shape[2]
    result = Counted(
        np.zeros((len(spectra), n)), np.zeros(n), np.ones(n, bool), np.zeros(n), np.zeros(n), np.zeros(n),
        np.zeros(n, np.int64),
    )  # fmt: skip
    moments = [modal_moments(each) for each in spectra]
    step = max(1, CHUNK_SIZE // (criterion.n_rows() * n_q))
    for first in range(0, n, step):
        part = slice(first, min(first + step, n))
        rows = linear_rows(np.asarray(stress[part]), None if frames is None else frames[part], criterion)
        damage, cycles, beyond, sizes = [], [], [], []
        for each, M in zip(spectra, moments, strict=True):
            found = row_moments(rows, M, criterion)  # (4, n, n_planes)
            mean = np.zeros(found.shape[1:]) if each.mean is None else mean_value(stress[part], rows, each, criterion)
            factor = mean_factor(mean, mean_stress)
            rates = damage_rates(found.reshape(4, -1), curve, method, factor.ravel())
            of_block = [(each.repeats * each.duration * rate).reshape(mean.shape) for rate in rates]
            damage.append(of_block[0])
            beyond.append(of_block[1])
            cycles.append(of_block[2])
            sizes.append(3 * factor * np.sqrt(np.maximum(found[0], 0.0)))
        total = np.sum(damage, axis=0)
        worst = np.argmax(total, axis=1)
        at = np.arange(len(worst)), worst
        result.damage[:, part] = np.stack(damage)[:, *at]
        result.cycles[part] = np.sum(cycles, axis=0)[at]
        result.beyond[part] = np.divide(
            np.sum(beyond, axis=0)[at], total[at], out=np.zeros(len(worst)), where=total[at] > 0
        )
        result.largest[part] = np.max(sizes, axis=0)[at]
        result.plane[part] = worst
        if progress is not None:
            progress(part.stop / n)
    result.bound[:] = result.total
    return result


def check(
    stress: Array, spectra: Sequence[ModalSpectra], curve: SNCurve, criterion: Criterion, mean_stress: MeanStress,
    method: str,
) -> None:  # fmt: skip
    """Raise `FatigueError` unless the inputs agree with each other."""
    if not spectra:
        raise FatigueError("fatigue: expected one spectrum at least")
    if method not in SPECTRAL_METHODS:
        from fe_models.foundation.words import nearest, quoted

        raise FatigueError(f"fatigue: unknown spectral method {quoted(method)}{nearest(method, SPECTRAL_METHODS)}")
    if criterion.name in ("principal", "findley"):
        instead = '"normal"' if criterion.name == "principal" else '"shear"'
        raise FatigueError(
            f'fatigue: criterion "{criterion.name}" is not linear in the stress, so that it has no spectrum; take '
            f'{instead}, over planes, or "signed-von-mises" (Preumont\'s equivalent stress)'
        )
    if mean_stress.law not in (NONE, LINE, GERBER):
        raise FatigueError(
            f'fatigue: mean stress "{mean_stress.name}" with spectra: expected goodman, gerber, soderberg, morrow or '
            "none, which are a factor on all amplitudes"
        )
    if criterion.is_shear and mean_stress.law != NONE:
        raise FatigueError(f'fatigue: criterion "{criterion.name}": shear has no mean stress correction; take "none"')
    if mean_stress.law != NONE and curve.stress_ratio != -1:
        raise FatigueError(
            f'fatigue: mean stress "{mean_stress.name}" with spectra: expected an S-N curve of R = -1, got '
            f"{curve.stress_ratio:g}"
        )
    for each in spectra:
        if each.spectra.shape[1] != stress.shape[2]:
            raise FatigueError(
                f"spectrum {each.name!r}: {each.spectra.shape[1]} modal coordinates, but stress shapes of "
                f"{stress.shape[2]}; give the body of the spectra"
            )


def stress_moments(stress: Array, spectra: ModalSpectra, criterion: Criterion, frames: Array | None = None) -> Array:
    """Return the spectral moments of orders 0, 1, 2, 4, over planes where there are some, (4, n, n_planes)."""
    return row_moments(linear_rows(stress, frames, criterion), modal_moments(spectra), criterion)


def linear_rows(stress: Array, frames: Array | None, criterion: Criterion) -> Array:
    """Return the rows of the stresses, (n, n_rows, n_q): A sigma for von Mises stress, one row per plane otherwise."""
    if criterion.is_shear:
        assert frames is not None
        return np.asarray(2 * shear_pairs(frames, criterion.n_planes)[0] @ stress)
    rows = criterion.rows(stress, frames)
    if criterion.name != "signed-von-mises":
        return rows
    if criterion.tensor == "full":
        return np.asarray(criterion.norm_root() @ rows)
    # sigma_vM² = xx² + yy² - xx yy + 3 xy² = |A (xx, yy, xy)|²
    A = np.array([[1.0, -0.5, 0.0], [0.0, np.sqrt(0.75), 0.0], [0.0, 0.0, np.sqrt(3.0)]])
    return np.asarray(A @ rows)


def row_moments(rows: Array, moments: Array, criterion: Criterion) -> Array:
    """Return r M r.T of each row, summed over the components of von Mises stress, (n_orders, n, n_planes)."""
    each = np.stack([np.einsum("nrk,nrk->nr", rows @ M, rows) for M in moments])
    return each.sum(axis=2, keepdims=True) if criterion.name == "signed-von-mises" else each


def mean_value(stress: Array, rows: Array, spectra: ModalSpectra, criterion: Criterion) -> Array:
    """Return the criterion for the static stress, (n, n_planes) [Pa]."""
    q = spectra.scale * np.asarray(spectra.mean)
    if criterion.name != "signed-von-mises":
        return np.asarray(rows @ q)
    from floatframe.durability.fatigue.kernels.stress_kernels import signed_von_mises

    found = np.empty((len(stress), 1))
    signed_von_mises(np.ascontiguousarray((stress @ q)[:, :, None]), found)
    return found


def mean_factor(mean: Array, mean_stress: MeanStress) -> Array:
    """Return the factor S_ar / S_a on amplitudes for a mean stress, same shape; only for laws like goodman."""
    if mean_stress.law == NONE:
        return np.ones(mean.shape)
    share = mean / mean_stress.value
    if not mean_stress.credit_compression:
        share = np.maximum(share, 0.0)
    if (share >= 1).any():
        raise FatigueError(
            f"fatigue: the static stress reaches {float(mean.max()):.6g}, no less than the strength "
            f"{mean_stress.value:.6g} of mean stress {mean_stress.name!r}: it fails at once; check loads and units"
        )
    return np.asarray(1 / (1 - (share if mean_stress.law == LINE else share**2)))
