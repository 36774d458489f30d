"""Vibration tests in one call: a structure on its bases, the tests, and their results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.durability.shaking.loads.inputs import band_notes
from floatframe.durability.shaking.loads.notching import DEEPEST, Limit, NotchedRun, notched_random, notched_sine
from floatframe.durability.shaking.loads.random_vibration import RandomRun, RandomTest, random_runs
from floatframe.durability.shaking.loads.shock import TimeRun, TimeTest, time_runs
from floatframe.durability.shaking.loads.sine import SineRun, SineTest, sine_run
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.structure.body import bases_of_body, shaken_body
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.model import DIRECTIONS, ShakenModel
from floatframe.durability.shaking.structure.places import Observed
from floatframe.durability.shaking.structure.system import bases_of_system, shaken_system
from floatframe.errors import ModelError
from floatframe.model.system import System

__all__ = ["EffectiveMasses", "NotchRequest", "ShakeJob", "ShakeResult", "effective_masses", "shake"]

LITTLE_MASS = 0.9  #: fraction of the mass in modes of a direction below which a note is written


@dataclass(frozen=True)
@checked_fields(ModelError)
class NotchRequest:
    """Limits for one kind of test, or one test.

    Parameters
    ----------
    limits
        The limits that notch the test.
    kind
        Kind of test, "sine" or "random".
    tests
        Names of the notched tests; (): all of the kind.
    deepest
        Largest allowed depth of a notch [dB].
    """

    limits: Sequence[Limit]
    kind: str
    tests: Sequence[str] = ()
    deepest: float = DEEPEST


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ShakeJob:
    """The structure, its bases and damping, the tests, and the requested outputs.

    Parameters
    ----------
    structure
        The shaken structure.
    base
        The parts that each base holds, by name of the base: interfaces of a body; joints, springs and bushings of a
        system. A single name is the part held by the only base; None: the only interface, or the ground.
    points
        Reference points of bases by name, coordinates of the mesh of a body or of the ground, (3,) [m].
    damping
        Damping of the structure.
    outputs
        The observed places.
    sine
        The sine tests.
    random
        The random tests.
    shock
        The shocks and transients.
    notch
        The requests for notching.
    uncertainty
        Factors on the responses, and uncertainty of the frequencies.
    residual_above
        Frequency above which modes respond statically [Hz].
    title
        Title of the report.
    source
        File of the structure, for the record.
    """

    structure: ReducedBody | System
    base: Mapping[str, Sequence[str]] | str | None = None
    points: Mapping[str, Array] = field(default_factory=dict)
    damping: Damping = field(default_factory=lambda: Damping(ratio=0.02))
    outputs: Sequence[Observed] = ()
    sine: Sequence[SineTest] = ()
    random: Sequence[RandomTest] = ()
    shock: Sequence[TimeTest] = ()
    notch: Sequence[NotchRequest] = ()
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    residual_above: float | None = None
    title: str = ""
    source: str = ""


@dataclass(frozen=True, eq=False)
class EffectiveMasses:
    """The effective mass of each mode relative to its base."""

    frequencies: Array  #: natural frequencies, (n_m,) [Hz]
    damping: Array  #: damping ratios, (n_m,)
    directions: tuple[str, ...]
    mass: Array  #: effective masses and inertias about the points of the bases, (n_m, 6 n_bases)
    total: Array  #: masses and inertias of the rigid structure, (6 n_bases,)

    @property
    def share(self) -> Array:
        """Effective masses divided by the total, (n_m, 6 n_bases)."""
        scale = np.maximum(self.total, 1e-12 * self.total.max())
        return np.asarray(self.mass / scale)

    @property
    def cumulative(self) -> Array:
        """Sum of the shares up to each mode, (n_m, 6 n_bases)."""
        return np.asarray(np.cumsum(self.share, axis=0))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ShakeResult:
    """All runs of a job.

    Parameters
    ----------
    job
        The job.
    model
        The model of the shaken structure.
    masses
        Effective masses of the modes.
    sine
        Results of the sine tests.
    random
        Results of the random tests.
    time
        Results of the shocks and transients.
    notched
        Notched inputs by (kind, test, direction).
    notes
        Notes for the report.
    """

    job: ShakeJob
    model: ShakenModel
    masses: EffectiveMasses
    sine: tuple[SineRun, ...]
    random: tuple[RandomRun, ...]
    time: tuple[TimeRun, ...]
    notched: Mapping[tuple[str, str, str], NotchedRun]
    notes: tuple[str, ...]


def effective_masses(model: ShakenModel) -> EffectiveMasses:
    """Return the effective masses of all modes.

    In the full model, their sum is the mass minus the mass that moves rigidly with the bases.
    """
    n_s = 6 * len(model.bases)
    return EffectiveMasses(
        model.frequencies,
        model.damping_ratios,
        model.inputs[:n_s],
        np.asarray(model.B[2, :, :n_s] ** 2),
        np.diag(model.mass).copy(),
    )


def shake(job: ShakeJob) -> ShakeResult:
    """Return the responses of a structure on its bases to all tests of a job.

    Parameters
    ----------
    job
        The checked content of a shake file, from `read_shake`.

    Raises
    ------
    ModelError
        If a base does not hold the structure, a name does not exist, a mode in a band has no damping, or a notch is
        impossible.
    """
    if not (job.sine or job.random or job.shock):
        raise ModelError("shake: expected a sine, random, shock or transient test, got none")
    forces = [name for test in job.shock for name in (test.inputs or {}) if not is_base_input(job, name)]
    model = model_of(job, tuple(dict.fromkeys(forces)))
    notes: list[str] = list(model.notes)
    if job.residual_above is not None:
        model = with_static_modes(model, job.residual_above)
        notes.append(
            f"{model.n_residual} of {len(model.omega)} modes are above {job.residual_above:g} Hz and respond statically"
        )
    masses = effective_masses(model)
    notes += mass_notes(masses)
    sines = tuple(sine_run(model, test, d, job.uncertainty) for test in job.sine for d in test.directions)
    randoms = tuple(run for test in job.random for run in random_runs(model, test, job.uncertainty))
    times = tuple(run for test in job.shock for run in time_runs(model, test, job.uncertainty))
    for sine in job.sine:
        notes += band_notes(model, sine.level.last, f"sine {sine.name}")
    for test in job.random:
        notes += band_notes(model, test.band[1], f"random {test.name}")
    notched: dict[tuple[str, str, str], NotchedRun] = {}
    for request in job.notch:
        for run in sines if request.kind == "sine" else randoms:
            if request.tests and run.test not in request.tests:
                continue
            key = (request.kind, run.test, run.direction)
            if isinstance(run, SineRun):
                notched[key] = notched_sine(model, run, request.limits, request.deepest)
            else:
                notched[key] = notched_random(model, run, request.limits, request.deepest)
    notes += [note for run in times for note in run.notes]
    return ShakeResult(job, model, masses, sines, randoms, times, notched, tuple(dict.fromkeys(notes)))


def model_of(job: ShakeJob, forces: tuple[str, ...]) -> ShakenModel:
    """Return the structure of a job on its bases."""
    if isinstance(job.structure, System):
        bases = bases_of_system(job.structure, job.base, job.points)
        return shaken_system(job.structure, bases, job.damping, job.outputs, forces)
    bases = bases_of_body(job.structure, job.base, job.points)
    return shaken_body(job.structure, bases, job.damping, job.outputs, forces)


def is_base_input(job: ShakeJob, name: str) -> bool:
    """Return whether an input is a base direction, not a force."""
    names = {job.base} if isinstance(job.base, str) else set(job.base or ())
    base, _, direction = name.rpartition(":")
    return direction in DIRECTIONS and (not base or base in names or job.base is None)


def with_static_modes(model: ShakenModel, above: float) -> ShakenModel:
    """Return the model in which modes above a frequency [Hz] respond statically."""
    n_residual = int((model.frequencies > above).sum())
    if n_residual == len(model.omega):
        raise ModelError(
            f"shake: residual_above = {above:g} Hz is below all modes (the first is at {model.frequencies[0]:.4g} "
            "Hz), so that no mode would vibrate"
        )
    return replace(model, n_residual=n_residual)


def mass_notes(masses: EffectiveMasses) -> list[str]:
    """Return notes on directions in which the modes contain little of the mass, for one base."""
    if len(masses.directions) > 6:
        return []
    carried = masses.cumulative[-1][:3]
    return [
        f"direction {name}: the modes contain {100 * share:.1f} % of the mass; the rest moves rigidly with the base, "
        "or vibrates above the last mode and is included in the forces as a rigid mass"
        for name, share in zip(masses.directions, carried, strict=False)
        if share < LITTLE_MASS
    ]
