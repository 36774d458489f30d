"""The railway engine: what its wheels see, its files, and its full body beside systems that are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.optimize import minimize_scalar
from scipy.sparse.linalg import splu

import cms
import floatframe as ff
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.reduction.basis.damping import RayleighDamping
from fe_models.elements.shells.shell_points import shell_points
from fe_models.foundation.parametric_file import read_parametric
from fe_models.parts import EngineBody
from floatframe.design.laboratory.body_study import (
    BodyReference,
    Loading,
    body_study,
    lean_body,
    stress_rows,
    without_rigid,
)
from floatframe.design.laboratory.suspended_body import suspended_motion
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.machines.railway_engine.mode_sets import FREE, MORE_SETS, NAME, SETS
from floatframe.machines.railway_engine.write_files import (
    Defect,
    SCurve,
    envelope,
    railway_engine_files,
    write_railway_engine,
)

SHIPPED = Path(ff.__file__).parent / "machines" / "railway_engine" / "files"
BETA = 2.6e-4


def test_a_wheel_on_a_round_crest_has_the_parallel_curve():
    """A rail of radius rho carries a wheel of radius R on a circle of radius R + rho about its centre."""
    rho, R = 0.8, 0.5
    s = np.linspace(-0.1, 0.1, 9)
    found = envelope(lambda x: np.sqrt(rho**2 - x**2) - rho, s, 0.2, R)
    assert_allclose(found, np.sqrt((R + rho) ** 2 - s**2) - R - rho, rtol=0, atol=1e-7)


def test_a_dip_is_seen_as_deep_as_the_wheel_reaches():
    """Over the middle of a dip the wheel stands on both flanks: least gap of a circle above the rail, by a search."""
    found = minimize_scalar(
        lambda x: 0.010 * 0.5 * (1 + np.cos(2 * np.pi * x / 0.1)) + 0.625 - np.sqrt(0.625**2 - x**2),
        bounds=(0, 0.05), method="bounded", options={"xatol": 1e-9},
    )  # fmt: skip
    sagitta = 0.625 - np.sqrt(0.625**2 - 0.05**2)
    assert 0.5 * sagitta < found.fun <= sagitta < 0.010
    seen = Defect(vertical=-0.010, patch=1e-3).lift(np.array([-0.2, 0.0, 0.2]))
    assert_allclose(seen, [0, -found.fun, 0], rtol=0, atol=5e-5)


def test_a_bump_is_seen_whole_and_longer():
    defect = Defect(patch=2e-3)
    s = np.linspace(-0.3, 0.3, 601)
    lift, push = defect.lift(s), defect.push(s)
    assert_allclose([lift.max(), push.max()], [0.010, 0.004], rtol=0, atol=5e-5)
    assert np.ptp(s[lift > 1e-4]) > 0.2 > 0.1 > np.ptp(s[np.abs(defect.shape(s)) > 0.1])


def test_wheels_keep_their_speed_through_the_curve():
    curve = SCurve()
    paths = curve.paths(np.array([6.5, -6.5]), 0.01)
    x, y, yaw = np.moveaxis(paths.places[:, :, :3], 2, 0)
    way = np.hypot(np.diff(x, axis=0), np.diff(y, axis=0))
    assert_allclose(way, 0.07, rtol=2e-6)
    direction = np.arctan2(np.diff(y, axis=0), np.diff(x, axis=0))
    assert_allclose(direction, 0.5 * (yaw[1:] + yaw[:-1]), rtol=0, atol=1e-6)
    assert_allclose(y[-1], 4.0, rtol=1e-12)
    curvature = np.abs(np.diff(yaw, axis=0)).max() / 0.07
    assert_allclose(curvature, 2 * np.pi * 4 / 50**2, rtol=0.02)  # the slope of 0.16 takes a little off


@pytest.mark.parametrize("case", ["defect", "s_curve"])
def test_the_shipped_files_are_those_that_are_written(case):
    for name, text in railway_engine_files(case).items():
        assert (SHIPPED / name).read_text("utf-8") == text, name


def test_the_drawn_rails_follow_the_wheels():
    """The path of the last wheelset lies on the drawn track: between its points to their sagitta, 2² m²/8/100 m."""
    scene = read_parametric(SHIPPED / "s_curve.toml", ModelError)["scene"]
    x, y, _ = np.transpose(scene[0]["points"])
    table = np.loadtxt(SHIPPED / "s_curve.csv", delimiter=",", skiprows=1)
    assert_allclose(table[:, 14], np.interp(table[:, 13], x, y), rtol=0, atol=0.006)


def test_what_does_not_fit_is_refused():
    with pytest.raises(ModelError, match=r"unknown case 'curve'.*s_curve"):
        railway_engine_files("curve")
    with pytest.raises(ModelError, match="case 'defect': expected a Defect, got SCurve"):
        railway_engine_files("defect", track=SCurve())
    with pytest.raises(ModelError, match="defect: length"):
        Defect(length=0.0)
    with pytest.raises(ModelError, match=r"reach above 0 and at most the radius 0\.5, got 0\.7"):
        envelope(np.zeros_like, np.zeros(1), 0.7, 0.5)


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """The vehicle with a coarse body, 4 m between two short passages: its system over the first bump and its body."""
    folder = tmp_path_factory.mktemp("engine")
    track = Defect(vertical=0.5e-3, lateral=0.2e-3, begin=0.3, rest=0.0)  # small: all is linear
    path = write_railway_engine(folder, "defect", track=track, part=EngineBody(pitch=3.0), size=3.0)
    body = job_body(read_job(folder / "carbody.toml"))
    with cms.modes.Families(lean_body(body)) as families:
        reduced = cms.reduce(
            families, cms.modes.guyan(families), damping=RayleighDamping(0.0, BETA), stress=False, geometric=False
        )
    cms.write(reduced, folder / "carbody.h5")
    system, run = read_system(path)
    system = replace(system, sensors=())
    return body, system, Loading(system, run.integrator, 0.30, 5e-4, 10)


@pytest.fixture(scope="module")
def full(coarse):
    body, system, loading = coarse
    return suspended_motion(
        system, NAME, lean_body(body), free=FREE, integrator=loading.integrator, t_end=loading.t_end, h=loading.h,
        every=loading.every, damping=RayleighDamping(0.0, BETA),
    )  # fmt: skip


def linear_vehicle(body, system):
    """Return M, D, K over (body, bogies) and the loads of the wheelsets' motion, written down anew: (M, D, K, Kw, Dw).

    Every bushing by the point where it stands; wheelsets move as given, w = (x y z and turns of each at its centre).
    """
    bogies = {"bogie_1": np.array([5.2, 0, 0.6]), "bogie_2": np.array([-5.2, 0, 0.6])}
    wheels = {f"wheelset_{k + 1}": np.array([x, 0, 0.625]) for k, x in enumerate((6.525, 3.875, -3.875, -6.525))}
    n = body.n_dof
    M = sp.block_diag([body.M, *[np.diag([11000.0] * 3 + [6000.0, 12000.0, 15000.0])] * 2], format="csc")
    K = sp.block_diag([body.K, sp.csc_array((12, 12))], format="csc")
    D = BETA * K
    K_w, D_w = np.zeros((n + 12, 24)), np.zeros((n + 12, 24))

    def at(point, place):
        r = point - place
        return np.block([[np.eye(3), -np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])],
                         [np.zeros((3, 3)), np.eye(3)]])  # fmt: skip

    for force in system.forces:
        a = force.marker_a if isinstance(force.marker_a, str) else force.marker_a.body
        b = force.marker_b
        x, x_w = np.zeros((6, n + 12)), np.zeros((6, 24))
        if b.body == NAME:
            interface = body.interface(b.interface)
            point = interface.reference
            x[:, interface.dofs] = np.eye(6)
        else:
            point = wheels[b.body] + b.position
            k = 6 * list(wheels).index(b.body)
            x_w[:, k : k + 6] = at(point, wheels[b.body])
        k = n + 6 * list(bogies).index(str(getattr(a, "name", a)))
        x[:, k : k + 6] = -at(point, bogies[str(getattr(a, "name", a))])
        k_b, d_b = np.asarray(force.stiffness), np.asarray(force.damping)
        K = K + sp.csc_array(x).T @ sp.csc_array(k_b) @ sp.csc_array(x)
        D = D + sp.csc_array(x).T @ sp.csc_array(d_b) @ sp.csc_array(x)
        K_w -= x.T @ k_b @ x_w
        D_w -= x.T @ d_b @ x_w
    return M, D, K, K_w, D_w


def test_the_full_body_moves_as_the_linear_vehicle_on_its_wheels(coarse, full):
    """On a straight track and a small defect all is linear: the whole vehicle at once, by the trapezoidal rule."""
    body, system, loading = coarse
    lean = lean_body(body)
    M, D, K, K_w, D_w = linear_vehicle(lean, system)
    h = loading.h
    t = h * np.arange(round(loading.t_end / h) + 1)
    w, w_dot = np.zeros((24, len(t))), np.zeros((24, len(t)))
    for k in range(4):
        y = next(j for j in system.joints if j.name == f"track_{k + 1}").motions["first"]
        roll = next(j for j in system.joints if j.name == f"rail_{k + 1}").motions["angle"]
        for order, rows in ((0, w), (1, w_dot)):
            turn, across = roll.at(t, order), y.at(t, order)
            rows[6 * k + 1] = across - 0.625 * turn  # about the right rail, 0.625 below and 0.75 beside the centre
            rows[6 * k + 2] = 0.75 * turn
            rows[6 * k + 3] = turn
    f = K_w @ w + D_w @ w_dot
    factor = splu(sp.csc_array(M + 0.5 * h * D + 0.25 * h**2 * K))
    u, v, a = np.zeros((3, M.shape[0]))
    kept = [u]
    for k in range(1, len(t)):
        u_p, v_p = u + h * v + 0.25 * h**2 * a, v + 0.5 * h * a
        a = factor.solve(f[:, k] - D @ v_p - K @ u_p)
        u, v = u_p + 0.25 * h**2 * a, v_p + 0.5 * h * a
        kept.append(u)
    there = without_rigid(lean, np.array(kept)[:: loading.every, : lean.n_dof].T)
    reference = BodyReference(lean, full.t, full.u)
    error = la.norm(there - reference.elastic) / la.norm(there)
    assert la.norm(there[:, -1]) > 0.01 * la.norm(there, axis=0).max()  # it still rings
    assert error < 1e-3  # with the defect of 10 mm it is 0.9 %: products of angles, which the linear vehicle lacks
    assert full.imbalance < 1e-9


@pytest.fixture(scope="module")
def floor_stress(coarse):
    """Rows that give the stress of the floor's cells from the displacements of the lean body."""
    return stress_rows(shell_points(coarse[0], {"quad": [0]}))


def test_rows_of_stress_give_the_stress_of_the_cells(coarse, floor_stress):
    body = coarse[0]
    cells = shell_points(body, {"quad": [0]})
    probe = np.random.default_rng(3).standard_normal((body.n_dof, 2))
    direct = cells.stress_points.stress(body.mesh_displacement(probe)).reshape(-1, 2)
    assert_allclose(floor_stress @ probe, direct, rtol=0, atol=1e-9 * np.abs(direct).max())


@pytest.mark.long
def test_sets_rank_by_what_they_hold(coarse, full, floor_stress):
    """Static completeness first, then the modes of the body as it is held: errors fall, and equal spans are equal."""
    body, _, loading = coarse
    lean = lean_body(body)

    def study(*cases):
        found = body_study(
            {"defect": loading}, NAME, lean, {"defect": full}, cases, damping=RayleighDamping(0.0, BETA),
            stress={"floor": floor_stress},
        )  # fmt: skip
        assert not [each.failure for each in found if each.failure]
        return [each.largest[1] for each in found]

    few, many = study(("rubin", SETS["rubin"], 10), ("rubin", SETS["rubin"], 120))
    (same,) = study(("craig-chang", MORE_SETS["craig-chang"], 10))
    (free,) = study(("normal", SETS["normal"], 46))
    assert many < 0.03 < few
    assert_allclose(same, few, rtol=1e-4)
    assert free > 10 * many


def test_systems_of_another_kind_are_refused(coarse):
    body, system, loading = coarse
    lean = lean_body(body)

    def run(changed, free=FREE):
        suspended_motion(changed, NAME, lean, free=free, integrator=loading.integrator, t_end=2e-3, h=1e-3)

    with pytest.raises(ModelError, match="free: expected rigid bodies, got 'carbody'"):
        run(system, free=("carbody",))
    first = system.forces[0]
    preloaded = replace(system, forces=(replace(first, preload=np.ones(6)), *system.forces[1:]))
    with pytest.raises(ModelError, match="expected no preload and no tables"):
        run(preloaded)
