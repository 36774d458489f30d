"""The road car: stiffness of its four motions, wheel travel, steady turns, sine steer, lane change, a twisting road.

python -m benchmarks.road_car [body posts wheels circle sine lanes twist]
"""

import logging
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tomlkit

import cms
import floatframe as ff
from floatframe.components.wheels import read_tyre_file, shipped_tyre
from floatframe.machines import copy_machine
from floatframe.machines.road_car import CarOnPosts, Linkage, RoadCar
from floatframe.machines.road_car.closed_forms import MODES, roll_control_stiffness
from floatframe.machines.road_car.description import CORNERS
from floatframe.machines.road_car.figures import CarMotion, body_twist_stiffness, car_mass, driven, steady_turn
from tests.floatframe.components.wheels.magic_formula_oracle import version_61

CAR = RoadCar()
SUPPORTS = ("hydraulic", "bars", "none")
TYRE = read_tyre_file(shipped_tyre("passenger_car_61"))
DEGREES = 180 / np.pi


def tyre(load: float, alpha: float, gamma: float, is_left: bool) -> tuple[float, float, float, float]:
    """Return F_y, M_x, M_y, M_z of a tyre; the right one is the mirror of the left one."""
    side = 1.0 if is_left else -1.0
    found, _ = version_61(TYRE.coefficients, 220e3, 220e3, load, 0.0, side * alpha, side * gamma, 18, 16.7, 0.32, 4e3)
    return side * found[1], side * found[2], -found[3], side * found[4]


def read(folder: Path, name: str, support: str, changes: dict[str, Any], *overlays: str) -> tuple[ff.System, Any]:
    """Return a system file of the car with one of SUPPORTS; "none" has bars without stiffness."""
    bases = [name, *(["bars.toml"] if support != "hydraulic" else []), *overlays]
    if support != "hydraulic" and name != "rig.toml":
        bases.append("no_pressures.toml")
    (folder / "no_pressures.toml").write_text('sensors."pressure {side}" = {}')
    (folder / "car_as_asked.toml").write_text(tomlkit.dumps({"extends": bases}))
    bars = {"bars": {"front": 0.0, "rear": 0.0}} if support == "none" else {}
    return ff.read_system(folder / "car_as_asked.toml", changes | bars)


def run(folder: Path, name: str, support: str, changes: dict[str, Any]) -> tuple[ff.System, CarMotion, float]:
    """Return a system, what its motion shows, and the processor time of a second."""
    system, options = read(folder, name, support, changes)
    assert options is not None
    begin = time.process_time()
    motion = ff.integrate(system, options.integrator, options.t_end, options.h, output_every=options.output_every)
    return system, driven(system, motion), (time.process_time() - begin) / options.t_end


def body(folder: Path) -> None:
    """Mass, modes and torsion of the body."""
    reduced = cms.reduce_job(folder / "body.toml")
    hertz = ", ".join(f"{f:.1f}" for f in reduced.free_frequencies[:4])
    torsion = body_twist_stiffness(reduced) / DEGREES / 1e3
    print(f"body: {reduced.moments.gram[0, 0]:.1f} kg, {reduced.n_q} modes, free {hertz} Hz, {torsion:.1f} kN m/degree")


def posts(folder: Path) -> None:
    """Forces of the posts at rest against the closed form, and the stiffness of the four motions."""
    small, track = 2e-3, 2 * CAR.front.centre[1]
    stiffness = {}
    for car, words in ((replace(CAR, mount_stiffness=None), "subframes fixed"), (CAR, "subframes on mounts")):
        worst = 0.0
        for support in SUPPORTS:
            for mode, way in MODES.items():
                forces = []
                for height in (small, -small, 0.03):
                    values: dict[str, Any] = {
                        f"couplers.post_{c}.constant": {"type": "constant", "value": float(height * w)}
                        for c, w in zip(CORNERS, way, strict=True)
                    }
                    overlays = ["fixed_subframes.toml"] if car.mount_stiffness is None else []
                    system, _ = read(folder, "rig.toml", support, values, *overlays)
                    rest = ff.analyses.snapshot(system, ff.static_equilibrium(system))
                    forces.append(
                        np.array([ff.results.coupler_motion(system, rest, f"post_{c}").force[0, 0] for c in CORNERS])
                    )
                    expected = CarOnPosts(car, support).forces(height * way)
                    worst = max(worst, float(np.abs(forces[-1] - expected).max() / np.abs(expected).max()))
                stiffness[support, mode] = float((forces[0] - forces[1]) @ way / 4 / (2 * small))
        print(f"{words}: forces of the posts against the closed form {worst:.1e}")
        for support in SUPPORTS:
            rates = ", ".join(f"{mode} {stiffness[support, mode] / 1e3:.2f}" for mode in MODES)
            print(
                f"{support}: {rates} kN/m at a wheel; roll {stiffness[support, 'roll'] * track**2 / 1e3:.2f} kN m/rad"
            )
        added = (stiffness["hydraulic", "roll"] - stiffness["none", "roll"]) * track**2
        print(f"hydraulics add {added / 1e3:.2f} kN m/rad, closed form {roll_control_stiffness(CAR) / 1e3:.2f}")


def wheels(folder: Path) -> None:
    """Steer, inclination and track over the travel of the left wheels."""
    for name in ("front", "rear"):
        linkage = Linkage(CAR.axle(name), 1)
        for z in (-0.08, -0.04, 0.04, 0.08):
            place = linkage.lifted(z)
            print(
                f"{name} {1e3 * z:+.0f} mm: steer {place.steer * DEGREES:+.3f}, inclination "
                f"{place.inclination * DEGREES:+.3f} degrees, y {1e3 * (place.centre[1] - 0.75):+.2f} mm"
            )


def circle(folder: Path) -> None:
    """Steady turns over the rack against four wheels, and the understeer gradient."""
    for support in ("hydraulic", "bars"):
        rows = []
        for rack in (0.001, 0.002, 0.003, 0.004, 0.005, 0.006):
            system, turn, _ = run(folder, "circle.toml", support, {"rack": rack})
            speed = float(turn.speed[-1])
            expected = steady_turn(CAR, car_mass(CAR, system), tyre, speed, rack, support)
            steer = np.mean([Linkage(CAR.front, side, -rack).lifted(0.0).steer for side in (1, -1)])
            both = [(float(turn.yaw_rate[-1]), float(turn.roll[-1]), turn.loads[-1])]
            both.append((expected.yaw_rate, expected.roll, expected.loads))
            rows.append([(speed * r, float(steer) - CAR.wheelbase * r / speed) for r, _, _ in both])
            for words, (rate, roll, loads) in zip(("run", "own equations"), both, strict=True):
                transfer = (loads[[1, 3]] - loads[[0, 2]]) / 2
                print(
                    f"{support} rack {1e3 * rack:.0f} mm {words}: V {speed:.3f} m/s, a_y {speed * rate:.4f} m/s², "
                    f"gain {rate / steer:.3f} 1/s, roll {roll * DEGREES:.3f} degrees, "
                    f"transfer {transfer[0]:.1f}, {transfer[1]:.1f} N, "
                    f"share in front {transfer[0] / transfer.sum():.4f}",
                    flush=True,
                )
        for k, words in enumerate(("run", "own equations")):
            a, angle = np.array([row[k] for row in rows]).T
            slopes = np.polyfit(a[:3], angle[:3], 1)[0] * DEGREES, np.gradient(angle, a)[-1] * DEGREES
            print(f"{support} {words}: understeer gradient {slopes[0]:.4f}, at the end {slopes[1]:.4f} degrees/(m/s²)")


def peaks(words: str, seen: CarMotion, cost: float) -> None:
    """Print the largest values of a motion."""
    told = [
        f"a_y {np.abs(seen.lateral_acceleration).max():.3f} m/s²",
        f"yaw rate {np.abs(seen.yaw_rate).max():.4f} rad/s",
        f"roll {np.abs(seen.roll).max() * DEGREES:.3f}",
        f"side-slip {np.abs(seen.side_slip).max() * DEGREES:.3f} degrees",
        f"loads {seen.loads.min():.0f} to {seen.loads.max():.0f} N",
    ]
    if seen.pressures.size:
        told.append(f"pressures {seen.pressures.min() / 1e5:.2f} to {seen.pressures.max() / 1e5:.2f} bar")
    if seen.error.size:
        told.append(f"error {np.abs(seen.error).max():.4f}, rms {np.sqrt((seen.error**2).mean()):.4f} m")
    print(f"{words}: {', '.join(told)}; {cost:.2f} s a second", flush=True)


def manoeuvre(folder: Path, name: str, file: str) -> None:
    """Print a manoeuvre with flexible and rigid body, hydraulics, bars and neither."""
    for support, is_rigid in (
        ("hydraulic", False),
        ("hydraulic", True),
        ("bars", False),
        ("bars", True),
        ("none", True),
    ):
        _, seen, cost = run(folder, file, support, {"is_rigid": is_rigid})
        peaks(f"{name} {support} {'rigid' if is_rigid else 'flexible'}", seen, cost)


def twisted_road(wave: float, height: float = 0.03) -> list[float]:
    """Return the left side of a road with sine waves of a length [m], opposite on the right, as in twist.toml.

    A wave as long as twice the wheelbase twists the car, one as long as the wheelbase rolls it.
    """
    x = np.arange(-4.0, 40.0, 0.2) - 3.0
    rise = np.clip(x / wave, 0.0, 1.0)
    return [float(z) for z in height * rise**2 * (3 - 2 * rise) * np.sin(2 * np.pi * x / wave)]


def twist(folder: Path) -> None:
    """Wheel loads and the twist of the body on a road that twists and on one that rolls the car."""
    for words, length in (("warp", 2 * CAR.wheelbase), ("roll", CAR.wheelbase)):
        for support, is_rigid in (
            ("hydraulic", False),
            ("bars", False),
            ("none", False),
            ("hydraulic", True),
            ("bars", True),
        ):
            changes = {"heights": twisted_road(length), "is_rigid": is_rigid}
            _, seen, _ = run(folder, "twist.toml", support, changes)
            late = seen.t > 3.0
            told = [
                f"loads vary by {np.ptp(seen.loads[late], axis=0).mean() / 2:.0f} N each way",
                f"roll by {np.ptp(seen.roll[late]) / 2 * DEGREES:.3f} degrees",
            ]
            if seen.pressures.size:
                told.append(f"pressures by {np.ptp(seen.pressures[late]) / 2e5:.2f} bar")
            print(f"{words} {support} {'rigid' if is_rigid else 'flexible'}: {', '.join(told)}", flush=True)


def main(wanted: list[str]) -> None:
    """Print what is asked for."""
    logging.disable(logging.WARNING)
    parts: dict[str, Callable[[Path], None]] = {
        "body": body,
        "posts": posts,
        "wheels": wheels,
        "circle": circle,
        "sine": lambda folder: manoeuvre(folder, "sine", "sine_steer.toml"),
        "lanes": lambda folder: manoeuvre(folder, "lanes", "lane_change.toml"),
        "twist": twist,
    }
    with TemporaryDirectory() as name:
        folder = Path(name)
        copy_machine("road-car", folder)
        cms.write(cms.reduce_job(folder / "body.toml"), folder / "body.h5")
        for part in wanted or parts:
            parts[part](folder)


if __name__ == "__main__":
    main(sys.argv[1:])
