"""Gaps between bodies at one state, for computations once per motion or step; steps use functions in the kernels."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.model import ELEMENT
from floatframe.engine.kernels.work import Work
from floatframe.model.state import State

__all__ = ["gaps_at", "has_gaps"]


def has_gaps(compiled: CompiledSystem) -> bool:
    """Whether a system has contacts, or elements that declare gaps."""
    return len(compiled.model.gaps.connection) > 0


def gaps_at(compiled: CompiledSystem, work: Work, t: float, state: State, w: Array) -> Array:
    """Return all gaps at a state and time t, (n_gaps,), see kernels/connections/gap.py."""
    from floatframe.engine.kernels.entry import rates_of_constraints

    model = compiled.model
    set_iterate(work, state, w=w)
    work.state.time[...] = t
    rates_of_constraints(model, work)
    values = np.zeros(len(model.gaps.connection))
    for g, c in enumerate(model.gaps.connection):
        i, a, b = int(model.connections.item[c]), int(model.connections.a[c]), int(model.connections.b[c])
        if model.connections.law[c] == ELEMENT:
            head = model.laws.head[i]
            values[g] = work.laws.outputs[6 * head[0] + head[2] + head[3] + model.gaps.output[g]]
            continue
        d = work.markers.r[b] - work.markers.r[a]
        if model.contacts.is_sphere[i]:
            values[g] = np.linalg.norm(d) - model.contacts.radius_a[i] - model.contacts.radius_b[i]
        else:
            normal = work.markers.A[a] @ model.rows.x[model.connections.w0[c]]
            values[g] = normal @ d - model.contacts.radius_b[i]
    return values
