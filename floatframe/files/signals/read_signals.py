"""Measured signals from files: text tables, MATLAB, RPC III."""

import os
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import is_stream, near_file
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.csv_file import RawTable, read_csv
from floatframe.files.signals.gaps import without_gaps
from floatframe.files.signals.mat_file import read_mat
from floatframe.files.signals.rpc_file import read_rpc
from floatframe.files.signals.signal_units import signal_unit
from floatframe.files.signals.signals import Signals

__all__ = ["SIGNAL_FORMATS", "read_signals"]

SIGNAL_FORMATS = {
    ".csv": "text", ".txt": "text", ".asc": "text", ".dat": "text", ".tsv": "text", ".mat": "MATLAB",
    ".rsp": "RPC III", ".drv": "RPC III", ".tim": "RPC III", ".rpc": "RPC III",
}  #: of files by their suffix  # fmt: skip


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
        Name of the column with the times; by default the first one of a text table, and in a .mat file what is called
        t or time. Times in other units than seconds are converted by the unit in their head.
    rate
        Samples a second [Hz] of a file without times; all its columns are channels then.
    fill
        Longest gap that is filled by interpolation [s]: missing samples, fields without numbers.
    uneven
        Let times with steps of a few sizes stand, which otherwise are taken for a fault of the record.
    decimal, delimiter
        Of text tables, "." or ",", and what stands between columns; by default found from the file.

    Raises
    ------
    SignalError
        If the file is not what its suffix says, is damaged, or has gaps; with line or place.
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
            f"name "
            "the column with the time, or give the rate of a table without times"
        )
    notes = [] if found_unit.factor == 1.0 else [f"times converted from {unit} to s"]
    return table.values[:, column] * found_unit.factor, column, notes


def is_time(name: str) -> bool:
    """Return whether the name of a variable denotes time."""
    return name.rpartition(".")[2].lower() in ("t", "time", "times", "zeit")
