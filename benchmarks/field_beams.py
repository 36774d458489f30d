"""Descriptions of the beams of `benchmarks.field`, their motions and references."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

import cms
import fe_models as fm
from fe_models.body.beam_line import BeamLine
from floatframe import System, Trajectory
from floatframe.components import corotational, exact_beams, finite_segments, floating_parts
from floatframe.components.flexible_parts import FlexiblePart, PartMaker
from floatframe.model.bodies.markers import Marker
from floatframe.results.place_motion import interface_motion, point_motion

Describe = Callable[[BeamLine], PartMaker]
UNITS = cms.unit_system("m-kg-s")


def with_middle(part: FlexiblePart, place: str) -> FlexiblePart:
    """Call one of its places the middle."""
    markers = {**part.markers, "middle": part.marker(place)}
    return FlexiblePart(part.name, part.bodies, part.joints, part.forces, markers)


def segments(n: int) -> Describe:
    """Rigid segments, n odd."""
    return lambda line: partial(
        finite_segments, line=line, n=n, stations={"start": 0.0, "middle": line.length / 2, "end": line.length}
    )


def superelements(n: int) -> Describe:
    """Corotational superelements in a row, n even for a middle."""

    def describe(line: BeamLine) -> PartMaker:
        piece = replace(line, length=line.length / n)
        body = cms.reduction.beam_from_assumed_modes(
            piece, name="element", units=UNITS, n_axial=1, n_bending=2, n_torsion=1, geometric=False
        )

        def make(name: str, *, position: np.ndarray, orientation: np.ndarray) -> FlexiblePart:
            part = corotational(name, [body] * n, position=position, orientation=orientation)
            return with_middle(part, f"node {n // 2 + 1}")

        return make

    return describe


def parts(n: int, *, n_torsion: int = 3, stiffening: bool = True) -> Describe:
    """Reduced bodies in floating frames, n even for a middle."""

    def describe(line: BeamLine) -> PartMaker:
        piece = replace(line, length=line.length / n)
        body = cms.reduction.beam_from_assumed_modes(
            piece, name="piece", units=UNITS, n_axial=1, n_bending=4, n_torsion=n_torsion
        )

        def make(name: str, *, position: np.ndarray, orientation: np.ndarray) -> FlexiblePart:
            part = floating_parts(name, [body] * n, position=position, orientation=orientation, stiffening=stiffening)
            return with_middle(part, f"node {n // 2 + 1}")

        return make

    return describe


def exact(n: int) -> Describe:
    """Geometrically exact beams of n elements, n even."""

    def describe(line: BeamLine) -> PartMaker:
        E, G = 1e11, 1e11 / 2.6
        A = line.EA / E
        section = fm.beams.GeneralSection(
            A, line.EIy / E, line.EIz / E, line.GJ / G, A_sy=line.GAy / G, A_sz=line.GAz / G
        )
        material = fm.Material("of the line", E=E, nu=0.3, rho=line.rho_A / A)
        mesh = fm.beams.straight_line((0, 0, 0), (line.length, 0, 0), 2)
        kept = [
            fm.beams.line_interface(mesh, place, fm.beams.NodeIndices((k,)))
            for k, place in enumerate(("start", "middle", "end"))
        ]
        prop = fm.beams.BeamProperty(section, material, orientation=(0, 1, 0))
        body = fm.beam_body(mesh, prop, name="beam", units=UNITS, interfaces=kept)
        return partial(exact_beams, body=body, pieces=n // 2)

    return describe


def path(motion: Trajectory, system: System, marker: Marker) -> np.ndarray:
    """Place of a marker over time, (n_t, 3)."""
    if marker.interface is None:
        at = np.zeros(3) if marker.position is None else marker.position
        return point_motion(motion, marker.body, at).position
    return interface_motion(motion, marker.body, system.body(marker.body).reduced, marker.interface).position


def marker_of(describe: Describe, line: BeamLine, name: str, place: str) -> Marker:
    """The marker of a place of a part as a system has it."""
    return describe(line)(name, position=np.zeros(3), orientation=np.eye(4)[0]).marker(place)
