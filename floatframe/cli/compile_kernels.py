"""Compile the kernels of the motion before they are needed: `python -m floatframe.cli.compile_kernels [relative]`.

Numba compiles them once on a machine and keeps them; it takes about a minute, on one core, and as long again for those
of joint coordinates (`relative`). A process beside can do that while another core works on something else. The kernels
have one signature, so that any system makes all of them.
"""

import sys
from collections.abc import Sequence

import numpy as np

from floatframe import GeneralizedAlpha, RigidBody, System, integrate

__all__ = ["main"]


def main(more: Sequence[str] = ()) -> None:
    """Move one free rigid body by one step, in absolute coordinates and in more formulations."""
    system = System([RigidBody("block", 1.0, np.eye(3))])
    for formulation in ("absolute", *more):
        integrate(system, GeneralizedAlpha(), 1e-3, 1e-3, formulation=formulation)


if __name__ == "__main__":
    main(sys.argv[1:])
