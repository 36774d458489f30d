"""Reading of the system file, as `floatframe run` does it (docs/system_file.md).

    system, run = read_system("swing.toml")
    trajectory = integrate(system, run.integrator, run.t_end, run.h, output="swing.h5", output_every=run.output_every,
                           progress=callback)          # callback(Progress(t, t_end, n_steps, n_total, n_iterations))
    trajectory = read_results("swing.h5")

All of them raise `FloatframeError`, whose text is a message for the user.
"""

import logging
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError
from fe_models.foundation.parametric_file import read_parametric
from fe_models.foundation.toml_file import Table, Vector3, choice, kind_field, validated
from fe_models.foundation.units import UNIT_SYSTEMS, unit_system
from fe_models.foundation.words import nearest
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import FloatframeError, SystemFileError
from floatframe.files.system_file.bodies import BodySection, ReadBodies, body_of
from floatframe.files.system_file.channel_section import (
    CosimulationSection,
    EventSection,
    FmuSection,
    ForeignSection,
    InputSection,
    OutputSection,
    SensorSection,
)
from floatframe.files.system_file.connections import (
    CouplerSection,
    ForceSection,
    JointSection,
    coupler_of,
    force_of,
    joint_of,
)
from floatframe.files.system_file.controller_section import ControllerSection
from floatframe.files.system_file.element_section import ElementSection, element_of
from floatframe.files.system_file.keys import Name
from floatframe.files.system_file.motion_section import overshoot_notes
from floatframe.files.system_file.run_section import RunOptions, RunSection
from floatframe.files.system_file.shape_section import ShapeSection
from floatframe.files.system_file.signal_section import SignalSection, signal_functions
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import (
    Force,
    Gravity,
)
from floatframe.model.system import REDUNDANT, System
from floatframe.simulation.events import require_events
from floatframe.simulation.sampling import require_controllers

__all__ = ["RunOptions", "read_system", "unit_hints"]


# hints that numbers of a system seem to be in other units than stated -------------------------------------------------


EARTH = 9.80665  #: m/s²
POWERS = (1e-6, 1e-3, 1e3, 1e6)  #: factors by which a number is wrong if m and mm, or kg and t, are confused
NEAR = 0.02  #: relative difference from such a factor
FAR = 300.0  #: ratio of radius of gyration to size of the system, or the inverse with its square, that no real part has


def unit_hints(system: System) -> tuple[str, ...]:
    """Return notes on numbers that do not fit the units of a system: gravity off by 1000, or implausible inertia."""
    hints = []
    units, where = system.units, f"system {system.name!r}, units {system.units.name}"
    for force in system.forces:
        if isinstance(force, Gravity):
            size = float(np.linalg.norm(force.acceleration))
            on_earth = EARTH * units.time**2 / units.length
            if any(abs(size / (factor * on_earth) - 1) < NEAR for factor in POWERS):
                hints.append(
                    f"{where}: gravity is {size:g} {units.length_symbol}/{units.time_symbol}², but on earth "
                    f"{on_earth:g}: is it in other units?"
                )
    rigid = [body for body in system.bodies if isinstance(body, RigidBody)]
    sizes = [
        float(np.linalg.norm(np.ptp(b.reduced.nodes, axis=0))) for b in system.bodies if not isinstance(b, RigidBody)
    ]
    reach = [float(np.linalg.norm(body.center_of_mass)) for body in rigid]
    places = np.array([body.drawn_position for body in system.bodies])
    length = max([*sizes, *reach, float(np.linalg.norm(np.ptp(places, axis=0)))])
    for body in rigid:
        radius = float(np.sqrt(np.linalg.eigvalsh(body.inertia)[-1] / body.mass))
        if length > 0 and (radius > FAR * length or (sizes and radius < length / FAR**2)):
            hints.append(
                f"{where}: rigid body {body.name!r} has mass and inertia of a part with a radius of gyration of "
                f"{radius:.3g} {units.length_symbol}, in a system of {length:.3g}: are they in "
                f"{units.mass_symbol} and {units.mass_symbol} {units.length_symbol}²?"
            )
    return tuple(hints)


# read system ----------------------------------------------------------------------------------------------------------


log = logging.getLogger(__name__)

#: tables of the objects that messages name, such as joint 'pin'
TABLES = {"body": "bodies"} | {kind: f"{kind}s" for kind in ("joint", "coupler", "force", "element", "sensor")}


class SystemSection(Table):
    """[system]: name, units and gravity of the system."""

    name: Name | None = Field(None, description="the name of the system, text; default: the name of the file")
    units: choice("unit system", lambda: tuple(UNIT_SYSTEMS)) = Field(  # type: ignore[valid-type]
        description=f"the unit system of all numbers, one of {', '.join(UNIT_SYSTEMS)}"
    )
    gravity: Vector3 = Field((0.0, 0.0, 0.0), description="the acceleration of free fall, [x, y, z]")
    redundant: choice("way with redundant constraints", lambda: REDUNDANT) = Field(  # type: ignore[valid-type]
        "refuse", description=f"one of {', '.join(REDUNDANT)}"
    )


class SystemFile(Table):
    """A system and its run."""

    kind: str = kind_field("system")
    system: SystemSection = Field(description="a table [system] with units and gravity")
    bodies: dict[str, BodySection] = Field(description="tables [bodies.NAME]")
    joints: dict[str, JointSection] = Field({}, description="tables [joints.NAME]")
    couplers: dict[str, CouplerSection] = Field({}, description="tables [couplers.NAME]")
    forces: dict[str, ForceSection] = Field({}, description="tables [forces.NAME]")
    elements: dict[str, ElementSection] = Field({}, description="tables [elements.NAME]")
    signals: dict[str, SignalSection] = Field({}, description="tables [signals.NAME]")
    sensors: dict[str, SensorSection] = Field({}, description="tables [sensors.NAME]")
    inputs: dict[str, InputSection] = Field({}, description="tables [inputs.NAME]")
    outputs: dict[str, OutputSection] = Field({}, description="tables [outputs.NAME]")
    controllers: dict[str, ControllerSection] = Field({}, description="tables [controllers.NAME]")
    events: dict[str, EventSection] = Field({}, description="tables [events.NAME]")
    fmu: FmuSection | None = Field(None, description="a table [fmu] with inputs, outputs and parameters")
    fmus: dict[str, ForeignSection] = Field({}, description="tables [fmus.NAME]")
    cosimulation: CosimulationSection | None = Field(None, description="a table [cosimulation] with step and scheme")
    scene: list[ShapeSection] = Field([], description="tables [[scene]], the surroundings: ground, road, track")
    run: RunSection | None = Field(None, description="a table [run] with t_end and h")

    @model_validator(mode="after")
    def _names_bodies(self) -> "SystemFile":
        choices = [GROUND.name, *self.bodies]
        terms = {f"{name}.terms": term for name, coupler in self.couplers.items() for term in coupler.terms}
        coordinates = {
            f"{name}.coordinates.{key}": section
            for name, force in self.forces.items()
            for key, section in (getattr(force, "coordinates", None) or {}).items()
        }
        for kind, sections in (("joints", self.joints), ("forces", self.forces), ("sensors", self.sensors),
                               ("couplers", terms), ("forces", coordinates),
                               ("inputs", self.inputs), ("outputs", self.outputs)):  # fmt: skip
            for name, section in sections.items():
                for key in ("body", "body_a", "body_b", "relative_to"):
                    body = getattr(section, key, None)
                    if body is not None and body not in choices:
                        hint = nearest(body, choices)
                        raise ValueError(f'{kind}.{name}.{key} = "{body}": there is no such body{hint}')
        return self


def read_system(
    path: str | os.PathLike[str],
    changes: Mapping[str, Any] | None = None,
    *,
    read_bodies: ReadBodies | None = None,
) -> tuple[System, RunOptions | None]:
    """Read and validate a system file and its modal files; return the system and, if there is a table [run], its run.

    Parameters
    ----------
    path
        The system file.
    changes
        Values that replace those in the file: of its parameters by name, of other keys by key path, such as
        {"length": 0.4, "bodies.rod.mass": 2.0}.
    read_bodies
        Bodies of modal files, empty at first. A caller that reads many systems passes the same dict to each call, so
        that a modal file is read again only if it has changed.

    Raises
    ------
    SystemFileError
        If the file is not valid. The message lists every problem, with key path, value, expected value and nearest
        name.
    """
    path = Path(path)
    content = read_parametric(path, SystemFileError, changes)
    data = validated(SystemFile, content, path, SystemFileError, context=path.parent)
    files: dict[Any, ReducedBody] = {}
    try:
        units = unit_system(data.system.units)
        bodies = [body_of(name, section, files, units, read_bodies) for name, section in data.bodies.items()]
        if read_bodies is not None:
            for file in set(read_bodies) - {section.file for section in data.bodies.values()}:
                del read_bodies[file]
        signals = signal_functions(data.signals, units)
        joints = [joint_of(name, section, signals) for name, section in data.joints.items()]
        couplers = [coupler_of(name, section, signals) for name, section in data.couplers.items()]
        forces: list[Force] = [force_of(name, section, signals) for name, section in data.forces.items()]
        element_files: list[str] = []
        elements = [
            element_of(name, table, path.parent, signals, element_files) for name, table in data.elements.items()
        ]
        if any(data.system.gravity):
            forces.insert(0, Gravity(np.array(data.system.gravity)))
        name = data.system.name or path.stem
        sensors = [section.object_named(key) for key, section in data.sensors.items()]
        data_files = [*content.files[1:], *(each.file for each in data.signals.values()), *element_files]
        data_files += [section.file for section in data.bodies.values() if section.file and section.at is not None]
        modules = (section.module_file(path.parent) for section in data.controllers.values())
        data_files += [file for file in modules if file is not None]
        if data.run is not None and data.run.continues is not None:
            data_files.append(data.run.continues)
        system = System(
            bodies, joints, forces, units, name, data.system.redundant, couplers, elements=elements, sensors=sensors,
            inputs=[section.channel(key) for key, section in data.inputs.items()],
            outputs=[section.output(key, sensors) for key, section in data.outputs.items()],
            controllers=[section.controller(key, path.parent) for key, section in data.controllers.items()],
            events=[section.object_named(key) for key, section in data.events.items()],
            fmus=[section.unit(key, path.parent) for key, section in data.fmus.items()],
            scene=[section.object_named() for section in data.scene],
            source=str(path.resolve()),
            changes=dict(changes or {}),
            data_files=tuple(dict.fromkeys(map(str, data_files))),
        )  # fmt: skip
        _ = compiled_system(system)  # looks up all markers and interfaces
        require_events(system)
        require_controllers(system)
        for signal in signals.values():
            if signal.notes:
                log.warning("%s: signal %s: %s", path, signal.name, "; ".join(signal.notes))
        for hint in (*overshoot_notes(data), *unit_hints(system)):
            log.warning("%s: %s", path, hint)
    except (FloatframeError, CmsError) as error:
        named = re.match(rf"({'|'.join(TABLES)}) '([^']*)'", str(error))
        keys = str(error).partition(":")[0].partition(" = ")[0].split(".")
        line = content.place((TABLES[named[1]], named[2]) if named else tuple(keys))
        raise SystemFileError(f"{path}: {error}{line}") from error
    if data.run is None:
        return system, None
    coupling = None if data.cosimulation is None else data.cosimulation.object_named()
    return system, replace(data.run.options(), coupling=coupling)
