"""The 6 mm rod of a slider-crank at 150 rad/s (Jahnke & Popp's), where a linear frame is a quarter off."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

import cms
import fe_models as fm
from floatframe import GeneralizedAlpha, integrate
from floatframe.components.mechanisms import slider_crank
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.mass_positivity import indefinite_masses
from floatframe.errors import ConvergenceError
from floatframe.model.functions.time_functions import cycloidal_spin_up, polynomial_of_time
from floatframe.results.place_motion import interface_motion
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem, rotation
from tests.references.planar_dynamics import integrate as integrate_exact

CRANK, ROD, DIAMETER, SPEED = 0.15, 0.3, 0.006, 150.0
TURN = 2 * np.pi / SPEED
STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=7870.0)
MASS = STEEL.rho * np.pi * DIAMETER**2 / 4 * ROD
FRAMES = {
    "held at both ends": cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (16, 1), (16, 2))),
    "mean axis": cms.TisserandFrame(),
    "clamped at the pin": cms.NodalFrame("start"),
    "Buckens": cms.reduction.BuckensFrame(),
}


def reduced_rod(frame):
    mesh = fm.beams.straight_line((0, 0, 0), (ROD, 0, 0), 16)
    kept = [
        fm.beams.line_interface(mesh, p, fm.beams.NodeIndices((k,)))
        for p, k in (("start", 0), ("middle", 8), ("end", 16))
    ]
    of_line = fm.beams.BeamProperty(fm.beams.Circle(DIAMETER / 2), STEEL, orientation=(0, 1, 0))
    body = fm.beam_body(mesh, of_line, name="rod", units=cms.unit_system("m-kg-s"), interfaces=kept)
    body = fm.planar(cms.couple(body))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=FRAMES[frame], geometric=True)


def deflection(knee, middle, tip):
    """Distance of the middle from the chord."""
    chord, arm = tip - knee, middle - knee
    return (chord[:, 0] * arm[:, 1] - chord[:, 1] * arm[:, 0]) / np.linalg.norm(chord, axis=1)


def flexible(rod, drive, t_end, h, speed):
    system = slider_crank(crank=CRANK, rod=ROD, slider_mass=MASS / 2, drive=drive, flexible_rod=rod, speed=speed)
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-9), t_end, h)
    return deflection(*(interface_motion(motion, "rod", rod, p).position[:, :2] for p in ("start", "middle", "end")))


def exact(drive, t_end, h, n, speed):
    """Return the deflection of the exact beam; it begins with the velocities of the rigid mechanism."""
    A, inertia = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
    shear = STEEL.E / (2 * (1 + STEEL.nu)) * fm.beams.Circle(DIAMETER / 2).properties(STEEL.nu).A_sy
    beam = ExactBeam(
        (CRANK, 0), (CRANK + ROD, 0), n, STEEL.E * A, shear, STEEL.E * inertia, STEEL.rho * A, STEEL.rho * inertia
    )
    x, y = rotation(lambda t: (drive(t), drive(t, 1), drive(t, 2)), CRANK)
    first, last = beam.node(0), beam.node(-1)
    slider = sp.csc_array(([MASS / 2], ([last[0]], [last[0]])), shape=(beam.n_dof,) * 2)
    held = {int(first[0]): x, int(first[1]): y, int(last[1]): lambda t: (0.0, 0.0, 0.0)}
    turn = -CRANK * speed / ROD
    s = beam.x0.reshape(-1, 3)[:, 0] - CRANK
    v = np.column_stack([0 * s, CRANK * speed + turn * s, np.full(len(s), turn)]).ravel()
    motion = integrate_exact(Problem(beam.mass() + slider, beam.force, beam.x0, held, v0=v), t_end, h, rho_inf=0.8)
    return deflection(*(motion.x[:, beam.node(k)[:2]] for k in (0, n, -1)))


def error(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.fixture(scope="module")
def half_a_turn():
    """Return drive and exact deflection after a sudden start, over half a turn."""
    drive = polynomial_of_time([0.0, SPEED])
    return drive, exact(drive, TURN / 2, 4e-5, 3, SPEED)


@pytest.mark.parametrize("frame", FRAMES)
def test_stiffened_rod_bends_as_the_exact_beam_after_a_sudden_start(half_a_turn, frame):
    drive, expected = half_a_turn
    rod = reduced_rod(frame)
    assert np.abs(expected).max() > 0.01 * ROD
    assert error(flexible(rod, drive, TURN / 2, 4e-5, SPEED), expected) < 0.03
    without = flexible(replace(rod, geometric=None), drive, TURN / 2, 4e-5, SPEED)
    assert error(without, expected) > 0.1


@pytest.mark.long
def test_two_turns_after_a_sudden_and_a_soft_start():
    for drive, t_end, h, speed, limit in (
        (polynomial_of_time([0.0, SPEED]), 2 * TURN, 2e-5, SPEED, 0.03),
        (cycloidal_spin_up(SPEED, 0.1), 0.05 + 2 * TURN, 4e-5, 0.0, 0.01),
    ):
        expected = exact(drive, t_end, h, 4, speed)
        for frame in ("held at both ends", "mean axis"):
            found = flexible(reduced_rod(frame), drive, t_end, h, speed)
            assert error(found[: len(expected)], expected[: len(found)]) < limit


def test_a_mass_matrix_that_the_second_order_made_indefinite_is_named():
    """As the rod would move in the frame of its file: clamped at its pin, against which it turns."""
    rod = reduced_rod("clamped at the pin")
    rod = replace(rod, frame=replace(rod.frame, kind="tisserand"))  # said to be, so that it stays in that frame
    system = slider_crank(crank=CRANK, rod=ROD, slider_mass=MASS / 2, flexible_rod=rod)
    placed = compiled_system(system).placed
    assert indefinite_masses(system, placed) == ()
    assert indefinite_masses(system, replace(placed, q=placed.q + 1e-3)) == ("rod",)
    with pytest.raises(ConvergenceError, match=r"'rod' is not positive definite there.*split it into parts"):
        flexible(rod, polynomial_of_time([0.0, SPEED]), 1e-2, 2e-5, SPEED)
