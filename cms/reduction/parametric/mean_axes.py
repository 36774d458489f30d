"""Samples in mean axes and without the damping that is stated by ratios of their modes, and the way back."""

from dataclasses import replace

import numpy as np

from cms.body.reduced_body import BodyFrame, ReducedBody
from cms.reduction.basis.damping import damping_of_words, modal_damping
from cms.reduction.basis.frames import FRAMES, Axes, NodalFrame, TisserandFrame
from cms.reduction.frame_conversion import convert_frame
from fe_models.foundation.arrays import Array

__all__ = ["in_frame", "in_mean_axes"]

CONVERTED = "frame converted from"  #: key of the provenance of bodies whose frame was converted


def in_mean_axes(sample: ReducedBody) -> ReducedBody:
    """Return a sample in the mean-axis frame with the axes of its frame; a held body stays in the frame of the ground.

    The damping of its modes that the provenance states is left out.
    """
    sample = replace(sample, D=sample.D - stated_damping(sample))
    return sample if sample.is_held else convert_frame(sample, TisserandFrame(axes=axes_of(sample.frame)))


def in_frame(body: ReducedBody, frame: BodyFrame, provenance: dict[str, str]) -> ReducedBody:
    """Return a body of mean axes in another frame, with this provenance and the damping that it states."""
    axes, origin = axes_of(frame), vector(frame.origin)
    if body.is_held:
        made = body
    elif frame.kind == "nodal":
        dofs = None if frame.at else tuple((int(node), int(component)) for node, component in frame.dofs)
        made = convert_frame(body, NodalFrame(frame.at or None, origin, axes, dofs))
    else:
        made = convert_frame(body, FRAMES[frame.kind](origin=origin, axes=axes))
    made = replace(made, provenance=provenance)
    return replace(made, D=made.D + stated_damping(made))


def stated_damping(body: ReducedBody) -> Array:
    """Return the damping of the modes that the provenance states, (n_q, n_q) [1/s]; zero if it states none."""
    damping = damping_of_words(body.provenance.get("damping", "none"))
    if damping is None or CONVERTED in body.provenance:
        return np.zeros_like(body.K)
    return modal_damping(damping, body.M, body.K, second=body.units.time)


def axes_of(frame: BodyFrame) -> Axes:
    """Return x, y and z axis of a frame in mesh axes."""
    x, y, z = (vector(axis) for axis in frame.axes.T)
    return x, y, z


def vector(values: Array) -> tuple[float, float, float]:
    """Return three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
