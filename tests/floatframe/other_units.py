"""Systems in other units, and moved: the same description with other numbers, and what comes out of it turned back.

The unit of every number of every part stands in `FIELDS`, once; a number without one is an error, so that a new field
cannot be left out. Electrical numbers are such that volt times ampere is the unit of power; currents stay.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace

import numpy as np

from cms.body.modal_file.file import convert_units
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.units import Dimensions, Units, unit_system
from floatframe import FlexibleBody, Gravity, JointForce, Marker, PointForce, RigidBody, SpringDamper, System
from floatframe.components.aerodynamics import LiftingSurface
from floatframe.components.bearings import Bearing
from floatframe.components.cables import Cable
from floatframe.components.clearances import Backlash, BallWithPlay, HingeWithPlay
from floatframe.components.drives import AntiSkidBrake, DcMotor, InductionMotor, PidDrive, SpeedControl, TorqueMap
from floatframe.components.friction import BristleFriction
from floatframe.components.hydraulics import (
    Accumulator,
    CheckValve,
    Cylinder,
    DirectionalValve,
    FlowSource,
    Fluid,
    Node,
    OleoStrut,
    Orifice,
    Pipe,
    Pump,
    Resistance,
    Supply,
)
from floatframe.components.wheels import BrushTyre, LinearTyre, MagicFormulaTyre
from floatframe.components.wheels.roads.road import Grip
from floatframe.components.wheels.tyre_file import TyreProperties
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.forces import BodyLoad, Bushing, SphereContact
from floatframe.joints import AxialDistance, CoordinateCoupler, JointCoordinate, PointDistance, RollingDisc, ScrewJoint
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import body_name
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.rotations import euler_parameter_product, euler_parameters, rotation_matrix
from floatframe.results.sensors import (
    AngleSensor,
    Channel,
    ElongationSensor,
    ModeSensor,
    StrainGauge,
    StressChannel,
    StressSensor,
    VonMisesSensor,
)

__all__ = ["FIELDS", "ODD", "SI", "SIZES", "Other", "dimensions", "in_units", "other_units"]

SI = unit_system("m-kg-s")
#: systems of other size in SI, of the same density under the same gravity: their numbers are those of such units
SIZES = {
    "micrometres": replace(SI, name="of micrometres", length=1e6, mass=1e18, time=1e3),
    "1000 km": replace(SI, name="of 1000 km", length=1e-6, mass=1e-18, time=1e-3),
}
#: no product of powers of its factors is 1, as that of mm/s is in mm and ms: a wrong exponent of any unit shows
ODD = Units("odd", 1.3e-3, 7e2, 1.1e-2, "o", "d", "y", "F", "P")
BASE = {
    "1": (0, 0, 0), "rad": (0, 0, 0), "A": (0, 0, 0), "kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1),
    "Hz": (0, 0, -1), "N": (1, 1, -2), "J": (1, 2, -2), "W": (1, 2, -3), "V": (1, 2, -3), "Pa": (1, -1, -2),
}  # fmt: skip


def dimensions(unit):
    """Return the dimensions of a unit such as "N s/m" or "m^3/s Pa", all after the stroke below it."""
    above, _, below = unit.partition("/")
    total = np.zeros(3)
    for sign, words in ((1, above), (-1, below)):
        for word in words.split():
            name, _, power = word.partition("^")
            total += sign * float(power or 1) * np.array(BASE[name])
    return Dimensions(*total)


def by_way(turn, slide):
    """Return a rule: the first unit where a part acts about its axis, the second where it acts along it."""
    return lambda part: turn if part.motion == "about" else slide


def stop_stiffness(part):
    """Return N/mⁿ, or N m for radⁿ."""
    return "N m" if getattr(part, "motion", "along") == "about" else f"N/m^{part.exponent}"


def along_coordinate(turn, slide):
    """Return a rule for forces in joints: the first unit along an angle, the second along a distance."""
    return lambda part: turn if "angle" in part.coordinate else slide


def per_time(unit, power):
    """Return a unit times a power of the second, as one word each."""
    above, _, below = unit.partition("/")
    return f"{above} s^{power}/{below}" if below else f"{above} s^{power}"


def controller_of(value, output):
    """Return the table of a controller by the unit that it sees and the one it gives."""
    top, _, bottom = value.partition("/")
    inverse = f"{bottom}/{top}" if bottom else f"1/{top}"
    kp = f"{output} {inverse}".replace("  ", " ")
    return {"target": value, "kp": kp, "ki": per_time(kp, -1), "kd": per_time(kp, 1), "filter_time": "s",
            "lower": output, "upper": output, "tracking_time": "s", "integral": output}  # fmt: skip


SEEN = {"angle": "rad", "speed": "rad/s", "current": "A", "distance": "m", "rate": "m/s"}
CONTACT = {"stiffness": stop_stiffness, "exponent": "1", "damping": "s/m", "friction": "1", "friction_speed": "m/s",
           "radius": "m"}  # fmt: skip
TYRE = {"radius": "m", "stiffness": "N/m", "damping": "N s/m", "friction": "1", "relaxation_x": "m",
        "relaxation_y": "m", "rolling_resistance": "1", "flattening": "1", "low_speed": "m/s", "settling_time": "s",
        "landing_depth": "m", "axis": "1"}  # fmt: skip
LEAK, PRESSURE, VOLUME = "m^3/s Pa", "Pa", "m^3"
VALVE = {"area": "m^2", "discharge": "1", "transition": PRESSURE, "leakage": LEAK}
ANGULAR = {"damping": "N m s", "friction": "N m", "friction_speed": "rad/s"}

#: unit of each number, array and function of time of each class, in SI; a pair: of a function, its value and argument;
#: a rule: by the part; a table: of a part of it
FIELDS = {
    # elements
    AntiSkidBrake: {"pressure": PRESSURE, "gain": VOLUME, "build_rate": "Pa/s", "release_rate": "Pa/s", "radius": "m",
                    "slip": "1", "slip_band": "1", "reference_deceleration": "m/s^2", "drop_out": "m/s",
                    "deceleration": "m/s^2", "deceleration_band": "m/s^2", "reference_time": "s", "sensor_time": "s",
                    "time_constant": "s", "friction_speed": "rad/s", "speed": "rad/s", "axis": "1"},
    Backlash: {"lower": by_way("rad", "m"), "upper": by_way("rad", "m"), "stiffness": stop_stiffness, "exponent": "1",
               "damping": by_way("s/rad", "s/m"), "axis": "1"},
    BallWithPlay: CONTACT | {"play": "m"},
    Bearing: {"stiffness": "N/m", "damping": "N s/m", "axial_stiffness": "N/m", "axial_damping": "N s/m",
              "tilt_stiffness": "N m", "tilt_damping": "N m s", "axis": "1", "x_axis": "1", "shaft_axis": "1"},
    BristleFriction: {"coulomb": by_way("N m", "N"), "stiffness": by_way("N m", "N/m"), "static": by_way("N m", "N"),
                      "stribeck_speed": by_way("rad/s", "m/s"), "damping": by_way("N m s", "N s/m"),
                      "viscous": by_way("N m s", "N s/m"), "elastic": "1", "speed": by_way("rad/s", "m/s"),
                      "axis": "1"},
    BrushTyre: TYRE | {"nominal_load": "N", "slip_stiffness": "N", "contact_length": "m"},
    Cable: {"stiffness": "N/m", "damping": "N s/m", "preload": "N", "length": "m"},
    DcMotor: ANGULAR | {"resistance": "V/A", "inductance": "V s/A", "constant": "N m/A", "voltage": "V", "axis": "1",
                        "controller": lambda part: controller_of(SEEN[part.controlled], "V"), "ratio": "1",
                        "current": "A"},
    HingeWithPlay: CONTACT | {"radial_play": "m", "length": "m", "axial_play": "m", "axial_stiffness": stop_stiffness,
                              "turn_stiffness": "N m", "turn_damping": "N m s", "turn_free": "rad", "axis": "1"},
    InductionMotor: {"stator_resistance": "V/A", "rotor_resistance": "V/A", "stator_leakage": "V s/A",
                     "rotor_leakage": "V s/A", "magnetizing": "V s/A", "pole_pairs": "1", "frequency": "Hz",
                     "voltage": "V", "rated_voltage": "V", "rated_frequency": "Hz", "boost": "V", "harmonics": "1",
                     "axis": "1", "ratio": "1", "damping": "N m s", "fluxes": "V s"},
    LiftingSurface: {"area": "m^2", "lift_slope": "1", "density": "kg/m^3", "zero_lift": "rad", "most_lift": "1",
                     "zero_drag": "1", "induced_drag": "1", "factor": "1", "wind": "m/s"},
    LinearTyre: TYRE | {"slip_stiffness": "N", "cornering_stiffness": "N", "camber_stiffness": "N", "trail": "m"},
    MagicFormulaTyre: {"pressure": PRESSURE, "relaxation_x": "m", "relaxation_y": "m", "low_speed": "m/s",
                       "settling_time": "s", "landing_depth": "m", "axis": "1"},
    OleoStrut: {"gas_volume": VOLUME, "charge": PRESSURE, "gas_area": "m^2", "oil_area": "m^2", "area": ("m^2", "m"),
                "stroke": "m", "extended_length": "m", "stop_stiffness": "N/m", "recoil_area": ("m^2", "m"),
                "exponent": "1", "discharge": "1", "oil_volume": VOLUME, "friction": "N", "friction_area": "m^2",
                "friction_speed": "m/s", "stop_damping": "s/m", "axis": "1"},
    PidDrive: {"axis": "1", "time_constant": "s",
               "controller": lambda part: controller_of(
                   SEEN[part.controlled], "N m" if part.controlled in ("angle", "speed") else "N")},
    SpeedControl: {"target": "rad/s", "gain": "N m s", "rate_time": "s", "filter_time": "s", "axis": "1",
                   "limit": "N m", "speed": "rad/s"},
    TorqueMap: {"speeds": "rad/s", "throttles": "1", "torques": "N m", "throttle": "1", "time_constant": "s",
                "controller": controller_of("rad/s", "1"), "ratio": "1", "axis": "1", "efficiency_torques": "N m",
                "efficiencies": "1"},
    # their parts
    Accumulator: {"gas_volume": VOLUME, "charge": PRESSURE, "exponent": "1", "oil_limit": VOLUME},
    CheckValve: VALVE | {"full": PRESSURE, "cracking": PRESSURE},
    Cylinder: {"head_area": "m^2", "rod_area": "m^2", "stroke": "m", "retracted_length": "m",
               "head_dead_volume": VOLUME, "rod_dead_volume": VOLUME, "leakage": LEAK, "friction": "N",
               "friction_speed": "m/s", "damping": "N s/m", "stop_stiffness": "N/m", "stop_damping": "s/m"},
    DirectionalValve: VALVE | {"opening": lambda part: "m" if part.follow else "1", "time_constant": "s",
                               "gain": "1/m", "overlap": "1"},
    FlowSource: {"flow": "m^3/s"},
    Fluid: {"density": "kg/m^3", "bulk_modulus": PRESSURE, "ambient": PRESSURE, "viscosity": "Pa s", "air": "1",
            "air_exponent": "1", "vapour_pressure": PRESSURE},
    Grip: {"x": "m", "factor": "1"},
    Node: {"volume": VOLUME, "pressure": PRESSURE},
    Orifice: VALVE | {"opening": "1"},
    Pipe: {"length": "m", "area": "m^2", "segments": "1", "friction_factor": "1", "wall_modulus": PRESSURE,
           "flow": "m^3/s"},
    Pump: {"displacement": VOLUME, "axis": "1", "leakage": LEAK, "drag": "N m s"},
    Resistance: {"conductance": LEAK},
    Supply: {"pressure": PRESSURE},
    # bodies, joints and forces
    RigidBody: {"mass": "kg", "inertia": "kg m^2", "center_of_mass": "m", "position": "m", "orientation": "1",
                "velocity": "m/s", "omega_B": "rad/s"},
    FlexibleBody: {"position": "m", "orientation": "1", "velocity": "m/s", "omega_B": "rad/s", "q": "kg^0.5 m",
                   "q_dot": "kg^0.5 m/s"},
    Marker: {"position": "m", "triad": "1", "tolerance": "1"},
    Gravity: {"acceleration": "m/s^2"},
    SpringDamper: {"stiffness": "N/m", "damping": "N s/m", "free_length": "m", "preload": "N",
                   "characteristic": ("N", "m")},
    PointForce: {"force": "N", "torque": "N m", "amplitude": "1"},
    BodyLoad: {"amplitude": "1"},
    JointForce: {"stiffness": along_coordinate("N m", "N/m"), "free": along_coordinate("rad", "m"),
                 "damping": along_coordinate("N m s", "N s/m"), "preload": along_coordinate("N m", "N"),
                 "motor": along_coordinate("N m", "N"), "friction": along_coordinate("N m", "N"),
                 "characteristic": along_coordinate(("N m", "rad"), ("N", "m")),
                 "friction_coefficient": along_coordinate("m", "1"),
                 "friction_speed": along_coordinate("rad/s", "m/s")},
    SphereContact: {"radius_a": "m", "radius_b": "m", "axis": "1", "modulus": PRESSURE, "stiffness": stop_stiffness,
                    "exponent": "1", "restitution": "1", "friction": "1", "friction_speed": "m/s", "slow": "m/s"},
    RollingDisc: {"radius": "m", "axis": "1", "axis_b": "1"},
    ScrewJoint: {"lead": "m", "axis": "1", "axis_b": "1"},
    AxialDistance: {"axis": "1"},
    PointDistance: {},
    # sensors
    AngleSensor: {"axis": "1"},
    Channel: {"direction": "1", "rate": "1"},
    JointCoordinate: {"rate": "1"},
    ElongationSensor: {"position_a": "m", "position_b": "m", "tolerance": "1"},
    ModeSensor: {"mode": "1"},
    StrainGauge: {"direction": "1", "young": PRESSURE, "poisson": "1", "position": "m", "tolerance": "1"},
    StressChannel: {"position": "m"},
    StressSensor: {"position": "m", "tolerance": "1"},
    VonMisesSensor: {},
}  # fmt: skip
JOINT = {"axis": "1", "axis_b": "1", "normal": "1", "rotation": "1", "distance": "m"}  #: of all joints


@dataclass(frozen=True)
class Other:
    """Other units, by their factors."""

    units: Units

    def factor(self, unit):
        """Return by what numbers in that SI unit are multiplied."""
        return dimensions(unit).factor(SI, self.units)

    def function(self, function, value="1", argument="s"):
        """Return a function of time, or of another argument, with value and argument in these units."""
        v, x = self.factor(value), self.factor(argument)
        pieces = np.array(function.pieces)
        pieces[:, :6] *= v / x ** np.arange(6)
        pieces[:, 6] *= v
        pieces[:, 7] /= x
        return TimeFunction(function.begins * x, pieces)

    def number(self, where, value, spec):
        """Return a number, an array or a function in these units."""
        if isinstance(value, TimeFunction):
            return self.function(value, *((spec, "s") if isinstance(spec, str) else spec))
        unit = spec if isinstance(spec, str) else spec[0]
        if isinstance(value, int) and unit == "1":
            return value
        return np.asarray(value, float) * self.factor(unit) if np.ndim(value) else value * self.factor(unit)

    def part(self, part, table=None):
        """Return a part of a system in these units: every number of every field."""
        if isinstance(part, TyreProperties | str | bool | None):
            return part
        if isinstance(part, ReducedBody):
            return convert_units(part, self.units)
        if isinstance(part, tuple | list):
            return type(part)(self.part(each) for each in part)
        if isinstance(part, Mapping):
            return {key: self.part(each) for key, each in part.items()}
        if isinstance(part, CoordinateCoupler):
            return self.coupler(part)
        if not is_dataclass(part):
            raise TypeError(f"no rule for {part!r}")
        return replace(part, **self.changes(part, self.table_of(part) if table is None else table))

    def table_of(self, part):
        """Return the units of the fields of a part."""
        for cls in type(part).__mro__:
            if cls in FIELDS:
                return FIELDS[cls]
        return JOINT if type(part).__module__.startswith("floatframe.model.joints") else {}

    def changes(self, part, table):
        """Return the fields of a part that have other values."""
        found = {}
        for each in fields(part):
            value, spec = getattr(part, each.name), table.get(each.name)
            spec = spec(part) if callable(spec) else spec
            if each.name == "motions":
                found[each.name] = {key: self.motion(key, value[key]) for key in value}
            elif isinstance(part, Bushing) and each.name in ("stiffness", "damping", "preload", "characteristics"):
                found[each.name] = self.of_bushing(each.name, value)
            elif value is None or isinstance(value, str | bool):
                continue
            elif isinstance(spec, dict):
                found[each.name] = self.part(value, spec)
            elif spec is not None:
                found[each.name] = self.number(f"{type(part).__name__}.{each.name}", value, spec)
            elif isinstance(value, int | float | TimeFunction | np.ndarray) and np.size(value):
                raise TypeError(f"{type(part).__name__}.{each.name}: no unit in FIELDS")
            elif is_dataclass(value) or isinstance(value, tuple | list | Mapping):
                if not isinstance(value, tuple | list | Mapping) or len(value):
                    found[each.name] = self.part(value)
        return {key: value for key, value in found.items() if key in {f.name for f in fields(part) if f.init}}

    def motion(self, coordinate, value):
        """Return a prescribed motion along a coordinate."""
        unit = "rad" if "angle" in coordinate else "m"
        return self.function(value, unit) if isinstance(value, TimeFunction) else value * self.factor(unit)

    def of_bushing(self, name, value):
        """Return numbers of a bushing, whose rows are forces and torques, and columns distances and angles."""
        of_length = np.array([1.0] * 3 + [0.0] * 3)
        if name == "characteristics":
            return {key: self.function(each, *(("N m", "rad") if key[0] == "r" else ("N", "m")))
                    for key, each in value.items()}  # fmt: skip
        if name == "preload":
            return np.asarray(value) * np.where(of_length, self.factor("N"), self.factor("N m"))
        powers = np.add.outer(1 - of_length, 1 - of_length) if np.ndim(value) == 2 else 2 * (1 - of_length)
        unit = self.factor("N/m" if name == "stiffness" else "N s/m")
        return np.asarray(value) * unit * self.factor("m") ** powers

    def coupler(self, part):
        """Return a coupler whose sum stays the number that it is in SI."""
        terms = []
        for coordinate, factor in part.terms:
            name = getattr(coordinate, "coordinate", type(coordinate).__name__.lower())
            scale = 1.0 if "angle" in name else 1 / self.factor("m")
            terms.append((self.part(coordinate), factor * scale))
        constant = part.constant
        constant = self.function(constant) if isinstance(constant, TimeFunction) else constant
        return replace(part, terms=tuple(terms), constant=constant)


def other_units(name):
    """Return other units, odd ones or other sizes, by name."""
    return Other((SIZES | {"odd": ODD}).get(name) or unit_system(name))


def in_units(system, units, turn=None, place=None):
    """Return a system in other units or of another size, as a whole turned by a rotation R and moved by a place [m]."""
    other = Other(units)
    system = system if turn is None else moved(system, np.asarray(turn), np.asarray(place))
    parts = {key: other.part(getattr(system, key)) for key in ("bodies", "joints", "forces", "couplers", "elements")}
    if units in SIZES.values():
        units = SI
        parts["bodies"] = [
            replace(body, reduced=replace(body.reduced, units=SI)) if isinstance(body, FlexibleBody) else body
            for body in parts["bodies"]
        ]
    return System(units=units, name=system.name, redundant=system.redundant, **parts)


def moved(system, R, place):
    """Return a system that as a whole is turned and moved: bodies, markers on the ground, what has ground axes."""

    system = replace(system, bodies=placed_bodies(system))  # not where their meshes are drawn

    def marker(each):
        if body_name(each.body) != GROUND.name:
            return each
        triad = np.eye(3) if each.triad is None else each.triad
        position = np.zeros(3) if each.position is None else each.position
        return Marker(GROUND, position=R @ position + place, triad=R @ triad)

    def on_ground(joint):
        """Return a joint whose marker A is the ground, without a place, with that place."""
        body = system.body(body_name(joint.marker_b.body))
        where = np.zeros(3) if joint.marker_b.position is None else joint.marker_b.position
        found = body.position + rotation_matrix(body.orientation) @ where
        return replace(joint, marker_a=Marker(GROUND, position=found))

    def part(each):
        if isinstance(each, Marker):
            return marker(each)
        if getattr(each, "marker_a", None) in (GROUND, GROUND.name):
            return part(on_ground(each))
        if isinstance(each, tuple | list):
            return type(each)(part(one) for one in each)
        if isinstance(each, Gravity):
            return replace(each, acceleration=R @ each.acceleration)
        if isinstance(each, PointForce) and not each.is_follower:
            each = replace(each, force=R @ each.force, torque=R @ each.torque)
        if isinstance(each, LiftingSurface):
            each = replace(each, wind=R @ each.wind)
        if is_dataclass(each) and not isinstance(each, type):
            new = {f.name: part(getattr(each, f.name)) for f in fields(each) if f.init}
            changed = {key: value for key, value in new.items() if value is not getattr(each, key)}
            return replace(each, **changed) if changed else each
        return each

    bodies = tuple(
        replace(body, position=R @ body.position + place, velocity=R @ body.velocity,
                orientation=euler_parameter_product(euler_parameters(R), body.orientation))
        for body in system.bodies
    )  # fmt: skip
    parts = {key: part(getattr(system, key)) for key in ("joints", "forces", "couplers", "elements")}
    return System(bodies, name=system.name, redundant=system.redundant, **parts)
