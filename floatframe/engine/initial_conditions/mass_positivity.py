"""Check that the mass matrices of stiffened bodies are positive definite at a state.

The kinetic energy of a stiffened body is truncated after the second order of the deformation (docs/theory.md §7), so
that, unlike that of a linear body, it can become negative at large deflections. (In a frame fixed to the hinge of the
body, shapes that are nearly a rigid rotation make it negative early. Therefore stiffened bodies move in mean axes.)
"""

import numpy as np

from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["indefinite_mass_words", "indefinite_masses"]


def indefinite_masses(system: System, state: State) -> tuple[str, ...]:
    """Return the names of the stiffened bodies whose mass matrix is not positive definite at a state."""
    model = compiled_system(system).model
    stiffened = [i for i, body in enumerate(system.bodies) if isinstance(body, FlexibleBody) and body.is_stiffened]
    if not stiffened or not all(np.isfinite(part).all() for part in (state.q, state.p)):
        return ()
    work = new_work(model)
    set_iterate(work, state)
    blocks = linearized(model, work, 1.0, 0.0, 0.0).H
    found = []
    for i in stiffened:
        M = (blocks[i] + blocks[i].T) / 2
        own = np.diag(M)
        massive = np.flatnonzero(own != 0)
        scale = 1 / np.sqrt(np.abs(own[massive]))
        lowest = np.linalg.eigvalsh(scale[:, None] * M[np.ix_(massive, massive)] * scale)[0]
        if lowest <= 0:
            found.append(compiled_system(system).body_names[i])
    return tuple(found)


def indefinite_mass_words(names: tuple[str, ...]) -> str:
    """Return a message with the meaning and the remedy; empty if there are no names."""
    if not names:
        return ""
    told = ", ".join(repr(name) for name in names)
    return (
        f"the mass matrix of the stiffened body {told} is not positive definite there: its deformation is too large "
        "for a theory of second order; split it into parts (cms split, [body] part)"
    )
