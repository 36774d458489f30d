"""Shapes of bodies during a motion: positions of their nodes, which follow the deformation of their carrier."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import MarkerShape, interface_shape
from floatframe.model.rotations import rotated, rotation_exp
from floatframe.model.shapes import Piece
from floatframe.model.shapes.shape import Shape
from floatframe.model.system import Body

__all__ = ["Look", "carrier_of", "looks_of", "places_over"]


@dataclass(frozen=True, eq=False)
class Look:
    """A piece with its carrier in the body."""

    piece: Piece  #: piece in the axes of the carrier
    carrier: MarkerShape  #: carrier in the body frame of the results file


def looks_of(body: Body) -> tuple[Look, ...]:
    """Return the shapes of a body."""
    shapes = [shape for shape in body.shapes if isinstance(shape, Shape)]  # bodies make shapes of geometries
    return tuple(Look(piece, carrier_of(body, shape)) for shape in shapes for piece in shape.pieces())


def carrier_of(body: Body, shape: Shape) -> MarkerShape:
    """Return the carrier of a shape: an interface, the mesh axes of a flexible body, or the frame of a rigid body."""
    if not isinstance(body, FlexibleBody):
        return MarkerShape(np.zeros(3), np.eye(3))
    if shape.interface is not None:
        return interface_shape(body.reduced, shape.interface, is_stiffened=body.is_stiffened)
    frame = body.reduced.frame
    return MarkerShape(-frame.axes.T @ frame.origin, frame.axes.T)


def places_over(look: Look, r: Array, R: Array, q: Array, magnification: float = 1.0) -> Array:
    """Return the nodes of a piece during a motion, in ground axes, (n_t, n, 3).

    Parameters
    ----------
    r, R, q
        Motion of its body, (n_t, 3), (n_t, 3, 3), (n_t, n_q).
    magnification
        Factor of the displacement and rotation of its carrier as drawn.
    """
    d = magnification * look.carrier.deformation(q)
    axes = rotation_exp(d[:, 3:]) @ look.carrier.triad
    local = (look.carrier.position + d[:, :3])[:, None] + np.einsum("tab,nb->tna", axes, look.piece.nodes)
    return np.asarray(r[:, None] + rotated(R[:, None], local))
