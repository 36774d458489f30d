"""Systems, bodies and helpers that several tests share: geometric reduction."""

from dataclasses import replace

import numpy as np

import cms
from fe_models.body.weld import weld
from fe_models.elements.beams.attachments import PointMass, RigidLink
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Rectangle
from fe_models.elements.interfaces import NodeIndices, line_interface
from fe_models.foundation.units import unit_system
from fe_models.meshes.line_mesh import straight_line
from tests.bodies import STEEL, bar, with_interfaces

SI = unit_system("m-kg-s")
SECTION = Rectangle(0.05, 0.04)


def bar_of_beams(n=12, length=1.0, section=SECTION, kind=None, **attached):
    mesh = straight_line((0, 0, 0), (length, 0, 0), n)
    ends = [line_interface(mesh, name, NodeIndices((node,))) for name, node in (("left", 0), ("right", n))]
    return beam_body(mesh, BeamProperty(section, STEEL), name="bar", units=SI, interfaces=ends, **attached)


def some_bodies():
    """Bodies with every kind of coupling, each coupled."""
    solid = bar(3, 1, 1, height=0.06)
    shift = np.array([0.02, 0.01, -0.03])
    shifted = [replace(i, reference=i.reference + shift) for i in solid.interfaces]
    rigid = cms.couple(with_interfaces(solid, *shifted))
    mean = cms.couple(with_interfaces(solid, *(replace(i, kind="distributing", weights=None) for i in shifted)))
    nodes = cms.couple(with_interfaces(solid, *(replace(i, kind="nodes") for i in shifted)))
    linked = cms.couple(
        bar_of_beams(4, links=[RigidLink(2, (1,))], point_masses=[PointMass(1, 1.0, 0.1, (0, 0.1, 0.2))])
    )
    beam = cms.couple(bar_of_beams(3))
    both = weld(
        [replace(rigid, name="solid"), replace(beam, name="beam")],
        [(("solid", "right"), ("beam", "left"))],
        name="both",
    )
    tied = weld(
        [replace(mean, name="solid"), replace(beam, name="beam"), replace(mean, name="third")],
        [(("beam", "left"), ("solid", "right")), (("solid", "right"), ("third", "left"))],
        name="tied",
    )
    two = weld(
        [replace(mean, name="one"), replace(mean, name="two"), replace(beam, name="beam")],
        [(("one", "right"), ("two", "left")), (("two", "right"), ("beam", "left"))],
        name="two",
    )
    welded = {"welded": both, "tied": tied, "two": two}
    return {"rigid": rigid, "distributing": mean, "nodes": nodes, "linked": linked} | welded
