"""Files of measured signals: what they hold is read, what is doubtful is asked back."""

import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_allclose

from floatframe.errors import SignalError
from floatframe.files.signals import read_signals
from floatframe.files.signals.mat_file import elements, sound_variables


def written(tmp_path, text, name="a.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "text",
    [
        "time [s],acc [g],x (mm)\n0,1.5,2\n0.001,-1.25,3e-1\n0.002,1,4\n",
        "time [ms];acc [g];x (mm)\n0,0;1,5;2\n1,0;-1,25;3e-1\n2,0;1;4\n",
        "time\tacc\tx\ns\tg\tmm\n0\t1.5\t2\n0.001\t-1.25\t0.3\n0.002\t1\t4\n",
        "# bench 3\nsome words\n\ntime [s] acc[g] x[mm]\n0 1,5 2\n0,001 -1,25 0,3\n0,002 1 4\n",
        '"time [s]","acc [g]","x (mm)"\n"0","1.5","2",\n"0.001","-1.25","0.3",\n"0.002","1","4",\n',
        "\ufefftime [s] | acc [g] | x [mm]\r\n0|1.5|2\r\n.001|-1.25|.3\r\n.002|1|4\r\n",
    ],
    ids=["commas", "semicolons, decimal commas, ms", "tabs, line of units", "spaces", "quotes", "bars, BOM, CRLF"],
)
def test_text_tables_of_all_manners_hold_the_same(tmp_path, text):
    signals = read_signals(written(tmp_path, text))
    assert (signals.names, signals.units) == (("acc", "x"), ("g", "mm"))
    assert_allclose(signals.time, [0, 0.001, 0.002], rtol=1e-15, atol=0)
    assert_allclose(signals.values, [[1.5, 2], [-1.25, 0.3], [1, 4]], rtol=1e-15, atol=0)


def test_a_table_without_times_or_head_needs_its_rate(tmp_path):
    path = written(tmp_path, "1\n2\n1.5\n")
    signals = read_signals(path, rate=200.0)
    assert signals.names == ("column 1",)
    assert_allclose(signals.time, [0, 0.005, 0.01], rtol=1e-15, atol=0)
    with pytest.raises(SignalError, match=r"expected a channel besides the time; a table without times needs its rate"):
        read_signals(path)


def rows(times, values):
    return "t [s],a [g]\n" + "".join(f"{t},{v}\n" for t, v in zip(times, values, strict=True))


def test_gaps_are_refused_with_their_line_and_filled_up_to_a_length(tmp_path):
    t = [f"{k / 1000:.3f}" for k in range(60)]
    values = [f"{np.sin(k / 9):.15f}" for k in range(60)]
    broken = written(tmp_path, rows(t, [*values[:20], "", "NaN", "n/a", *values[23:]]))
    with pytest.raises(SignalError, match=r"a.csv, line 22: channel 'a': 3 samples are no numbers.*fill = 0.004"):
        read_signals(broken, fill=0.003)
    lost = written(tmp_path, rows(t[:20] + t[23:], values[:20] + values[23:]), "lost.csv")
    with pytest.raises(SignalError, match=r"lost.csv, line 22: samples are missing between t = 0.019 and 0.023 s"):
        read_signals(lost)
    for path, words in ((broken, "samples are no numbers"), (lost, "samples are missing")):
        with pytest.raises(SignalError, match=words):
            read_signals(path, fill=0.0039)
    for path, words in ((broken, "3 samples in 1 gaps filled"), (lost, "3 missing samples in 1 gaps")):
        filled = read_signals(path, fill=0.004)
        assert_allclose(filled.time, np.arange(60) / 1000, rtol=0, atol=1e-12)
        assert_allclose(filled.values[:, 0], np.sin(np.arange(60) / 9), rtol=0, atol=(4 / 9) ** 2 / 8)  # of the chord
        assert np.abs(filled.values[20:23, 0] - np.sin(np.arange(20, 23) / 9)).max() > 1e-6  # interpolated, not known
        assert any(words in note for note in filled.notes)


def test_the_note_of_filled_gaps_counts_them_and_names_the_longest(tmp_path):
    """From the last sample before a gap to the first one behind it: 2 ms, 4 ms and 3 ms."""
    t = [f"{k / 1000:.3f}" for k in range(60)]
    values = np.arange(60.0).astype(str)
    values[[10, 20, 21, 22, 40, 41]] = "NaN"
    filled = read_signals(written(tmp_path, rows(t, values)), fill=0.0041)
    assert "channel a: 6 samples in 3 gaps filled by interpolation, the longest 0.004 s" in filled.notes
    assert_allclose(filled.values[:, 0], np.arange(60.0), rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: [*t[:30], t[29], *t[31:]], r"line 32: expected times that rise, got 0.029 after 0.029"),
        (lambda t: [*t[:30], "", *t[31:]], r"line 32: the time is missing"),
        (lambda t: [*t[:30], *(f"{0.03 + k / 2000:.4f}" for k in range(30))], r"line 33: the step changes from"),
        (lambda t: [*t[:30], *(f"{0.0304 + k / 1000:.4f}" for k in range(30))], r"line 32: the step is 0.0014 s"),
    ],
    ids=["repeated", "no time", "two rates", "a shifted part"],
)  # fmt: skip
def test_times_that_are_none_are_refused_with_their_line(tmp_path, change, words):
    t = change([f"{k / 1000:.3f}" for k in range(60)])
    with pytest.raises(SignalError, match=words):
        read_signals(written(tmp_path, rows(t, range(60))))


def test_steps_that_differ_by_more_than_a_fifth_are_two_rates(tmp_path):
    """30 steps of 10 ms, then 30 of 12.1 ms, which are 1.21 of them, are two rates; 11.9 ms count as uneven steps."""
    for longer, is_refused in ((0.0121, True), (0.0119, False)):
        t = [f"{0.01 * k if k < 30 else 0.3 + longer * (k - 30):.5f}" for k in range(60)]
        path = written(tmp_path, rows(t, range(60)))
        if is_refused:
            with pytest.raises(SignalError, match=r"line 33: the step changes from 0.01 to 0.0121 s \(2 different"):
                read_signals(path)
        else:
            assert_allclose(np.diff(read_signals(path).time)[[0, -1]], [0.01, longer], rtol=1e-9, atol=0)


def test_uneven_times_may_be_meant(tmp_path):
    path = written(tmp_path, "t [s],x [mm]\n0,0\n0.5,1\n0.6,4\n2,4\n")
    assert_allclose(read_signals(path).time, [0, 0.5, 0.6, 2], rtol=1e-15, atol=0)
    two = written(tmp_path, rows([k / 10 for k in range(20)] + [2 + k / 20 for k in range(20)], range(40)))
    assert len(read_signals(two, uneven=True).time) == 40


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty file"),
        ("t,a\n0,1\n1,x\n", "line 3: expected a number in column 2, got 'x'"),
        ("t,a\n0,1\n1,2,3\n", "line 3: expected 2 fields .*, got 3"),
        ("t;a\n0,0;1.5\n0,1;2.5\n", "decimal comma .* and with decimal point"),
        ("0,1\n1,2\n2,3\n", "can be read with commas between columns or as decimal commas"),
        ("a [g],b [g]\n0,1\n1.5,2\n", r"taken as the time, is in g \(acceleration\)"),
        ("t [s]\n0\n1\n", "expected a channel besides the time"),
        ("words\nand words\n", "no row of numbers"),
        (b"\x00\x01\x02\x03" * 99, "got binary data"),
    ],
)
def test_doubtful_tables_are_asked_back(tmp_path, text, words):
    with pytest.raises(SignalError, match=words):
        read_signals(written(tmp_path, text))


def test_names_that_are_not_there_are_told_with_the_nearest(tmp_path):
    signals = read_signals(written(tmp_path, "t,acc x,acc y\n0,1,2\n1.5,2,3\n"))
    with pytest.raises(SignalError, match="did you mean 'acc x'"):
        signals["acc_x"]
    with pytest.raises(SignalError, match="expected a number of 1 to 2"):
        signals[3]
    assert signals[2].name == "acc y"
    with pytest.raises(SignalError, match=r"no such file; did you mean 'a.csv'\?"):
        read_signals(tmp_path / "b.csv")
    with pytest.raises(SignalError, match=r"expected a file that ends in .csv"):
        read_signals(written(tmp_path, "x", "a.xyz"))


def test_matlab_files_of_both_versions_hold_the_same(tmp_path):
    h5py = pytest.importorskip("h5py")
    t = np.arange(50) / 100
    acc, table = np.sin(9 * t), np.stack([t**2, np.cos(t)], axis=1)
    scipy.io.savemat(tmp_path / "5.mat", {
        "t": t[:, None], "acc": acc[None, :], "acc_unit": "g", "force": {"values": table, "unit": "kN", "label": "F"},
        "short": np.arange(7.0), "words": "bench",
    })  # fmt: skip
    with h5py.File(tmp_path / "73.mat", "w", userblock_size=512) as file:
        for name, value in {"t": t[None, :], "acc": acc[:, None], "short": np.arange(7.0)[None, :]}.items():
            file[name] = value
        group = file.create_group("force")
        group["values"] = table.T
        for owner, name, text in ((file, "acc_unit", "g"), (group, "unit", "kN"), (group, "label", "F")):
            owner[name] = np.array([[ord(c)] for c in text], dtype=np.uint16)
            owner[name].attrs["MATLAB_class"] = np.bytes_("char")
    for name in ("5.mat", "73.mat"):
        signals = read_signals(tmp_path / name)
        assert sorted(zip(signals.names, signals.units, strict=True)) == [("F 1", "kN"), ("F 2", "kN"), ("acc", "g")]
        assert_allclose(signals["acc"].values, acc, rtol=1e-15, atol=0)
        assert_allclose(signals["F 2"].values, table[:, 1], rtol=1e-15, atol=0)
        assert any("omitted, because their length is not 50: short" in note for note in signals.notes)
        with pytest.raises(SignalError, match="no variable 'tt' with the time"):
            read_signals(tmp_path / name, time="tt")
    assert len(read_signals(tmp_path / "5.mat", rate=100.0).names) == 4


def test_complex_channels_of_both_versions_are_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    t, z = np.arange(50) / 100, np.exp(0.3j * np.arange(50))
    scipy.io.savemat(tmp_path / "5.mat", {"t": t, "x": z})
    with h5py.File(tmp_path / "73.mat", "w", userblock_size=512) as file:
        file["t"] = t[None, :]
        file["x"] = np.array(list(zip(z.real, z.imag, strict=True)), dtype=[("real", float), ("imag", float)])[None, :]
    for name in ("5.mat", "73.mat"):
        with pytest.raises(SignalError, match="x: expected real numbers, got complex ones"):
            read_signals(tmp_path / name)


def test_damaged_matlab_files_are_refused(tmp_path):
    t = np.arange(500) / 100
    scipy.io.savemat(tmp_path / "a.mat", {"t": t, "x": np.random.default_rng(0).normal(size=500)}, do_compression=True)
    whole = (tmp_path / "a.mat").read_bytes()
    for content, words in ((whole[: len(whole) // 2], "a.mat"), (b"x" * 900, "expected a MATLAB file")):
        with pytest.raises(SignalError, match=words):
            read_signals(written(tmp_path, content, "a.mat"))
    scipy.io.savemat(tmp_path / "c.mat", {"t": t, "x": t * 1j})
    with pytest.raises(SignalError, match="expected real numbers"):
        read_signals(tmp_path / "c.mat")


@pytest.mark.parametrize("is_packed", [False, True])
def test_altered_bytes_of_a_matlab_file_are_refused_or_change_numbers_alone(tmp_path, is_packed):
    """SciPy's reader would take the program along with some of them; tags and sizes are walked through before."""
    t = np.arange(40) / 100
    path = tmp_path / "a.mat"
    content = {"t": t, "x": np.sin(t), "s": {"values": np.cos(t), "unit": "g"}}
    scipy.io.savemat(path, content, do_compression=is_packed)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(150):
        altered = bytearray(whole)
        for place in rng.integers(124, len(whole), 3):
            altered[place] = rng.integers(0, 256)
        path.write_bytes(bytes(altered))
        try:
            assert len(read_signals(path).time) == 40
        except SignalError:
            refused += 1
    assert refused > 30


def test_numbers_that_do_not_fill_their_dimensions_are_found_before_the_reader(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"x": np.arange(40.0)})
    whole = path.read_bytes()
    assert sound_variables("a.mat", whole) == ["x"]
    place = whole.index(np.array([1, 40], dtype="<i4").tobytes())
    altered = whole[:place] + np.array([1, 39], dtype="<i4").tobytes() + whole[place + 8 :]
    with pytest.raises(SignalError, match=r"a.mat: array 'x': its numbers do not fill \(1, 39\); the file is damaged"):
        sound_variables("a.mat", altered)


def test_an_element_that_ends_beyond_its_file_is_refused():
    """A tag of 8 bytes and 16 bytes of data; with 17 claimed one is missing."""
    for size, is_sound in ((16, True), (17, False)):
        data = np.array([9, size], dtype="<u4").tobytes() + bytes(16)
        if is_sound:
            assert list(elements("a.mat", data, 0, len(data), "<")) == [(9, 8, 24)]
        else:
            with pytest.raises(SignalError, match="an element of 17 bytes at byte 0, where 16 are left"):
                list(elements("a.mat", data, 0, len(data), "<"))


def test_an_array_that_claims_more_than_deflate_can_hold_is_refused_before_it_is_read(tmp_path):
    """1024 numbers of 8 bytes without a stored byte claim 8192 bytes, more than 1100; 128 of them do not."""
    h5py = pytest.importorskip("h5py")
    for n, is_sound in ((128, True), (1024, False)):
        with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
            file.create_dataset("t", data=np.arange(n) / 100.0)
            file.create_dataset("x", shape=(n,), dtype=float, chunks=(n,))  # no chunk is written
        image = (tmp_path / "a.mat").read_bytes()
        (tmp_path / "a.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + image[128:])
        if is_sound:
            assert len(read_signals(tmp_path / "a.mat").time) == n
        else:
            with pytest.raises(SignalError, match="x claims 8192 bytes and has 0; the file is damaged"):
                read_signals(tmp_path / "a.mat")


def test_a_gap_of_no_end_is_refused(tmp_path):
    t = [*(k / 1000 for k in range(60)), 1e300]
    with pytest.raises(SignalError, match="line 62: samples are missing"):
        read_signals(written(tmp_path, rows(t, range(61))))


def test_the_first_gap_that_is_too_long_is_named_not_a_shorter_one_before_it(tmp_path):
    t = [f"{k / 1000:.3f}" for k in range(90)]
    values = [f"{k}.0" for k in range(90)]
    kept = [*range(20), *range(22, 50), *range(55, 70), *range(80, 90)]  # 2, 5 and 10 samples are lost
    lost = written(tmp_path, rows([t[k] for k in kept], [values[k] for k in kept]))
    words = r"line 50: samples are missing between t = 0.049 and 0.055 s.*17 samples in 3 gaps, the longest 0.011 s"
    with pytest.raises(SignalError, match=words):
        read_signals(lost, fill=0.003)
    assert len(read_signals(lost, fill=0.011).time) == 90


@pytest.mark.parametrize("depth", [1, 8, 9, 12])
def test_structures_are_read_down_to_a_depth_of_eight(tmp_path, depth):
    """A vector in so many structures, one in the other, beside a plain one; what lies deeper is left out."""
    x = np.arange(40.0)
    inner = {"x": x**2}
    for k in range(depth):
        inner = {f"s{k}": inner}
    scipy.io.savemat(tmp_path / "deep.mat", {"t": x / 10, "y": x, **inner})
    found = read_signals(tmp_path / "deep.mat")
    name = ".".join([*(f"s{k}" for k in reversed(range(depth))), "x"])
    assert (name in found.names) == (depth <= 8)
    assert_allclose(found["y"].values, x)
    if depth <= 8:
        assert_allclose(found[name].values, x**2)
