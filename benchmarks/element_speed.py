"""What a public element costs: processor time of a step beside the built-in force of the same law.

python benchmarks/element_speed.py

Chains of rigid bodies on springs, by spring-dampers and by elements with the same law, in three ways to its tangent;
the runs take turns, and the least time of each counts.
"""

import time
from dataclasses import dataclass

import numpy as np
from numba import njit

from floatframe import GROUND, GeneralizedAlpha, Gravity, Marker, RigidBody, SpringDamper, System
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.work import new_work
from floatframe.integrators.integrator import Integrator
from floatframe.model import Element, ElementLaw
from floatframe.model.elements import Placed

N_BODIES, N_STEPS, H, TURNS = 20, 2000, 1e-4, 7
STIFFNESS, DAMPING = 200.0, 1.0


@njit
def spring(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Pull along the line of two markers: k (L - L0) + c L'."""
    k, c, free = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    rate = ((x[1, 12] - x[0, 12]) * d0 + (x[1, 13] - x[0, 13]) * d1 + (x[1, 14] - x[0, 14]) * d2) / length
    f = (k * (length - free) + c * rate) / length
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2


@njit
def slopes_of_spring(t, x, z, lam, data, slopes):
    """Write its derivatives: by place and by velocity of both markers."""
    k, c, free = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    v0, v1, v2 = x[1, 12] - x[0, 12], x[1, 13] - x[0, 13], x[1, 14] - x[0, 14]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    e, v = (d0 / length, d1 / length, d2 / length), (v0, v1, v2)
    rate = e[0] * v0 + e[1] * v1 + e[2] * v2
    f = (k * (length - free) + c * rate) / length
    for r in range(3):
        for j in range(3):
            by_d = (f if r == j else 0.0) + (k - f) * e[r] * e[j] + c / length * e[r] * (v[j] - rate * e[j])
            by_v = c * e[r] * e[j]
            slopes[r, j], slopes[r, 12 + j] = -by_d, by_d
            slopes[r, 6 + j], slopes[r, 18 + j] = -by_v, by_v
            slopes[6 + r, j], slopes[6 + r, 12 + j] = by_d, -by_d
            slopes[6 + r, 6 + j], slopes[6 + r, 18 + j] = by_v, -by_v


@dataclass(frozen=True, eq=False)
class Spring(Element):
    """A spring-damper as an element."""

    name: str
    marker_a: Marker
    marker_b: Marker
    tangent: object

    def law(self, placed: Placed) -> ElementLaw:
        """Return its law, free as placed."""
        free = float(np.linalg.norm(placed.r[1] - placed.r[0]))
        return ElementLaw(
            function=spring, data=[STIFFNESS, DAMPING, free], acts=("force", "force"), is_opposite=True,
            tangent=self.tangent,
        )  # fmt: skip


def chain(tangent: object) -> System:
    """Return a chain of bodies; tangent None: with built-in springs."""
    bodies = [
        RigidBody(f"b{k}", 1.0, 0.1 * np.eye(3), position=(k + 1.0, 0, 0), omega_B=(0, 0, 0.1 * k))
        for k in range(N_BODIES)
    ]
    before = Marker(GROUND)
    forces: list = [Gravity((0, 0, -9.81))]
    elements = []
    for k, body in enumerate(bodies):
        ends = before, Marker(body.name, position=(-0.2, 0.1, 0))
        if tangent is None:
            forces.append(SpringDamper(f"s{k}", *ends, stiffness=STIFFNESS, damping=DAMPING))
        else:
            elements.append(Spring(f"s{k}", *ends, tangent))
        before = Marker(body.name, position=(0.2, 0, 0.1))
    return System(bodies, forces=forces, elements=elements)


def step_time(system: System, method: Integrator) -> float:
    """Return the processor time of a step [s]."""
    work = new_work(compiled_system(system).model)
    memory = method.start(system, 0.0)
    memory, _ = method.observe(system, 0.0, memory, work)
    began = time.process_time()
    method.advance(system, memory, work, t0=0.0, h=H, first=0, n_steps=N_STEPS, every=N_STEPS)
    return (time.process_time() - began) / N_STEPS


def measured() -> dict[str, float]:
    """Return the processor time of a step by the way to the tangent [s]."""
    ways = {"built in": None, "given tangent": slopes_of_spring, "complex": "complex", "differences": "differences"}
    systems = {name: chain(tangent) for name, tangent in ways.items()}
    method = GeneralizedAlpha(0.8)
    for system in systems.values():
        step_time(system, method)
    times = {name: [] for name in systems}
    for _ in range(TURNS):
        for name, system in systems.items():
            times[name].append(step_time(system, method))
    return {name: min(values) for name, values in times.items()}


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    times = measured()
    built_in = times.pop("built in")
    return {f"step with elements, {name}, over that with springs": each / built_in for name, each in times.items()}


def main() -> None:
    """Print the table."""
    times = measured()
    print(f"{N_BODIES} bodies on {N_BODIES} springs, processor time of a step")
    for name, seconds in times.items():
        print(f"{name:14} {1e6 * seconds:7.2f} us {seconds / times['built in']:6.2f}")


if __name__ == "__main__":
    main()
