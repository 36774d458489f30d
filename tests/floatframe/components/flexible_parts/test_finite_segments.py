"""Finite segments against beam theory: deflections, frequencies, large rotations."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from floatframe import GROUND, FixedJoint, PointForce, System, linearize, static_equilibrium, system_modes
from floatframe.components import finite_segments
from floatframe.components.flexible_parts.finite_segments import element_stiffness
from floatframe.errors import ModelError

STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=7870.0)
LENGTH = 0.6


def line(shear=True):
    return fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), STEEL, shear=shear))


def cone(thick=0.04, thin=0.02):
    d = Polynomial([thick, (thin - thick) / LENGTH])
    A, inertia = np.pi / 4 * d**2, np.pi / 64 * d**4
    E, G, mass = STEEL.E, STEEL.E / (2 * (1 + STEEL.nu)), STEEL.rho * inertia
    return fm.beams.BeamLine(
        LENGTH, STEEL.rho * A, E * A, E * inertia, E * inertia, 2 * G * inertia, rho_Iy=mass, rho_Iz=mass
    )


def clamped(law, n, force=None, torque=(0, 0, 0)):
    part = finite_segments("beam", law, n)
    load = [] if force is None else [PointForce("load", part.marker("end"), force=force, torque=torque)]
    return System(part.bodies, [FixedJoint("clamp", GROUND, part.marker("start"))], [*part.forces, *load])


def tip(law, n, force, torque=(0, 0, 0)):
    """Displacement of the end."""
    return static_equilibrium(clamped(law, n, force, torque)).state.r[-1] - [LENGTH, 0, 0]


@pytest.mark.parametrize("n", [2, 5])
def test_deflection_under_an_end_load_is_that_of_timoshenkos_beam(n):
    section = fm.beams.Rectangle(0.02, 0.03).properties(STEEL.nu)
    G = STEEL.E / (2 * (1 + STEEL.nu))
    exact = [
        -1e-2 * (LENGTH**3 / (3 * STEEL.E * section.Iz) + LENGTH / (G * section.A_sy)),
        2e-2 * (LENGTH**3 / (3 * STEEL.E * section.Iy) + LENGTH / (G * section.A_sz)),
    ]
    assert_allclose(tip(line(), n, (0, -1e-2, 2e-2))[1:], exact, rtol=1e-6)
    assert_allclose(tip(line(), n, (10.0, 0, 0))[0], 10.0 * LENGTH / (STEEL.E * section.A), rtol=1e-6)


@pytest.mark.parametrize("n", [2, 4])
def test_a_cone_deflects_as_its_closed_form_whatever_the_number_of_segments(n):
    """P L³ / (3 E I_thin) (d_thin / d_thick)³; the springs hold the exact flexibility of their piece."""
    found = tip(cone(), n, (0, -1e-2, 0))[1]
    I_thin = np.pi / 64 * 0.02**4
    assert_allclose(found, -1e-2 * LENGTH**3 / (3 * STEEL.E * I_thin) * 0.5**3, rtol=1e-5)


def test_mass_centre_and_inertia_of_the_whole_are_those_of_the_beam():
    part = finite_segments("beam", cone(), 7)
    masses = np.array([body.mass for body in part.bodies])
    places = np.array([body.position + body.center_of_mass for body in part.bodies])
    x, weight = cone().points(2)
    mass, rotary = weight * cone().at("rho_A", x), weight * cone().at("rho_Iy", x)
    center = mass @ x / mass.sum()
    assert_allclose(masses.sum(), mass.sum(), rtol=1e-12)
    assert_allclose(masses @ places / masses.sum(), [center, 0, 0], rtol=0, atol=1e-12)
    inertia = sum(body.inertia for body in part.bodies)
    inertia = inertia + masses @ (places[:, 0] - center) ** 2 * np.diag([0.0, 1.0, 1.0])
    across = rotary.sum() + mass @ (x - center) ** 2
    assert_allclose(inertia, np.diag([2 * rotary.sum(), across, across]), rtol=0, atol=1e-12 * across)


def test_bending_frequencies_converge_with_the_square_of_the_length():
    """To those of the same beam in polynomials of high degree."""
    body = cms.reduction.beam_from_assumed_modes(
        line(), name="beam", units=cms.unit_system("m-kg-s"), n_bending=10, frame=cms.NodalFrame("start")
    )
    found = np.array([system_modes(linearize(clamped(line(), n))).frequencies[:4] for n in (6, 11, 21)])
    errors = np.abs(found / body.frequencies[:4] - 1)
    assert errors[2].max() < 3e-3
    assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, rtol=0, atol=0.15)


def test_an_end_moment_bends_it_to_a_quarter_of_a_circle():
    """M = pi EI / (2 L): the end at (2 L / pi, 2 L / pi), in the limit of many segments."""
    law = fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(fm.beams.Circle(0.001), STEEL, shear=False))
    moment = np.pi * law.EIz / (2 * LENGTH)
    exact = np.array([2 * LENGTH / np.pi - LENGTH, 2 * LENGTH / np.pi, 0])
    errors = [np.linalg.norm(tip(law, n, (0, 0, 0), (0, 0, moment)) - exact) / LENGTH for n in (9, 17)]
    assert errors[1] < 1e-3
    assert 3.6 < errors[0] / errors[1] < 4.4


def test_a_part_is_placed_and_moves_as_one_body():
    p = np.array([np.cos(0.4), 0, 0, np.sin(0.4)])
    part = finite_segments(
        "beam", line(), 4, position=(1, 2, 3), orientation=p, velocity=(0.1, 0, 0), omega_B=(0, 0, 2.0)
    )
    first, last = part.bodies[0], part.bodies[-1]
    axis = np.array([np.cos(0.8), np.sin(0.8), 0])
    assert_allclose(last.position - first.position, LENGTH * axis, atol=1e-12)
    assert_allclose(last.velocity - first.velocity, np.cross([0, 0, 2.0], LENGTH * axis), atol=1e-12)
    assert_allclose(first.velocity, (0.1, 0, 0), atol=1e-15)


def test_a_station_between_nodes_is_fixed_to_the_nearest_segment():
    part = finite_segments("beam", line(), 4, stations={"here": 0.23})
    assert part.marker("here").body == "beam 2"
    assert_allclose(part.marker("here").position, [0.03, 0, 0], atol=1e-15)


def test_stiffness_of_a_uniform_piece_is_that_of_beam_theory():
    law, h = line(), 0.1
    shear = [1 / (h**3 / 12 / EI + h / GA) for EI, GA in ((law.EIz, law.GAy), (law.EIy, law.GAz))]
    expected = np.diag([law.EA / h, *shear, law.GJ / h, law.EIy / h, law.EIz / h])
    assert_allclose(element_stiffness(law, 0.2, 0.3), expected, rtol=1e-10, atol=1e-6)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"n": 1}, "at least 2 segments"),
        ({"n": 3, "damping": -1.0}, "damping: expected zero or more"),
        ({"n": 3, "stations": {"tip": 0.7}}, "within 0 .. 0.6"),
    ],
)
def test_impossible_segments_are_refused(options, text):
    with pytest.raises(ModelError, match=text):
        finite_segments("beam", line(), **options)


def test_a_beam_without_rotary_inertia_is_refused():
    law = fm.beams.BeamLine(1.0, 1.0, 1e6, 10.0, 10.0, 10.0)
    with pytest.raises(ModelError, match="no rotary inertia about x"):
        finite_segments("beam", law, 4)


def test_places_are_told():
    with pytest.raises(ModelError, match="did you mean 'start'"):
        finite_segments("beam", line(), 3).marker("strt")
