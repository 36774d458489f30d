"""Flexible multibody dynamics in floating frames of reference.

rod = cms.read("rod.h5")
pin = RevoluteJoint("pin", GROUND, Marker("rod", "big_end"), axis=(0, 1, 0))
system = System([FlexibleBody("rod", rod)], [pin], [Gravity((0, 0, -9810.0))], units=rod.units)
trajectory = integrate(system, GeneralizedAlpha(rho_inf=0.8), t_end=1.0, h=1e-3)
"""

import lazy_loader

# The public names are listed in __init__.pyi. A module is imported when one of its names is first used, and a function
# checks its arguments (`at_door`).
attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    found = attribute(name)
    from fe_models.foundation.records import at_door
    from floatframe.errors import ModelError

    return at_door(__name__, name, found, ModelError)
