"""Motions for other programs: a table, deformed surfaces for ParaView (PVD and VTU), a summary of the run."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.body.stress import stress_of, von_mises
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.documents.table import Table
from fe_models.foundation.paths import replace_file
from fe_models.meshes.numbering import NONE
from floatframe.errors import ResultsError
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.place_motion import interface_motion
from floatframe.results.recovery import elastic_displacements, nodal_displacements, require_same_modes
from floatframe.results.sensors import coordinate_sensors, measured, sensors_of
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import Trajectory

__all__ = ["export_vtk", "motion_table", "run_record", "sensor_table"]


def motion_table(
    trajectory: Trajectory, bodies: Mapping[str, ReducedBody] | None = None, system: System | None = None
) -> Table:
    """Return the table of a motion; `motion_table(motion).write("motion.csv")` writes it.

    The columns are time; position and motion of every body frame; position, velocity and elastic displacement in B for
    the interfaces of the given bodies; force and moment on marker A for joints and springs; and energies. With the
    system, also its joint coordinates (value, rate and force along them) and the measurements of all its sensors.

    Parameters
    ----------
    trajectory
        The motion.
    bodies
        Reduced bodies by name, in the units of the motion.
    system
        The system that moves.
    """
    units = trajectory.units
    m, s = units.length_symbol, units.time_symbol
    N, Nm = units.force_symbol, f"{units.force_symbol} {units.length_symbol}"
    table: dict[str, Array] = {"t": trajectory.t}
    known = {"t": s}

    def put(name: str, values: Array, unit: str, components: str = "xyz") -> None:
        for k, component in enumerate(components):
            table[f"{name} {component}"] = values[:, k]
            known[f"{name} {component}"] = unit

    for name in trajectory.body_names:
        motion = trajectory.body(name)
        put(f"{name} origin", motion.r, m)
        put(f"{name} p", motion.p, "-", "wxyz")
        put(f"{name} velocity", motion.v, f"{m}/{s}")
        put(f"{name} omega_B", motion.omega_B, f"rad/{s}")
    for name, reduced in (bodies or {}).items():
        for interface in reduced.interfaces:
            where = f"{name} {interface.name}"
            place = interface_motion(trajectory, name, reduced, interface.name)
            put(f"{where} position", place.position, m)
            put(f"{where} velocity", place.velocity, f"{m}/{s}")
            put(f"{where} elastic", elastic_displacements(trajectory, name, reduced, interface.name), m)
    for name in trajectory.connection_names:
        reaction = trajectory.reaction(name)
        put(f"{name} force", reaction.force, N)
        put(f"{name} moment", reaction.moment, Nm)
    energies = trajectory.energies
    for name in ("kinetic", "strain", "gravity", "springs", "work", "dissipated", "total", "balance"):
        table[f"energy {name}"] = getattr(energies, name)
        known[f"energy {name}"] = Nm
    if system is not None:
        for measurement in measured(system, trajectory, [*coordinate_sensors(system), *sensors_of(system)]).values():
            add_measurement(measurement, table, known)
    return Table(table, known)


def sensor_table(trajectory: Trajectory, chosen: Sequence[Measurement]) -> Table:
    """Return the time and the columns of the chosen measurements."""
    columns, units = {"t": trajectory.t}, {"t": trajectory.units.time_symbol}
    for measurement in chosen:
        add_measurement(measurement, columns, units)
    return Table(columns, units)


def add_measurement(measurement: Measurement, columns: dict[str, Array], units: dict[str, str]) -> None:
    """Add the columns of a measurement and their units to two dictionaries."""
    columns |= {measurement.head(name): values for name, values in measurement.columns.items()}
    units |= {measurement.head(name): unit for name, unit in measurement.units.items()}


def export_vtk(
    trajectory: Trajectory,
    bodies: Mapping[str, ReducedBody],
    path: str | os.PathLike[str],
    *,
    every: int = 1,
    on_frame: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write the deformed surfaces of the given bodies as a series for ParaView: a .pvd file and a folder of .vtu files.

    Point data: elastic displacement in ground axes, the von Mises stress if every body has stress modes, and "node".
    Cell data: "element". "node" and "element" are the numbers in the user's meshes, -1 if there is none.

    Parameters
    ----------
    trajectory
        The motion.
    bodies
        Reduced bodies by name.
    path
        Name that ends in .pvd; the .vtu files are written to a folder with the same name without the ending.
    every
        Step between the output times that are written.
    on_frame
        Called with the number of times written so far and the total number.

    Returns
    -------
    list of Path
        The .pvd file first.

    Raises
    ------
    ResultsError
        If no body has a surface, or a body does not match the motion.
    """
    import meshio

    path = Path(path)
    if path.suffix.lower() != ".pvd":
        raise ResultsError(f"{path}: expected a file name that ends in .pvd")
    drawn = {name: body for name, body in bodies.items() if len(body.surface)}
    if not drawn:
        raise ResultsError("export: no body with a surface; a motion of rigid bodies can be exported as .csv")
    for name, body in drawn.items():
        require_same_modes(trajectory, name, body)
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    motions = {name: trajectory.body(name) for name in drawn}
    starts = np.cumsum([0, *(len(body.nodes) for body in drawn.values())])
    triangles = np.concatenate([b.surface + k for b, k in zip(drawn.values(), starts[:-1], strict=True)])
    number = np.repeat(np.arange(len(drawn)), [len(body.surface) for body in drawn.values()])
    has_stress = all(body.stress is not None for body in drawn.values())
    by_node, by_cell = numbers_of(list(drawn.values()))
    rows = range(0, len(trajectory.t), every)
    written, entries = [path], []
    for done, i in enumerate(rows):
        points, displacement, stress = [], [], []
        for name, body in drawn.items():
            motion = motions[name]
            R = rotation_matrix(motion.p[i])
            elastic = nodal_displacements(trajectory, name, body, i)
            points.append(motion.r[i] + (body.nodes + elastic) @ R.T)
            displacement.append(elastic @ R.T)
            if has_stress and body.stress is not None:
                stress.append(von_mises(stress_of(body.stress, motion.q[i])))
        data = {"elastic displacement": np.concatenate(displacement), **by_node}
        if has_stress:
            data["von Mises stress"] = np.concatenate(stress)
        file = folder / f"{i:06d}.vtu"
        meshio.Mesh(
            np.concatenate(points), [("triangle", triangles)], point_data=data, cell_data={"body": [number], **by_cell}
        ).write(file)
        written.append(file)
        time = float(trajectory.t[i])
        entries.append(f'<DataSet timestep="{time!r}" file="{escape(folder.name)}/{file.name}"/>')
        if on_frame is not None:
            on_frame(done + 1, len(rows))
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
    replace_file(path, (head + "\n".join(entries) + "\n</Collection>\n</VTKFile>\n").encode())
    return written


def numbers_of(bodies: list[ReducedBody]) -> tuple[dict[str, IntArray], dict[str, list[IntArray]]]:
    """Return the user's numbers of nodes and elements of several bodies as point data and cell data, if they exist."""
    nodes = [filled(body.numbering.nodes, len(body.nodes)) for body in bodies]
    elements = [filled(body.numbering.elements, len(body.surface)) for body in bodies]
    by_node = {"node": np.concatenate(nodes)} if any(body.numbering.nodes.size for body in bodies) else {}
    by_cell = {"element": [np.concatenate(elements)]} if any(body.numbering.elements.size for body in bodies) else {}
    return by_node, by_cell


def filled(numbers: IntArray, n: int) -> IntArray:
    """Return the numbers, or -1 for each of n entries if they do not exist."""
    return numbers if numbers.size else np.full(n, NONE)


# the quality of a motion as a record, printed by `floatframe run` and `floatframe info` -----------------------------


def run_record(trajectory: Trajectory, system: System | None = None) -> dict[str, Any]:
    """Return times, bodies, energies, energy balance, drift and sensor ranges as plain types, in units of the run.

    `energy_defect` is the largest |balance defect| divided by `energy_scale`; a drift is the largest over time.
    """
    energies, scale = trajectory.energies, energy_scale(trajectory)
    defect = float(np.abs(balance_defect(trajectory)).max(initial=0.0))
    drifts = {name: trajectory.drift(name) for name in trajectory.head.joints}
    run = trajectory.head.run
    n_t = len(trajectory.t)
    return {
        "system": trajectory.head.system,
        "units": trajectory.head.units,
        "is_complete": trajectory.is_complete,
        "run": dict(run),
        "n_outputs": n_t,
        "t_first": float(trajectory.t[0]) if n_t else None,
        "t_last": float(trajectory.t[-1]) if n_t else None,
        "summary": {name: value for name, value in trajectory.head.summary.items() if name != "watched"},
        "n_steps": trajectory.head.summary.get("n_steps")
        or (round((float(trajectory.t[-1]) - run["t_start"]) / run["h"]) if n_t else 0),
        "bodies": [
            {
                "name": body.name,
                "n_modes": body.n_q,
                "source": body.source,
                "digest": body.digest,
                "is_stiffened": body.is_stiffened,
            }
            for body in trajectory.head.bodies
        ],
        "validity": [asdict(note) | {"words": note.words} for note in trajectory.validity],
        "energy": {
            name: [float(values[0]), float(values[-1])] if n_t else None
            for name, values in {
                "kinetic": energies.kinetic,
                "strain": energies.strain,
                "gravity": energies.gravity,
                "springs": energies.springs,
                "work": energies.work,
                "dissipated": energies.dissipated,
            }.items()
        },
        "energy_scale": scale,
        "energy_defect": defect / scale if scale else 0.0,
        "drift": {
            name: {
                "distance": float(np.abs(drift.distance).max(initial=0.0)),
                "angle": float(np.abs(drift.angle).max(initial=0.0)),
                "distance_rate": float(np.abs(drift.distance_rate).max(initial=0.0)),
                "angle_rate": float(np.abs(drift.angle_rate).max(initial=0.0)),
            }
            for name, drift in drifts.items()
        },
        "sensors": {} if system is None or not n_t else sensors_record(system, trajectory),
        "places": {name: list(words) for name, words in trajectory.head.places.items()},
    }


def sensors_record(system: System, trajectory: Trajectory) -> dict[str, Any]:
    """Return unit, smallest, largest and last value of every quantity that the system's sensors measure.

    `peak` contains the time at which the magnitude is largest, and the numbers of the place (node, instance) at that
    time.
    """
    record = {}
    for measurement in measured(system, trajectory).values():
        for name, values in measurement.quantities.items():
            row = int(np.abs(values).argmax())
            record[f"{measurement.sensor} {name}"] = {
                "unit": measurement.units[name],
                "least": float(values.min()),
                "greatest": float(values.max()),
                "last": float(values[-1]),
                "peak": {"t": float(trajectory.t[row])}
                | {number: int(measurement.columns[number][row]) for number in measurement.numbers},
            }
    return record
