"""Whether every body can be accelerated: mass, inertia about every axis, and mass or stiffness of every mode.

Bodies are eliminated one by one, each by its own matrix, so that none may be without inertia, joints or not.
"""

from collections.abc import Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody

__all__ = ["require_inertia"]

NO_INERTIA = 1e-13  #: smallest principal moment by the largest one that is none


def require_inertia(bodies: Sequence[RigidBody | FlexibleBody]) -> None:
    """Raise `ModelError` naming a body that some motion of its own would move without force.

    That is a rigid body, or a beam without thickness, that has no moment of inertia about an axis, and a mode that
    has neither mass nor stiffness.
    """
    checked: list[ReducedBody] = []
    for body in bodies:
        if isinstance(body, RigidBody):
            require_moments(f"rigid body {body.name!r}", body.inertia)
        elif not any(body.reduced is other for other in checked):
            checked.append(body.reduced)
            where = f"flexible body {body.name!r}"
            moments = body.reduced.moments
            c = moments.S / moments.m
            require_moments(where, moments.J0 - moments.m * (c @ c * np.eye(3) - np.outer(c, c)))
            require_modes(where, body.reduced)


def require_moments(where: str, inertia: Array) -> None:
    """Raise `ModelError` with the axis about which an inertia tensor about the centre of mass has no moment."""
    moments, axes = np.linalg.eigh(0.5 * (inertia + inertia.T))
    if moments[0] > NO_INERTIA * moments[-1]:
        return
    axis = axes[:, 0] * np.sign(axes[np.argmax(np.abs(axes[:, 0])), 0])
    direction = ", ".join(f"{value:.3g}" for value in axis + 0.0)
    raise ModelError(
        f"{where}: it has no inertia about its axis [{direction}]: expected a moment above zero, got {moments[0]:.3g} "
        f"beside {moments[-1]:.3g}; nothing would resist its turning. Give the moment of its real thickness (m r²/2 "
        "for a round rod of radius r), or leave a rod without mass out: a distance joint is one"
    )


def require_modes(where: str, reduced: ReducedBody) -> None:
    """Raise `ModelError` with the first mode that has neither mass nor stiffness."""
    mass, stiffness = np.diag(reduced.M), np.diag(reduced.K)
    nothing = np.flatnonzero((mass <= 0) & (stiffness <= 0))
    if len(nothing):
        k = int(nothing[0])
        raise ModelError(
            f"{where}: mode {k + 1} ({reduced.labels[k]}) has neither mass nor stiffness, so that any force would move "
            "it without end; reduce the body again, or leave the mode out"
        )
