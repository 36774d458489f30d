"""A flexible arm on a motor whose angle is prescribed, swinging in a vertical plane, with a payload at its tip."""

from functools import cache

import numpy as np

import cms
import fe_models as fm
from fe_models.foundation.units import unit_system
from floatframe import FixedJoint, FlexibleBody, Gravity, Marker, RevoluteJoint, RigidBody, System
from floatframe.design.identification.scaled_link import scaled_link
from floatframe.forces import Bushing
from floatframe.model.functions.time_functions import sampled
from floatframe.sensors import PlaceSensor, ReactionSensor

LENGTH = 1.0
#: hub inertia [kg m²], payload [kg], factors of the link's density and modulus, damping ratio, viscous friction [N m s]
TRUTH = {"hub": 0.03, "payload": 0.15, "mass": 1.1, "stiffness": 0.85, "ratio": 0.02, "friction": 0.08}
GUESS = {"hub": 0.02, "payload": 0.1, "mass": 1.0, "stiffness": 1.0, "ratio": 0.01, "friction": 0.05}
OUTPUTS = ("shoulder.angle force", "deflection y", "base force y", "base force x")
NOISE = np.array([0.02, 2e-4, 0.05, 0.05])  #: of a torque sensor [N m], an optical sensor [m], a balance [N]


@cache
def link(E=7e10, rho=2700.0):
    """An aluminium strip of 50 mm by 8 mm that bends in the plane, two modes, its frame held at the root."""
    section = fm.beams.GeneralSection(A=4e-4, Iy=2.13e-9, Iz=2.13e-9, J=8e-9)
    mesh = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), 8)
    places = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", 8))]
    strip = fm.beams.BeamProperty(section, fm.Material("aluminium", E=E, nu=0.3, rho=rho), orientation=(0, 1, 0))
    body = fm.planar(cms.couple(fm.beam_body(mesh, strip, name="link", units=unit_system("m-kg-s"), interfaces=places)))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=1), frame=cms.NodalFrame("root"), geometric=True)


def swing(t):
    """The angle of the motor: from rest into a sum of three sines, 0.7 to 6 Hz."""
    begin = np.clip(t / 0.5, 0, 1)
    begin = begin**3 * (10 - 15 * begin + 6 * begin**2)
    return begin * sum(
        a * np.sin(2 * np.pi * f * t + c) for a, f, c in ((0.4, 0.7, 0.0), (0.04, 2.3, 1.0), (0.008, 6.0, 2.0))
    )


@cache
def drive(t_end):
    """The same, as the engine knows it."""
    return sampled(lambda t: float(swing(t)), 0.0, t_end, 1e-7)


def arm(p, t_end=2.0, reduced=None):
    """The arm with parameters by name."""
    hub = RigidBody("hub", 1.0, p["hub"] * np.eye(3))
    own = FlexibleBody("link", link() if reduced is None else reduced)
    strip = scaled_link(own, mass=p["mass"], stiffness=p["stiffness"], damping=[p["ratio"]])
    payload = RigidBody("payload", p["payload"], 1e-5 * np.eye(3), position=(LENGTH, 0, 0))
    joints = [
        RevoluteJoint("shoulder", Marker("ground"), Marker("hub"), axis=(0, 0, 1), motions={"angle": drive(t_end)}),
        FixedJoint("clamp", Marker("hub"), Marker("link", "root")),
        FixedJoint("grip", Marker("link", "tip"), Marker("payload")),
    ]
    friction = Bushing("friction", Marker("ground"), Marker("hub"), damping=[0, 0, 0, 0, 0, p["friction"]])
    sensors = [
        PlaceSensor("deflection", Marker("link", "tip"), relative_to=Marker("hub")),
        ReactionSensor("base", "shoulder"),
    ]
    return System([hub, strip, payload], joints, [Gravity((0, -9.81, 0)), friction], sensors=sensors)
