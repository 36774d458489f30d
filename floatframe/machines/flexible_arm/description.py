"""The arm as a system: two aluminium strips on hinges in a horizontal plane, with elbow motor and load as masses."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cms
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.mode_choice import frozen_to_rigid, with_modes
from floatframe.model.joints import RevoluteJoint
from floatframe.model.system import System
from floatframe.results.sensors import JointCoordinate, PlaceSensor

__all__ = ["BENDING", "LENGTH", "FlexibleLinks", "arm", "links"]

FILES = Path(__file__).parent / "files"
LENGTH = 0.5  #: length of each link [m]
BENDING = (0, 1)  #: the two lowest modes of a link, in the numbering of its job
TIP = Marker("forearm", "tip")


@dataclass(frozen=True, eq=False)
class FlexibleLinks:
    """The reduced links."""

    upper: cms.ReducedBody
    forearm: cms.ReducedBody


def links(folder: Path = FILES) -> FlexibleLinks:
    """Reduce both links with the jobs in a folder; default: the shipped jobs."""
    return FlexibleLinks(*(cms.reduce_job(folder / f"{name}.toml") for name in ("upper", "forearm")))


def arm(parts: FlexibleLinks, *, modes: Sequence[int] | None = None, is_rigid: bool = False) -> System:
    """Return the arm, stretched along x, at rest, with free hinges `shoulder` and `elbow`, without gravity.

    Parameters
    ----------
    parts
        The links.
    modes
        Numbers of the modes of each link, from zero; None: all.
    is_rigid
        Whether to remove all modes.
    """
    bodies = []
    for name, x in (("upper", 0.0), ("forearm", LENGTH)):
        part = getattr(parts, name)
        if is_rigid:
            part = frozen_to_rigid(part)
        elif modes is not None:
            part = with_modes(part, modes)
        bodies.append(FlexibleBody(name, part, position=np.array([x, 0.0, 0.0])))
    axis = np.array([0.0, 0.0, 1.0])
    joints = (
        RevoluteJoint("shoulder", Marker(GROUND), Marker("upper", "shoulder"), axis=axis),
        RevoluteJoint("elbow", Marker("upper", "elbow"), Marker("forearm", "elbow"), axis=axis),
    )
    sensors: list[PlaceSensor | JointCoordinate] = [PlaceSensor("tip", TIP)]
    sensors += [JointCoordinate(joint, "angle", joint) for joint in ("shoulder", "elbow")]
    return System(tuple(bodies), joints, name="flexible arm", sensors=tuple(sensors))
