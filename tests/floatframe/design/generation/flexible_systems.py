"""Trees with flexible bodies for the tests of generated code, and motions in which these are bent a good deal."""

from dataclasses import replace

import numpy as np

import cms
import fe_models
import floatframe as ff
from cms.reduction.basis.frames import NodalFrame
from floatframe.components.mechanisms import chain
from floatframe.engine.tree.recursion.expansion import marker_shape
from tests.floatframe.engine.tree.plain_kinematics import flexible_tree
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

SLENDER = fe_models.beams.BeamLine(1.0, 4.7, 1.26e8, 4.2e3, 9.5e3, 3.8e3, rho_Iy=1.6e-4, rho_Iz=3.5e-4)
METRES = cms.unit_system("m-kg-s")


def beam(*, is_clamped, n_axial=0, n_bending=2, n_torsion=0, is_nodal=False):
    """Return a beam in mean axes with geometric stiffness, or clamped at its start without.

    is_nodal: with geometric stiffness too the file has a frame that goes with the start, which the engine changes.
    """
    frame = NodalFrame("start", origin=(0.2, 0.1, 0.0)) if is_nodal else NodalFrame("start") if is_clamped else None
    return cms.reduction.beam_from_assumed_modes(
        SLENDER, name="beam", units=METRES, n_axial=n_axial, n_bending=n_bending, n_torsion=n_torsion, n_shear=0,
        stations={"start": 0.0, "end": 1.0}, frame=frame,
        geometric=not is_clamped, damping=cms.reduction.ModalDamping(0.02),
    )  # fmt: skip


def pendulum():
    """Return a beam in space on a hinge, in mean axes, with geometric stiffness."""
    return chain(1, rod=beam(is_clamped=False, n_axial=1, n_torsion=1))


def two_link_arm():
    """Return two beams clamped to their hinges, in the plane and out of it."""
    return chain(2, rod=beam(is_clamped=True))


def flexible_in_the_middle():
    """Return a rigid link, a beam in mean axes between two interfaces, and a rigid tool; axes in space."""
    rigid = ff.RigidBody("base link", 3.0, np.diag([0.2, 0.3, 0.25]), (0.1, 0.05, -0.02))
    middle = ff.FlexibleBody("middle", beam(is_clamped=False, is_nodal=True), position=(0.6, 0.1, 0.1))
    tool = ff.RigidBody("tool", 0.7, np.diag([0.02, 0.03, 0.01]), (0.05, 0.0, 0.1), position=(1.4, 0.0, 0.1))
    at = ff.Marker("base link", position=(0.4, 0.0, 0.1))
    joints = [
        ff.RevoluteJoint("waist", ff.GROUND, ff.Marker("base link"), axis=(0, 0, 1)),
        ff.RevoluteJoint("elbow", at, ff.Marker("middle", "start"), axis=(0, 1, 0)),
        ff.joints.UniversalJoint(
            "wrist", ff.Marker("middle", "end"), ff.Marker("tool"), axis=(0, 1, 0), axis_b=(0, 0, 1)
        ),
    ]
    return ff.System([rigid, middle, tool], joints, [ff.Gravity((0.3, -0.2, -9.81))], name="middle")


def held_at_the_free_end():
    """Return a beam in the frame of its start that hangs at its end, and a rigid body on a hinge at the start."""
    link = ff.FlexibleBody("link", beam(is_clamped=True), position=(-1.0, 0.0, 0.0))
    weight = ff.RigidBody("weight", 0.7, np.diag([0.02, 0.03, 0.01]), (0.05, 0.0, 0.1), position=(-1.0, 0.0, 0.0))
    joints = [
        ff.RevoluteJoint("upper", ff.GROUND, ff.Marker("link", "end"), axis=(0, 1, 0)),
        ff.RevoluteJoint("lower", ff.Marker("link", "start"), ff.Marker("weight"), axis=(0.6, 0, 0.8)),
    ]
    return ff.System([link, weight], joints, [ff.Gravity((0.3, -0.2, -9.81))], name="held")


def spun_about_its_length():
    """Return a beam clamped to a hinge along it: undeformed it is the same all around that."""
    line = replace(SLENDER, rho_Iz=SLENDER.rho_Iy)
    shaft = cms.reduction.beam_from_assumed_modes(
        line, name="shaft", units=METRES, n_axial=0, n_bending=1, n_torsion=0, n_shear=0,
        stations={"start": 0.0, "end": 1.0}, frame=NodalFrame("start"), geometric=False,
    )  # fmt: skip
    spin = ff.RevoluteJoint("spin", ff.GROUND, ff.Marker("shaft", "start"), axis=(1, 0, 0))
    return ff.System([ff.FlexibleBody("shaft", shaft)], [spin], [ff.Gravity((0.3, -0.2, -9.81))], name="shaft")


def dense_body(n=8):
    """Return a body on a hinge whose invariants have no zeros."""
    rod = reduced_body(random_point_masses(n, softness=0.1), stiffness(n))
    return chain(1, rod=rod, ends=("end_b", "end_a"))


SYSTEMS = {
    "pendulum": pendulum,
    "two-link arm": two_link_arm,
    "flexible in the middle": flexible_in_the_middle,
    "held at the free end": held_at_the_free_end,
    "mixed tree": lambda: flexible_tree(n=2, seed=4, is_free=True),
}


def bent_motion(model, seed, angle=1.0):
    """Return z, z_dot, z_ddot; the largest elastic rotation of a marker at a joint is nearly that angle [rad]."""
    rng, n = np.random.default_rng(seed), model.n_rates
    expansion = model.expansion
    z = model.moved(model.positions()[0], rng.normal(size=n))
    for xq in expansion.xq_of:
        z[xq] = rng.normal(size=xq.stop - xq.start)
    z_dot, z_ddot = rng.normal(size=(2, n))
    markers = expansion.compiled.model.markers
    shapes = [
        (marker_shape(expansion.compiled, int(m)), z[expansion.xq_of[int(markers.body[m])]])
        for m in np.flatnonzero(markers.psi0 >= 0)
    ]
    scale = 10.0
    while max(np.linalg.norm(shape.deformation(scale * q)[3:]) for shape, q in shapes) > angle:
        scale *= 0.9
    for xq, vq in zip(expansion.xq_of, expansion.vq_of, strict=True):
        z[xq] *= scale
        z_dot[vq] *= scale
        z_ddot[vq] *= scale
    return z, z_dot, z_ddot
