"""Wheel forces of the car from volumes, gas and linkage lengths, as an independent check.

(1) The oil content of a line is constant, (V_chambers + V_0 - V_gas(p))/v(p), with v(p) = exp(-(p - p_a)/K). (2) The
    gas follows p V^n = const. (3) Wheel forces follow from virtual work: F_i = sum over springs, cylinders and bars of
    force times the derivative of length, or angle, by the height of the wheel.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fe_models.foundation.arrays import Array
from floatframe.machines.road_car.description import CORNERS, RoadCar, RollControl
from floatframe.machines.road_car.linkage import Linkage, spring_preload

__all__ = ["MODES", "CarOnPosts", "line_pressure", "roll_centre", "roll_control_stiffness", "transfer_shares"]

#: heights of the wheels (front left, front right, rear left, rear right) in the four wheel motions
MODES = {
    "heave": np.array([1.0, 1.0, 1.0, 1.0]),
    "pitch": np.array([1.0, 1.0, -1.0, -1.0]),
    "roll": np.array([1.0, -1.0, 1.0, -1.0]),
    "warp": np.array([1.0, -1.0, -1.0, 1.0]),
}
STEP = 1e-5  #: step of finite differences of the linkage [m]


def gas(control: RollControl, p: float) -> float:
    """Return the volume of the gas at a pressure, (2) [m³]."""
    return float(control.gas_volume * (control.charge / p) ** (1 / control.exponent))


def chambers_at_design(control: RollControl) -> float:
    """Return the volume of a line without its gas at design height: two heads, two rod sides, dead volumes [m³]."""
    c = control
    swept = c.head_area * c.at_design + c.rod_area * (c.stroke - c.at_design)
    return 2 * (swept + 2 * c.dead_volume) + c.dead_volume


def line_pressure(control: RollControl, growth: float) -> float:
    """Return the pressure of a line whose chambers have grown by a volume since the design height, by (1) [Pa].

    At design height, the chambers of two heads and two rod sides are at the stroke `at_design`.
    """
    c, chambers = control, chambers_at_design(control)

    def content(p: float, volume: float) -> float:
        oil = volume + c.gas_volume - gas(c, p)
        return float(oil * np.exp((p - c.ambient) / c.bulk_modulus))

    kept = content(c.pressure, chambers)
    low, high = 0.5 * c.charge, 50 * c.pressure
    return float(brentq(lambda p: content(p, chambers + growth) - kept, low, high, xtol=1e-3, rtol=1e-14))


def roll_control_stiffness(car: RoadCar) -> float:
    """Return the change of the roll stiffness by both lines at design height, for small motions [N m/rad].

    A line displaces (A_h + A_r) times the strokes of two cylinders. Its compliance is that of the gas, V_gas/(n p),
    plus that of the oil, V_oil/K: k = 2 (dV/dphi)²/(V_gas/(n p) + V_oil/K), minus the work of the cylinder forces due
    to the curvature of their paths.
    """
    c = car.control
    oil = chambers_at_design(c) + c.gas_volume - gas(c, c.pressure)
    yielding = gas(c, c.pressure) / (c.exponent * c.pressure) + oil / c.bulk_modulus
    swept, curved = 0.0, 0.0
    push = (c.pressure - c.ambient) * (c.head_area - c.rod_area)
    for name in ("front", "rear"):
        corner, y = Linkage(car.axle(name), 1), car.axle(name).centre[1]
        low, mid, high = (corner.lifted(z).cylinder for z in (-1e-4, 0.0, 1e-4))
        swept += -(c.head_area + c.rod_area) * (high - low) / 2e-4 * y
        curved += -2 * push * (high - 2 * mid + low) / 1e-8 * y * y
    return 2 * swept**2 / yielding + curved


@dataclass(frozen=True, eq=False)
class CarOnPosts:
    """The car with its body fixed and its wheels on posts."""

    car: RoadCar
    support: str = "hydraulic"

    def forces(self, heights: Array) -> Array:
        """Return the upward forces of the posts at wheel heights above design height, without weight, (4,) [N]."""
        car, c = self.car, self.car.control
        places, slopes = [], []
        for (name, side), z in zip(CORNERS.values(), heights, strict=True):
            linkage = Linkage(car.axle(name), side)
            low, here, high = (linkage.lifted(z + step) for step in (-STEP, 0.0, STEP))
            places.append((here, linkage.at(0.0)))
            slopes.append(
                [(getattr(high, of) - getattr(low, of)) / (2 * STEP) for of in ("spring", "cylinder", "lower_angle")]
            )
        pressures = self.pressures(heights)
        found = []
        for k, (name, side) in enumerate(CORNERS.values()):
            axle, (here, design) = car.axle(name), places[k]
            tension = axle.spring * (here.spring - design.spring) - spring_preload(car, name, self.support)  # (3)
            force = tension * slopes[k][0]
            if self.support == "hydraulic":
                head, rod = pressures if side > 0 else pressures[::-1]
                push = (head - c.ambient) * c.head_area - (rod - c.ambient) * c.rod_area
                force -= push * slopes[k][1]
            if self.support == "bars":
                other = places[k ^ 1][0]
                force += axle.bar * (here.lower_angle + other.lower_angle) * slopes[k][2]
            found.append(force)
        return np.array(found)

    def pressures(self, heights: Array) -> tuple[float, float]:
        """Return the pressures of the left and the right line at wheel heights [Pa]."""
        c = self.car.control
        left = right = 0.0
        for (name, side), z in zip(CORNERS.values(), heights, strict=True):
            linkage = Linkage(self.car.axle(name), side)
            longer = linkage.lifted(z).cylinder - linkage.at(0.0).cylinder
            head, rod = c.head_area * longer, -c.rod_area * longer
            left, right = (left + head, right + rod) if side > 0 else (left + rod, right + head)
        return line_pressure(c, left), line_pressure(c, right)

    def stiffness(self, mode: str, height: float = 0.0, step: float = 1e-4) -> float:
        """Return the stiffness of a wheel motion, the force of a wheel divided by its height [N/m]."""
        way = MODES[mode]
        high, low = (self.forces((height + s) * way) @ way / 4 for s in (step, -step))
        return float((high - low) / (2 * step))


def roll_centre(car: RoadCar, name: str) -> float:
    """Return the height of the roll centre of an axle at design height: y times the slope of the contact path [m].

    The contact moves laterally by dy if the wheel moves up by dz, so that a lateral force F there has the vertical
    component F dy/dz on the wheel.
    """
    linkage = Linkage(car.axle(name), 1)
    low, high = (linkage.lifted(z) for z in (-1e-4, 1e-4))
    feet = [place.centre[1] + place.centre[2] * place.axle[2] for place in (low, high)]
    return float(car.axle(name).centre[1] * (feet[1] - feet[0]) / 2e-4)


def transfer_shares(
    car: RoadCar, support: str, *, mass: float, x: float, height: float, tyre_stiffness: float
) -> tuple[float, float]:
    """Return the load transfer of the front and rear axle, divided by m a_y h/t [-].

    Classic closed form for small roll: each axle takes its part of the sprung mass at its roll centre, its unsprung
    mass at wheel height, and a part of the remaining moment in proportion to its roll stiffness, with springs and tyres
    in series.
    """
    unsprung = 2 * (car.wheel + car.upright + 0.5 * (car.lower_arm + car.upper_arm))
    axles = {name: car.axle(name) for name in ("front", "rear")}
    wheel_height, track = car.front.centre[2], 2 * car.front.centre[1]
    sprung = mass - 2 * unsprung
    sprung_x = (mass * x - unsprung * sum(axle.centre[0] for axle in axles.values())) / sprung
    sprung_height = (mass * height - 2 * unsprung * wheel_height) / sprung
    part = {
        "front": (sprung_x - car.rear.centre[0]) / car.wheelbase,
        "rear": (car.front.centre[0] - sprung_x) / car.wheelbase,
    }
    centre = {name: roll_centre(car, name) for name in axles}
    step, way = 1e-4, MODES["roll"]
    rate = (
        (CarOnPosts(car, support).forces(step * way) - CarOnPosts(car, support).forces(-step * way)) * way / (2 * step)
    )
    stiffness = {}
    for name, k in (("front", rate[:2].mean()), ("rear", rate[2:].mean())):
        stiffness[name] = 0.5 * track**2 / (1 / k + 1 / tyre_stiffness)
    lever = sprung_height - sum(part[name] * centre[name] for name in axles)
    # the roll moves the weight outwards
    rolling = sum(stiffness.values()) / (sum(stiffness.values()) - sprung * 9.81 * lever)
    found = [
        sprung * (part[name] * centre[name] + rolling * lever * stiffness[name] / sum(stiffness.values()))
        + unsprung * wheel_height
        for name in axles
    ]
    return found[0] / (mass * height), found[1] / (mass * height)
