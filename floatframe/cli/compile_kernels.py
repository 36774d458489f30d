"""Compile the kernels of the motion before they are needed: `python -m floatframe.cli.compile_kernels`.

Numba compiles them once on a machine and keeps them; it takes about a minute, on one core. A process beside can do that
while another core works on something else. The kernels have one signature, so that any system makes all of them.
"""

import numpy as np

from floatframe import GeneralizedAlpha, RigidBody, System, integrate

__all__ = ["main"]


def main() -> None:
    """Move one free rigid body by one step."""
    block = RigidBody("block", 1.0, np.eye(3))
    integrate(System([block]), GeneralizedAlpha(), 1e-3, 1e-3)


if __name__ == "__main__":
    main()
