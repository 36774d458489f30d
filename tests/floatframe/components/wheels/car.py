"""A rigid car with four wheels and its centre of mass on the ground, and the single-track model it then is."""

from dataclasses import dataclass

import numpy as np

import floatframe as ff
from floatframe.components import wheels

R, G = 0.3, 9.81
HALF_TRACK = 0.2
LOADED = 0.29  #: height of the hubs [m]


@dataclass(frozen=True)
class Car:
    """m, I_z, distances of the axles to the centre of mass, cornering stiffness of each axle."""

    m: float = 1000.0
    I_z: float = 1400.0
    a: float = 1.1
    b: float = 1.4
    C_f: float = 7e4
    C_r: float = 9e4
    sigma: float = 0.0  #: relaxation length along y [m]

    def matrix(self, V):
        """A of (v, r) or of (v, r, F_f, F_r): m (v_dot + V r) = F_f + F_r, I r_dot = a F_f - b F_r."""
        alpha = np.array([[1.0, self.a], [1.0, -self.b]]) / V  # of (v, r)
        force = np.array([[1 / self.m, 1 / self.m], [self.a / self.I_z, -self.b / self.I_z]])
        turning = np.array([[0.0, -V], [0.0, 0.0]])
        stiffness = -np.diag([self.C_f, self.C_r])
        if self.sigma == 0:
            return turning + force @ stiffness @ alpha
        rate = V / self.sigma
        return np.block([[turning, force], [rate * stiffness @ alpha, -rate * np.eye(2)]])

    def critical_speed(self):
        """V² = C_f C_r L² / (m (a C_f - b C_r)), of an oversteering car."""
        L = self.a + self.b
        return np.sqrt(self.C_f * self.C_r * L**2 / (self.m * (self.a * self.C_f - self.b * self.C_r)))

    def yaw_rate_gain(self, V):
        """r/delta = V / (L + K V²), K = m (b C_r - a C_f)/(L C_f C_r)."""
        L = self.a + self.b
        return V / (L + V**2 * self.m * (self.b * self.C_r - self.a * self.C_f) / (L * self.C_f * self.C_r))

    def system(self, V, *, steer=0.0, v=0.0, r=0.0):
        """Return it in space: stiff springs, light wheels that roll freely, all four tyres on flat ground."""
        chassis = ff.RigidBody(
            "chassis", self.m - 0.4, np.diag([400.0, 1500.0, self.I_z]), velocity=(V, v, 0), omega_B=(0, 0, r)
        )
        bodies, joints, tyres = [chassis], [], []
        d = R - LOADED
        for name, x, C, delta in (("f", self.a, self.C_f, steer), ("r", -self.b, self.C_r, 0.0)):
            A = np.array([[np.cos(delta), -np.sin(delta), 0], [np.sin(delta), np.cos(delta), 0], [0, 0, 1.0]])
            for side in (1, -1):
                place, wheel = np.array([x, side * HALF_TRACK, LOADED]), f"{name}{'l' if side > 0 else 'r'}"
                velocity = np.array([V - r * place[1], v + r * x, 0.0])
                spin = (A.T @ velocity)[0] / (R - d / 3)
                bodies.append(
                    ff.RigidBody(
                        wheel, 0.1, 1e-4 * np.eye(3), position=place, velocity=velocity, omega_B=(0, spin, r),
                        orientation=(np.cos(delta / 2), 0, 0, np.sin(delta / 2)),
                    )
                )  # fmt: skip
                hub = ff.Marker("chassis", position=place, triad=A)
                joints.append(ff.RevoluteJoint(f"hub_{wheel}", hub, ff.Marker(wheel), axis=(0, 1, 0)))
                share = (self.b if name == "f" else self.a) / (self.a + self.b) / 2
                load = self.m * G * share
                tyres.append(
                    wheels.LinearTyre(
                        f"tyre_{wheel}", ff.Marker(ff.GROUND), ff.Marker(wheel), radius=R, stiffness=load / d,
                        slip_stiffness=5e4, cornering_stiffness=C / 2, relaxation_y=self.sigma, damping=0.05 * load / d,
                    )
                )  # fmt: skip
        return ff.System(bodies, joints, [ff.Gravity((0, 0, -G))], elements=tyres)
