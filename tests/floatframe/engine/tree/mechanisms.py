"""Every mechanism of `floatframe.components.mechanisms`, small and in motion."""

from dataclasses import replace
from functools import cache

import cms
import fe_models as fm
from floatframe import Gravity, Marker, PointForce
from floatframe.components.mechanisms import (
    chain,
    double_pendulum,
    four_bar,
    pendulum,
    rotating_blade,
    satellite,
    slider_crank,
    spin_up_beam,
    spinning_shaft,
    spinning_top,
    telescopic_slider_crank,
)
from floatframe.model.functions.time_functions import polynomial_of_time

SOFT = fm.Material("soft", E=4e9, nu=0.3, rho=2700.0)
DOWN = Gravity((0.0, -9.81, 0.0))
ALONG = ("start", "a", "b", "c", "end")


@cache
def beam(length=1.0, n_modes=2):
    """A slender beam with five interfaces and geometric stiffness."""
    n = 8
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), n)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((2 * k,))) for k, name in enumerate(ALONG)]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.03, 0.02), SOFT, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="beam", units=cms.unit_system("m-kg-s"), interfaces=ends))

    return cms.reduce(body, cms.craig_bampton(body, n_modes=n_modes), geometric=True)


def falling(system):
    """The system under gravity."""
    return replace(system, forces=[*system.forces, DOWN])


def pushed(system, body, force):
    """The system with a force on a body."""
    return replace(system, forces=[*system.forces, PointForce("push", Marker(body), force)])


TURNING = polynomial_of_time([0.3, 4.0, 2.0])
MECHANISMS = {
    "pendulum": lambda: pendulum(angle=0.5),
    "double pendulum": lambda: double_pendulum(angles=(0.3, -1.0)),
    "chain": lambda: chain(5, angles=(0.3, -1.0, 0.2, 0.1, 0.5)),
    "slider-crank": lambda: slider_crank(angle=0.3, speed=6.0),
    "slider-crank driven": lambda: slider_crank(angle=0.3, drive=TURNING),
    "four-bar": lambda: falling(four_bar(angle=1.0)),
    "four-bar driven": lambda: four_bar(angle=0.3, drive=TURNING),
    "satellite": lambda: pushed(satellite(spin=1.0), "hub", (1.0, 2.0, 5.0)),
    "top": spinning_top,
    "flexible pendulum": lambda: pendulum(angle=0.5, rod=beam()),
    "flexible double pendulum": lambda: double_pendulum(angles=(0.3, -1.0), rod=beam()),
    "flexible slider-crank": lambda: slider_crank(angle=0.3, speed=6.0, flexible_rod=beam(0.3)),
    "flexible four-bar": lambda: four_bar(angle=0.3, drive=TURNING, flexible_coupler=beam(0.9)),
    "flexible satellite": lambda: pushed(satellite(spin=1.0, boom_length=1.0, boom=beam()), "hub", (1.0, 2.0, 5.0)),
    "spin-up": lambda: spin_up_beam(beam(), speed=3.0, duration=0.4, root="start"),
    "blade": lambda: falling(rotating_blade(beam(), hub_inertia=0.5, root="start")),
    "shaft": lambda: falling(spinning_shaft(beam(), speed=20.0, ends=("start", "end"))),
    "telescopic": lambda: telescopic_slider_crank(beam(0.5), ALONG, ring=0.25, angle=0.3, drive=TURNING),
}  # fmt: skip
