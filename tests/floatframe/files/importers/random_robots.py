"""Random robots as URDF text."""

import numpy as np

from floatframe.model.rotations import rotation_exp

AXES = ("1 0 0", "0 1 0", "0 0 1", "0.3 -0.5 0.8")
TYPES = ("revolute", "continuous", "prismatic", "fixed")


def words(values):
    return " ".join(repr(float(value)) for value in values)


def inertia(rng, mass):
    """The tensor of point masses, so that it is possible."""
    points = rng.normal(size=(6, 3)) * 0.2
    points -= points.mean(axis=0)
    R = rotation_exp(rng.normal(size=3))
    return R @ (mass / 6 * sum(p @ p * np.eye(3) - np.outer(p, p) for p in points)) @ R.T


def link_text(rng, name):
    mass = rng.uniform(0.5, 3.0)
    J = inertia(rng, mass)
    tensor = " ".join(f'{key}="{J[place]!r}"' for key, place in zip(
        ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), strict=True
    )).replace("np.float64(", "").replace(")", "")  # fmt: skip
    return (
        f'<link name="{name}"><inertial><origin xyz="{words(rng.normal(size=3) * 0.2)}" '
        f'rpy="{words(rng.normal(size=3))}"/><mass value="{mass}"/><inertia {tensor}/></inertial></link>'
    )


def random_robot(seed, n, types=TYPES):
    """URDF of a tree of n joints on a base, with damping; fixed joints hold links with mass."""
    rng = np.random.default_rng(seed)
    lines = ['<robot name="random">', '<link name="base"/>']
    for k in range(n):
        lines.append(link_text(rng, f"link{k}"))
        parent = "base" if k == 0 else f"link{rng.integers(max(0, k - 3), k)}"
        kind = types[k % len(types)]
        limit = '<limit lower="-9" upper="9" effort="9" velocity="9"/>' if kind in ("revolute", "prismatic") else ""
        lines.append(
            f'<joint name="joint{k}" type="{kind}"><parent link="{parent}"/><child link="link{k}"/>'
            f'<origin xyz="{words(rng.normal(size=3) * 0.4)}" rpy="{words(rng.normal(size=3))}"/>'
            f'<axis xyz="{AXES[rng.integers(4)]}"/>{limit}</joint>'
        )
    return "\n".join([*lines, "</robot>"])
