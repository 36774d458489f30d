"""Frequency responses of a linearised system: amplitude and phase of every output divided by every input."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.linear.linearization import LinearSystem
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.errors import ModelError

__all__ = ["FrequencyResponse", "frequency_response", "resolved_frequencies"]

AROUND = 12.0  #: range around a resonance with additional points, in half-widths
POINTS_AROUND = 40  #: even, so that none is at the middle, where an undamped response is infinite
LEAST_DAMPING = 1e-4  #: least damping used for the width of a resonance, because an undamped one has zero width


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FrequencyResponse:
    """Responses y/s at frequencies.

    Parameters
    ----------
    frequencies
        Ascending frequencies, (n_f,) [1/unit of time].
    values
        Complex responses, (n_f, n_outputs, n_inputs).
    inputs
        Names of the inputs.
    outputs
        Names of the outputs.
    units
        Unit of each output divided by that of each input.
    """

    frequencies: Array
    values: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: tuple[tuple[str, ...], ...]

    @property
    def amplitudes(self) -> Array:
        """|y/s|, (n_f, n_outputs, n_inputs)."""
        return np.abs(self.values)

    @property
    def phases(self) -> Array:
        """Phase of y/s, continuous over the frequency, starting between -180 and 180, same shape [degrees]."""
        return np.degrees(np.unwrap(np.angle(self.values), axis=0))

    def to_table(self, time_unit: float = 1.0) -> Table:
        """Return the frequency in Hz, and amplitude and phase of every output divided by every input.

        time_unit: the unit of time of the system [s].
        """
        columns, units = {"frequency": self.frequencies / time_unit}, {"frequency": "Hz"}
        amplitudes, phases = self.amplitudes, self.phases
        for o, output in enumerate(self.outputs):
            for i, given in enumerate(self.inputs):
                name = f"{output} / {given}"
                columns |= {f"{name} amplitude": amplitudes[:, o, i], f"{name} phase": phases[:, o, i]}
                units |= {f"{name} amplitude": self.units[o][i], f"{name} phase": "degrees"}
        return Table(columns, units)


def frequency_response(linear: LinearSystem, frequencies: Array) -> FrequencyResponse:
    """Return the responses of a linearised system.

    Parameters
    ----------
    linear
        The linearised system, with inputs and outputs.
    frequencies
        Ascending, (n_f,) [1/unit of time of the system]; `resolved_frequencies` returns frequencies that resolve
        resonances.

    Raises
    ------
    ModelError
        If there is no input or output, or frequencies are negative or not ascending.
    """
    f = np.asarray(frequencies, dtype=float)
    if f.ndim != 1 or not len(f) or not np.isfinite(f).all() or f[0] < 0 or (np.diff(f) <= 0).any():
        raise ModelError("frequency_response: frequencies: expected ascending numbers of 0 or more")
    for kind in ("inputs", "outputs"):
        if not getattr(linear, kind):
            raise ModelError(
                f"frequency_response: the linearised system has no {kind}; name some: linearize(system, {kind}=[...]), "
                f"tables [{kind}.NAME] in the system file"
            )
    units = tuple(
        tuple(f"{o}/({i})" if set(i) & {" ", "/"} else f"{o}/{i}" for i in linear.input_units)
        for o in linear.output_units
    )
    return FrequencyResponse(f, linear.response(f), linear.inputs, linear.outputs, units)


def resolved_frequencies(linear: LinearSystem, first: float, last: float, *, n: int = 400) -> Array:
    """Return logarithmically spaced frequencies with additional ones around each resonance in the band, (n_f,).

    Parameters
    ----------
    linear
        The linearised system, whose modes give the resonances.
    first, last
        Ends of the band [Hz], 0 < first < last.
    n
        Number of logarithmically spaced frequencies.

    Raises
    ------
    ModelError
        If the band is empty or does not begin above zero.
    """
    if not 0 < first < last:
        raise ModelError(f"frequency response: expected an ascending band above 0, got {first:g} to {last:g}")
    modes = system_modes(linear)
    # frequencies of the peaks
    f = modes.natural_frequencies * np.sqrt(np.maximum(1 - 2 * modes.damping_ratios**2, 0.0))
    width = np.maximum(modes.damping_ratios, LEAST_DAMPING)
    inside = (f > first) & (f < last) & (modes.damping_ratios < 0.5)
    spread = AROUND * np.linspace(-1.0, 1.0, POINTS_AROUND) ** 3
    is_damped = inside & (modes.damping_ratios >= LEAST_DAMPING)
    around = (f[is_damped, None] * (1 + width[is_damped, None] * spread)).ravel()
    aside = (f[inside & ~is_damped, None] * (1 + LEAST_DAMPING * spread[np.abs(spread) > 0.5])).ravel()
    points = np.concatenate([np.geomspace(first, last, n), around, aside])
    return np.unique(points[(points >= first) & (points <= last)])
