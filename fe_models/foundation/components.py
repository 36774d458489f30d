"""Names of components, in the order of the arrays."""

__all__ = ["MOTION_COMPONENTS", "STRESS_COMPONENTS"]

#: components of a node or interface: translations, then rotations; component k of `FEBody.dofs`
MOTION_COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")

STRESS_COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")  #: components of a symmetric tensor, in Voigt's order
