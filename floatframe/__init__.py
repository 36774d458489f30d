"""Flexible multibody dynamics in floating frames of reference.

rod = cms.read("rod.h5")
pin = RevoluteJoint("pin", GROUND, Marker("rod", "big_end"), axis=(0, 1, 0))
system = System([FlexibleBody("rod", rod)], [pin], [Gravity((0, 0, -9810.0))], units=rod.units)
trajectory = integrate(system, GeneralizedAlpha(rho_inf=0.8), t_end=1.0, h=1e-3)
"""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
