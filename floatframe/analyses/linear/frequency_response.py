"""Frequency responses of a linearised system: amplitude and phase of every output divided by every input."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.plot_axes import log_frequencies
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.linear.linearization import LinearSystem
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.errors import ModelError
from floatframe.results.sensor_plots import figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["FrequencyResponse", "frequency_response", "resolved_frequencies"]

AROUND = 12.0  #: range with additional frequencies around a resonance, in half-widths of the resonance
#: even number of additional frequencies, so that none is at the resonance, where an undamped response is infinite
POINTS_AROUND = 40
ROUNDING = 1e-12  #: rounding error of a response, relative to the largest amplitude with the same unit
LEAST_DAMPING = 1e-4  #: smallest damping ratio for the width of a resonance, because an undamped one has zero width


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FrequencyResponse(Tabular):
    """Frequency responses y/s.

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
        """Phase of y/s, continuous over frequency, initially in -180 to 180, (n_f, n_outputs, n_inputs) [degrees]."""
        return np.degrees(np.unwrap(np.angle(self.values), axis=0))

    def plot(self, *, axes: "Sequence[Axes] | None" = None, time_unit: float = 1.0) -> "Figure":
        """Draw a Bode plot with a curve for each output and input: one panel of amplitudes for each unit, phases below.

        Parameters
        ----------
        axes
            Axes of a figure: one for the amplitudes of each unit, and one for the phases. None: a new figure.
        time_unit
            Unit of time of the system [s].

        Raises
        ------
        ModelError
            If another number of axes is given.
        """
        from matplotlib.figure import Figure

        pairs = [(o, i) for o in range(len(self.outputs)) for i in range(len(self.inputs))]
        amplitudes, phases = self.amplitudes, self.phases
        finite = np.where(np.isfinite(amplitudes), amplitudes, 0.0)
        sizes = {pair: float(finite[:, pair[0], pair[1]].max()) for pair in pairs}
        largest = {self.units[o][i]: 0.0 for o, i in pairs}
        for (o, i), size in sizes.items():
            largest[self.units[o][i]] = max(largest[self.units[o][i]], size)
        units = [unit for unit, size in largest.items() if size > 0] or [self.units[0][0]]
        if axes is None:
            new = Figure(figsize=(8, 2.8 * len(units) + 2.6), layout="constrained")
            axes = list(new.subplots(len(units) + 1, 1, sharex=True, squeeze=False).ravel())
        if len(axes) != len(units) + 1:
            raise ModelError(
                f"plot: expected {len(units) + 1} axes, for the amplitudes in {', '.join(units)} and the phases, got "
                f"{len(axes)}"
            )
        figure = figure_of(axes[0])
        hertz = self.frequencies / time_unit
        still = []
        for k, (o, i) in enumerate(pairs):
            unit, label = self.units[o][i], f"{self.outputs[o]} / {self.inputs[i]}"
            if sizes[o, i] <= ROUNDING * largest[unit]:
                still.append(label)
                continue
            curve = amplitudes[:, o, i]
            curve = np.where((curve > 0) & np.isfinite(curve), curve, np.nan)
            axes[units.index(unit)].loglog(hertz, curve, color=f"C{k % 10}", linewidth=1.4, label=label)
            axes[-1].semilogx(hertz, phases[:, o, i], color=f"C{k % 10}", linewidth=1.1)
        for unit, ax in zip(units, axes, strict=False):
            ax.set_ylabel(f"amplitude [{unit}]")
            if ax.get_legend_handles_labels()[0]:
                ax.legend(fontsize="small")
            ax.grid(which="major", alpha=0.4)
            ax.grid(which="minor", alpha=0.15)
        ax = axes[-1]
        ax.set_ylabel("phase [degrees]")
        low, high = ax.get_ylim()
        first, last = np.floor(low / 90 - 0.05), np.ceil(high / 90 + 0.05)
        ax.set_yticks(90 * np.arange(first, last + 1, max(1, (last - first) // 6)))
        ax.grid(which="major", alpha=0.4)
        ax.set_xlabel("frequency [Hz]")
        log_frequencies(ax)
        ax.set_xlim(hertz[0], hertz[-1])
        if still:
            figure.suptitle(f"no response: {', '.join(still)}", fontsize="small", color="0.4")
        return figure

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
    """Return logarithmically spaced frequencies with more of them around each resonance in the band, (n_f,).

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
