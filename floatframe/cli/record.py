"""The quality of a computed motion as a record, printed by `floatframe run` and `floatframe info`."""

from dataclasses import asdict
from typing import Any

import numpy as np

from floatframe.model.system import System
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.sensors import measured
from floatframe.results.trajectory import Trajectory

__all__ = ["run_record"]


def run_record(trajectory: Trajectory, system: System | None = None) -> dict[str, Any]:
    """Return times, bodies, energies, energy balance, drift and ranges of sensors, in plain types and units of the run.

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
        "summary": dict(trajectory.head.summary),
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
    """Return unit, least, greatest and last value of every column of the sensors of a system."""
    return {
        f"{measurement.sensor} {name}": {
            "unit": measurement.units[name],
            "least": float(values.min()),
            "greatest": float(values.max()),
            "last": float(values[-1]),
        }
        for measurement in measured(system, trajectory).values()
        for name, values in measurement.columns.items()
    }
