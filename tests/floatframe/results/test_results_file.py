"""Results on disk: what a run, a stopped run and a killed run leave."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.foundation.hdf5_file import Manifest, as_attribute, write_sealed_file
from floatframe import GeneralizedAlpha, integrate, read_results
from floatframe.engine.compiling.counted_angles import CountedAngle
from floatframe.errors import ConvergenceError, ModelError, ResultsError
from floatframe.results.head import BodyEntry, Head
from floatframe.results.place_motion import point_motion
from floatframe.results.recovery import interface_positions, nodal_positions
from floatframe.results.results_file import KIND
from tests.floatframe.results.examples import SYSTEM
from tests.root import ROOT

METHOD = GeneralizedAlpha()
DATA = ("t", "position", "euler_parameters", "q", "u", "u_dot", "w", "diagnostics", "drift")


def assert_same_motion(first, second):
    for name in DATA:
        assert_array_equal(first.source.read(name), second.source.read(name), err_msg=name)


def test_file_holds_the_motion_bit_for_bit(tmp_path):
    kept = integrate(SYSTEM, METHOD, 0.3, 1e-3)
    written = integrate(SYSTEM, METHOD, 0.3, 1e-3, output=tmp_path / "run.h5")
    assert_same_motion(kept, written)
    again = read_results(tmp_path / "run.h5")
    assert_same_motion(kept, again)
    assert again.is_complete
    assert again.body_names == ("rod", "bob")
    assert again.head.run["h"] == 1e-3
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


@pytest.mark.parametrize("batch_steps", [1, 7, 300])
def test_motion_does_not_depend_on_the_size_of_batches(batch_steps):
    reference = integrate(SYSTEM, METHOD, 0.3, 1e-3)
    assert_same_motion(reference, integrate(SYSTEM, METHOD, 0.3, 1e-3, batch_steps=batch_steps))


def test_output_every_thins_the_same_motion_out():
    every = integrate(SYSTEM, METHOD, 0.3, 1e-3)
    thin = integrate(SYSTEM, METHOD, 0.3, 1e-3, output_every=20, batch_steps=7)
    assert_array_equal(thin.t, every.t[::20])
    assert_array_equal(thin.source.read("q"), every.source.read("q")[::20])


def test_steps_one_by_one_are_the_same_motion_to_the_tolerance():
    motion = integrate(SYSTEM, METHOD, 0.02, 1e-3)
    memory = METHOD.start(SYSTEM, 0.0)
    for k in range(20):
        memory = METHOD.step(SYSTEM, k * 1e-3, 1e-3, memory)
    u = motion.source.read("u")
    assert_allclose(memory.state.u, u[-1], rtol=0, atol=1e-8 * np.abs(u).max())


def test_a_step_size_that_does_not_divide_the_time_is_made_smaller():
    motion = integrate(SYSTEM, METHOD, 0.1, 0.003)
    assert len(motion.t) == 35
    assert_allclose(motion.t[-1], 0.1, rtol=1e-14)


def test_a_callback_that_raises_leaves_the_closed_results_and_the_old_file(tmp_path):
    path = tmp_path / "run.h5"
    path.write_bytes(b"old")

    def stop(progress):
        if progress.n_steps >= 100:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(SYSTEM, METHOD, 1.0, 1e-3, output=path, progress=stop, batch_steps=10)
    assert path.read_bytes() == b"old"
    left = read_results(tmp_path / "run.h5.segments")
    assert not left.is_complete
    full = integrate(SYSTEM, METHOD, 0.1, 1e-3)
    assert len(left.t) == 101
    assert_array_equal(left.source.read("q"), full.source.read("q"))
    path.unlink()
    assert len(read_results(path).t) == 101  # found in the place of the missing file


class Interrupting:
    """Is interrupted while it is freed, where Python drops what is raised."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


def test_an_interrupt_while_something_is_freed_ends_the_run():
    reached = []

    def free(progress):
        reached.append(progress.n_steps)
        Interrupting()

    with pytest.raises(KeyboardInterrupt):
        integrate(SYSTEM, METHOD, 0.1, 1e-3, progress=free, batch_steps=10)
    assert reached == [10]


KILLED = """
import sys
import floatframe.simulation.integrate as integration
from tests.floatframe.results.test_results_file import SYSTEM, METHOD
integration.SEGMENT_SECONDS = 0.02
integration.integrate(SYSTEM, METHOD, 1e6, 1e-3, output=sys.argv[1], batch_steps=20, output_every=10)
"""


def test_a_killed_run_leaves_a_readable_file(tmp_path):
    path = tmp_path / "run.h5"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)]) as process:
        segments = tmp_path / "run.h5.segments"
        while not (segments / "000003.h5").exists() and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    left = read_results(path)
    assert not left.is_complete
    assert len(left.t) > 4
    assert_allclose(np.diff(left.t), 1e-2, rtol=1e-6)
    expected = integrate(SYSTEM, METHOD, left.t[-1], 1e-3, output_every=10)
    assert_array_equal(left.source.read("q"), expected.source.read("q"))


def test_failure_of_newton_carries_the_motion_so_far(tmp_path):
    method = GeneralizedAlpha(max_iterations=1)
    with pytest.raises(
        ConvergenceError, match=r"the step of 0.001 from t = .* did not converge in 1 iterations"
    ) as error:
        integrate(SYSTEM, method, 1.0, 1e-3, output=tmp_path / "run.h5")
    assert error.value.h == 1e-3
    assert error.value.residual > 1
    assert len(error.value.trajectory.t) >= 1
    assert not error.value.trajectory.is_complete
    assert not (tmp_path / "run.h5").exists()


def test_files_of_another_kind_are_refused(tmp_path):
    path = tmp_path / "run.h5"
    with pytest.raises(ResultsError, match="no such file"):
        read_results(path)
    path.write_bytes(b"\x89HDF nothing")
    with pytest.raises(ResultsError, match="not a results-file: expected an HDF5 file"):
        read_results(path)
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "modal-file"
    with pytest.raises(ResultsError, match="expected a results-file, got format 'modal-file'"):
        read_results(path)


def rewritten(path, change):
    """Write a results file anew with its seal, after a change of what it says."""

    def fill(file):
        with h5py.File(path, "r") as old:
            values = {name: item[()] for name, item in old.items()}
            attributes = {name: as_attribute(value) for name, value in old.attrs.items() if name != "digest"}
        change(values, attributes)
        manifest = Manifest(file)
        for name, value in values.items():
            manifest.dataset(f"/{name}", value, {})
        manifest.attributes("/", attributes)
        manifest.close()

    write_sealed_file(path, replace(KIND, version=2), fill, part=path.with_name("part"))
    return path


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    path = tmp_path_factory.mktemp("short") / "run.h5"
    integrate(SYSTEM, METHOD, 0.01, 1e-3, output=path)
    return path


@pytest.fixture
def path(short, tmp_path):
    return Path(shutil.copy(short, tmp_path / "run.h5"))


def test_a_newer_version_is_refused_by_its_number(path):
    with pytest.raises(ResultsError, match="format version 99, this program reads versions up to 2"):
        read_results(rewritten(path, lambda values, attributes: attributes.update(version=99)))
    path.write_bytes(b"floatframe results-file 12\nbytes 9\nof a kind that does not exist yet")
    with pytest.raises(ResultsError, match="format version 12"):
        read_results(path)


def test_no_damaged_byte_is_read(path):
    """Two hundred files with one to four bytes changed, cut off, or with a hole; the same numbers or one message."""
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    for k in range(200):
        data = bytearray(whole)
        if k % 4 == 0:
            del data[int(rng.integers(len(data))) :]
        elif k % 4 == 1:
            first = int(rng.integers(len(data)))
            data[first : first + 64] = bytes(len(data[first : first + 64]))
        else:
            for place in rng.integers(len(data), size=k % 4):
                data[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(data)
        if bytes(data) != whole:
            with pytest.raises(ResultsError):
                read_results(path)


HEADS = {  # what is changed in the head -> what the message names
    "system": (lambda head: head.update(system=3), "system: expected text"),
    "missing": (lambda head: head.pop("bodies"), "bodies: missing"),
    "unknown": (lambda head: head.update(more=1), "more: unknown key"),
    "units": (lambda head: head.update(units="mm"), "units: expected one of"),
    "n_q": (lambda head: head["bodies"][0].update(n_q=10**9), "bodies.1..q0"),
    "negative": (lambda head: head["bodies"][1].update(n_q=-1), "n_q: expected at least 0, got -1"),
    "kind": (lambda head: head["bodies"][0].update(n_q="3"), "expected a whole number"),
    "name": (lambda head: head["bodies"][1].update(name="rod"), "a name of its own"),
    "w0": (lambda head: head.update(w0=[0, 9, 6]), "w0: expected"),
    "joints": (lambda head: head.update(joints=[1, 2]), "joints.0.: expected text"),
    "list": (lambda head: head.update(joints="pin"), "joints: expected a list, got 'pin'"),
    "empty": (lambda head: head.update(bodies=[]), "bodies: expected at least 1 item, not 0"),
    "boolean": (lambda head: head["bodies"][0].update(is_stiffened=1), "is_stiffened: expected true or false, got 1"),
    "run": (lambda head: head["run"].update(h=float("nan")), "run.h: expected a finite number"),
    "gravity": (lambda head: head["run"].update(gravity=["g"]), "run.gravity"),
    "summary": (lambda head: head.update(summary={"n_steps": "many"}), "summary.n_steps"),
    "events": (lambda head: head.update(summary={"events": [{"name": "stop"}]}), r"summary.events.0..t"),
}


@pytest.mark.parametrize("case", HEADS)
def test_a_head_that_does_not_fit_is_refused_even_when_sealed(path, case):
    change, words = HEADS[case]

    def changed(values, attributes):
        head = json.loads(attributes["head"])
        change(head)
        attributes["head"] = json.dumps(head)

    with pytest.raises(ResultsError, match=words):
        read_results(rewritten(path, changed))


@pytest.mark.parametrize("text", ["", "[", "null", "[[" * 10**5, '"' + "x" * 10**5 + '"', "1" + "0" * 5000])
def test_a_head_that_is_no_object_is_refused_in_one_short_message(path, text):
    for name in ("head", "validity"):
        with pytest.raises(ResultsError) as error:
            read_results(rewritten(path, lambda values, attributes, name=name: attributes.update({name: text or " "})))
        assert len(str(error.value)) < 500


@pytest.mark.parametrize("record", [Head, BodyEntry, CountedAngle])
def test_every_key_of_the_head_is_in_the_specification(record):
    page = (ROOT / "docs" / "results_file.md").read_text("utf-8")
    assert [each.name for each in fields(record) if f"`{each.name}`" not in page and each.name not in "xyz"] == []


def test_misshapen_and_missing_datasets_are_refused(path):
    for change in (
        lambda values, attributes: values.pop("q"),
        lambda values, attributes: values.update(q=values["q"][:, :1]),
        lambda values, attributes: values.update(u=values["u"][1:]),
        lambda values, attributes: values.update(t=np.arange(len(values["t"]))),
        lambda values, attributes: values.update(t=values["t"][::-1]),
        lambda values, attributes: values.update(t=values["t"] * np.nan),
        lambda values, attributes: values.update(u=np.full_like(values["u"], np.inf)),
    ):
        whole = path.read_bytes()
        with pytest.raises(ResultsError, match=r"misshapen|ascend|finite"):
            read_results(rewritten(path, change))
        path.write_bytes(whole)


def repacked(path, change=lambda file: None):
    """Return a copy without seal, as an HDF5 tool writes it, in which something may be changed."""
    copy = path.with_name("repacked.h5")
    with h5py.File(path, "r") as old, h5py.File(copy, "w") as new:
        for name in old:
            old.copy(name, new)
        for name, value in old.attrs.items():
            new.attrs.create(name, value, dtype=old.attrs.get_id(name).dtype)
        change(new)
    return copy


def test_a_repacked_file_is_read_and_its_changes_are_seen_by_the_digest(path):
    assert_same_motion(read_results(path), read_results(repacked(path)))

    def one_number(file):
        file["q"][3, 0] += 1e-12

    def renamed(file):
        file.move("u", "v")

    def other_head(file):
        file.attrs["head"] = as_attribute(file.attrs["head"]).replace("bob", "box")

    for change, words in ((one_number, "sha256"), (renamed, "digest"), (other_head, "digest")):
        with pytest.raises(ResultsError, match=words):
            read_results(repacked(path, change))


def test_numbers_that_lie_elsewhere_or_nowhere_are_refused(path, tmp_path):
    """External links, soft links, virtual and external datasets; a shape of which the file holds nothing."""
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["q"] = np.zeros((11, 3))
    n_t = len(read_results(path).t)

    def external_link(file):
        del file["q"]
        file["q"] = h5py.ExternalLink("other.h5", "/q")

    def soft_link(file):
        del file["q"]
        file["q"] = h5py.SoftLink("/u")

    def virtual(file):
        del file["q"]
        layout = h5py.VirtualLayout((n_t, 3), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "q", (11, 3))
        file.create_virtual_dataset("q", layout)

    def external(file):
        del file["q"]
        file.create_dataset("q", (n_t, 3), "f8", external=[(str(tmp_path / "q.bin"), 0, n_t * 24)])

    def empty(file):
        del file["q"]
        file.create_dataset("q", (10**9, 3), "f8")

    def cycle(file):
        file["again"] = file["/"]

    for change, words in ((external_link, "link to elsewhere"), (soft_link, "link to elsewhere"),
                          (virtual, "another file"), (external, "another file"), (empty, "of which the file holds 0"),
                          (cycle, "two names")):  # fmt: skip
        with pytest.raises(ResultsError, match=words):
            read_results(repacked(path, change))


def test_a_file_of_version_1_is_read_and_said_to_have_no_checksum(path, caplog):
    old = path.with_name("old.h5")
    with h5py.File(path, "r") as new, h5py.File(old, "w") as file:
        for name in new:
            file[name] = new[name][...]
        file.attrs["format"], file.attrs["version"], file.attrs["is_complete"] = "floatframe-results", 1, True
        file.attrs["head"] = new.attrs["head"]
    assert_same_motion(read_results(path), read_results(old))
    assert [record.message for record in caplog.records if "no checksum" in record.message]


def test_a_folder_that_is_not_there_is_refused_before_the_run(tmp_path):
    with pytest.raises(ResultsError, match="no such folder"):
        integrate(SYSTEM, METHOD, 0.1, 1e-3, output=tmp_path / "missing" / "run.h5")


def test_impossible_arguments_are_refused():
    with pytest.raises(ModelError, match=r"t_end above t_start"):
        integrate(SYSTEM, METHOD, -1.0, 1e-3)
    with pytest.raises(ModelError, match=r"h: expected a number above 0"):
        integrate(SYSTEM, METHOD, 1.0, 0.0)
    with pytest.raises(ModelError, match="finite"):
        integrate(SYSTEM, METHOD, float("nan"), 1e-3)
    with pytest.raises(ModelError, match="rho_inf"):
        GeneralizedAlpha(rho_inf=1.2)


def test_unknown_names_are_answered_with_the_nearest():
    motion = integrate(SYSTEM, METHOD, 0.01, 1e-3)
    with pytest.raises(ResultsError, match="did you mean 'rod'"):
        motion.body("rid")
    with pytest.raises(ResultsError, match="did you mean 'pin'"):
        motion.reaction("pinn")
    with pytest.raises(ResultsError, match="did you mean 'link'"):
        motion.drift("lnk")


def test_nodes_follow_the_frame_and_the_modes_and_meet_at_the_joint():
    motion = integrate(SYSTEM, METHOD, 0.2, 1e-3)
    reduced = SYSTEM.bodies[0].reduced
    tip = interface_positions(motion, "rod", reduced, "end_a")
    assert_allclose(tip, motion.body("bob").r, rtol=0, atol=1e-12)
    assert_allclose(point_motion(motion, "bob", (0, 0, 0)).position, tip, rtol=0, atol=1e-12)
    node = int(np.argmax(reduced.nodes[:, 0]))
    for k in (0, 100, 200):
        assert_allclose(nodal_positions(motion, "rod", reduced, k)[node], tip[k], rtol=0, atol=1e-12)
    with pytest.raises(ResultsError, match="has 0 modes"):
        nodal_positions(motion, "bob", reduced, 0)
