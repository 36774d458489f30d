"""Measured signals from files: text tables, MATLAB, RPC III."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import is_stream, near_file
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.csv_file import RawTable, read_csv
from floatframe.files.signals.mat_file import read_mat
from floatframe.files.signals.rpc_file import read_rpc
from floatframe.files.signals.signal_units import signal_unit
from floatframe.files.signals.signals import Signals, equidistant_step

__all__ = ["SIGNAL_FORMATS", "read_signals", "without_gaps"]


SIGNAL_FORMATS = {
    ".csv": "text", ".txt": "text", ".asc": "text", ".dat": "text", ".tsv": "text", ".mat": "MATLAB",
    ".rsp": "RPC III", ".drv": "RPC III", ".tim": "RPC III", ".rpc": "RPC III",
}  #: format of a file by its suffix  # fmt: skip


def read_signals(
    path: str | os.PathLike[str],
    *,
    time: str | None = None,
    rate: float | None = None,
    fill: float = 0.0,
    uneven: bool = False,
    decimal: str | None = None,
    delimiter: str | None = None,
) -> Signals:
    """Read the channels of a file.

    Text tables (.csv, .txt, .asc, .dat, .tsv), MATLAB 5 and 7.3 (.mat), RPC III (.rsp, .drv, .tim, .rpc).

    Parameters
    ----------
    path
        The file.
    time
        Name of the column with the times; default: the first column of a text table, or the variable t or time of a
        .mat file. Times in other units than seconds are converted according to the unit in their head.
    rate
        Samples per second [Hz] of a file without times; all its columns are then channels.
    fill
        Longest gap that is filled by interpolation [s]: missing samples, fields without numbers.
    uneven
        Whether times with steps of a few sizes are accepted; otherwise they count as an error of the record.
    decimal, delimiter
        Decimal sign, "." or ",", and delimiter between columns of text tables; default: determined from the file.

    Raises
    ------
    SignalError
        If the file does not have the format of its suffix, is damaged, or has gaps; the message has the location.
    """
    path = Path(path)
    if is_stream(path):
        raise SignalError(f"{path}: expected a file, got a device or a pipe")
    if not path.is_file():
        raise SignalError(f"{path}: no such file{near_file(path)}")
    kind = SIGNAL_FORMATS.get(path.suffix.lower())
    if kind is None:
        raise SignalError(
            f"{path}: expected a file that ends in {', '.join(SIGNAL_FORMATS)}{nearest(path.suffix, SIGNAL_FORMATS)}"
        )
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise SignalError(f"{path}: rate: expected a number above 0 [Hz], got {rate!r}")
    if not (np.isfinite(fill) and fill >= 0):
        raise SignalError(f"{path}: fill: expected a number, 0 or more [s], got {fill!r}")
    if rate is not None and time is not None:
        raise SignalError(f"{path}: expected the name of the time ({quoted(time)}) or a rate ({rate:g} Hz), got both")
    if kind == "RPC III":
        if time is not None or rate is not None:
            raise SignalError(f"{path}: an RPC III file states its step; expected neither time nor rate")
        return read_rpc(path)
    if kind == "text":
        table, first = read_csv(path, decimal=decimal, delimiter=delimiter), True
    else:
        table, first = read_mat(path, time=time, rate=rate), False
    t, column, notes = times_of(path, table, time, rate, takes_first=first)
    kept = [k for k in range(len(table.names)) if k != column]
    if not kept:
        raise SignalError(f"{path}: expected a channel besides the time; a table without times needs its rate")
    names = tuple(table.names[k] for k in kept)

    def place(k: int) -> str:
        return f"{path}, line {table.lines[k]:.0f}" if table.lines is not None else f"{path}, sample {k + 1}"

    t, values, told = without_gaps(t, table.values[:, kept], names, place, fill=fill, uneven=uneven)
    units = tuple(table.units[k] for k in kept)
    return Signals(t, values, names, units, str(path), (*table.notes, *notes, *told))


def times_of(
    path: Path, table: RawTable, time: str | None, rate: float | None, *, takes_first: bool
) -> tuple[Array, int | None, list[str]]:
    """Return the times of a table [s], the index of their column, and notes."""
    if rate is not None:
        return np.arange(len(table.values)) / rate, None, []
    if time is not None:
        if time not in table.names:
            raise SignalError(f"{path}: no column {quoted(time)} with the time{nearest(time, table.names)}")
        column = table.names.index(time)
    elif takes_first:
        column = 0
    else:
        found = [k for k, name in enumerate(table.names) if is_time(name)]
        if len(found) != 1:
            raise SignalError(
                f"{path}: expected one variable t or time, got {len(found)}; name the one that holds the times, or "
                f"give the rate; there are {', '.join(table.names[:20])}"
            )
        column = found[0]
    unit = table.units[column]
    if not unit:
        return table.values[:, column], column, []
    found_unit = signal_unit(unit, f"{path}: column {quoted(table.names[column])} with the time")
    if found_unit.quantity != "time":
        raise SignalError(
            f"{path}: column {quoted(table.names[column])}, taken as the time, is in {unit} ({found_unit.quantity}); "
            "name the column that holds the times, or give the rate if the table has no times"
        )
    notes = [] if found_unit.factor == 1.0 else [f"times converted from {unit} to s"]
    return table.values[:, column] * found_unit.factor, column, notes


def is_time(name: str) -> bool:
    """Return whether the name of a variable denotes time."""
    return name.rpartition(".")[2].lower() in ("t", "time", "times", "zeit")


# gaps in measured histories: times that do not increase, changing steps, missing or invalid samples -------------------
# Each is refused in one message with the place in the file; gaps up to a stated length are filled by interpolation,
# which a note states.


FEW = 20  #: number of samples below which unequal steps count as intended
MOST_STEPS = 4  #: largest number of different steps that count as a change of rate; more are an adaptive step
COMMON = 0.9  #: fraction of equal steps above which the other steps are gaps
MOST_COUNTED = 1e12  #: largest number of samples in a gap
ALIKE = 0.02  #: relative difference of equal steps, due to rounded times


def without_gaps(
    time: Array,
    values: Array,
    names: Sequence[str],
    place: Callable[[int], str],
    *,
    fill: float = 0.0,
    uneven: bool = False,
) -> tuple[Array, Array, tuple[str, ...]]:
    """Return times and values without gaps, and notes on what was done.

    Parameters
    ----------
    time
        Times as read, (n_t,) [s]; NaN if missing.
    values
        Samples, (n_t, n_channels); NaN if missing.
    names
        Names of the channels.
    place
        Function from k to the location of sample k in the file as text, such as "road.csv, line 17".
    fill
        Longest gap that is filled by a monotone cubic (PCHIP) between the samples beside it [s].
    uneven
        Whether steps of several sizes are accepted.

    Raises
    ------
    SignalError
        If a gap is longer; the message has the location of the first one.
    """
    time, values = np.array(time, dtype=float), np.array(values, dtype=float)
    require_rising(time, place)
    step = usual_step(time)
    notes: list[str] = []
    if step is not None and equidistant_step(time) is None:
        if not uneven:
            require_whole_steps(time, step, place)
        if not uneven or fill > 0:
            time, values, told = with_lost_samples(time, values, step, fill, place)
            notes += told
    elif step is None and not uneven:
        require_one_rate(time, place)
    values, told = with_numbers(time, values, names, fill, place)
    return time, values, (*notes, *told)


def require_rising(time: Array, place: Callable[[int], str]) -> None:
    """Raise `SignalError` at the first time that is not a number, or does not increase."""
    bad = np.flatnonzero(~np.isfinite(time))
    if len(bad):
        raise SignalError(f"{place(int(bad[0]))}: the time is missing or no number; expected rising times")
    bad = np.flatnonzero(np.diff(time) <= 0)
    if len(bad):
        k = int(bad[0]) + 1
        more = f" ({len(bad)} such places)" if len(bad) > 1 else ""
        raise SignalError(
            f"{place(k)}: expected times that rise, got {time[k]:.9g} after {time[k - 1]:.9g}{more}; is this column "
            f"the "
            "time? A table without times needs its rate"
        )


def usual_step(time: Array) -> float | None:
    """Return the step of nearly all samples; None if there is none."""
    if len(time) < FEW:
        return None
    dt = np.diff(time)
    step = float(np.median(dt))
    alike = np.abs(dt - step) <= ALIKE * step
    return float(dt[alike].mean()) if alike.mean() >= COMMON else None


def require_whole_steps(time: Array, step: float, place: Callable[[int], str]) -> None:
    """Raise `SignalError` where a step is not a multiple of the usual step, because the rate changes there."""
    dt = np.diff(time)
    odd = np.flatnonzero((np.abs(dt - step) > 10 * ALIKE * step) & (np.abs(dt / step - np.round(dt / step)) > 0.1))
    if len(odd):
        k = int(odd[0])
        raise SignalError(
            f"{place(k + 1)}: the step is {dt[k]:.6g} s, elsewhere {step:.6g} s, and no multiple of it ({len(odd)} "
            "such places); resample it (resample = ..., or uneven steps allowed)"
        )


def with_lost_samples(
    time: Array, values: Array, step: float, fill: float, place: Callable[[int], str]
) -> tuple[Array, Array, list[str]]:
    """Return times with the missing samples inserted, and NaN as their values."""
    counts = np.minimum(np.round(np.diff(time) / step), MOST_COUNTED).astype(np.int64)
    wide = np.flatnonzero(counts > 1)
    if not len(wide):
        return time, values, []
    longest = int(wide[np.argmax(counts[wide])])
    length = float(time[longest + 1] - time[longest])
    n_lost = int((counts[wide] - 1).sum())
    if length > fill * (1 + 1e-9):
        k = next(int(i) for i in wide if time[i + 1] - time[i] > fill * (1 + 1e-9))
        raise SignalError(
            f"{place(k + 1)}: samples are missing between t = {time[k]:.9g} and {time[k + 1]:.9g} s, at steps of "
            f"{step:.6g} s ({n_lost} samples in {len(wide)} gaps, the longest {length:.6g} s); gaps up to a length are "
            f"filled by interpolation on request (fill = {length:.3g})"
        )
    row = np.concatenate([[0], np.cumsum(np.maximum(counts, 1))])
    whole = np.full((int(row[-1]) + 1, values.shape[1]), np.nan)
    whole[row] = values
    times = np.interp(np.arange(len(whole)), row, time)
    return times, whole, [f"{n_lost} missing samples in {len(wide)} gaps, the longest {length:.6g} s"]


def require_one_rate(time: Array, place: Callable[[int], str]) -> None:
    """Raise `SignalError` if the record changes between a few rates."""
    if len(time) < FEW:
        return
    dt = np.diff(time)
    kinds: list[float] = []
    for size in dt:  # until there are too many kinds: the step is then adaptive, and intended
        if all(abs(size - kind) > 10 * ALIKE * kind for kind in kinds):
            kinds.append(float(size))
            if len(kinds) > MOST_STEPS:
                return
    if len(kinds) > 1:
        k = int(np.flatnonzero(np.abs(dt - dt[0]) > 10 * ALIKE * dt[0])[0])
        raise SignalError(
            f"{place(k + 1)}: the step changes from {dt[0]:.6g} to {dt[k]:.6g} s ({len(kinds)} different steps in the "
            "record); resample it (resample = ..., or uneven steps allowed)"
        )


def with_numbers(
    time: Array, values: Array, names: Sequence[str], fill: float, place: Callable[[int], str]
) -> tuple[Array, list[str]]:
    """Return values with gaps filled; `SignalError` for the first gap that is too long, or at an end."""
    from scipy.interpolate import PchipInterpolator

    notes = []
    for column, name in enumerate(names):
        bad = ~np.isfinite(values[:, column])
        if not bad.any():
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]]).astype(np.int8)))
        begins, ends = edges[::2], edges[1::2]  # beginnings and exclusive ends of the gaps
        for first, end in zip(begins, ends, strict=True):
            where = f"{place(int(first))}: channel {quoted(name)}"
            if first == 0 or end == len(time):
                at = "begins" if first == 0 else "ends"
                raise SignalError(f"{where} {at} without numbers; expected a number in every sample there: cut it off")
            length = float(time[end] - time[first - 1])
            if length > fill * (1 + 1e-9):
                raise SignalError(
                    f"{where}: {end - first} samples are no numbers, from t = {time[first]:.9g} s on ({int(bad.sum())} "
                    f"in the channel, in {len(begins)} gaps); gaps up to a length are filled by interpolation "
                    f"on request (fill = {length:.3g})"
                )
        good = ~bad
        values[bad, column] = PchipInterpolator(time[good], values[good, column])(time[bad])
        longest = float((time[ends] - time[begins - 1]).max())
        notes.append(
            f"channel {name}: {int(bad.sum())} samples in {len(begins)} gaps filled by interpolation, the longest "
            f"{longest:.6g} s"
        )
    return values, notes
