"""Sine tests: steady-state responses to a level over frequency, and responses during the sweep itself.

The response to a sweep s_ddot = Re(F(t) exp(i phi(t))), phi_dot = 2 pi f, f = f_1 2^(R t), is Re(w), where w is the
response to F exp(i phi) and |w| its envelope. In eigenvectors of the state matrix, each state follows
p_dot = mu p + c F exp(i phi), and over a step h

    p(h) = exp(mu h) p(0) + c ∫_0^h exp(mu (h - t)) G(t) exp(i phi_dot(0) t) dt exp(i phi(0)),   G = F exp(i r)

where r is the phase in excess of the frequency at the start of the step, ½ phi_ddot t², about 0.001. G is smooth for
any frequency, and is replaced by a cubic through four points, whose moments with the exponentials are exact. The step
0.05 / sqrt(phi_ddot) depends on the sweep, not on the oscillation.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from floatframe.durability.shaking.loads.inputs import input_index, require_damped
from floatframe.durability.shaking.loads.levels import Level, in_model
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.responses.resolved import resolved_band
from floatframe.durability.shaking.responses.scalars import scalar_outputs, scalar_sizes
from floatframe.durability.shaking.responses.time_steps import state_matrix
from floatframe.durability.shaking.structure.model import Output, ShakenModel, moving, response
from floatframe.errors import ModelError

__all__ = ["SineRun", "SineTest", "sine_run", "sweep_envelope"]

STEP = 0.05  #: step of the sweep, in 1/sqrt(phi_ddot)
MOST_STEPS = 2_000_000


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SineTest:
    """A sine sweep in several base directions, one after the other.

    Parameters
    ----------
    name
        Name of the test.
    level
        Amplitude over frequency, 0 to peak.
    directions
        Directions, one run for each; "base:x" if there are several bases.
    rate
        Sweep rate in octaves per minute; None: the response is steady at every frequency.
    downward
        Whether the sweep runs from the last frequency to the first.
    """

    name: str
    level: Level
    directions: Sequence[str] = ("x", "y", "z")
    rate: float | None = None
    downward: bool = False

    def __post_init__(self) -> None:
        where = f"shake: sine {self.name!r}"
        if self.level.is_density:
            raise ModelError(
                f"{where}: level: unit {self.level.unit} is that of a random test; expected g, m/s2, mm, ..."
            )
        if self.rate is not None and not (math.isfinite(self.rate) and self.rate > 0):
            raise ModelError(f"{where}: rate: expected octaves per minute above 0, got {self.rate!r}")
        if not self.directions:
            raise ModelError(f"{where}: directions: expected at least one")


@dataclass(frozen=True, eq=False)
class SineRun:
    """Amplitudes of all outputs in one direction."""

    test: str
    direction: str  #: name of the input
    outputs: tuple[Output, ...]  #: outputs of the model, followed by von Mises stresses
    frequencies: Array  #: frequencies of the test, (n_f,) [Hz]
    level: Array  #: amplitude of the input, (n_f,) [units of the model]
    sizes: Array  #: steady amplitudes, (n_f, n_out) [units of the model]
    transfer: Array  #: complex response of the model outputs per unit of input, (n_f, n_rows)
    uncertain: Array  #: amplitudes with uncertainty, (n_f, n_out)
    static: Array  #: quasi-static amplitudes: the response at the lowest frequency, scaled with the level, (n_f, n_out)
    swept_frequencies: Array = field(default_factory=lambda: np.zeros(0))  #: frequencies of the sweep, (n_t,) [Hz]
    swept: Array | None = None  #: envelopes during the sweep, (n_t, n_out)
    rate: float | None = None  #: sweep rate in octaves per minute

    @property
    def peaks(self) -> Array:
        """Largest steady amplitudes, (n_out,)."""
        return np.asarray(self.sizes.max(axis=0))

    @property
    def peak_frequencies(self) -> Array:
        """Frequencies of the peaks, (n_out,) [Hz]."""
        return np.asarray(self.frequencies[self.sizes.argmax(axis=0)])

    @property
    def swept_peaks(self) -> Array | None:
        """Largest amplitudes during the sweep, (n_out,)."""
        return None if self.swept is None else np.asarray(self.swept.max(axis=0))


def sine_run(model: ShakenModel, test: SineTest, direction: str, uncertainty: Uncertainty | None = None) -> SineRun:
    """Return the responses to a sine test in one direction.

    Raises
    ------
    ModelError
        If there is no such direction, or a mode in the band has no damping.
    """
    uncertainty = uncertainty or Uncertainty()
    k = input_index(model, direction, f"shake: sine {test.name!r}")
    level = test.level
    require_damped(model, level.first, level.last, f"shake: sine {test.name!r}")
    band = resolved_band(level.first, level.last, model.frequencies, model.damping_ratios, level.frequencies)
    f = band.frequencies
    amplitude = level.in_si(f) * in_model(level, direction.rpartition(":")[2], model.units)
    H = response(model, f)[:, :, k]
    sizes = scalar_sizes(model, H)
    low = np.array([min(level.first, float(model.frequencies[0])) * 1e-3])
    static = scalar_sizes(model, response(model, low)[:, :, k])
    swept_f, swept = np.zeros(0), None
    if test.rate is not None:
        swept_f, w = sweep_envelope(model, k, test)
        swept = scalar_sizes(model, w)
    return SineRun(
        test=test.name,
        direction=model.inputs[k],
        outputs=scalar_outputs(model),
        frequencies=f,
        level=amplitude,
        sizes=sizes * amplitude[:, None],
        transfer=H,
        uncertain=uncertainty.widened(f, sizes) * amplitude[:, None],
        static=static * amplitude[:, None],
        swept_frequencies=swept_f,
        swept=swept,
        rate=test.rate,
    )


def sweep_envelope(model: ShakenModel, k: int, test: SineTest, step: float = STEP) -> tuple[Array, Array]:
    """Return the frequencies of a sweep [Hz], (n_t,), and the complex envelopes of the outputs, (n_t, n_rows).

    The sweep begins in the steady state of its first frequency.

    Raises
    ------
    ModelError
        If the input moves bases relative to each other, which needs a sweep of their displacement too.
    """
    where, rate = f"shake: sine {test.name!r}", test.rate
    assert rate is not None
    if model.B[:2, :, k].any() or model.D[:2, :, k].any():
        raise ModelError(
            f"{where}: rate: bases that move relative to each other are supported only in steady state; remove rate"
        )
    growth = rate / 60 * math.log(2.0)  # growth rate of the frequency [1/s]
    f, t = sweep_times(test, growth, step, where)
    sign = -1.0 if test.downward else 1.0
    second = 1 / model.units.time
    n_m, n_d = len(model.omega), len(model.omega) - model.n_residual
    mu, X = np.linalg.eig(state_matrix(model, n_d) * second)  # states (eta, eta_dot): rates in 1/s
    c = np.linalg.solve(X, np.concatenate([np.zeros(n_d), model.B[2, :n_d, k]]) * second)
    level = test.level
    to_model = in_model(level, model.inputs[k].rpartition(":")[2], model.units)

    def load(frequency: Array) -> Array:
        return level.in_si(np.clip(frequency, level.first, level.last)) * to_model

    nodes = np.array([0.0, 1 / 3, 2 / 3, 1.0])
    to_powers = np.linalg.inv(np.vander(nodes, increasing=True))
    p = c * load(f[:1])[0] / (2j * np.pi * f[0] - mu)
    states = np.empty((len(f), 2 * n_d), complex)
    states[0] = p
    for n in range(len(f) - 1):
        h, w = t[n + 1] - t[n], 2 * np.pi * f[n]
        own = f[n] * np.exp(sign * growth * h * nodes)
        # phase in excess of the constant frequency at the start of the step: w (exp(g t) - 1 - g t)/g
        x = sign * growth * h * nodes
        beyond = w * (np.expm1(x) - x) / (sign * growth)
        powers = to_powers @ (load(own) * np.exp(1j * beyond))
        z, turn, decay = (1j * w - mu) * h, np.exp(1j * w * h), np.exp(mu * h)
        p = decay * p + c * h * (powers @ moments(z, turn, decay, mu * h))
        turned = np.exp(-1j * (w * h + beyond[-1]))  # the phase restarts at zero in every step
        p = p * turned
        states[n + 1] = p
    F = load(f)
    eta, eta_dot = states @ X[:n_d].T, states @ X[n_d:].T
    eta_ddot = F[:, None] * model.B[2, :n_d, k] - eta_dot @ model.C[:n_d, :n_d].T - eta * model.omega[:n_d] ** 2
    E = moving(model)
    out = sum(rates @ E[r, :, :n_d].T for r, rates in enumerate((eta, eta_dot, eta_ddot)))
    static = F[:, None] * (model.B[2, n_d:, k] / model.omega[n_d:] ** 2) if n_m > n_d else np.zeros((len(F), 0))
    return f, np.asarray(out + static @ E[0, :, n_d:].T + F[:, None] * model.D[2, :, k])


def sweep_times(test: SineTest, growth: float, step: float, where: str) -> tuple[Array, Array]:
    """Return frequencies [Hz] and times [s] of the steps of a sweep, including the corner frequencies of its level."""
    corners = test.level.frequencies[::-1] if test.downward else test.level.frequencies
    f, t = [np.array([corners[0]])], [np.zeros(1)]
    now = 0.0
    for a, b in itertools.pairwise(corners):
        duration = abs(math.log(b / a)) / growth
        # equal steps of sqrt(f), for which dt sqrt(phi_ddot) is constant
        n = math.ceil(2 * abs(math.sqrt(2 * math.pi * b / growth) - math.sqrt(2 * math.pi * a / growth)) / step)
        n = max(n, math.ceil(duration * growth / 0.05), 8)
        if n > MOST_STEPS:
            raise ModelError(
                f"{where}: rate: {test.rate:g} octaves per minute take {n:.1e} steps; remove it, because such a slow "
                "sweep is steady"
            )
        own = np.linspace(math.sqrt(a), math.sqrt(b), n + 1)[1:] ** 2
        own[-1] = b
        f.append(own)
        t.append(now + np.abs(np.log(own / a)) / growth)
        now += duration
    return np.concatenate(f), np.concatenate(t)


def moments(z: Array, turn: complex, decay: Array, left: Array) -> Array:
    """Return ∫_0^1 exp(left (1 - x)) exp(i w h x) x^m dx for m = 0 .. 3, (4, n); z = i w h - left."""
    found = np.empty((4, len(z)), complex)
    large = np.abs(z) > 4.0
    if large.any():
        own = (turn - decay[large]) / z[large]
        found[0, large] = own
        for m in range(1, 4):
            own = (turn - m * own) / z[large]
            found[m, large] = own
    if not large.all():
        x, w = GAUSS
        values = np.exp(left[~large][:, None] + z[~large][:, None] * x) * w
        for m in range(4):
            found[m, ~large] = values @ x**m
    return found


def gauss(n: int) -> tuple[Array, Array]:
    """Return points and weights of Gauss's rule on 0..1."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (x + 1) / 2, w / 2


GAUSS = gauss(14)
