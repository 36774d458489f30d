"""Wheels on roads: tyres (linear, brush, Magic Formula), tyre property files, flat, measured and random roads."""

import lazy_loader

# the public names are listed in __init__.pyi; each module is imported when its name is first used
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

#: module and class of each element, by its type in a system file without "wheels."
ELEMENTS = {
    "linear-tyre": "floatframe.components.wheels.linear_tyre:LinearTyre",
    "brush-tyre": "floatframe.components.wheels.brush_tyre:BrushTyre",
    "magic-formula-tyre": "floatframe.components.wheels.magic_formula_tyre:MagicFormulaTyre",
}
