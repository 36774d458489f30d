"""Damage of a shaken body: the random test of `floatframe shake` gives the cross spectra of its modes.

The modes with the bases held, eta, and the motion of the inputs are the coordinates: their stress at kept nodes and
stress points is the field of the model, and their cross spectra G = H S H^H are exact at the frequencies of the run,
with its weights.
"""

from collections.abc import Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.mean_stress import NO_CORRECTION, MeanStress
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.durability.fatigue.spectral.spectra import ModalSpectra
from floatframe.durability.fatigue.surface_damage import FatigueResult, spectral_damage
from floatframe.durability.shaking.loads.inputs import input_index
from floatframe.durability.shaking.loads.random_vibration import RandomRun, RandomTest, input_density, spectral_root
from floatframe.durability.shaking.structure.model import ShakenModel, driven, modal_response
from floatframe.errors import FatigueError

__all__ = ["shaken_damage", "shaken_spectra"]


def shaken_spectra(model: ShakenModel, test: RandomTest, run: RandomRun, duration: float) -> tuple[ModalSpectra, Array]:
    """Return the cross spectra of modes and inputs in a random run, and their stress at all places, (n, 6, n_q).

    Places: the kept nodes, then the stress points.

    Raises
    ------
    FatigueError
        If the body of the model has no stress.
    """
    if model.field is None:
        raise FatigueError(f"shaken body {model.name!r}: it has no stress of the modes; reduce it with stress = true")
    columns = [model.inputs.index(name) for name in run.inputs]
    where = f"shake: random {test.name!r}"
    levels = {input_index(model, name, where): (name, level) for name, level in (test.levels or {}).items()}
    acting = {k: levels[k] if test.level is None else (model.inputs[k], test.level) for k in columns}
    f = run.band.frequencies
    eta, omega = modal_response(model, f)
    of_modes, of_inputs = model.field
    if of_inputs[:, :, columns].any():  # otherwise the motion of the bases causes no stress by itself
        unit = np.zeros((3, len(model.inputs), len(model.inputs)))
        unit[0] = np.eye(len(model.inputs))
        eta = np.concatenate([eta, driven(unit, model.rates, omega)], axis=1)
        of_modes = np.concatenate([of_modes, of_inputs], axis=2)
    moved = eta[:, :, columns] @ spectral_root(input_density(model, test, acting, f))
    G = np.asarray(moved @ moved.conj().transpose(0, 2, 1), dtype=np.complex128)
    return ModalSpectra(f"{run.test} {run.direction}", f, G, duration, weights=run.band.weights), of_modes


def shaken_damage(
    body: ReducedBody,
    model: ShakenModel,
    test: RandomTest,
    runs: Sequence[RandomRun],
    curve: SNCurve,
    *,
    duration: float | None = None,
    method: str = "dirlik",
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    extrapolate: bool = False,
    nodes: IntArray | None = None,
) -> FatigueResult:
    """Return the damage on the surface of a shaken body, summed over the runs of a random test.

    Parameters
    ----------
    body
        The body that was shaken.
    duration
        Of each run [s]; None: that of the test.

    Raises
    ------
    FatigueError
        If no duration is known, the runs are of another test, or as `spectral_damage` raises.
    """
    chosen = [run for run in runs if run.test == test.name]
    lasts = duration if duration is not None else test.duration
    if lasts is None or not chosen:
        what = "no run of it was made" if not chosen else "how long it lasts is not known; give duration"
        raise FatigueError(f"random test {test.name!r}: {what}")
    made = [shaken_spectra(model, test, run, lasts) for run in chosen]
    return spectral_damage(
        body, [each for each, _ in made], curve, method=method, criterion=criterion, mean_stress=mean_stress,
        extrapolate=extrapolate, nodes=nodes, stress=made[0][1],
    )  # fmt: skip
