"""Signals in RPC III, the format of road simulators (.rsp, .drv, .tim): reading and writing.

A file is made of blocks of 512 bytes. The head has NUM_HEADER_BLOCKS of them, each of four parameters: a key of 32
bytes and a value of 96 bytes, both text padded with zeros; FORMAT, NUM_HEADER_BLOCKS and NUM_PARAMS come first. The
numbers are stored in groups: PTS_PER_GROUP samples of each channel, one channel after the other, which are
PTS_PER_GROUP/PTS_PER_FRAME frames; the last group is padded. A short integer n is the value n SCALE.CHAN_k
INT_FULL_SCALE/32768; a float is the value itself.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_file
from fe_models.foundation.words import quoted
from floatframe.errors import SignalError
from floatframe.files.signals.signals import Signals, equidistant_step

__all__ = ["read_rpc", "write_rpc"]

BLOCK, KEY, VALUE = 512, 32, 96  #: sizes of a block, a key and a value in bytes
RECORD = KEY + VALUE
FULL_SCALE = 32768  #: full scale of a short integer, by which INT_FULL_SCALE is divided
MOST_PARAMETERS, MOST_CHANNELS = 100000, 10000
ORDERS = {"BINARY": "<", "BINARY_IEEE_LITTLE_END": "<", "BINARY_IEEE_BIG_END": ">"}
TYPES = {"SHORT_INTEGER": "i2", "FLOATING_POINT": "f4"}
PER_FRAME = 1024  #: number of samples per frame in written files, with one frame per group


def read_rpc(path: str | os.PathLike[str]) -> Signals:
    """Read an RPC III file, with the units as given in the file.

    Raises
    ------
    SignalError
        If a parameter is missing or impossible, or the length of the file differs from that in its head.
    """
    path = Path(path)
    size = path.stat().st_size
    with path.open("rb") as file:
        head = read_head(path, file, size)
        order, kind = kind_of(path, head)
        n_channels = whole(path, head, "CHANNELS", 1, MOST_CHANNELS)
        per_frame = whole(path, head, "PTS_PER_FRAME", 1, size)
        per_group = whole(path, head, "PTS_PER_GROUP", per_frame, size)
        n_frames = whole(path, head, "FRAMES", 1, size)
        if per_group % per_frame:
            raise SignalError(
                f"{path}: PTS_PER_GROUP = {per_group}: expected a multiple of PTS_PER_FRAME = {per_frame}"
            )
        if head.get("HALF_FRAMES", "0") not in ("", "0"):
            raise SignalError(
                f"{path}: HALF_FRAMES = {quoted(head['HALF_FRAMES'])}: files with half frames are not read"
            )
        step = real(path, head, "DELTA_T")
        if step <= 0:
            raise SignalError(f"{path}: DELTA_T = {step:g}: expected a step above 0 [s]")
        n_samples = n_frames * per_frame
        n_groups = -(-n_samples // per_group)
        begin = whole(path, head, "NUM_HEADER_BLOCKS", 1, size) * BLOCK
        width = np.dtype(kind).itemsize
        full, exact = (n * n_channels * width for n in (n_groups * per_group, n_samples))
        found = size - begin
        if found not in (full, exact) and not full < found < full + BLOCK:
            raise SignalError(
                f"{path}: {found} bytes follow the head, expected {full}: {n_channels} channels of {n_frames} frames "
                f"of {per_frame} samples, in groups of {per_group}, {width} bytes each; the file is cut off, or "
                f"DATA_TYPE = {head['DATA_TYPE']} is wrong"
            )
        file.seek(begin)
        raw = np.frombuffer(file.read(min(found, full)), dtype=order + kind)
    values = np.empty((n_samples, n_channels))
    at = 0
    for group in range(n_groups):
        first = group * per_group
        n_here = min(per_group, n_samples - first)
        stride = per_group if found >= full else n_here
        part = raw[at : at + stride * n_channels].reshape(n_channels, stride)
        values[first : first + n_here] = part[:, :n_here].T
        at += stride * n_channels
    scale, notes = scales_of(path, head, n_channels, kind)
    values *= scale
    names = tuple(head.get(f"DESC.CHAN_{k}", "") or f"channel {k}" for k in range(1, n_channels + 1))
    units = tuple(head.get(f"UNITS.CHAN_{k}", "") for k in range(1, n_channels + 1))
    n_given = whole(path, head, "SAMPLES", 1, n_samples) if "SAMPLES" in head else n_samples
    if n_given == n_samples and (n_tail := constant_tail(values, per_frame)) > 0:
        notes.append(f"the last {n_tail} samples of all channels are equal; they may be padding of the last frame")
    bad = np.argwhere(~np.isfinite(values[:n_given]))
    if len(bad):
        raise SignalError(
            f"{path}, sample {bad[0][0] + 1}: channel {quoted(names[bad[0][1]])}: expected a finite number"
        )
    times = step * np.arange(n_given, dtype=float)
    return Signals(times, values[:n_given], names, units, str(path), tuple(notes))


def read_head(path: Path, file: Any, size: int) -> dict[str, str]:
    """Return the parameters of the head by key."""
    first = [parameter(file.read(RECORD)) for _ in range(3)]
    if [key for key, _ in first] != ["FORMAT", "NUM_HEADER_BLOCKS", "NUM_PARAMS"]:
        raise SignalError(
            f"{path}: expected an RPC III file, which begins with FORMAT, NUM_HEADER_BLOCKS and NUM_PARAMS, got "
            f"{', '.join(quoted(key) for key, _ in first)}"
        )
    head = dict(first)
    n_blocks = whole(path, head, "NUM_HEADER_BLOCKS", 1, MOST_PARAMETERS // 4)
    n_parameters = whole(path, head, "NUM_PARAMS", 3, MOST_PARAMETERS)
    if n_blocks * BLOCK > size or n_parameters > 4 * n_blocks:
        raise SignalError(
            f"{path}: NUM_HEADER_BLOCKS = {n_blocks} and NUM_PARAMS = {n_parameters} do not fit each other and a file "
            f"of {size} bytes; it is cut off"
        )
    for _ in range(3, 4 * n_blocks):
        key, value = parameter(file.read(RECORD))
        if key:
            head[key.upper()] = value
    return head


def parameter(record: bytes) -> tuple[str, str]:
    """Return key and value of a parameter; bytes after the first zero are ignored."""
    key, value = (part.split(b"\0")[0].decode("cp1252", "replace").strip() for part in (record[:KEY], record[KEY:]))
    return key, value


def kind_of(path: Path, head: Mapping[str, str]) -> tuple[str, str]:
    """Return byte order and type of the numbers."""
    if head["FORMAT"] not in ORDERS:
        raise SignalError(
            f"{path}: FORMAT = {quoted(head['FORMAT'])}: expected one of {', '.join(ORDERS)}; text files are not read"
        )
    if head.get("FILE_TYPE", "TIME_HISTORY") != "TIME_HISTORY":
        raise SignalError(f"{path}: FILE_TYPE = {quoted(head['FILE_TYPE'])}: expected TIME_HISTORY, signals over time")
    if head.get("DATA_TYPE") not in TYPES:
        raise SignalError(
            f"{path}: DATA_TYPE = {quoted(head.get('DATA_TYPE', ''))}: expected one of {', '.join(TYPES)}"
        )
    return ORDERS[head["FORMAT"]], TYPES[head["DATA_TYPE"]]


def whole(path: Path, head: Mapping[str, str], key: str, least: int, most: int) -> int:
    """Return a whole number of the head."""
    try:
        number = int(head[key])
    except (KeyError, ValueError):
        number = least - 1
    if not least <= number <= most:
        raise SignalError(
            f"{path}: {key} = {quoted(head.get(key, 'missing'))}: expected a whole number of {least} to {most}"
        )
    return number


def real(path: Path, head: Mapping[str, str], key: str) -> float:
    """Return a finite number of the head."""
    try:
        number = float(head[key])
    except (KeyError, ValueError):
        number = np.nan
    if not np.isfinite(number):
        raise SignalError(f"{path}: {key} = {quoted(head.get(key, 'missing'))}: expected a number")
    return number


def scales_of(path: Path, head: Mapping[str, str], n_channels: int, kind: str) -> tuple[Array, list[str]]:
    """Return the scale factor of each channel, and notes."""
    if kind == "f4":
        return np.ones(n_channels), []
    scale = np.array([real(path, head, f"SCALE.CHAN_{k}") for k in range(1, n_channels + 1)])
    full = whole(path, head, "INT_FULL_SCALE", 1, FULL_SCALE) if "INT_FULL_SCALE" in head else FULL_SCALE
    if full == FULL_SCALE:
        return scale, []
    note = f"INT_FULL_SCALE = {full}: integers are multiplied by SCALE and {full}/{FULL_SCALE}"
    return scale * full / FULL_SCALE, [note]


def constant_tail(values: Array, per_frame: int) -> int:
    """Return how many samples at the end of the last frame equal the last one in all channels; 0 if they are few."""
    last = values[-per_frame:]
    changes = np.flatnonzero((last != last[-1]).any(axis=1))
    n = len(last) - (int(changes[-1]) + 1 if len(changes) else 0)
    return n if 8 < n < len(values) else 0


def write_rpc(
    signals: Signals, path: str | os.PathLike[str], *, integers: bool = False, time_type: str = "RESPONSE"
) -> None:
    """Write channels as an RPC III file, in groups of one frame of 1024 samples.

    The last frame is padded with the last sample; the head also contains the number of samples (SAMPLES).

    Parameters
    ----------
    signals
        At equidistant times.
    path
        The file; conventionally .rsp for responses, .drv for drives, .tim for other time histories.
    integers
        Whether numbers are written as short integers, with each channel scaled to its largest value (an error of
        1/65534 of it), instead of floats of single precision.
    time_type
        RESPONSE, DRIVE, DESIRED, MULT_DRIVE or another word of the format.

    Raises
    ------
    SignalError
        If times are not equidistant, or a name, unit or number does not fit.
    """
    path = Path(path)
    step = equidistant_step(signals.time)
    if step is None:
        raise SignalError(f"{path}: RPC III has one step for all samples; resample the signals first")
    n_t, n_channels = signals.values.shape
    n_frames = -(-n_t // PER_FRAME)
    padded = np.concatenate([signals.values, np.repeat(signals.values[-1:], n_frames * PER_FRAME - n_t, axis=0)])
    largest = np.abs(padded).max(axis=0)
    if (largest > np.finfo(np.float32).max).any():
        raise SignalError(f"{path}: numbers up to {largest.max():.3g} do not fit single precision")
    scale = np.where(largest > 0, largest / (FULL_SCALE - 1), 1.0) if integers else np.ones(n_channels)
    scale = np.array([float(f"{s:.9E}") for s in scale])  # as written in the file
    numbers = np.clip(np.rint(padded / scale), 1 - FULL_SCALE, FULL_SCALE - 1) if integers else padded
    parameters: list[tuple[str, str]] = [
        ("FILE_TYPE", "TIME_HISTORY"), ("TIME_TYPE", time_type), ("DELTA_T", f"{step:.12E}"),
        ("CHANNELS", str(n_channels)), ("PTS_PER_FRAME", str(PER_FRAME)), ("PTS_PER_GROUP", str(PER_FRAME)),
        ("FRAMES", str(n_frames)), ("HALF_FRAMES", "0"), ("REPEATS", "0"), ("SAMPLES", str(n_t)),
        ("DATA_TYPE", "SHORT_INTEGER" if integers else "FLOATING_POINT"), ("INT_FULL_SCALE", str(FULL_SCALE)),
        ("OPERATION", "floatframe"), ("PARENT_1", ""),
    ]  # fmt: skip
    for k in range(n_channels):
        parameters += [
            (f"DESC.CHAN_{k + 1}", signals.names[k]), (f"UNITS.CHAN_{k + 1}", signals.units[k]),
            (f"SCALE.CHAN_{k + 1}", f"{scale[k]:.9E}"),
            (f"LOWER_LIMIT.CHAN_{k + 1}", f"{signals.values[:, k].min():.9E}"),
            (f"UPPER_LIMIT.CHAN_{k + 1}", f"{signals.values[:, k].max():.9E}"), (f"MAP.CHAN_{k + 1}", str(k + 1)),
        ]  # fmt: skip
    n_parameters = len(parameters) + 3
    n_blocks = -(-n_parameters // 4)
    first = [("FORMAT", "BINARY"), ("NUM_HEADER_BLOCKS", str(n_blocks)), ("NUM_PARAMS", str(n_parameters))]
    head = b"".join(record_of(path, key, value) for key, value in first + parameters).ljust(n_blocks * BLOCK, b"\0")
    frames = numbers.reshape(n_frames, PER_FRAME, n_channels).transpose(0, 2, 1)
    replace_file(path, head, np.ascontiguousarray(frames, dtype="<i2" if integers else "<f4").tobytes())


def record_of(path: Path, key: str, value: str) -> bytes:
    """Return a parameter as 128 bytes; `SignalError` if it does not fit."""
    try:
        words = key.encode("ascii"), value.encode("cp1252")
    except UnicodeEncodeError:
        raise SignalError(f"{path}: {key} = {quoted(value)}: RPC III supports only Windows-1252 text") from None
    if len(words[0]) >= KEY or len(words[1]) >= VALUE or b"\0" in words[1]:
        raise SignalError(f"{path}: {key} = {quoted(value)}: expected up to {VALUE - 1} characters")
    return words[0].ljust(KEY, b"\0") + words[1].ljust(VALUE, b"\0")
