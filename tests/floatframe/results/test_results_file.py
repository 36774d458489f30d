"""Results on disk: what a run, a stopped run and a killed run leave."""

import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    ConvergenceError,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    ModelError,
    ResultsError,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
    read_results,
)
from floatframe.results.recovery import interface_positions, nodal_positions, point_positions
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

METHOD = GeneralizedAlpha()
DATA = ("t", "position", "euler_parameters", "q", "u", "u_dot", "w", "diagnostics", "drift")


def pendulum():
    reduced = reduced_body(random_point_masses(3, 3), stiffness(3), name="rod")
    bob = RigidBody("bob", 0.5, 0.1 * np.eye(3), position=reduced.interface("end_a").position)
    joints = [
        SphericalJoint("pin", GROUND, Marker("rod", "end_b")),
        SphericalJoint("link", Marker("rod", "end_a"), Marker("bob")),
    ]
    return System([FlexibleBody("rod", reduced), bob], joints, [Gravity((0, 0, -9.81))])


SYSTEM = pendulum()


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
    carry = METHOD.start(SYSTEM, 0.0)
    for k in range(20):
        carry = METHOD.step(SYSTEM, k * 1e-3, 1e-3, carry)
    u = motion.source.read("u")
    assert_allclose(carry.state.u, u[-1], rtol=0, atol=1e-8 * np.abs(u).max())


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


KILLED = """
import sys
from floatframe.motion import integration
from tests.floatframe.results.test_results_file import SYSTEM, METHOD
integration.SEGMENT_SECONDS = 0.02
integration.integrate(SYSTEM, METHOD, 1e6, 1e-3, output=sys.argv[1], batch_steps=20, output_every=10)
"""


def test_a_killed_run_leaves_a_readable_file(tmp_path):
    path = tmp_path / "run.h5"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)]) as process:
        segments = tmp_path / "run.h5.segments"
        deadline = time.monotonic() + 120
        while not (segments / "000003.h5").exists() and time.monotonic() < deadline and process.poll() is None:
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
    with pytest.raises(ResultsError, match="damaged or of another kind"):
        read_results(path)
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "modal-file"
    with pytest.raises(ResultsError, match=r"expected a results file .* 'modal-file'"):
        read_results(path)


def test_a_newer_version_is_refused_and_so_is_a_misshapen_file(tmp_path):
    path = tmp_path / "run.h5"
    integrate(SYSTEM, METHOD, 0.01, 1e-3, output=path)
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = 99
    with pytest.raises(ResultsError, match="results format 99"):
        read_results(path)
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = 1
        del file["q"]
    with pytest.raises(ResultsError, match="'q' is missing"):
        read_results(path)


def test_a_folder_that_is_not_there_is_refused_before_the_run(tmp_path):
    with pytest.raises(ResultsError, match="no such folder"):
        integrate(SYSTEM, METHOD, 0.1, 1e-3, output=tmp_path / "missing" / "run.h5")


def test_impossible_arguments_are_refused():
    with pytest.raises(ModelError, match=r"t_end above t_start"):
        integrate(SYSTEM, METHOD, -1.0, 1e-3)
    with pytest.raises(ModelError, match=r"h: expected a number > 0"):
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
    assert_allclose(point_positions(motion, "bob", np.zeros(3)), tip, rtol=0, atol=1e-12)
    node = int(np.argmax(reduced.nodes[:, 0]))
    for k in (0, 100, 200):
        assert_allclose(nodal_positions(motion, "rod", reduced, k)[node], tip[k], rtol=0, atol=1e-12)
    with pytest.raises(ResultsError, match="has 0 modes"):
        nodal_positions(motion, "bob", reduced, 0)
