"""Random tests: responses to power spectral densities of the bases, including cross spectra.

    S_y(f) = H(f) S(f) H(f)^H,   sigma² = ∫ S_y df,   nu² = ∫ f² S_y df / sigma²

S is Hermitian and positive semidefinite, with densities on its diagonal. Its other entries follow from the coherence
gamma² and the phase, S_ab = gamma sqrt(S_aa S_bb) exp(i phase). The integrals and their error bounds are in `resolved`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.durability.shaking.loads.inputs import input_index, require_damped
from floatframe.durability.shaking.loads.levels import Level, in_model, level_rms
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.responses.resolved import ResolvedBand, resolved_band
from floatframe.durability.shaking.responses.scalars import scalar_outputs, stress_groups
from floatframe.durability.shaking.responses.stresses import (
    VON_MISES,
    RandomVonMises,
    random_von_mises,
    von_mises_density,
)
from floatframe.durability.shaking.structure.model import Output, ShakenModel, driven, modal_response, response
from floatframe.errors import ModelError

__all__ = ["CrossSpectrum", "Miles", "RandomRun", "RandomTest", "input_density", "random_run", "random_runs"]

ROUNDING = 1e-9  #: largest magnitude of a negative eigenvalue of a coherence matrix that counts as rounding error
CHUNK_SIZE = 4_000_000  #: largest number of stress values in memory


@presented
@dataclass(frozen=True)
@checked_fields(ModelError)
class CrossSpectrum:
    """Coherence and phase between two inputs, the same at all frequencies.

    Parameters
    ----------
    a
        Name of the first input.
    b
        Name of the second input.
    coherence
        Coherence gamma², 0 to 1.
    phase
        Phase of S_ab, positive if a leads b [degrees].
    """

    a: str
    b: str
    coherence: float
    phase: float = 0.0


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RandomTest:
    """A stationary Gaussian excitation.

    `level` excites one direction after the other, with one run for each; `levels` excite several inputs in a single
    run.

    Parameters
    ----------
    name
        Name of the test.
    level
        Power spectral density of the excitation of one direction after the other.
    directions
        Directions that `level` excites, one after the other.
    levels
        Power spectral density of each input by name; all act at once.
    cross
        Coherence and phase between inputs of `levels`; inputs that are not named are independent.
    duration
        Duration for the expected largest value [s].
    """

    name: str
    level: Level | None = None
    directions: Sequence[str] = ("x", "y", "z")
    levels: Mapping[str, Level] | None = None
    cross: Sequence[CrossSpectrum] = ()
    duration: float | None = None

    def __post_init__(self) -> None:
        where = f"shake: random {self.name!r}"
        if (self.level is None) == (self.levels is None):
            raise ModelError(f"{where}: expected either level (one direction after the other) or levels (all at once)")
        for level in [self.level] if self.level is not None else list((self.levels or {}).values()):
            if not level.is_density:
                raise ModelError(
                    f"{where}: expected the unit of a density, such as g2/Hz or (m/s2)2/Hz, got {level.unit}"
                )
        if self.levels is not None and not self.levels:
            raise ModelError(f"{where}: levels: expected one input at least")
        if self.cross and self.levels is None:
            raise ModelError(f"{where}: cross spectra need inputs that act at once: give levels by input")
        if self.duration is not None and not (math.isfinite(self.duration) and self.duration > 0):
            raise ModelError(f"{where}: duration: expected seconds above 0, got {self.duration!r}")
        for each in self.cross:
            if not 0 <= each.coherence <= 1:
                raise ModelError(
                    f"{where}: coherence of {each.a} and {each.b}: expected 0 to 1, got {each.coherence!r}"
                )

    @property
    def band(self) -> tuple[float, float]:
        """First and last frequency of all levels [Hz]."""
        levels = [self.level] if self.level is not None else list((self.levels or {}).values())
        return min(level.first for level in levels if level), max(level.last for level in levels if level)


@dataclass(frozen=True)
class Miles:
    """Miles' estimate for a mode: the rms acceleration sqrt(pi/2 f Q S(f)) of a single mass at its frequency."""

    mode: int  #: number of the mode, from 1
    frequency: float  #: natural frequency of the mode [Hz]
    Q: float
    density: float  #: density of the input at the frequency [g²/Hz]
    grms: float  #: root mean square acceleration [g]
    share: float  #: fraction of the mass that is effective in the direction


@dataclass(frozen=True, eq=False)
class RandomRun:
    """Densities and rms of all outputs, including von Mises stresses as defined in `stresses`."""

    test: str
    direction: str  #: names of the inputs
    outputs: tuple[Output, ...]
    band: ResolvedBand
    level: Array  #: densities of the acting inputs, (n_f, n_act) [units of the model² per Hz]
    inputs: tuple[str, ...]  #: names of the acting inputs
    input_rms: Array  #: exact rms of the acting inputs, (n_act,) [units of the model]
    density: Array  #: densities of the outputs, (n_f, n_out) [units of the model² per Hz]
    rms: Array  #: root mean squares of the outputs, (n_out,)
    error: Array  #: bound of the relative integration error of rms, (n_out,)
    wide: Array  #: densities with uncertainty, to which notch limits apply, (n_f, n_out)
    uncertain: Array  #: rms with uncertainty, (n_out,)
    crossings: Array  #: zero up-crossings per second, (n_out,) [Hz]
    expected: Array | None  #: expected largest value in the duration, (n_out,)
    von_mises: Mapping[str, RandomVonMises]  #: von Mises stresses by place
    miles: tuple[Miles, ...]  #: estimates for the modes in the band; () if several inputs act
    transfer: Array  #: complex response of the rows per unit of input, (n_f, n_rows, n_act)
    field: Array | None = None  #: rms of the von Mises stress at all kept nodes, (n_nodes,)


def random_runs(model: ShakenModel, test: RandomTest, uncertainty: Uncertainty | None = None) -> list[RandomRun]:
    """Return the runs of a test: one for each direction, or a single one."""
    if test.level is not None:
        return [random_run(model, test, {direction: test.level}, uncertainty) for direction in test.directions]
    return [random_run(model, test, dict(test.levels or {}), uncertainty)]


def random_run(
    model: ShakenModel, test: RandomTest, levels: Mapping[str, Level], uncertainty: Uncertainty | None = None
) -> RandomRun:
    """Return the responses to densities of one or several inputs.

    Raises
    ------
    ModelError
        If there is no such input, a mode in the band has no damping, or the cross spectra are not positive
        semidefinite.
    """
    where, uncertainty = f"shake: random {test.name!r}", uncertainty or Uncertainty()
    acting = {input_index(model, name, where): (name, level) for name, level in levels.items()}
    first = min(level.first for level in levels.values())
    last = max(level.last for level in levels.values())
    require_damped(model, first, last, where)
    corners = np.concatenate([level.frequencies for level in levels.values()])
    band = resolved_band(first, last, model.frequencies, model.damping_ratios, corners)
    f, columns = band.frequencies, list(acting)
    density_in = input_density(model, test, acting, f)
    H = response(model, f)[:, :, columns]
    root = spectral_root(density_in)
    G = H @ root  # S_y = G G^H
    groups = stress_groups(model)
    density = densities(G, groups)
    rms2 = band.integral(density)
    rms = np.sqrt(np.maximum(rms2, 0.0))
    crossings = np.sqrt(
        np.divide(band.integral(f[:, None] ** 2 * density), rms2, out=np.zeros_like(rms2), where=rms2 > 0)
    )
    wide = density if uncertainty.is_none else wide_densities(uncertainty, f, H, root, groups)
    of_places = {
        model.outputs[rows.start].group: random_von_mises(
            band.integral(np.einsum("fai,fbi->fab", G[:, rows], G[:, rows].conj()).real)
        )
        for rows in groups
    }  # fmt: skip
    single = len(columns) == 1 and model.rates[columns[0]] == 2
    return RandomRun(
        test=test.name,
        direction=" and ".join(model.inputs[k] for k in columns),
        outputs=scalar_outputs(model),
        band=band,
        level=np.stack([density_in[:, k, k].real for k in range(len(columns))], axis=1),
        inputs=tuple(model.inputs[k] for k in columns),
        input_rms=np.array([level_rms(level) * si_factor(level, model, k) for k, (_, level) in acting.items()]),
        density=density,
        rms=rms,
        error=np.divide(band.error(density), 2 * rms2, out=np.zeros_like(rms2), where=rms2 > 0),
        wide=wide,
        uncertain=np.sqrt(np.maximum(band.integral(wide), 0.0)),
        crossings=crossings,
        expected=None if test.duration is None else largest(rms, crossings, test.duration),
        von_mises=of_places,
        miles=miles_of(model, columns[0], next(iter(levels.values()))) if single else (),
        transfer=H,
        field=von_mises_field(model, band, columns, root),
    )


def si_factor(level: Level, model: ShakenModel, k: int) -> float:
    """Return the factor from the acceleration unit of a level to that of the model."""
    one = Level(level.frequencies[:2], np.ones(2), level.unit, level.where)
    factor = in_model(level, model.inputs[k].rpartition(":")[2], model.units)
    return float(np.sqrt(one.in_si(level.frequencies[:1])[0] * factor))


def input_density(model: ShakenModel, test: RandomTest, acting: Mapping[int, tuple[str, Level]], f: Array) -> Array:
    """Return the spectral matrix of the acting inputs, (n_f, n_act, n_act) complex [units of the model² per Hz].

    Raises
    ------
    ModelError
        If it has a negative eigenvalue, because no signals have such coherences and phases.
    """
    where = f"shake: random {test.name!r}"
    columns = list(acting)
    size = np.stack(
        [
            np.sqrt(level.in_si(f) * in_model(level, model.inputs[k].rpartition(":")[2], model.units))
            for k, (_, level) in acting.items()
        ],
        axis=1,
    )
    gamma = np.eye(len(columns), dtype=complex)
    for each in test.cross:
        a, b = (input_index(model, name, where) for name in (each.a, each.b))
        for name, k in ((each.a, a), (each.b, b)):
            if k not in acting:
                raise ModelError(f"{where}: the cross spectrum names {name!r}, which has no level; give it a level")
        i, j = columns.index(a), columns.index(b)
        if i == j:
            raise ModelError(f"{where}: cross spectrum of {each.a!r} with itself")
        gamma[i, j] = math.sqrt(each.coherence) * np.exp(1j * math.radians(each.phase))
        gamma[j, i] = gamma[i, j].conj()
    least = float(np.linalg.eigvalsh(gamma)[0])
    if least < -ROUNDING:
        raise ModelError(
            f"{where}: the coherences and phases contradict each other (eigenvalue {least:.3g} of their matrix is "
            "below 0): "
            "no signals have them; if a follows b and b follows c, the phase from a to c is their sum"
        )
    return np.asarray(size[:, :, None] * gamma * size[:, None, :])


def spectral_root(S: Array) -> Array:
    """Return L with L L^H = S, (n_f, n, n), from the eigenvectors of S, because S may be singular."""
    if S.shape[1] == 1:
        return np.sqrt(S.real).astype(complex)
    values, axes = np.linalg.eigh(S)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0.0))[:, None, :])


def densities(G: Array, groups: Sequence[slice]) -> Array:
    """Return the densities of the rows of G G^H, followed by those of von Mises stresses, (n_f, n_out)."""
    extra = [von_mises_density(G[:, rows] @ G[:, rows].conj().transpose(0, 2, 1))[:, None] for rows in groups]
    return np.concatenate([(np.abs(G) ** 2).sum(axis=2), *extra], axis=1)


def wide_densities(uncertainty: Uncertainty, f: Array, H: Array, root: Array, groups: Sequence[slice]) -> Array:
    """Return the densities with uncertain frequencies and factors, (n_f, n_out).

    The density of an output at f is the largest one for the transfer functions between f/(1 + delta) and f/(1 - delta),
    with the spectral matrix L L^H of the inputs at f.
    """
    if root.shape[1] == 1:
        return uncertainty.widened(f, np.sqrt(densities(H, groups))) ** 2 * np.abs(root[:, 0]) ** 2
    factor, low, high = uncertainty.windows(f)
    largest_of = [densities(H[a:b] @ L, groups).max(axis=0) for a, b, L in zip(low, high, root, strict=True)]
    return np.asarray(np.array(largest_of) * factor[:, None] ** 2)


def largest(rms: Array, crossings: Array, duration: float) -> Array:
    """Return the expected largest value of a Gaussian process, (n,): sigma (a + 0.5772/a), a = sqrt(2 ln(nu T))."""
    a = np.sqrt(2 * np.log(np.maximum(crossings * duration, math.e)))
    return np.asarray(rms * (a + np.euler_gamma / a))


def miles_of(model: ShakenModel, k: int, level: Level) -> tuple[Miles, ...]:
    """Return Miles' estimates for the modes in the band of a level."""
    if model.inputs[k].rpartition(":")[2] not in ("x", "y", "z"):
        return ()
    shares = model.B[2, :, k] ** 2 / model.mass[k, k]
    factor = in_model(level, "x", model.units)
    found = []
    for mode, (f, zeta) in enumerate(zip(model.frequencies, model.damping_ratios, strict=True)):
        if level.first <= f <= level.last:
            density = float(level.in_si(np.array([f]))[0] * factor / model.gravity**2)
            Q = 1 / (2 * zeta)
            found.append(
                Miles(
                    mode + 1, float(f), float(Q), density, math.sqrt(math.pi / 2 * f * Q * density), float(shares[mode])
                )
            )
    return tuple(found)


def von_mises_field(model: ShakenModel, band: ResolvedBand, columns: Sequence[int], root: Array) -> Array | None:
    """Return the rms of the von Mises stress at all kept nodes, (n_nodes,), from the covariance of the modes."""
    if model.field is None:
        return None
    of_modes, of_s = model.field
    eta, omega = modal_response(model, band.frequencies)
    moved = eta[:, :, columns] @ root
    stress_modes = of_modes
    if of_s[:, :, columns].any():
        unit = np.zeros((3, len(columns), len(columns)))
        unit[0] = np.eye(len(columns))
        own = driven(unit, model.rates[list(columns)], omega) @ root
        moved, stress_modes = (
            np.concatenate([moved, own], axis=1),
            np.concatenate([of_modes, of_s[:, :, columns]], axis=2),
        )
    covariance = np.einsum("f,fki,fli->kl", band.weights, moved, moved.conj(), optimize=True).real
    values, axes = np.linalg.eigh(covariance)
    L = axes * np.sqrt(np.maximum(values, 0.0))
    n_nodes = len(stress_modes)
    rms = np.empty(n_nodes)
    rows = max(1, CHUNK_SIZE // max(1, 6 * L.shape[1]))
    for first in range(0, n_nodes, rows):
        s = stress_modes[first : first + rows] @ L
        rms[first : first + rows] = np.sqrt(np.maximum(np.einsum("nak,ab,nbk->n", s, VON_MISES, s, optimize=True), 0.0))
    return rms
