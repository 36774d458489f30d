import os
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from fe_models.foundation.paths import file_state, is_stream, near_file, replace_file, same_file
from tests.root import ROOT


def test_a_pipe_gets_the_bytes_and_stays_a_pipe(tmp_path):
    pipe, got = tmp_path / "pipe.csv", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    replace_file(pipe, b"one ", b"two")
    reader.join(10)
    assert got == [b"one two"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert [each.name for each in tmp_path.iterdir()] == ["pipe.csv"]


@pytest.mark.skipif(not hasattr(os, "mknod") or os.geteuid() != 0, reason="only root can make a device")
def test_a_device_gets_the_bytes_and_stays_a_device(tmp_path):
    null = tmp_path / "null"
    try:
        os.mknod(null, 0o666 | stat.S_IFCHR, os.makedev(1, 3))  # one's own /dev/null
        null.write_bytes(b"")
    except OSError:
        pytest.skip("this place has no devices")
    (tmp_path / "link").symlink_to(null)
    for path in (null, tmp_path / "link"):
        replace_file(path, b"gone")
        assert stat.S_ISCHR(path.stat().st_mode)


@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_standard_output_is_written_to_behind_what_was_printed(tmp_path, name):
    """Into a file, which stays the one the shell opened, and into a pipe."""
    code = f"from pathlib import Path; from fe_models.foundation.paths import replace_file; print('before'); " \
           f"replace_file(Path({name!r}), b'bytes\\n'); print('after')"  # fmt: skip
    with open(tmp_path / "out", "w+") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, cwd=ROOT, check=True)
        out.seek(0)
        assert out.read() == "before\nbytes\nafter\n"
    piped = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert piped.stdout == "before\nbytes\nafter\n"


def test_files_and_folders_are_no_streams_and_links_are_the_same_file(tmp_path):
    (tmp_path / "a").write_bytes(b"")
    (tmp_path / "b").symlink_to("a")
    (tmp_path / "c").symlink_to("d")
    assert not any(is_stream(tmp_path / name) for name in ("a", "b", "c", "d", "."))
    assert same_file(tmp_path / "a", tmp_path / "b")
    assert same_file(tmp_path / "c", tmp_path / "d")
    assert not same_file(tmp_path / "a", tmp_path / "d")


def test_a_changed_file_of_the_same_size_and_time_is_noticed(tmp_path):
    path = tmp_path / "body.h5"
    assert file_state(path) is None
    path.write_bytes(b"one")
    before, found = file_state(path), path.stat()
    assert file_state(path) == before
    time.sleep(0.02)  # times of files are rounded to some milliseconds
    path.write_bytes(b"two")
    os.utime(path, ns=(found.st_atime_ns, found.st_mtime_ns))
    assert path.stat().st_mtime_ns == found.st_mtime_ns
    assert file_state(path) != before


def test_a_missing_file_of_toml_is_proposed_for_a_suffix_like_its_own(tmp_path):
    for name in ("arm.msh", "arm.toml", "swing.h5"):
        (tmp_path / name).touch()
    proposed = {name: near_file(Path(tmp_path / name)) for name in ("arm.tmol", "arm.mesh", "arms.toml")}
    words = "; did you mean {!r}?".format
    assert proposed == {"arm.tmol": words("arm.toml"), "arm.mesh": words("arm.msh"), "arms.toml": words("arm.toml")}
