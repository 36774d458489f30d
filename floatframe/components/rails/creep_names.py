"""Names of the creep laws, without importing the compiled code."""

__all__ = ["CREEP_LAWS", "NORMAL_LAWS"]

#: number of the law in `creep_force`, by name
CREEP_LAWS = {"kalker": 0, "kalker-saturated": 1, "polach": 2, "fastsim": 3}
NORMAL_LAWS = ("hertz", "constraint")
