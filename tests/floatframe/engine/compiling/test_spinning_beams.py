"""Spinning beams with geometric stiffening: spin-up, rotating cantilevers, a spinning free beam, whirl of a shaft."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import cms
import fe_models as fm
from floatframe import FixedJoint, FlexibleBody, GeneralizedAlpha, Marker, System, integrate, linearize, system_modes
from floatframe.analyses import steady_rotation
from floatframe.analyses.equilibrium import turning
from floatframe.analyses.snapshot import Equilibrium
from floatframe.components.mechanisms import rotating_blade, spin_up_beam, spinning_shaft
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.functions.time_functions import cycloidal_spin_up, smooth_step
from floatframe.results.place_motion import interface_motion
from tests.bodies import bar
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem
from tests.references.planar_dynamics import integrate as integrate_exact
from tests.references.rotating_beam import (
    cantilever_frequencies,
    end_condition,
    free_frequencies,
    whirl_frequencies,
)

SI = cms.unit_system("m-kg-s")
#: length, EA, shear stiffness, EI, mass and rotary inertia per length, speed, time of the spin-up
SIMO_VU_QUOC = {"L": 10.0, "EA": 2.8e7, "GA": 1e7, "EI": 1.4e4, "rho_A": 1.2, "rho_I": 6e-4, "speed": 6.0, "T": 15.0}
WU_HAUG = {
    "L": 8.0, "EA": 6.8952e10 * 7.2968e-5, "GA": 6.8952e10 / 2.6 * 7.2968e-5 * 5 / 6, "EI": 6.8952e10 * 8.2189e-9,
    "rho_A": 2766.7 * 7.2968e-5, "rho_I": 2766.7 * 8.2189e-9, "speed": 4.0, "T": 15.0,
}  # fmt: skip


def coupled_beam(length, section, material, n, ends=("root", "tip")):
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), n)
    places = [
        fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in zip(ends, (0, n), strict=True)
    ]
    of_line = fm.beams.BeamProperty(section, material, orientation=(0, 1, 0))
    return cms.couple(fm.beam_body(mesh, of_line, name="beam", units=SI, interfaces=places))


def reduced(body, n_modes, frame):
    return cms.reduce(body, cms.craig_bampton(body, n_modes=n_modes), frame=frame, geometric=True)


# spin-up -------------------------------------------------------------------------------------------------------------


def planar_beam(data, frame, n_modes=6):
    """Return the beam of a data set, elastic in its plane; E = EA/A for an area that puts rho I = rho A I/A."""
    inertia = data["rho_I"] / data["rho_A"]  # over the area, taken as one
    E = data["EI"] / inertia
    material = fm.Material("beam", E=E, nu=0.3, rho=data["rho_A"])
    assert_allclose(E, data["EA"], rtol=1e-6)
    section = fm.beams.GeneralSection(A=1.0, Iy=inertia, Iz=inertia, J=2 * inertia, A_sy=data["GA"] / (E / 2.6))
    return reduced(fm.planar(coupled_beam(data["L"], section, material, 16)), n_modes, frame)


def tip_in_turning_axes(positions, data, t):
    """Return elongation and deflection of the tip seen from the root, (n_t, 2)."""
    angle = np.array([cycloidal_spin_up(data["speed"], data["T"])(x) for x in t])
    c, s = np.cos(angle), np.sin(angle)
    x, y = positions[:, 0], positions[:, 1]
    return np.column_stack([x * c + y * s - data["L"], y * c - x * s])


def spun_up(data, beam, t_end, h, **options):
    system = spin_up_beam(beam, speed=data["speed"], duration=data["T"], **options)
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-9), t_end, h)
    return tip_in_turning_axes(interface_motion(motion, "beam", beam, "tip").position, data, motion.t)


def exact_spin_up(data, t_end, h, n):
    beam = ExactBeam((0, 0), (data["L"], 0), n, *(data[key] for key in ("EA", "GA", "EI", "rho_A", "rho_I")))
    drive, root = cycloidal_spin_up(data["speed"], data["T"]), beam.node(0)
    held = {int(k): lambda t: (0.0, 0.0, 0.0) for k in root[:2]}
    held[int(root[2])] = lambda t: (drive(t), drive(t, 1), drive(t, 2))
    motion = integrate_exact(Problem(beam.mass(), beam.force, beam.x0, held), t_end, h, rho_inf=0.6)
    return tip_in_turning_axes(motion.x[:, beam.node(-1)[:2]], data, motion.t)


def errors(found, exact):
    """Return the largest errors of deflection and of elongation, each by the largest value."""
    return np.abs(found - exact).max(axis=0)[::-1] / np.abs(exact).max(axis=0)[::-1]


@pytest.fixture(scope="module")
def first_seconds():
    """Return the exact motion over the largest deflection, six per cent of the length."""
    return exact_spin_up(SIMO_VU_QUOC, 8.0, 0.02, 4)


@pytest.mark.parametrize("frame", [cms.NodalFrame("root"), cms.TisserandFrame()], ids=["tangent", "mean axis"])
def test_spin_up_bends_and_shortens_as_the_exact_beam(first_seconds, frame):
    beam = planar_beam(SIMO_VU_QUOC, frame)
    of_deflection, of_shortening = errors(spun_up(SIMO_VU_QUOC, beam, 8.0, 0.02), first_seconds)
    assert np.abs(first_seconds[:, 1]).max() > 0.05 * SIMO_VU_QUOC["L"]
    assert of_deflection < 0.005
    assert of_shortening < 0.01


def test_spin_up_without_stiffening_fails(first_seconds):
    """In the frame at the root it diverges above the first frequency; in the mean frame it is a quarter off."""
    found = spun_up(SIMO_VU_QUOC, planar_beam(SIMO_VU_QUOC, cms.TisserandFrame()), 8.0, 0.02, stiffening=False)
    assert errors(found, first_seconds)[0] > 0.2
    found = spun_up(SIMO_VU_QUOC, planar_beam(SIMO_VU_QUOC, cms.NodalFrame("root")), 8.0, 0.02, stiffening=False)
    assert errors(found, first_seconds)[0] > 2.0


def test_spin_up_of_a_body_of_solids(first_seconds):
    """The same beam of 32 bricks, square of the height that has its rotary inertia, without lateral contraction."""
    data = SIMO_VU_QUOC
    height = np.sqrt(12 * data["rho_I"] / data["rho_A"])
    material = fm.Material("solid", E=data["EA"] / height**2, nu=0.0, rho=data["rho_A"] / height**2)
    body = cms.couple(bar(32, 1, 1, length=data["L"], width=height, height=height, material=material))
    beam = reduced(body, 12, cms.TisserandFrame())
    system = spin_up_beam(beam, speed=data["speed"], duration=data["T"], root="left")
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-9), 8.0, 0.02)
    tip = interface_motion(motion, "beam", beam, "right").position
    of_deflection, of_shortening = errors(tip_in_turning_axes(tip, data, motion.t), first_seconds)
    assert of_deflection < 0.005
    assert of_shortening < 0.01


def in_turning_axes(positions, data, t):
    """Return the displacement of the tip in axes that turn with the hub, (n_t, 3)."""
    return np.column_stack([tip_in_turning_axes(positions, data, t), positions[:, 2]])


def test_spin_up_with_pitch_is_that_of_the_beam_in_parts():
    """In space: on top of the spin the root turns by 0.6 rad about the beam; one body against six, each bent little."""
    data, pitch = SIMO_VU_QUOC, smooth_step(1.0, 4.0, 0.0, 0.6)
    inertia = data["rho_I"] / data["rho_A"]
    material = fm.Material("beam", E=data["EI"] / inertia, nu=0.3, rho=data["rho_A"])
    section = fm.beams.GeneralSection(A=1.0, Iy=2 * inertia, Iz=inertia, J=2 * inertia)
    n = 6
    part = reduced(coupled_beam(data["L"] / n, section, material, 4), 4, cms.TisserandFrame())
    whole = reduced(coupled_beam(data["L"], section, material, 16), 12, cms.TisserandFrame())

    def motion_of(beam, others=0, stiffening="auto"):
        system = spin_up_beam(
            beam, speed=data["speed"], duration=data["T"], pitch=pitch, stiffening=stiffening
        )  # fmt: skip
        bodies, joints, last = list(system.bodies), list(system.joints), "beam"
        for k in range(1, others + 1):
            name = f"part {k}"
            bodies.append(FlexibleBody(name, beam, position=(k * data["L"] / n, 0, 0)))
            joints.append(FixedJoint(f"weld {k}", Marker(last, "tip"), Marker(name, "root")))
            last = name
        motion = integrate(System(bodies, joints), GeneralizedAlpha(0.9, 1e-9), 8.0, 0.02)
        return in_turning_axes(interface_motion(motion, last, beam, "tip").position, data, motion.t)

    parts = motion_of(part, n - 1)
    scale = np.abs(parts).max(axis=0)  # shortening, deflection in and across the plane of the spin
    assert (scale[1:] > 0.1).all()
    found = np.abs(motion_of(whole) - parts).max(axis=0) / scale
    assert found[0] < 0.01
    assert (found[1:] < 0.005).all()
    assert (np.abs(motion_of(whole, stiffening=False) - parts).max(axis=0) / scale > 0.1).all()


@pytest.mark.long
@pytest.mark.parametrize("data", [SIMO_VU_QUOC, WU_HAUG], ids=["Simo & Vu-Quoc", "Wu & Haug"])
def test_whole_spin_up_of_both_data_sets(data):
    """Twenty seconds, with the vibration that stays about the steady state."""
    exact = exact_spin_up(data, 20.0, 0.01, 6)
    for frame in (cms.NodalFrame("root"), cms.TisserandFrame()):
        of_deflection, of_shortening = errors(spun_up(data, planar_beam(data, frame), 20.0, 0.01), exact)
        assert of_deflection < 0.005
        assert of_shortening < 0.01


def test_steady_extension_is_that_of_the_rod():
    """EA u'' + rho A Omega² (x + u) = 0: tan(beta L)/beta - L with beta² = rho A Omega²/EA; 5.14e-4."""
    data = SIMO_VU_QUOC
    beam = planar_beam(data, cms.NodalFrame("root"))
    steady = steady_rotation(rotating_blade(beam), (0, 0, data["speed"]))
    K = beam.geometric.interfaces[1]
    d = beam.interface("tip").Psi @ steady.state.q - 0.5 * K @ steady.state.q @ steady.state.q
    beta = data["speed"] * np.sqrt(data["rho_A"] / data["EA"])
    assert_allclose(d[0], np.tan(beta * data["L"]) / beta - data["L"], rtol=2e-4)
    assert_allclose(d[0], 5.14e-4, rtol=0, atol=0.5e-6)


# rotating cantilever -------------------------------------------------------------------------------------------------

LENGTH, THIN = 10.0, 1 / 2000  #: radius of gyration by length: no rotary inertia, a stiff axis
ALLOY = fm.Material("alloy", E=7e10, nu=0.3, rho=2700.0)
AREA = 1e-4
INERTIA = AREA * (THIN * LENGTH) ** 2
UNIT = np.sqrt(ALLOY.E * INERTIA / (ALLOY.rho * AREA * LENGTH**4))
THIN_SECTION = fm.beams.GeneralSection(A=AREA, Iy=INERTIA, Iz=INERTIA, J=2 * INERTIA)


@pytest.fixture(scope="module")
def blade():
    return reduced(coupled_beam(LENGTH, THIN_SECTION, ALLOY, 24), 16, cms.NodalFrame("root"))


def frequencies_at(system, speed):
    """Return the frequencies in units of the beam, ascending, of a system that turns about z."""
    modes = system_modes(linearize(system, steady_rotation(system, np.asarray(speed) * UNIT)))
    return np.sort(2 * np.pi * modes.natural_frequencies) / UNIT


def nearest(values, targets):
    return np.array([values[np.argmin(np.abs(values - target))] for target in targets])


@pytest.mark.parametrize("alpha", [0.0, 1.0])
@pytest.mark.parametrize(("eta", "rtol"), [(1, 1e-4), (3, 1e-4), (6, 2e-4), (12, 5e-4)])
def test_rotating_cantilever_has_the_flap_and_lag_frequencies(blade, alpha, eta, rtol):
    found = frequencies_at(rotating_blade(blade, hub_radius=alpha * LENGTH), (0, 0, eta))
    for delta in (0, 1):
        expected = cantilever_frequencies(eta, alpha, delta=delta)[:3]
        assert_allclose(nearest(found, expected), expected, rtol=rtol)


def test_published_frequencies_of_the_rotating_cantilever(blade):
    """First and second flap frequency over the speed for a hub without radius, as Wright et al. (1982) have them."""
    published = {2: (4.1373, 22.6149), 6: (7.3604, 26.8091), 12: (13.1702, 37.6031)}
    for eta, expected in published.items():
        assert_allclose(cantilever_frequencies(eta)[:2], expected, rtol=0, atol=6e-5)
        found = frequencies_at(rotating_blade(blade), (0, 0, eta))
        assert_allclose(nearest(found, expected), expected, rtol=1e-4)


def test_both_roads_to_the_rotating_cantilever_agree():
    for eta, alpha in ((3, 0.0), (6, 1.0), (12, 0.0)):
        for omega in cantilever_frequencies(eta, alpha)[:2]:
            root = brentq(lambda x, e=eta, a=alpha: end_condition(x, e, a), 0.999 * omega, 1.001 * omega, xtol=1e-10)
            assert_allclose(root, omega, rtol=1e-8)


def test_without_stiffening_the_rotating_cantilever_loses_its_lag_frequency(blade):
    system = rotating_blade(blade, stiffening=False)
    assert system_modes(linearize(system, steady_rotation(system, (0, 0, 3 * UNIT)))).is_stable
    modes = system_modes(linearize(system, steady_rotation(system, (0, 0, 4 * UNIT))))  # first frequency: 3.516
    assert not modes.is_stable


def test_spinning_free_beam_has_the_frequencies_of_theory():
    """It turns undeformed, since its axis is stiff; held nowhere, its steady rotation is found by no search."""
    beam = reduced(coupled_beam(LENGTH, THIN_SECTION, ALLOY, 24), 16, cms.TisserandFrame())
    system = System([FlexibleBody("beam", beam, position=(-LENGTH / 2, 0, 0))])
    for eta in (3, 12):
        omega = np.array([0, 0, eta * UNIT])
        state, u_dot = turning(compiled_system(system), compiled_system(system).placed, omega, np.zeros(3))
        about = Equilibrium(state, u_dot, np.zeros(0), omega, 1.0, 0)  # residual: the stretch of its axis is left out
        modes = system_modes(linearize(system, about))
        found = np.sort(2 * np.pi * modes.natural_frequencies) / UNIT
        for delta in (0, 1):
            expected = free_frequencies(eta, delta=delta)[2:5]
            assert_allclose(nearest(found, expected), expected, rtol=1e-3)


# whirl ---------------------------------------------------------------------------------------------------------------

STEEL = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
RADIUS, SHAFT = 0.05, 1.0
ROUND = fm.beams.Circle(RADIUS).properties(STEEL.nu)


@pytest.mark.parametrize("frame", [cms.NodalFrame("left"), cms.TisserandFrame()], ids=["tangent", "mean axis"])
def test_pinned_shaft_whirls_as_rayleighs(frame):
    """In axes that turn with the shaft: forward whirl minus the speed, backward plus it."""
    section = fm.beams.GeneralSection(A=ROUND.A, Iy=ROUND.Iy, Iz=ROUND.Iz, J=ROUND.J)
    shaft = reduced(coupled_beam(SHAFT, section, STEEL, 24, ("left", "right")), 12, frame)
    of_shaft = {"E": STEEL.E, "rho": STEEL.rho, "A": ROUND.A, "inertia": ROUND.Iy, "length": SHAFT}
    critical = whirl_frequencies(1, **of_shaft, speed=0.0)[0]
    for ratio in (0.5, 2.0):
        speed = ratio * critical
        expected = []
        for n in (1, 2):
            forward, backward = whirl_frequencies(n, **of_shaft, speed=speed)
            expected += [abs(forward - speed), backward + speed]
        found = {}
        for stiffening in (True, False):
            system = spinning_shaft(shaft, speed=speed, stiffening=stiffening)
            modes = system_modes(linearize(system, steady_rotation(system, (speed, 0, 0))))
            assert modes.is_stable
            found[stiffening] = nearest(2 * np.pi * modes.natural_frequencies, expected)
        assert_allclose(found[True], expected, rtol=2e-4)
        assert np.abs(found[False] / expected - 1).max() > 1e-3


def test_shaft_of_solids_whirls_as_one_of_beams():
    """A square shaft, shear included, at twice its critical speed; in axes that turn with it."""
    steel, side = fm.Material("steel", E=2.1e11, nu=0.0, rho=7850.0), 0.08
    bodies = {
        "solids": cms.couple(bar(16, 2, 2, width=side, height=side, material=steel)),
        "beams": coupled_beam(1.0, fm.beams.Rectangle(side, side), steel, 24, ("left", "right")),
    }
    found = {}
    for name, body in bodies.items():
        shaft = reduced(body, 14, cms.TisserandFrame())
        for stiffening in (True, False):
            speed = 4 * np.pi * 186.0
            system = spinning_shaft(shaft, speed=speed, stiffening=stiffening)
            f = np.sort(system_modes(linearize(system, steady_rotation(system, (speed, 0, 0)))).natural_frequencies)
            found[name, stiffening] = f[f > 1.0][:4]
    assert_allclose(found["solids", True], found["beams", True], rtol=2e-3)
    assert_allclose(found["solids", True][0], found["beams", True][0], rtol=5e-4)
    assert abs(found["solids", False][0] / found["solids", True][0] - 1) > 5e-3
