"""System files of the vehicle, with the shipped parameters or with others."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.rails import Pair, Track, Wheelset
from floatframe.machines.bogie.frame import frame_files
from floatframe.machines.bogie.vehicle import NAMES, RailVehicle, vehicle_parts
from floatframe.model.bodies.markers import Marker
from floatframe.model.forces import Bushing

__all__ = ["bogie_files"]

IRREGULAR = 'irregularities = {spectrum = "erri-low", length = 420, seed = 1, start = 20}'
CURVE = "curve = {radius = 300, length = 150, transition = 60, cant = 0.1, before = 30}"
#: title, speed [m/s], duration [s] and track of each run
RUNS = {
    "straight": ("a straight track with irregular rails", 55.0, 8.0, IRREGULAR),
    "curve": ("a curve of 300 m", 15.0, 20.0, CURVE),
}


def numbers(values: Array | tuple[float, ...]) -> str:
    """Return numbers as a list of a file."""
    return "[" + ", ".join(f"{float(value):.10g}" for value in np.asarray(values)) + "]"


def bogie_files(data: RailVehicle | None = None) -> dict[str, str]:
    """Return the files of the machine, by name: the frame, and the vehicle with flexible frames on two tracks."""
    data = data or RailVehicle()
    files = dict(frame_files(data))
    for name, (words, speed, seconds, track) in RUNS.items():
        files[f"{name}.toml"] = vehicle_file(data, words, speed, seconds, track)
    return files


def vehicle_file(data: RailVehicle, words: str, speed: float, seconds: float, track: str) -> str:
    """Return the system file of the vehicle with flexible frames on a track."""
    parts = vehicle_parts(data, speed, Pair(), Track(), None, False, True)
    text = [
        f"# A passenger vehicle with flexible bogie frames on {words}\n"
        '[system]\nunits = "m-kg-s"\ngravity = [0, 0, -9.81]\n'
    ]
    for k, name in enumerate(NAMES):
        x = (1 - 2 * k) * data.pivot
        text.append(
            f'[bodies.frame_{name}]\nfile = "frame.h5"\nposition = [{x:g}, 0, 0]\nvelocity = [{speed:g}, 0, 0]\n'
        )
    for body in parts.bodies:
        rows = ", ".join(numbers(row) for row in body.inertia)
        text.append(
            f"[bodies.{body.name}]\nmass = {body.mass:g}\ninertia = [{rows}]\nposition = {numbers(body.position)}\n"
            f"velocity = [{speed:g}, 0, 0]\n"
        )
        if body.name == "body":
            text.append(
                '[[bodies.body.shapes]]\ntype = "box"\nsize = [24.0, 2.8, 2.6]\nposition = [0, 0, 0.6]\n'
                'color = "#3b6ea5"\nopacity = 0.6\n'
            )
    for force in parts.forces:
        if isinstance(force, Bushing):
            ends = []
            for key, marker in (("a", force.marker_a), ("b", force.marker_b)):
                assert isinstance(marker, Marker)
                point = np.zeros(3) if marker.position is None else marker.position
                place = f'"{marker.interface}"' if marker.interface else numbers(point)
                ends.append(f'body_{key} = "{marker.body}"\nmarker_{key} = {place}')
            text.append(
                f'[forces.{force.name}]\ntype = "bushing"\n'
                + "\n".join(ends)
                + f"\nstiffness = {numbers(np.diag(force.stiffness))}\n"
                f"damping = {numbers(np.diag(force.damping))}\npreload = {numbers(force.preload)}\n"
            )
    for wheels in parts.elements:
        assert isinstance(wheels, Wheelset)
        text.append(
            f'[elements.{wheels.name}]\ntype = "rails.wheelset"\n'
            f'marker = {{body = "{wheels.marker.body}", marker = [0, 0, 0]}}\n'
            f"spin_inertia = {wheels.spin_inertia:g}\nspin = {wheels.spin:.10g}\n"
            f"friction = {wheels.laws.friction:g}\n\n"
            f"[elements.{wheels.name}.track]\n{track}\n"
        )
    text.append('[sensors.leading]\ntype = "element"\nof = "axle_front_leading_wheels"\n')
    text.append(f"[run]\nt_end = {seconds:g}\nh = 2e-3\noutput_every = 5\n")
    return "\n".join(text)
