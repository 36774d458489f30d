"""Files of the bogie with induction motors: the frame with brackets, and starts on several supplies."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.rails import ContactLaws, Pair, Track, Wheelset, height_on_rails
from floatframe.machines.bogie.frame import frame_files
from floatframe.machines.bogie.vehicle import GRAVITY, PITCH, SIDES
from floatframe.machines.motor_bogie.closed_forms import steady_fluxes
from floatframe.machines.motor_bogie.description import ENDS, MOUNTS, MotorBogie
from floatframe.model.bodies.markers import Marker

__all__ = ["SUPPLIES", "motor_bogie_file", "motor_bogie_files"]

LAWS = ContactLaws(creep="kalker-saturated", friction=0.4)
#: title and harmonics of each shipped start; None: those of the description
SUPPLIES = {
    "six_steps": ("an inverter in six steps", None),
    "sine": ("a supply of pure sines", ()),
    "unbalanced": ("an unbalanced supply: 3 % of its voltage has negative sequence", ((-1, 0.03),)),
}


def numbers(*values: float) -> str:
    """Return numbers as a list of a file."""
    return "[" + ", ".join(f"{float(value):.10g}" for value in values) + "]"


def motor_bogie_files(data: MotorBogie | None = None) -> dict[str, str]:
    """Return the files of the machine, by name, without README.md."""
    data = data or MotorBogie()
    files = dict(frame_files(data.vehicle, supports=data.supports()))
    plain = "geometric_stiffness = false  # its loads are far from buckling it"
    files["frame.toml"] = files["frame.toml"].replace("n_modes = 6\n", f"n_modes = 6\n{plain}\n")
    for name, (words, harmonics) in SUPPLIES.items():
        given = data if harmonics is None else replace(data, harmonics=harmonics)
        files[f"{name}.toml"] = motor_bogie_file(given, words)
    return files


def motor_bogie_file(data: MotorBogie, words: str) -> str:
    """Return the system file of the bogie that starts on a supply."""
    height = height_on_rails(Wheelset("wheels", Marker("axle"), Pair(), Track(), LAWS), wheel_load(data))
    text = [
        f"# A bogie with a flexible frame and two induction motors starts on {words}\n"
        f'[system]\nunits = "m-kg-s"\ngravity = [0, 0, {-GRAVITY:g}]\n',
        '[bodies.frame]\nfile = "frame.h5"\n' + moving(data.speed),
        vehicle_above(data),
        *(axle_and_motor(data, word, height) for word in ENDS),
        sensors(),
        f"[run]\nt_end = {data.t_end:g}\nh = {data.h:g}\noutput_every = 2\nrho_inf = 0.8\n",
    ]
    return "\n".join(text)


def wheel_load(data: MotorBogie) -> float:
    """Return the vertical load of a wheel [N]."""
    v = data.vehicle
    return (0.5 * v.body_mass + v.frame_mass + 2 * v.axle_mass) * GRAVITY / 4 + data.motor_weight / 2


def moving(speed: float, spin: float = 0.0) -> str:
    """Return the velocities of a body that moves forward and rotates about its transverse axis."""
    spinning = f"omega_B = {numbers(0, spin, 0)}\n" if spin else ""
    return (f"velocity = {numbers(speed, 0, 0)}\n" if speed else "") + spinning


def rigid(
    name: str,
    mass: float,
    inertia: tuple[float, ...] | Array,
    at: tuple[float, float, float],
    speed: float,
    spin: float = 0.0,
) -> str:
    """Return the table of a rigid body."""
    rows = ", ".join(numbers(*row) for row in np.diag(inertia))
    return f"[bodies.{name}]\nmass = {mass:g}\ninertia = [{rows}]\nposition = {numbers(*at)}\n{moving(speed, spin)}"


def bushing(
    name: str, a: tuple[str, str], b: tuple[str, str], stiffness: str, damping: str, preload: str | None = None
) -> str:
    """Return the table of a bushing between two markers, each given as (body, marker)."""
    given = "" if preload is None else f"preload = {preload}\n"
    return (
        f'[forces.{name}]\ntype = "bushing"\nbody_a = "{a[0]}"\nmarker_a = {a[1]}\nbody_b = "{b[0]}"\n'
        f"marker_b = {b[1]}\nstiffness = {stiffness}\ndamping = {damping}\n{given}"
    )


def vehicle_above(data: MotorBogie) -> str:
    """Return half of the vehicle body on its air springs, with springs that replace the other bogie."""
    v = data.vehicle
    load = 0.5 * v.body_mass * GRAVITY / 2
    I_x, I_y, I_z = (0.5 * each for each in v.body_inertia)
    parts = [
        rigid("body", 0.5 * v.body_mass, (I_x, I_y, I_z), (0, 0, v.body_height), data.speed),
        '[[bodies.body.shapes]]\ntype = "box"\nsize = [9.0, 2.8, 2.6]\nposition = [0, 0, 0.6]\n'
        'color = "#3b6ea5"\nopacity = 0.25\n',
        bushing(
            "other_bogie", ("ground", numbers(0, 0, v.body_height)), ("body", "[0, 0, 0]"),
            numbers(0, 0, 0, 0, data.pitch[0], data.pitch[0]), numbers(0, 0, 0, 0, data.pitch[1], data.pitch[1]),
        ),
        bushing(
            "rod", ("body", numbers(0, 0, v.frame_height - v.body_height)), ("frame", '"pivot"'),
            numbers(v.rod, 0, 0, 0, 0, 0), numbers(v.rod_damping, 0, 0, 0, 0, 0),
        ),
    ]  # fmt: skip
    for side, hand in SIDES:
        above = numbers(0, side * v.secondary_arm, v.secondary_height - v.body_height)
        parts.append(
            bushing(
                f"air_{hand}",
                ("body", above),
                ("frame", f'"air_{hand}"'),
                numbers(*v.secondary, v.roll_bar / 2, 0, 0),
                numbers(*v.secondary_damping, 0, 0, 0),
                numbers(0, 0, load, 0, 0, 0),
            )
        )
    return "\n".join(parts)


def axle_and_motor(data: MotorBogie, word: str, height: float) -> str:
    """Return an axle in its boxes, its motor, gear and hollow shaft, and the joints and forces between them."""
    v, end = data.vehicle, ENDS[word]
    x, rotor_x = end * v.wheelbase, end * (v.wheelbase - data.centres)
    axle, boxes, motor, rotor, quill = (f"{word}_{part}" for part in ("axle", "boxes", "motor", "rotor", "quill"))
    u = data.speed
    spin = u / data.rolling_radius
    turning = np.array(v.axle_inertia) - np.array([data.boxes_inertia[0], 0.0, data.boxes_inertia[2]])
    parts = [
        rigid(axle, v.axle_mass - data.boxes_mass, turning, (x, 0, height), u, spin),
        rigid(boxes, data.boxes_mass, data.boxes_inertia, (x, 0, height), u),
        *(
            f'[[bodies.{boxes}.shapes]]\ntype = "box"\nsize = [0.3, 0.2, 0.3]\nposition = {numbers(0, y, 0)}\n'
            'color = "dark"\n'
            for y in (-v.primary_arm, v.primary_arm)
        ),
        rigid(motor, data.housing_mass, data.housing_inertia, (rotor_x, 0, height), u),
        f'[[bodies.{motor}.shapes]]\ntype = "cylinder"\nradius = 0.29\nlength = 0.8\naxis = [0, 1, 0]\n'
        'color = "steel"\nopacity = 0.5\n',
        rigid(rotor, data.rotor_mass, data.rotor_inertia, (rotor_x, 0, height), u, -data.ratio * spin),
        f'[[bodies.{rotor}.shapes]]\ntype = "cylinder"\nradius = 0.2\nlength = 0.6\naxis = [0, 1, 0]\n'
        'color = "red"\n',
        rigid(quill, data.quill_mass, data.quill_inertia, (x, 0, height), u, spin),
        f'[[bodies.{quill}.shapes]]\ntype = "cylinder"\nradius = {data.centres * data.ratio / (1 + data.ratio):g}\n'
        "length = 0.1\naxis = [0, 1, 0]\nposition = [0, 0.45, 0]\n",
        hinge(f"{word}_bearing", boxes, (0, 0, 0), axle),
        hinge(f"{word}_spindle", motor, (0, 0, 0), rotor),
        hinge(f"{word}_hollow", motor, (x - rotor_x, 0, 0), quill),
        f"[couplers.{word}_gear]\nconstant = 0.0\nterms = [\n"
        f'    {{ joint = "{word}_spindle", coordinate = "angle", factor = 1.0 }},\n'
        f'    {{ joint = "{word}_hollow", coordinate = "angle", factor = {data.ratio:g} }},\n]\n',
        primary_springs(data, word),
        bushing(
            f"{word}_coupling", (quill, "[0, 0, 0]"), (axle, "[0, 0, 0]"),
            numbers(data.coupling[2], 0.5 * data.coupling[2], data.coupling[2], 1e4, data.coupling[0], 1e4),
            numbers(2e3, 1e3, 2e3, 10, data.coupling[1], 10),
        ),
        *mounts(data, word, rotor_x, height),
        electric(data, word),
        f'[elements.{word}_wheels]\ntype = "rails.wheelset"\nmarker = {{body = "{axle}", marker = [0, 0, 0]}}\n'
        f'creep = "{LAWS.creep}"\nfriction = {LAWS.friction:g}\n',
    ]  # fmt: skip
    return "\n".join(parts)


def hinge(name: str, body: str, at: tuple[float, float, float], turning: str) -> str:
    """Return a revolute joint about the transverse axis, at the origin of the rotating body."""
    return (
        f'[joints.{name}]\ntype = "revolute"\nbody_a = "{body}"\nmarker_a = {numbers(*at)}\nbody_b = "{turning}"\n'
        "marker_b = [0, 0, 0]\naxis = [0, 1, 0]\n"
    )


def primary_springs(data: MotorBogie, word: str) -> str:
    """Return the springs between the frame and the boxes of an axle."""
    v = data.vehicle
    load = (0.5 * v.body_mass + v.frame_mass) * GRAVITY / 4 + data.motor_weight / 2
    return "\n".join(
        bushing(
            f"{word}_box_{hand}",
            ("frame", f'"{word}_{hand}"'),
            (f"{word}_boxes", numbers(0, side * v.primary_arm, 0)),
            numbers(*v.primary, 0, PITCH[0], 0),
            numbers(0, 0, v.primary_damping, 0, PITCH[1], 0),
            numbers(0, 0, load, 0, 0, 0),
        )
        for side, hand in SIDES
    )


def mounts(data: MotorBogie, word: str, rotor_x: float, height: float) -> list[str]:
    """Return the three mounts of a motor, preloaded by its weight.

    Each carries a third of the weight W. The centre of mass is at a distance d in front of them, so the upper mounts
    are pulled and the lower one is pressed by W d divided by their difference in height.
    """
    end, (upper, lower) = ENDS[word], data.mount_heights
    W = data.motor_weight
    pull = end * W * (data.centre - data.mount_reach) / (upper - lower)
    found = []
    for name, y, z, along in (
        ("left", data.mount_arm, upper, pull / 2),
        ("right", -data.mount_arm, upper, pull / 2),
        ("lower", 0.0, lower, -pull),
    ):
        at = numbers(end * data.mount_reach - rotor_x, y, z - height)
        found.append(
            bushing(
                f"{word}_mount_{name}",
                ("frame", f'"{word}_motor_{name}"'),
                (f"{word}_motor", at),
                numbers(*data.mount, 0, 0, 0),
                numbers(*data.mount_damping, 0, 0, 0),
                numbers(along, 0, -W / 3, 0, 0, 0),
            )
        )
    return found


def electric(data: MotorBogie, word: str) -> str:
    """Return a motor; its rotor rotates opposite to the axle, so its axis points to the right."""
    m, (begin, soft) = data.motor, data.start
    text = [f'[elements.{word}_drive]\ntype = "drives.induction-motor"\n']
    text[0] += f'marker_a = {{body = "{word}_motor", marker = [0, 0, 0]}}\n'
    text[0] += f'marker_b = {{body = "{word}_rotor", marker = [0, 0, 0]}}\naxis = [0, -1, 0]\n'
    for key, value in vars(m).items():
        text[0] += f"{key} = {value:g}\n"
    text[0] += "harmonics = [" + ", ".join(f"[{order:g}, {part:.12g}]" for order, part in data.harmonics) + "]\n"
    if data.speed:
        f = data.running_frequency
        fluxes = steady_fluxes(m, f, 2 * np.pi * f / m.pole_pairs)
        text[0] += f"fluxes = {numbers(*fluxes)}\nfrequency = {f:.10g}\n"
        return text[0]
    text.append(
        f'[elements.{word}_drive.frequency]\ntype = "piecewise"\nt = {numbers(0, begin, begin + soft)}\npieces = [\n'
        '    { type = "constant", value = 0.0 },\n'
        f'    {{ type = "polynomial", coefficients = {numbers(0, 0, 0.5 * data.rise / soft)} }},\n'
        f'    {{ type = "polynomial", coefficients = {numbers(0.5 * data.rise * soft, data.rise)} }},\n]\n'
    )
    return "\n".join(text)


def sensors() -> str:
    """Return the sensors: motors, forces of their mounts, and torques of the couplings."""
    found = []
    for word in ENDS:
        found.append(f'[sensors.{word}_drive]\ntype = "element"\nof = "{word}_drive"\n')
        found += [
            f'[sensors.{word}_{name}]\ntype = "reaction"\nof = "{word}_mount_{name}"\naxes = "marker"\n'
            for name in MOUNTS
        ]
        found.append(f'[sensors.{word}_twist]\ntype = "bushing"\nof = "{word}_coupling"\n')
    return "\n".join(found)
