"""Names of the laws, without the compiled code behind them."""

__all__ = ["CREEP_LAWS", "NORMAL_LAWS"]

CREEP_LAWS = {"kalker": 0, "kalker-saturated": 1, "polach": 2, "fastsim": 3}  #: name: number in `creep_force`
NORMAL_LAWS = ("hertz", "constraint")
