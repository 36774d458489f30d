"""Names of components, in the order in which arrays hold them."""

__all__ = ["MOTION_COMPONENTS", "STRESS_COMPONENTS"]

#: of a node or interface: translations, then rotations; component k of `FEBody.dofs`
MOTION_COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")

STRESS_COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")  #: of a symmetric tensor, Voigt's order
