"""Values that connections remember between steps: angles beyond full turns, states, approach speeds of contacts.

Each value is in its own row of the memory; the other rows contain wrenches of the results.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.contact import V_0
from floatframe.engine.kernels.model import CONTACT
from floatframe.engine.kernels.vector import copy
from floatframe.engine.structure_preserving.kernels.connections.contacts import speed_of_approach
from floatframe.engine.structure_preserving.kernels.coordinates import ends_of_step

__all__ = ["expect_angles", "keep", "recall", "remember"]


@inner
def recall(memory, step):
    """Read the remembered values at the start of the step."""
    copy(memory.w, step.known)


@inner
def expect_angles(memory, step):
    """Advance counted angles by their rates to the time at which forces act."""
    for k in range(memory.angle.shape[0]):
        step.angle[k] = memory.angle[k] + (step.t_force - step.t_0) * memory.angle_rate[k]


@inner
def remember(model, discrete, step):
    """Compute the remembered values at the end of the step from its unknowns and final marker positions."""
    for c in range(model.connections.size.shape[0]):
        if model.connections.law[c] == CONTACT:
            step.known[model.connections.w0[c] + V_0] = speed_of_approach(model, step, c)
    for p in range(model.coordinates.row.shape[0]):
        k = model.coordinates.row[p]
        _, step.known[k] = ends_of_step(model, step, k, model.coordinates.a[p], model.coordinates.b[p])
    for e in range(discrete.equation.shape[0]):
        step.known[model.laws.equation[e]] = step.f[discrete.equation[e]]
    change0 = step.load.shape[0] + step.f.shape[0]
    for s in range(model.states.row.shape[0]):
        k = model.states.row[s]
        step.known[k] += step.z[change0 + s]
        step.known[k + 1] = step.z[change0 + s] / step.h


@inner
def keep(discrete, step, memory):
    """Write the remembered values of connections into the memory."""
    for j in range(discrete.remembered.shape[0]):
        memory.w[discrete.remembered[j]] = step.known[discrete.remembered[j]]
