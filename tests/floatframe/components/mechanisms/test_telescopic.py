"""A flexible rod through a ring: kinematics of the stiff rod, work of the drive of the soft one."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models
from floatframe import GeneralizedAlpha, integrate
from floatframe.analyses import mobility
from floatframe.components.mechanisms import telescopic_slider_crank
from floatframe.errors import ModelError
from floatframe.joints import JointCoordinate
from floatframe.model.functions.time_functions import cycloidal_spin_up
from floatframe.results.place_motion import interface_motion

LENGTH, CRANK, RING = 0.4, 0.1, 0.25
STATIONS = {f"s{k}": k * LENGTH / 8 for k in range(9)}


def rod(EI, geometric=True):
    line = fe_models.beams.BeamLine(LENGTH, 0.2, 1e5 * EI, EI, EI, 0.8 * EI, rho_Iy=1e-6, rho_Iz=1e-6)
    units = cms.unit_system("m-kg-s")
    return cms.reduction.beam_from_assumed_modes(
        line, name="rod", units=units, n_axial=1, n_bending=6, n_torsion=1, stations=STATIONS, geometric=geometric
    )


def test_a_stiff_rod_points_at_the_ring():
    drive = cycloidal_spin_up(20.0, 0.2)
    body = rod(1e4)
    system = telescopic_slider_crank(body, list(STATIONS), crank=CRANK, ring=RING, angle=0.3, drive=drive)
    assert mobility(system).mobility == 0  # driven
    motion = integrate(system, GeneralizedAlpha(0.8), 0.4, 1e-3)
    phi = 0.3 + JointCoordinate("main", "angle").measure(system, motion).value
    pin = CRANK * np.column_stack([np.cos(phi), np.sin(phi), np.zeros(len(phi))])
    way = np.array([RING, 0, 0]) - pin
    reach = np.linalg.norm(way, axis=1)
    tip = interface_motion(motion, "rod", body, "s8").position
    assert np.ptp(reach) > 0.15
    assert_allclose(tip, pin + LENGTH * way / reach[:, None], rtol=0, atol=2e-4 * LENGTH)
    assert_allclose(motion.joint("ring").distance, reach, rtol=0, atol=2e-4 * LENGTH)


def test_work_of_the_drive_is_the_energy_of_the_rod_that_bends():
    drive = cycloidal_spin_up(30.0, 0.2)
    system = telescopic_slider_crank(rod(1.0), list(STATIONS), crank=CRANK, ring=RING, drive=drive)
    gaps = []
    for h in (1e-3, 5e-4):
        motion = integrate(system, GeneralizedAlpha(0.95), 0.4, h)
        e = motion.energies
        gaps.append(np.abs(e.work - e.work[0] - (e.kinetic + e.strain) + (e.kinetic + e.strain)[0]).max())
    assert e.strain.max() > 0.02 * e.kinetic.max()
    assert gaps[1] < 0.35 * gaps[0]
    assert gaps[1] < 5e-3 * e.kinetic.max()


def test_a_ring_out_of_reach_is_refused():
    with pytest.raises(ModelError, match="within the rod"):
        telescopic_slider_crank(rod(1.0), list(STATIONS), crank=0.2)
    with pytest.raises(ModelError, match="expected two or more"):
        telescopic_slider_crank(rod(1.0), ["s0"])
