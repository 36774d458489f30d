"""Geometrically exact beams: closed forms, Cosserat's equations, another exact beam, and the model they come from."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import cms
import fe_models as fm
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.elements.beams.element import local_stiffness, shear_parameter, stiffness_about_shear_center
from floatframe import GROUND, FixedJoint, GeneralizedAlpha, PointForce, System, integrate, static_equilibrium
from floatframe.components import exact_beams
from floatframe.components.flexible_parts.exact_beams import piece_stiffness
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import piecewise, polynomial_of_time
from floatframe.model.rotations import tilde
from floatframe.results.place_motion import point_motion
from tests.bodies import bar
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem
from tests.references.planar_dynamics import integrate as integrate_exact

SI = cms.unit_system("m-kg-s")


def body_of(nodes, section, material):
    """Return a chain of lines through points, with interfaces at both ends."""
    n = len(nodes) - 1
    mesh = fm.beams.LineMesh(np.asarray(nodes, float), np.column_stack([np.arange(n), np.arange(1, n + 1)]))
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", n))]
    item = fm.beams.BeamProperty(section, material)
    return fm.beam_body(mesh, item, name="beam", units=SI, interfaces=ends)


def straight(n, length, section, material):
    return body_of(np.linspace([0, 0, 0], [length, 0, 0], n + 1), section, material)


def bent(part, steps=30, **load):
    """Return position and Euler parameters of the tip under a load that is brought on in steps."""
    root, state = FixedJoint("root", GROUND, part.marker("root")), None
    for share in np.linspace(1 / steps, 1, steps):
        force = PointForce("load", part.marker("tip"), **{key: share * np.array(x) for key, x in load.items()})
        system = System(part.bodies, [root], [*part.forces, force])
        found = static_equilibrium(system) if state is None else static_equilibrium(system, state)
        state = found.state
    tip = [body.name for body in system.bodies].index(part.marker("tip").body)
    return state.r[tip], state.p[tip]


def test_a_cantilever_is_rolled_up_to_a_circle():
    """M = 2 pi EI / L: the tip is back at the root, turned once, whatever the division: its elements bend exactly."""
    soft = fm.Material("soft", E=2e7, nu=0.25, rho=1000.0)
    part = exact_beams("beam", straight(2, 1.0, fm.beams.Rectangle(0.1, 0.1), soft), pieces=4)
    tip, p = bent(part, steps=5, torque=(0, 0, 2 * np.pi * 2e7 * 0.1**4 / 12))
    assert_allclose(tip, 0, rtol=0, atol=1e-10)
    assert_allclose(np.abs(p[0]), 1, rtol=1e-10)
    tip, _ = bent(part, steps=5, torque=(0, 0, np.pi * 2e7 * 0.1**4 / 12))  # half: the chord of an eighth, twice
    h = 1 / 8
    expected = h / (2 * np.sin(np.pi / 16)) * 2  # diameter of the circle through the nodes
    assert_allclose(tip, [0, expected, 0], rtol=0, atol=1e-9)


E, G, RADIUS = 1e7, 5e6, 100.0  #: of the bend, with a section of one by one


def rod(tip_force):
    """Return the tip of the bend by Cosserat's equations along it, the moment at the root found by shooting."""
    L = RADIUS * np.pi / 4

    def tip(m0, force):
        def along(_, y):
            R, m = y[3:12].reshape(3, 3), y[12:]
            n, m = R.T @ force, R.T @ m
            kappa = np.array([m[0] * 6 / G, m[1] * 12 / E, m[2] * 12 / E + 1 / RADIUS])
            r_s = R @ (np.array([1, 0, 0]) + n / [E, G * 5 / 6, G * 5 / 6])
            return np.concatenate([r_s, (R @ tilde(kappa)).ravel(), -np.cross(r_s, force)])

        y0 = np.concatenate([np.zeros(3), np.eye(3).ravel(), m0])
        return solve_ivp(along, (0, L), y0, rtol=1e-7, atol=1e-6, method="DOP853").y[:, -1]

    moment = np.zeros(3)
    for share in np.linspace(0.1, 1, 10):
        moment = fsolve(lambda m, share=share: tip(m, share * tip_force)[12:] / 1e4, moment, xtol=1e-9)
    return tip(moment, tip_force)[:3]


def test_the_45_degree_bend():
    """Bathe & Bolourchi's bend under 600 across its plane, half of its radius: errors fall with the square."""
    section = fm.beams.GeneralSection(A=1.0, Iy=1 / 12, Iz=1 / 12, J=1 / 6, A_sy=5 / 6, A_sz=5 / 6)
    material = fm.Material("bend", E=E, nu=0.0, rho=1e-3)
    force, found = np.array([0, 0, 600.0]), []
    for n in (6, 12):
        angle = np.linspace(0, np.pi / 4, n + 1)
        nodes = RADIUS * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
        found.append(bent(exact_beams("beam", body_of(nodes, section, material)), steps=12, force=force)[0])
    exact = rod(force)
    errors = [np.linalg.norm(tip - exact) for tip in found]
    assert exact[2] > 0.5 * RADIUS
    assert 3.7 < errors[0] / errors[1] < 4.3
    assert errors[1] < 8e-4 * exact[2]


def test_a_free_beam_tumbles_as_another_exact_beam_does():
    """A force and a moment at one end for a while, free flight after it: three-node planar elements beside these."""
    L, EA, GA, EI, rho_A, rho_I = 2.0, 4e4, 2e4, 30.0, 1.5, 0.01
    t_end, n_steps = 0.6, 240
    beam = ExactBeam((0, 0), (L, 0), 10, EA, GA, EI, rho_A, rho_I)
    end = beam.node(-1)

    def load(t):
        f = np.zeros(beam.n_dof)
        s = min(t, 0.6 - t, 0.0 if t > 0.6 else 1.0) / 0.3
        f[end] = [40 * s, 30 * s, 20 * s]
        return f

    exact = integrate_exact(Problem(beam.mass(), beam.force, beam.x0, load=load), t_end, t_end / n_steps, rho_inf=0.8)
    inertia = rho_I / rho_A  # of the section; stiffness is set below
    section = fm.beams.GeneralSection(A=1.0, Iy=inertia, Iz=inertia, J=2 * inertia, A_sy=1.0, A_sz=1.0)
    stiff = fm.Material("beam", E=EA, nu=0.0, rho=rho_A)
    errors = []
    for n in (12, 24):
        part = exact_beams("beam", straight(n, L, section, stiff))
        h = L / n
        K = np.linalg.inv(np.diag([h / EA, h / GA + h**3 / 12 / EI, h / GA + h**3 / 12 / EI, h, h / EI, h / EI]))
        rest = -K @ np.array([h, 0, 0, 0, 0, 0])
        springs = [replace(spring, stiffness=K, preload=rest) for spring in part.forces]
        ramp = piecewise([0.0, 0.3], [polynomial_of_time([0, 1 / 0.3]), polynomial_of_time([1, -1 / 0.3])])
        push = PointForce("push", part.marker("tip"), force=(40, 30, 0), torque=(0, 0, 20), amplitude=ramp)
        motion = integrate(System(part.bodies, [], [*springs, push]), GeneralizedAlpha(0.8), t_end, t_end / n_steps)
        ends = [point_motion(motion, part.marker(m).body, np.zeros(3)).position[:, :2] for m in ("root", "tip")]
        apart = [np.abs(x - exact.x[:, beam.node(k)[:2]]).max() for x, k in zip(ends, (0, -1), strict=True)]
        errors.append(max(apart))
    moved = np.abs(exact.x[-1, end[:2]] - exact.x[0, end[:2]]).max()
    assert moved > 1.0
    assert errors[1] < 4e-3 * moved
    assert errors[0] / errors[1] > 3.0


def test_pieces_of_a_line_are_those_of_a_finer_mesh():
    """Shear, and a shear centre beside the centroid: the section is found from the element and divided again."""
    EA, GJ, EIy, EIz, GAy, GAz, L = 3e6, 400.0, 900.0, 1500.0, 8e5, 6e5, 0.9
    center = np.array([[0.02, -0.013]])

    def element(length):
        return stiffness_about_shear_center(local(EA, GJ, EIy, EIz, GAy, GAz, length)[None], center)[0]

    fine, divided = piece_stiffness(element(L / 5), L / 5, 1), piece_stiffness(element(L), L, 5)
    assert_allclose(divided, fine, rtol=0, atol=1e-9 * np.abs(fine).max())
    plain = piece_stiffness(local(EA, GJ, EIy, EIz, GAy, GAz, L), L, 1)
    expected = [EA / L, 1 / (L**3 / 12 / EIz + L / GAy), 1 / (L**3 / 12 / EIy + L / GAz), GJ / L, EIy / L, EIz / L]
    assert_allclose(plain, np.diag(expected), rtol=0, atol=1e-9 * EA / L)


def local(EA, GJ, EIy, EIz, GAy, GAz, L):
    one = np.array([L])
    values = (np.array([x]) for x in (EA, GJ, EIy, EIz))
    shear = [shear_parameter(np.array([EI]), np.array([GA]), one) for EI, GA in ((EIz, GAy), (EIy, GAz))]
    return local_stiffness(*values, *shear, one)[0]


def test_mass_and_inertia_are_those_of_the_body():
    """Offsets, a point mass with its arm, crooked lines: mass, first moment and inertia about the mesh origin."""
    mesh = fm.beams.LineMesh(np.array([[0, 0, 0], [0.4, 0.1, 0], [0.5, 0.1, 0.3]], float), np.array([[0, 1], [1, 2]]))
    steel = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    item = fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), steel, offset=(0.01, -0.02))
    mass = fm.beams.PointMass(2, mass=0.7, inertia=(1e-3, 2e-3, 2.5e-3), offset=(0.01, 0.02, -0.03))
    body = fm.beam_body(mesh, item, name="frame", units=SI, point_masses=[mass])
    part = exact_beams("frame", body, pieces=3, position=(1.0, 0, 0))
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    expected = Psi_R.T @ (body.M @ Psi_R)
    total, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    for each in part.bodies:
        c = each.position - [1.0, 0, 0] + each.center_of_mass
        total += each.mass
        moment += each.mass * c
        inertia += each.inertia + each.mass * (c @ c * np.eye(3) - np.outer(c, c))
    assert_allclose(total, expected[0, 0], rtol=1e-12)
    assert_allclose(moment, [expected[5, 1], expected[3, 2], expected[4, 0]], rtol=1e-9)
    assert_allclose(inertia, expected[3:, 3:], rtol=0, atol=1e-9 * np.abs(expected[3:, 3:]).max())


def test_springs_between_nodes_come_along():
    """Two stubs joined by a spring of six stiffnesses: the tip under a force goes as the linear model does."""
    nodes = np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0, 0.01], [0.6, 0, 0.01]])
    mesh = fm.beams.LineMesh(nodes, np.array([[0, 1], [2, 3]]))
    steel = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    spring = fm.beams.Spring((1, 2), (2e5, 3e5, 4e5, 50.0, 60.0, 70.0))
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", 3))]
    body = fm.beam_body(
        mesh, fm.beams.BeamProperty(fm.beams.Circle(0.01), steel), name="b", units=SI, springs=[spring], interfaces=ends
    )
    tip, _ = bent(exact_beams("b", body), steps=1, force=(0.001, 0.002, 0.003))
    K = body.K.toarray()
    f = np.zeros(24)
    f[18:21] = 0.001, 0.002, 0.003
    linear = np.linalg.solve(K[6:, 6:], f[6:])[12:15]
    assert_allclose(tip - nodes[3], linear, rtol=1e-4, atol=2e-5 * np.abs(linear).max())  # turned by 1e-5


def test_what_is_refused():
    with pytest.raises(ModelError, match="does not consist of beams alone"):
        exact_beams("bar", bar(nx=2))
    steel = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    with pytest.raises(ModelError, match="pieces from 1"):
        exact_beams("b", straight(2, 1.0, fm.beams.Circle(0.01), steel), pieces=0)
    mesh = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 3)
    item = fm.beams.BeamProperty(fm.beams.Circle(0.01), steel)
    both = fm.beams.line_interface(mesh, "both", fm.beams.NodeIndices((0, 1)))
    with pytest.raises(ModelError, match="interface 'both' has 2 nodes"):
        exact_beams("b", fm.beam_body(mesh, item, name="b", units=SI, interfaces=[both]))
    linked = fm.beam_body(mesh, item, name="b", units=SI, links=[fm.beams.RigidLink(0, (1,))])
    with pytest.raises(ModelError, match="has rigid links"):
        exact_beams("b", linked)
