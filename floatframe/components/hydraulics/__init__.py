"""Hydraulic circuits and shock absorbers with their own states, as public elements.

`fluid` and `gas` give volumes and energies as functions of the pressure. `components` describes circuits, `nodes`
validates them, `circuit_data` writes their data, and `circuit_law` is the compiled law. `oleo_strut` is a shock
absorber.
"""

from floatframe.components.hydraulics.circuit_data import Circuit
from floatframe.components.hydraulics.components import (
    Accumulator,
    CheckValve,
    Cylinder,
    DirectionalValve,
    FlowSource,
    Node,
    Orifice,
    Pipe,
    Pump,
    ReliefValve,
    Resistance,
    Supply,
    Tank,
)
from floatframe.components.hydraulics.fluid import Fluid
from floatframe.components.hydraulics.oleo_strut import OleoStrut

ELEMENTS = {
    "circuit": "floatframe.components.hydraulics.circuit_data:Circuit",
    "oleo-strut": "floatframe.components.hydraulics.oleo_strut:OleoStrut",
}

__all__ = [
    "Accumulator",
    "CheckValve",
    "Circuit",
    "Cylinder",
    "DirectionalValve",
    "FlowSource",
    "Fluid",
    "Node",
    "OleoStrut",
    "Orifice",
    "Pipe",
    "Pump",
    "ReliefValve",
    "Resistance",
    "Supply",
    "Tank",
]
