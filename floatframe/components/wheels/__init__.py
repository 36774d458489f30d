"""Wheels on roads: tyres (linear, brush, Magic Formula), tyre property files, flat, measured and random roads."""

from fe_models.door import open_door

open_door(__name__)

#: module and class of each element, by its type in a system file without "wheels."
ELEMENTS = {
    "linear-tyre": "floatframe.components.wheels.linear_tyre:LinearTyre",
    "brush-tyre": "floatframe.components.wheels.brush_tyre:BrushTyre",
    "magic-formula-tyre": "floatframe.components.wheels.magic_formula_tyre:MagicFormulaTyre",
}
