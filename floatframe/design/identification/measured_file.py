"""A measured motion from a file: positions, torques, and reactions at the base, by the names of their channels.

    joint1/angle                 position of a coordinate, by its name in results
    joint1/angle rate            its rate; joint1/angle acceleration: its acceleration; if missing: from positions
    joint1/angle torque          torque or force of its drive; joint1/angle force is the same
    base F_x ... base M_z        force and moment of the ground on the tree, about the origin of the ground

Rates that were not measured are central differences. A filter (Butterworth of fourth order, forwards and backwards,
without phase) removes noise from positions and rates. The same filter acts on the torques, the reactions and the rows
of the linear form, so that both sides of the equations remain equal at jumps (friction). After filtering, only as many
rows are kept as are independent within the passed band.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.design.identification.estimation import BASE, Measured
from floatframe.design.identification.regressors import LinearForm
from floatframe.engine.tree.topology import tree_of
from floatframe.errors import ModelError
from floatframe.files.signals.read_signals import read_signals
from floatframe.files.signals.signals import Signals
from floatframe.model.system import System

__all__ = ["MeasuredFile", "measured_coordinates", "read_measured"]

LEAST_ROWS = 20  #: smallest number of instants for an estimate
#: bandwidth of the filtered noise, relative to the cut-off: the integral of 1/(1 + x⁸)²
BAND = 0.898
ENDS = 3  #: periods of the cut-off that are excluded at both ends, where filters and differences are inaccurate
KINDS = {"": "position", " rate": "rate", " acceleration": "acceleration", " torque": "torque", " force": "torque"}


@dataclass(frozen=True, eq=False)
class MeasuredFile:
    """A measured motion, and notes on its processing."""

    measured: Measured
    notes: tuple[str, ...]


def read_measured(
    path: str | os.PathLike[str], form: LinearForm, *, cutoff: float | None = None, thin: int | None = None
) -> MeasuredFile:
    """Read a measured motion of a tree of rigid bodies, or of the independent coordinates of a system with loops.

    Parameters
    ----------
    path
        A table of channels, see `floatframe.files.signals.read_signals`.
    form
        The linear form; angles (rad, deg) and lengths in any unit that the file states are converted to its units.
    cutoff
        Cut-off frequency of the filter [Hz]; None: no filter.
    thin
        Every thin-th row is used; default: all rows, or with a cut-off as many as are independent after filtering.

    Raises
    ------
    ModelError
        If channels are missing, unknown or in wrong units, the file is too short, or the cut-off is too high.
    SignalError
        If the file cannot be read.
    """
    where = str(path)
    columns = form.columns
    names = [column.name for column in columns]
    signals = read_signals(path)
    known = [name + suffix for name in names for suffix in KINDS] + list(BASE)
    unknown = [name for name in signals.names if name not in known]
    if unknown:
        raise ModelError(
            f"{where}: channel {quoted(unknown[0])}: expected the name of a coordinate, alone or with "
            f"' rate', ' acceleration', ' torque', or 'base F_x' to 'base M_z'{nearest(unknown[0], known)}"
        )
    missing = [name for name in names if name not in signals.names]
    if missing:
        raise ModelError(
            f"{where}: no position of {', '.join(quoted(name) for name in missing)}; every coordinate needs one "
            f"(channels: {', '.join(signals.names)})"
        )
    has_torque = [name + " torque" in signals.names or name + " force" in signals.names for name in names]
    has_base = [name in signals.names for name in BASE]
    for has, what, all_names in ((has_torque, "torques", names), (has_base, "reactions", list(BASE))):
        if any(has) and not all(has):
            lacking = [name for name, is_there in zip(all_names, has, strict=True) if not is_there]
            raise ModelError(f"{where}: {what}: expected all or none, missing {', '.join(lacking)}")
    if not any(has_torque) and not any(has_base):
        raise ModelError(
            f"{where}: neither torques ('{names[0]} torque') nor reactions ('base F_x', ...) were measured"
        )
    steps = np.diff(signals.time)
    if len(signals.time) < LEAST_ROWS or steps.max() > 1.01 * steps.min():
        raise ModelError(
            f"{where}: expected at least {LEAST_ROWS} rows at one rate, got {len(signals.time)} with steps of "
            f"{steps.min(initial=np.inf):.6g} to {steps.max(initial=0):.6g} s; resample it first (docs/signals.md)"
        )
    return assembled(where, form, signals, columns, cutoff, thin, any(has_torque), any(has_base))


def measured_coordinates(path: str | os.PathLike[str], system: System) -> tuple[str, ...] | None:
    """Return the coordinates with measured positions, which drive a system with loops; None if there are none."""
    tree = tree_of(system)
    if not tree.cut:
        return None
    names = read_signals(path).names
    return tuple(column.name for column in tree.columns if column.name in names) or None


def assembled(
    where: str, form: LinearForm, signals: Signals, columns: tuple, cutoff: float | None, thin: int | None,
    has_torque: bool, has_base: bool,
) -> MeasuredFile:  # fmt: skip
    """Return the motion from channels that have been checked to exist."""
    t = np.asarray(signals.time)
    h, notes = float(t[-1] - t[0]) / (len(t) - 1), list(signals.notes)
    smooth = filter_of(where, cutoff, 1.0 / h)
    length, force, moment = units_of(form.system)

    def channel(name: str, unit: str) -> Array:
        signal = signals[name]
        if not signal.unit:
            return np.asarray(signal.values)
        return np.asarray(signal.to(unit).values)

    x, rate, acceleration, torque = (np.empty((len(t), len(columns))) for _ in range(4))
    derived = []
    for k, column in enumerate(columns):
        unit = length if column.unit == "m" else "rad"
        x[:, k] = smooth(channel(column.name, unit))
        for out, suffix, source, of_unit in (
            (rate, " rate", x, f"{unit}/s"), (acceleration, " acceleration", rate, f"{unit}/s^2"),
        ):  # fmt: skip
            if column.name + suffix in signals.names:
                out[:, k] = smooth(channel(column.name + suffix, of_unit))
            else:
                out[:, k] = np.gradient(source[:, k], h, edge_order=2)
                derived.append(column.name + suffix)
        if has_torque:
            own = " torque" if column.name + " torque" in signals.names else " force"
            torque[:, k] = channel(column.name + own, force if column.unit == "m" else moment)
    base = np.stack([channel(name, force if "F" in name else moment) for name in BASE], 1) if has_base else None
    if derived:
        notes.append(f"derived by central differences: {', '.join(derived[:4])}{', ...' if len(derived) > 4 else ''}")
    if cutoff is not None:
        notes.append(f"filtered at {cutoff:g} Hz, forwards and backwards: positions, torques with their linear form")
    ends = 2 if cutoff is None else int(np.ceil(ENDS / (cutoff * h)))
    step = thin or (1 if cutoff is None else int(np.ceil(1 / (2 * BAND * cutoff * h))))
    rows = slice(ends, len(t) - ends, step)
    if len(t[rows]) < LEAST_ROWS:
        raise ModelError(
            f"{where}: {len(t)} rows over {t[-1] - t[0]:.3g} s leave {len(t[rows])} instants, expected at least "
            f"{LEAST_ROWS}; measure longer, or raise the cut-off"
        )
    notes.append(f"{len(t[rows])} of {len(t)} rows used")
    samples = form.samples(x, rate, acceleration)
    measured = Measured(
        samples, torque if has_torque else None, base, time=t, smooth=None if cutoff is None else smooth, used=rows
    )
    return MeasuredFile(measured, tuple(notes))


def units_of(system: System) -> tuple[str, str, str]:
    """Return the units of length, force and moment of a system."""
    units = system.units
    return units.length_symbol, units.force_symbol, f"{units.force_symbol} {units.length_symbol}"


def filter_of(where: str, cutoff: float | None, rate: float) -> Callable[[Array], Array]:
    """Return the filter of a channel as a function."""
    if cutoff is None:
        return lambda values: values
    if not 0 < cutoff < 0.45 * rate:
        raise ModelError(
            f"{where}: cut-off: expected above 0 and below {0.45 * rate:.4g} Hz (rate {rate:.4g} Hz), got {cutoff:g}"
        )
    sos = butter(4, cutoff, fs=rate, output="sos")
    return lambda values: sosfiltfilt(sos, values, axis=0)
