"""RPC III files: round trips, an independent reader, layouts of other writers, damage."""

import contextlib
import io

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from rpc_reader.rpc_reader import ReadRPC

from floatframe.errors import SignalError
from floatframe.files.signals import Signals, read_signals, write_rpc


def three_channels(n=3000, rate=500.0):
    t = np.arange(n) / rate
    values = np.stack([3 * np.sin(9 * t), 1e-3 * np.cos(40 * t), 100 * t], axis=1)
    return Signals(t, values, ("wheel force", "Beschleunigung längs", "x"), ("kN", "m/s²", ""))


def foreign_reader(path):
    with contextlib.redirect_stdout(io.StringIO()):
        reader = ReadRPC(path)
        reader.import_rpc_data_from_file()
    return reader


@pytest.mark.parametrize("integers", [False, True])
@pytest.mark.parametrize("n", [1, 1024, 3000])
def test_channels_come_back_as_they_went(tmp_path, integers, n):
    path, given = tmp_path / "a.rsp", three_channels(max(n, 2))
    write_rpc(given, path, integers=integers)
    found = read_signals(path)
    assert (found.names, found.units) == (given.names, given.units)
    assert_allclose(found.time, given.time, rtol=1e-12, atol=0)
    step = np.abs(given.values).max(axis=0) * (1 / 65534 if integers else 2**-24) * 1.001
    assert (np.abs(found.values - given.values) <= step + 1e-30).all()


@pytest.mark.parametrize("integers", [False, True])
def test_another_reader_reads_the_same_numbers(tmp_path, integers):
    path, given = tmp_path / "a.rsp", three_channels()
    write_rpc(given, path, integers=integers)
    other, found = foreign_reader(path), read_signals(path)
    assert_allclose(other.get_data()[: len(found.time)], found.values, rtol=1e-12, atol=0)
    assert [c["Description"] for c in other.get_channels().values()] == list(given.names)
    assert [c["Units"] for c in other.get_channels().values()] == list(given.units)


def foreign_file(path, values, kind, per_frame, per_group, *, order="<", compact=False, **changes):
    """Write a file by the layout alone: groups, in each group every channel with its samples; by another hand."""
    n_t, n_channels = values.shape
    n_frames = -(-n_t // per_frame)
    head = {
        "FORMAT": "BINARY" if order == "<" else "BINARY_IEEE_BIG_END", "NUM_HEADER_BLOCKS": 0, "NUM_PARAMS": 0,
        "FILE_TYPE": "TIME_HISTORY", "DATA_TYPE": {"i2": "SHORT_INTEGER", "f4": "FLOATING_POINT"}[kind],
        "DELTA_T": 0.002, "CHANNELS": n_channels, "PTS_PER_FRAME": per_frame, "PTS_PER_GROUP": per_group,
        "FRAMES": n_frames, "INT_FULL_SCALE": 32768,
    }  # fmt: skip
    for k in range(n_channels):
        head |= {f"DESC.CHAN_{k + 1}": f"channel {k + 1}", f"UNITS.CHAN_{k + 1}": "g"}
        head |= {f"SCALE.CHAN_{k + 1}": 0.25 * (k + 1), f"UPPER_LIMIT.CHAN_{k + 1}": 1.0}
        head |= {f"LOWER_LIMIT.CHAN_{k + 1}": -1.0}
    head |= changes
    head["NUM_PARAMS"] = len(head)
    head["NUM_HEADER_BLOCKS"] = head_blocks = -(-len(head) // 4)
    text = b"".join(str(k).encode().ljust(32, b"\0") + str(v).encode().ljust(96, b"\0") for k, v in head.items())
    padded = np.zeros((n_frames * per_frame, n_channels))
    padded[:n_t] = values
    data = b""
    for first in range(0, len(padded), per_group):
        for k in range(n_channels):
            part = padded[first : first + per_group, k]
            part = part if compact else np.concatenate([part, np.zeros(per_group - len(part))])
            data += part.astype(order + kind).tobytes()
    path.write_bytes(text.ljust(head_blocks * 512, b"\0") + data)


@pytest.mark.parametrize("kind", ["i2", "f4"])
@pytest.mark.parametrize(("order", "compact"), [("<", False), (">", False), ("<", True)])
def test_groups_of_several_frames_and_both_byte_orders(tmp_path, kind, order, compact):
    path = tmp_path / "a.tim"
    counts = np.random.default_rng(4).integers(-32000, 32000, (64 * 5, 3)).astype(float)
    foreign_file(path, counts, kind, 64, 128, order=order, compact=compact)
    found = read_signals(path)
    assert_array_equal(found.values, counts * ([0.25, 0.5, 0.75] if kind == "i2" else 1.0))
    assert_allclose(np.diff(found.time), 0.002, rtol=1e-9, atol=0)
    if order == "<" and not compact and kind == "i2":
        foreign_file(path, counts[: 64 * 4], kind, 64, 128)  # whole groups, which the other reader takes too
        assert_allclose(foreign_reader(path).get_data(), counts[: 64 * 4] * [0.25, 0.5, 0.75], rtol=1e-12, atol=0)


def test_another_full_scale_is_taken_as_the_other_reader_takes_it_and_said(tmp_path):
    path = tmp_path / "a.rsp"
    foreign_file(path, np.arange(128.0)[:, None], "i2", 64, 64, INT_FULL_SCALE=32752)
    found = read_signals(path)
    assert_allclose(found.values, foreign_reader(path).get_data(), rtol=1e-12, atol=0)
    assert "INT_FULL_SCALE = 32752" in found.notes[0]


def test_a_filled_last_frame_is_said(tmp_path):
    path = tmp_path / "a.rsp"
    foreign_file(path, np.arange(1.0, 101.0)[:, None], "f4", 64, 64)
    assert read_signals(path).notes == (
        "the last 28 samples of all channels are equal; they may be padding of the last frame",
    )
    foreign_file(path, np.minimum(np.arange(256.0), 90.0)[:, None], "f4", 64, 64)  # stands still for two frames
    assert read_signals(path).notes == (
        "the last 64 samples of all channels are equal; they may be padding of the last frame",
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"PTS_PER_GROUP": 100}, "expected a multiple of PTS_PER_FRAME"),
        ({"FRAMES": 10**15}, "FRAMES = '1000000000000000': expected a whole number"),
        ({"CHANNELS": 2}, "bytes follow the head, expected 512"),
        ({"DATA_TYPE": "DOUBLE"}, "DATA_TYPE = 'DOUBLE': expected one of SHORT_INTEGER"),
        ({"DELTA_T": "0"}, "DELTA_T = 0"),
        ({"DELTA_T": "nan"}, "DELTA_T = 'nan'"),
        ({"SCALE.CHAN_1": "x"}, "SCALE.CHAN_1 = 'x'"),
        ({"FILE_TYPE": "HISTOGRAM"}, "expected TIME_HISTORY"),
        ({"HALF_FRAMES": "1"}, "half frames"),
        ({"FORMAT": "ASCII"}, "FORMAT = 'ASCII'"),
    ],
)
def test_heads_that_do_not_fit_are_refused(tmp_path, change, words):
    path = tmp_path / "a.rsp"
    foreign_file(path, np.arange(128.0)[:, None], "i2", 64, 128, **change)
    with pytest.raises(SignalError, match=words):
        read_signals(path)


@pytest.mark.parametrize("length", [0, 100, 700, 3000, -1])
def test_files_cut_off_are_refused(tmp_path, length):
    path = tmp_path / "a.rsp"
    write_rpc(three_channels(), path)
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(SignalError):
        read_signals(path)


def test_what_the_format_cannot_hold_is_not_written(tmp_path):
    t = np.arange(9) / 10
    for signals, words in (
        (Signals(t**2 + t, t[:, None], ("a",), ("m",)), "one step for all samples"),
        (Signals(t, t[:, None], ("ж",), ("m",)), "Windows-1252"),
        (Signals(t, t[:, None], ("a" * 96,), ("m",)), "up to 95 characters"),
        (Signals(t, 1e300 * t[:, None], ("a",), ("m",)), "single precision"),
    ):
        with pytest.raises(SignalError, match=words):
            write_rpc(signals, tmp_path / "a.rsp")
    assert list(tmp_path.iterdir()) == []
