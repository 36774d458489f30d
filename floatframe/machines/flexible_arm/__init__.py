"""A flexible arm of two links that is moved fast: rigid computed torque beside a move optimised with its modes."""

from floatframe.machines.flexible_arm.collocation import OptimalMove, casadi_function, optimal_move
from floatframe.machines.flexible_arm.control import computed_torque, following
from floatframe.machines.flexible_arm.description import BENDING, FlexibleLinks, arm, links
from floatframe.machines.flexible_arm.study import ArmMotion, compared, controlled, moves, plot_motions

__all__ = [
    "BENDING", "ArmMotion", "FlexibleLinks", "OptimalMove", "arm", "casadi_function", "compared", "computed_torque",
    "controlled", "following", "links", "moves", "optimal_move", "plot_motions",
]  # fmt: skip
