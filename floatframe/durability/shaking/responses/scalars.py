"""Outputs as real columns: the outputs of a model, followed by von Mises stresses of places with six components."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.durability.shaking.responses.stresses import cycle_von_mises
from floatframe.durability.shaking.structure.model import Output, ShakenModel

__all__ = ["scalar_outputs", "scalar_sizes", "stress_groups"]


def stress_groups(model: ShakenModel) -> list[slice]:
    """Return the rows of the six components of each observed stress."""
    first = [k for k, output in enumerate(model.outputs) if output.kind == "stress" and output.name.endswith(" xx")]
    return [slice(k, k + 6) for k in first]


def scalar_outputs(model: ShakenModel) -> tuple[Output, ...]:
    """Return the outputs of the columns."""
    more = []
    for rows in stress_groups(model):
        one = model.outputs[rows.start]
        more.append(Output(f"{one.group} von Mises", "von Mises", one.unit, one.group, one.place))
    return (*model.outputs, *more)


def scalar_sizes(model: ShakenModel, amplitudes: Array) -> Array:
    """Return magnitudes of complex amplitudes (n, n_rows), and largest von Mises stresses in a cycle, (n, n_out)."""
    extra = [cycle_von_mises(amplitudes[:, rows])[:, None] for rows in stress_groups(model)]
    return np.concatenate([np.abs(amplitudes), *extra], axis=1)
