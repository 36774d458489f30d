"""Processor time that a sensor takes for one row of results: `python benchmarks/sensor_rows.py [rows]`.

A flexible body with 24 modes on a pin carries a turning wheel; each sensor is measured alone over all rows, the
smallest of five times.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import floatframe as ff
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness


def system() -> ff.System:
    rod = reduced_body(random_point_masses(24, 11), stiffness(24, omega=200.0), name="rod")
    pin, tip, wheel = ff.Marker("rod", "end_b"), ff.Marker("rod", "end_a"), ff.Marker("wheel")
    place = rod.interface("end_a").position
    bodies = [
        ff.FlexibleBody("rod", rod),
        ff.RigidBody("wheel", 0.2, 0.01 * np.eye(3), position=place, omega_B=(0, 0, 30.0)),
    ]
    joints = [ff.SphericalJoint("pin", ff.GROUND, pin), ff.RevoluteJoint("axle", tip, wheel, axis=(0, 0, 1))]
    quantities = ("position", "velocity", "acceleration", "rotation-vector", "angular-velocity")
    sensors = [
        *(ff.sensors.PlaceSensor(quantity, tip, quantity) for quantity in quantities),
        ff.sensors.PlaceSensor("acceleration seen from the tip", wheel, "acceleration", relative_to=tip),
        ff.sensors.AngleSensor("angle", tip, wheel),
        ff.joints.JointCoordinate("axle", "angle", "coordinate"),
        ff.sensors.ReactionSensor("reaction", "axle"),
        ff.sensors.ReactionSensor("reaction in the axes of the tip", "axle", axes="marker"),
        ff.sensors.DisplacementSensor("displacement", tip),
        ff.sensors.EnergySensor("energy"),
        ff.sensors.ModeSensor("mode", "rod", 1),
    ]
    return ff.System(bodies, joints, [ff.Gravity((0, 0, -9.81))], sensors=sensors)


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 4000
    made = system()
    motion = ff.integrate(made, ff.GeneralizedAlpha(), n * 1e-4, 1e-4)
    for sensor in made.sensors:
        times = []
        for _ in range(5):
            began = time.process_time()
            ff.sensors.measured(made, motion, [sensor])  # type: ignore[list-item]
            times.append(time.process_time() - began)
        print(f"{sensor.name:34s} {1e6 * min(times) / len(motion.t):8.2f} us a row")


if __name__ == "__main__":
    main()
