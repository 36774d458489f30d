"""Exudyn runs our bodies to our motion: the same equations in another program."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from tests.cms.exchange.exporters.small_bodies import cloud_body, soft_bar

exu = pytest.importorskip("exudyn", reason="exudyn is not installed: pip install 'floatframe[test]'")

SPIN, FORCE = np.array([3.0, 4.0, -5.0]), np.array([2.0, -1.0, 1.5])
GRAVITY = np.array([1.0, -2.0, -9.81])


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The bar, its archive, and the script as a module."""
    path = tmp_path_factory.mktemp("exudyn") / "bar.npz"
    reduced = soft_bar()
    cms.exchange.export_body(reduced, path, to="exudyn", units="m-kg-s")
    spec = importlib.util.spec_from_file_location("bar_of_exudyn", path.with_suffix(".py"))
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return reduced, path, script


def run_there(script, n_steps, t_end, *, force=None, q=None, **options):
    """The end of a motion in exudyn: (r, R, q, angular acceleration)."""
    mbs = exu.SystemContainer().AddSystem()
    body = script.add_body(mbs, **options)
    if q is not None:
        mbs.SetNodeParameter(body["nGenericODE2"], "initialCoordinates", list(q))
    if force is not None:
        tip = script.marker(mbs, body, "right", rigid=False)
        mbs.AddLoad(exu.itemInterface.Force(markerNumber=tip, loadVector=force))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    time = settings.timeIntegration
    time.endTime, time.numberOfSteps, time.verboseMode = t_end, n_steps, 0
    time.generalizedAlpha.spectralRadius, time.generalizedAlpha.computeInitialAccelerations = 0.9, True
    time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-12, 1e-14
    settings.solution.file.write = False
    mbs.SolveDynamic(settings)
    kinds = exu.OutputVariableType
    found = [mbs.GetNodeOutput(body["nRigidBody"], kind) for kind in (kinds.Position, kinds.RotationMatrix)]
    q_end = mbs.GetNodeOutput(body["nGenericODE2"], kinds.Coordinates)
    alpha = mbs.GetNodeOutput(body["nRigidBody"], kinds.AngularAcceleration)
    return found[0], found[1].reshape(3, 3), q_end, alpha


def run_here(reduced, n_steps, t_end, *loads, **placed):
    """The same motion of a body whose frame B starts at the origin of the ground."""
    origin = reduced.frame.origin
    omega = placed.pop("omega", np.zeros(3))
    body = ff.FlexibleBody("bar", reduced, position=-origin, velocity=-np.cross(omega, origin), omega_B=omega, **placed)
    system = ff.System([body], [], loads, units=reduced.units)
    scheme = ff.GeneralizedAlpha(0.9, tolerance=1e-12, stabilized=False)  # Exudyn does not take spins by themselves
    return ff.integrate(system, scheme, t_end=t_end, h=t_end / n_steps).body("bar")


def rotation(p):
    w, x, y, z = p
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_a_spinning_body_under_a_tip_force_moves_as_here(exported):
    """Plain steps are those of Exudyn: 2000 over 0.2 s leave 4e-4 of the deflection in both alike, 3e-7 between them.

    More steps bring them no nearer: from 4000 on Exudyn's modal coordinates scatter by some 1e-6.
    """
    reduced, _, script = exported
    r, R, q, _ = run_there(script, 2000, 0.2, force=FORCE, initialAngularVelocity=SPIN)
    ours = run_here(reduced, 2000, 0.2, ff.PointForce("tip", ff.Marker("bar", "right"), force=FORCE), omega=SPIN)
    assert np.abs(q).max() > 1e-3  # it bends
    assert_allclose(ours.r[-1], r, rtol=0, atol=1e-6)
    assert_allclose(rotation(ours.p[-1]), R, rtol=0, atol=1e-6)
    assert_allclose(ours.q[-1], q, rtol=0, atol=1e-6 * np.abs(q).max())


def test_gravity_there_acts_on_the_undeformed_centre_of_mass(exported):
    """Its torque lacks (1C q) × g: angular accelerations of a deformed body at rest differ by what that makes."""
    reduced, _, script = exported
    moments, n = reduced.moments, reduced.n_q
    q = np.array([0.02, -0.01, 0.003, 0.002])
    *_, alpha = run_there(script, 1, 1e-7, q=q, gravity=GRAVITY)
    ours = run_here(reduced, 1, 1e-7, ff.Gravity(GRAVITY), q=q).omega_B_dot[0]
    # inertia of the deformed body at rest (docs/theory.md §6), unknowns a, alpha, q_ddot
    s, J = moments.S + moments.C1 @ q, moments.inertia(q)
    B = moments.C2 + np.einsum("kla,l->ak", moments.C4, q)
    M = np.zeros((6 + n, 6 + n))
    M[:3, :3], M[3:6, 3:6], M[6:, 6:] = moments.m * np.eye(3), J, moments.M
    M[3:6, :3] = np.cross(s, np.eye(3)).T
    M[:3, 6:], M[3:6, 6:] = moments.C1, B
    M[:3, 3:6], M[6:, :3], M[6:, 3:6] = M[3:6, :3].T, M[:3, 6:].T, M[3:6, 6:].T
    torque = np.cross(moments.C1 @ q, GRAVITY)
    predicted = np.linalg.solve(M, np.concatenate([np.zeros(3), torque, np.zeros(n)]))[3:6]
    assert np.abs(predicted).max() > 1e-2
    assert_allclose(ours - alpha, predicted, rtol=0, atol=1e-6 * np.abs(predicted).max())


def test_the_archive_holds_what_exudyn_computes_from_the_points():
    """Its own formulas, with the matrices of the full model, for a body of point masses."""
    from exudyn.rigidBodyUtilities import ComputeSkewMatrix

    from cms.exchange.programs.exudyn import archive_of

    body, cloud = cloud_body()
    archive = archive_of(body)
    M = np.diag(np.repeat(cloud.mass, 3))
    psi, x = cloud.phi.reshape(-1, body.n_q), cloud.c.reshape(-1)
    psi_tilde, x_tilde = ComputeSkewMatrix(psi), ComputeSkewMatrix(x)
    sums = np.kron(np.ones(len(cloud.mass)), np.eye(3))
    theirs = {
        "inertiaLocal": x_tilde.T @ M @ x_tilde,
        "mPsiTildePsi": psi_tilde.T @ M @ psi,
        "mPsiTildePsiTilde": psi_tilde.T @ M @ psi_tilde,
        "mPhitTPsi": sums @ M @ psi,
        "mPhitTPsiTilde": sums @ M @ psi_tilde,
        "mXRefTildePsi": x_tilde.T @ M @ psi,
        "mXRefTildePsiTilde": x_tilde.T @ M @ psi_tilde,
        "chiU": sums @ M @ x / cloud.mass.sum(),
    }
    for name, values in theirs.items():
        assert_allclose(archive[name], values, rtol=0, atol=1e-12 * np.abs(values).max(), err_msg=name)


def test_the_script_runs_as_it_stands_and_prints_our_motion(exported):
    reduced, path, script = exported
    done = subprocess.run(
        [sys.executable, "-W", "error", path.with_suffix(".py")], capture_output=True, text=True,
        cwd=path.parent, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said = dict(line.split(": ", 1) for line in done.stdout.splitlines() if ": " in line)
    body = ff.FlexibleBody("body", reduced, omega_B=script.OMEGA, q=script.Q_0, stiffening=False)
    system, h = ff.System([body], units=reduced.units), script.END / script.STEPS
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.9), t_end=script.END, h=h)
    r = np.array(said["position of the body frame"].split(), dtype=float)
    q = np.array(said["modal coordinates"].split(), dtype=float)
    assert np.abs(q).max() > 1e-5
    assert_allclose(r, motion.body("body").r[-1], rtol=0, atol=1e-6)
    assert_allclose(q, motion.body("body").q[-1], rtol=0, atol=1e-5 * np.abs(q).max())
