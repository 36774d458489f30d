"""Limits on how far joints may move bodies from their given positions: large moves are logged, huge ones rejected.

Newton's method closes the joints from any position. From far away it can end in another configuration than the intended
one (with an elbow bent to the other side).
"""

import logging

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.errors import ModelError
from floatframe.model.state import State

__all__ = ["require_placed_near"]

log = logging.getLogger(__name__)

REPORTED = 0.1  #: displacement, relative to the size of the body, above which it is logged
REFUSED = 3.0  #: displacement, relative to the size of the largest body, above which it is rejected


def require_placed_near(compiled: CompiledSystem, placed: State, closed: State) -> None:
    """Log the body that the joints moved far, and raise `ModelError` if a body was moved too far.

    Prescribed motions, and the joints of a loop that place bodies without a position, may move bodies far at the start.
    Their moves are only logged.

    Parameters
    ----------
    compiled
        The system.
    placed, closed
        The state as given, and with its joints closed; in the frames of the engine.
    """
    way = np.linalg.norm(closed.r - placed.r, axis=1)
    size = body_sizes(compiled)
    by_joints = compiled.by_joints & (placed is compiled.placed)
    is_driven = bool((compiled.model.rows.motion >= 0).any())
    i = int(np.argmax(way / size))
    if way[i] <= REPORTED * size[i]:
        return
    given = np.where(by_joints, 0.0, way)
    if given.max() > REFUSED * size.max() and not is_driven:
        far = int(np.argmax(given))
        raise ModelError(
            f"body {compiled.body_names[far]!r} was placed {way[far]:.3g} from the position that its joints require, "
            f"but the largest body has a size of {size.max():.3g}; place it at its joints, or check the units of its "
            "position"
        )
    if by_joints[i]:
        log.warning(
            "body %r has no position: closing its joints moved it by %.3g, %.2g of its size; from this distance they "
            "can close in another configuration, so give an approximate position and orientation",
            compiled.body_names[i], way[i], way[i] / size[i],
        )  # fmt: skip
        return
    log.warning(
        "body %r was placed %.3g from the position that its joints require, %.2g of its size, and was moved there; "
        "from this distance it can end in another configuration, so place it at its joints",
        compiled.body_names[i], way[i], way[i] / size[i],
    )  # fmt: skip


def body_sizes(compiled: CompiledSystem) -> Array:
    """Return the size of each body, (n_b,) [m]: largest marker arm or radius of gyration; 1 if all are 0."""
    model = compiled.model
    kind, types, markers = model.bodies.kind, model.body_types, model.markers
    size = np.sqrt(np.maximum(np.trace(types.J0, axis1=1, axis2=2), 0.0) / (2 * types.mass))[kind]
    on_body = markers.body >= 0
    np.maximum.at(size, markers.body[on_body], np.linalg.norm(markers.position[on_body], axis=1))
    return np.where(size > 0, size, size.max(initial=0.0) or 1.0)
