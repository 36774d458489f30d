"""The kart: its chassis against its finite elements, its loads against levers, its turn rigid and flexible."""

from dataclasses import fields

import numpy as np
import pytest
import scipy.sparse.linalg
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from floatframe.machines import copy_machine, parameters_of
from floatframe.machines.kart import Kart, chassis_tables
from floatframe.machines.kart.figures import torsion_stiffness, turn_of
from floatframe.machines.kart.steady_turn import steady_turn, turn_eigenvalues

G = 9.81
KART = Kart()
METHOD = ff.GeneralizedAlpha(0.8, 1e-7)


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kart")
    copy_machine("kart", folder)
    chassis = cms.reduce_job(folder / "chassis.toml")
    cms.write(chassis, folder / "chassis.h5")
    return folder, chassis


@pytest.fixture(scope="module")
def turns(parts):
    def turn(is_rigid):
        system, _ = ff.read_system(parts[0] / "kart.toml", {"steer_at": 0.7, "is_rigid": is_rigid})
        return turn_of(system, ff.integrate(system, METHOD, 1.8, 2e-3))

    return {is_rigid: turn(is_rigid) for is_rigid in (True, False)}


def test_the_files_have_the_dimensions_and_tables_of_the_description(parts):
    given = parameters_of(parts[0] / "kart.toml")
    front, rear = given.wheels
    names = {"front_half_track": front["y"], "rear_half_track": rear["y"], "front_height": front["z"],
             "rear_height": rear["z"], "rail_height": given.column[2], "wheelbase": given.wheelbase,
             "kingpin_y": given.kingpin_y}  # fmt: skip
    assert names == {field.name: getattr(KART, field.name) for field in fields(KART)}
    for name, text in chassis_tables(KART).items():
        assert (parts[0] / name).read_text() == text


def test_torsion_of_the_reduced_chassis_is_that_of_its_finite_elements(parts):
    """Craig-Bampton is statically complete: the same forces on the full matrices, held in six components."""
    folder, chassis = parts
    body = job_body(read_job(folder / "chassis.toml"))
    ends = {i.name: i for i in body.interfaces}
    width = {"kingpin": 2 * KART.kingpin_y, "rear": 2 * (KART.rear_half_track - 0.06)}
    load = np.zeros(body.n_dof)
    vertical = {}
    for name, sign in (("kingpin", 1.0), ("rear", -1.0)):
        for side, s in (("left", 1.0), ("right", -1.0)):
            row = vertical[name, side] = int(ends[f"{name}_{side}"].dofs[2])
            load[row] += sign * s / width[name]
    held = np.asarray(ends["seat_rear_left"].dofs)
    free = np.setdiff1d(np.arange(body.n_dof), held)
    u = np.zeros(body.n_dof)
    u[free] = scipy.sparse.linalg.spsolve(body.K.tocsc()[free][:, free], load[free])
    twist = [(u[vertical[n, "left"]] - u[vertical[n, "right"]]) / width[n] for n in ("kingpin", "rear")]
    assert_allclose(torsion_stiffness(chassis), 1.0 / (twist[0] - twist[1]), rtol=1e-6)


def test_the_engine_lowers_the_modes_of_the_frame(parts):
    """Mass added anywhere lowers every frequency (Rayleigh): the frame with and without its engine."""
    found = []
    for has_engine in (False, True):
        removed = "" if has_engine else "masses.engine = {}"
        (parts[0] / "frame.toml").write_text(f'extends = "chassis.toml"\n{removed}')
        found.append(cms.reduce_job(parts[0] / "frame.toml").frequencies[:5])
    assert np.all(found[1] < found[0])


def weight(chassis):
    """Return that of chassis, pilot, column, knuckles and wheels [N]."""
    return G * (chassis.moments.gram[0, 0] + 75.0 + 2.5 + 2 * (1.5 + 2.5 + 4.0))


@pytest.mark.parametrize("is_rigid", [True, False])
def test_straight_on_the_tyres_carry_the_weight(turns, parts, is_rigid):
    turn = turns[is_rigid]
    before = turn.loads[(turn.t > 0.4) & (turn.t < 0.69)].mean(axis=0)
    assert_allclose(before.sum(), weight(parts[1]), rtol=0.01)


def test_a_flexible_chassis_turns_wider_and_keeps_the_front_wheels_down(turns):
    """What the literature says of karts, and what comes out here: see the page."""
    rigid, flexible = turns[True], turns[False]
    assert flexible.radius > 1.05 * rigid.radius
    assert abs(flexible.lateral_acceleration[-1]) < abs(rigid.lateral_acceleration[-1])
    assert flexible.transfer("rear") < rigid.transfer("rear")


def test_in_the_turn_loads_move_by_the_lateral_acceleration_times_the_height_of_the_mass(turns, parts):
    """Moments about x: the loads' against that before the step is m a_y h."""
    turn = turns[True]
    assert_allclose(turn.loads[-1].sum(), weight(parts[1]), rtol=0.01)
    y = np.array([KART.front_half_track, -KART.front_half_track, KART.rear_half_track, -KART.rear_half_track])
    before = turn.loads[(turn.t > 0.4) & (turn.t < 0.69)].mean(axis=0)
    height = -(turn.loads[-1] - before) @ y * G / (weight(parts[1]) * turn.lateral_acceleration[-1])
    assert 0.17 < height < 0.26  # pilot at 0.28, chassis and wheels near 0.1


@pytest.mark.parametrize("is_rigid", [True, False])
def test_the_steady_turn_is_where_the_run_ends_and_it_is_stable(turns, parts, is_rigid):
    """Second road: 1.1 s after the step the run turns within 1 % as the state without a time does."""
    name = "kart_rigid.toml" if is_rigid else "kart.toml"
    motion = steady_turn(ff.read_system(parts[0] / name)[0], float(turns[is_rigid].speed[-1]))
    assert_allclose(1 / motion.curvature, turns[is_rigid].radius, rtol=0.01)
    loads = [
        ff.results.element_motion(
            motion.system, ff.analyses.snapshot(motion.system, motion.equilibrium, t=100.0), f"tyre_{wheel}"
        )
        for wheel in ("front_left", "front_right", "rear_left", "rear_right")
    ]
    found = [float(each.outputs["Fz"][0]) for each in loads]
    assert_allclose(found, turns[is_rigid].loads[-1], rtol=0.03)
    assert turn_eigenvalues(motion).real.max() < -5 * is_rigid
