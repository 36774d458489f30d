"""An L-shaped cantilever and the Princeton beam in every description."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    Marker,
    PointForce,
    System,
    linearize,
    static_equilibrium,
    system_modes,
)
from floatframe.components import corotational, finite_segments
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem, equilibrium

UNITS = cms.unit_system("m-kg-s")
STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=7870.0)
LEG, SECTION = 0.5, fm.beams.Rectangle(0.02, 0.03)
UPWARD = euler_parameters_of_rotation_vector(np.array([0, 0, np.pi / 2]))  # the second leg along y


@cache
def frame_of_elements():
    """Both legs as one frame of 80 elements."""
    n = 40
    x = np.concatenate([np.linspace(0, LEG, n + 1), np.full(n, LEG)])
    y = np.concatenate([np.zeros(n + 1), np.linspace(0, LEG, n + 1)[1:]])
    nodes = np.column_stack([x, y, np.zeros_like(x)])
    lines = np.column_stack([np.arange(2 * n), np.arange(1, 2 * n + 1)])
    first = np.arange(2 * n) < n
    mesh = fm.beams.LineMesh(nodes, lines, line_sets={"first": np.flatnonzero(first), "second": np.flatnonzero(~first)})
    sections = {
        "first": fm.beams.BeamProperty(SECTION, STEEL, orientation=(0, 1, 0)),
        "second": fm.beams.BeamProperty(SECTION, STEEL, orientation=(-1, 0, 0)),
    }
    root = fm.beams.line_interface(mesh, "root", fm.beams.NodeIndices((0,)))
    body = cms.couple(fm.beam_body(mesh, sections, name="frame", units=UNITS, interfaces=[root]))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=10), frame=cms.NodalFrame("root")).frequencies[:6]


def law(length=LEG):
    return fm.beams.beam_line(length, fm.beams.BeamProperty(SECTION, STEEL))


def leg_of_modes():
    return cms.reduction.beam_from_assumed_modes(law(), name="leg", units=UNITS, n_axial=3, n_bending=6, n_torsion=3)


def l_frame(kind):
    """The cantilever in one of the descriptions."""
    if kind == "assumed modes":
        leg = leg_of_modes()
        bodies = [FlexibleBody("a", leg), FlexibleBody("b", leg, position=(LEG, 0, 0), orientation=UPWARD)]
        clamp, end, start, forces = Marker("a", "start"), Marker("a", "end"), Marker("b", "start"), []
    else:
        if kind == "finite segments":
            parts = [finite_segments(name, law(), 17, position=p, orientation=o) for name, p, o in PLACES]
        else:
            element = cms.reduction.beam_from_assumed_modes(
                law(LEG / 16), name="element", units=UNITS, n_axial=1, n_bending=2, n_torsion=1
            )
            parts = [corotational(name, [element] * 16, position=p, orientation=o) for name, p, o in PLACES]
        bodies, forces = [b for part in parts for b in part.bodies], [f for part in parts for f in part.forces]
        clamp, end, start = parts[0].marker("start"), parts[0].marker("end"), parts[1].marker("start")
    return System(bodies, [FixedJoint("clamp", GROUND, clamp), FixedJoint("corner", end, start)], forces, UNITS)


PLACES = (("a", (0, 0, 0), (1.0, 0, 0, 0)), ("b", (LEG, 0, 0), UPWARD))


@pytest.mark.parametrize(
    ("kind", "tolerance"), [("assumed modes", 2e-4), ("finite segments", 1e-2), ("corotational", 1e-2)]
)
def test_frequencies_of_the_l_shaped_cantilever(kind, tolerance):
    """In its plane and out of it, where the first leg twists."""
    found = system_modes(linearize(l_frame(kind))).frequencies
    assert_allclose(found[:4], frame_of_elements()[:4], rtol=tolerance)


# the beam of the Princeton experiments: aluminium, 0.508 m, 12.377 mm by 3.2024 mm, weights of one pound at the tip
LENGTH, WIDE, THIN, POUND = 0.508, 12.377e-3, 3.2024e-3, 4.448
N_LOADS = 6
ALUMINIUM = fm.Material("aluminium", E=71.7e9, nu=0.31, rho=2700.0)


def strip():
    return fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(fm.beams.Rectangle(THIN, WIDE), ALUMINIUM))


def exact_tip(load):
    """Tip of the exact planar beam in the weak direction, (2,)."""
    line = strip()
    beam = ExactBeam((0, 0), (LENGTH, 0), 12, line.EA, line.GAy, line.EIz, line.rho_A, line.rho_Iz)
    force = np.zeros(beam.n_dof)
    force[beam.node(-1)[1]] = load
    held = {int(k): (lambda t: (0.0, 0.0, 0.0)) for k in beam.node(0)}
    return equilibrium(Problem(beam.mass(), beam.force, beam.x0, held), force)[beam.node(-1)[:2]]


def strip_of(kind, force):
    """Tip under a force there, (3,)."""
    if kind == "segments":
        part = finite_segments("strip", strip(), 17)
    elif kind == "corotational":
        line = fm.beams.beam_line(LENGTH / 16, fm.beams.BeamProperty(fm.beams.Rectangle(THIN, WIDE), ALUMINIUM))
        element = cms.reduction.beam_from_assumed_modes(
            line, name="element", units=UNITS, n_axial=1, n_bending=2, n_torsion=1
        )
        part = corotational("strip", [element] * 16)
    else:
        body = cms.reduction.beam_from_assumed_modes(
            strip(), name="strip", units=UNITS, n_axial=3, n_bending=6, n_torsion=3, frame=cms.NodalFrame("start")
        )
        system = System(
            [FlexibleBody("strip", body)],
            [FixedJoint("clamp", GROUND, Marker("strip", "start"))],
            [PointForce("weight", Marker("strip", "end"), force=force)],
            UNITS,
        )
        state = static_equilibrium(system).state
        d = body.interface("end").Psi @ state.q
        second = np.einsum("akl,k,l->a", body.geometric.interfaces[1], state.q, state.q) / 2
        return np.array([LENGTH, 0, 0]) + d[:3] - second[:3]
    state = None
    for share in np.linspace(0, 1, N_LOADS + 1)[1:]:  # brought on in steps
        load = PointForce("weight", part.marker("end"), force=share * np.asarray(force))
        system = System(part.bodies, [FixedJoint("clamp", GROUND, part.marker("start"))], [*part.forces, load], UNITS)
        state = static_equilibrium(system, state=state, max_iterations=400).state
    return state.r[-1]


@pytest.mark.parametrize(
    ("kind", "pounds", "tolerance"),
    [("segments", 1, 2e-3), ("segments", 3, 2e-3), ("corotational", 3, 2e-3), ("stiffened modes", 0.25, 2e-3)],
)
def test_princeton_beam_bends_in_its_weak_direction_as_the_exact_beam(kind, pounds, tolerance):
    """15 % of its length by one pound, 38 % by three, where one linear frame is out of its range."""
    exact = exact_tip(pounds * POUND)
    found = strip_of(kind, (0, pounds * POUND, 0))
    assert exact[1] > (0.15 if pounds >= 1 else 0.035) * LENGTH
    assert_allclose(found[:2] - [LENGTH, 0], exact - [LENGTH, 0], rtol=0, atol=tolerance * exact[1])


def test_princeton_beam_under_an_oblique_load_is_alike_in_both_nonlinear_descriptions():
    """At 45 degrees it bends both ways and twists."""
    force = POUND * np.array([0, np.sqrt(0.5), np.sqrt(0.5)])
    segments, elements = (strip_of(kind, force) for kind in ("segments", "corotational"))
    assert_allclose(segments, elements, rtol=0, atol=1e-3 * LENGTH)
    assert segments[1] > 10 * segments[2] > 0.01 * LENGTH
