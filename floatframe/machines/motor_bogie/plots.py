"""A start as one figure: electrical and mechanical frequencies over time, and the load where they cross."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.channels import AnyOutput, Column
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.components.drives import InductionMotor
from floatframe.errors import ModelError
from floatframe.files.signals.orders import SpectralMap, order_cut, order_map
from floatframe.files.signals.signals import Signal
from floatframe.machines.motor_bogie.closed_forms import speed_of_torque, torque_lines, torque_over_speed
from floatframe.machines.motor_bogie.description import ENDS, MotorBogie
from floatframe.model.system import System
from floatframe.results.element_motion import element_motion
from floatframe.results.sensors import measured
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "ModeOfBogie",
    "SupplyLines",
    "at_rest",
    "modes_of",
    "plot_lines",
    "plot_map",
    "plot_start",
    "predicted_lines",
    "supply_lines",
    "supply_phase",
]


# evaluation of a start: modes, supply lines in the loads of the mounts, and their predictions -------------------------


MULTIPLES = (6, 12)  #: multiples of the supply frequency, for a six-step inverter


def at_rest(system: System, load: str = "leading_lower", column: str = "force x") -> LinearSystem:
    """Return the bogie without supply, linearised at rest.

    Inputs are the air-gap torques of both motors. Outputs are a column of a mount, and the speed of the leading rotor
    relative to its motor. Wheels at rest stick to the rails, as they do at small slip.
    """
    drives = [each for each in system.elements if isinstance(each, InductionMotor)]
    bodies = [replace(each, velocity=np.zeros(3), omega_B=np.zeros(3)) for each in system.bodies]
    still = replace(
        system, bodies=bodies, elements=[each for each in system.elements if each not in drives], sensors=[]
    )
    sensor = next((each for each in system.sensors if each.name == load), None)
    if sensor is None:
        raise ModelError(f"at_rest: the system has no sensor {load!r}")
    torques = [JointCoordinate(f"{word}_spindle", "angle", f"torque {word}") for word in ENDS]
    speed = JointCoordinate("leading_spindle", "angle", "speed", 1)
    return linearize(still, inputs=torques, outputs=[Column(cast(AnyOutput, sensor), column), speed])


class ModeOfBogie(NamedTuple):
    """An oscillation, and the location of its kinetic energy."""

    frequency: float  #: natural frequency of the mode [Hz]
    damping: float  #: damping ratio of the mode
    where: str  #: names of the two bodies with the largest shares
    flexible: float  #: share of the kinetic energy in the modes of the frame


def modes_of(linear: LinearSystem, lowest: float = 5.0, highest: float = 200.0) -> list[ModeOfBogie]:
    """Return the oscillations of the bogie at rest between two frequencies."""
    modes: SystemModes = system_modes(linear)
    sizes = [len(mass) for mass in linear.body_masses]
    first = np.concatenate([[0], np.cumsum(sizes)])
    found = []
    for k, root in enumerate(modes.eigenvalues):
        f = abs(root) / (2 * np.pi)
        if root.imag <= 0 or not lowest < f < highest:
            continue
        parts, elastic = [], 0.0
        for i, mass in enumerate(linear.body_masses):
            x = modes.shapes[first[i] : first[i + 1], k]
            parts.append(float((x.conj() @ mass @ x).real))
            if sizes[i] > 6:
                elastic = float((x[6:].conj() @ mass[6:, 6:] @ x[6:]).real)
        order = np.argsort(parts)[::-1][:2]
        where = ", ".join(linear.body_names[i] for i in order)
        found.append(ModeOfBogie(f, float(-root.real / abs(root)), where, elastic / sum(parts)))
    return found


class SupplyLines(NamedTuple):
    """Amplitudes at multiples of the supply frequency."""

    frequency: Array  #: supply frequency, (n,) [Hz]
    torque: dict[int, Array]  #: torque in the air gap of the leading motor for each multiple, (n,) [N m]
    load: dict[int, Array]  #: force in a mount for each multiple, (n,) [N]


def supply_phase(system: System, t: Array, drive: str = "leading_drive") -> tuple[Array, Array]:
    """Return frequency [Hz] and phase [rad] of the supply of a motor, (n_t,) each."""
    motor = next(each for each in system.elements if each.name == drive)
    assert isinstance(motor, InductionMotor)
    frequency = motor.frequency.at(t)  # type: ignore[union-attr]
    return frequency, 2 * np.pi * np.concatenate(
        [[0.0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(t))]
    )


def supply_lines(
    system: System, motion: Trajectory, load: str = "leading_lower", column: str = "force x",
    *, multiples: tuple[int, ...] = MULTIPLES, slowest: float = 1.5,
) -> SupplyLines:  # fmt: skip
    """Return the supply lines of a start, by order tracking relative to the supply, above a supply frequency [Hz]."""
    t = np.asarray(motion.t)
    _, phase = supply_phase(system, t)
    torque = element_motion(system, motion, "leading_drive").outputs["torque"]
    force = measured(system, motion)[load].columns[column]
    maps = [
        order_map(
            Signal(name, t, np.asarray(values), unit), phase, max_order=max(multiples) + 1.0, resolution=0.5,
            slowest=2 * np.pi * slowest,
        )
        for name, values, unit in (("torque", torque, "N m"), ("load", force, "N"))
    ]  # fmt: skip
    speeds = maps[0].speeds
    assert speeds is not None
    cuts = [{n: order_cut(each, n) for n in multiples} for each in maps]
    return SupplyLines(speeds / (2 * np.pi), cuts[0], cuts[1])


def predicted_lines(
    data: MotorBogie, linear: LinearSystem, frequencies: Array, torque: float, multiples: tuple[int, ...] = MULTIPLES
) -> SupplyLines:
    """Return the lines for constant speed at each supply frequency, from closed forms and frequency responses.

    The ripple T_n of `torque_lines` rotates the rotors with the mobility Y = speed / torque of the linearised bogie.
    This adds G = `torque_over_speed` times the speed to the torque: T = T_n/(1 - G Y). The load is the response H to
    both torques.
    """
    f = np.asarray(frequencies, dtype=float)
    rotor = np.array([speed_of_torque(data.motor, each, torque) for each in f])
    lines = [torque_lines(data.motor, data.harmonics, each, speed) for each, speed in zip(f, rotor, strict=True)]
    torques, loads = {}, {}
    for n in multiples:
        response = linear.response(n * f).sum(axis=2)  # both motors have the same supply
        G = np.array([torque_over_speed(data.motor, each, w, n * each) for each, w in zip(f, rotor, strict=True)])
        T = np.array([each[n] for each in lines]) / (1 - G * response[:, 1])
        torques[n], loads[n] = np.abs(T), np.abs(T * response[:, 0])
    return SupplyLines(f, torques, loads)


# plots ----------------------------------------------------------------------------------------------------------------


DECADES = 4.0  #: range of amplitudes that colours show, in decades


def plot_start(
    maps: Sequence[tuple[SpectralMap, Sequence[int]]],
    supply: tuple[Array, Array],
    modes: Sequence[ModeOfBogie],
    found: SupplyLines,
    predicted: SupplyLines,
) -> "Figure":
    """Return a figure with spectra over time, the supply lines and the modes, and loads over frequency.

    Parameters
    ----------
    maps
        Maps of a current, a torque and the force of a mount, from `frequency_map`, each with the multiples of the
        supply frequency to be drawn as lines.
    supply
        Times [s] and supply frequency [Hz], (n_t,) each.
    modes
        Modes of the bogie, drawn as horizontal lines.
    found, predicted
        Results of `supply_lines` and `predicted_lines`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.3 * (len(maps) + 1)), layout="constrained")
    axes = figure.subplots(len(maps) + 1, 1)
    highest = 1.12 * min(found.load) * float(supply[1].max())
    for (spectrum, multiples), ax in zip(maps, axes, strict=False):
        plot_map(spectrum, supply, multiples, modes, ax, highest)
    plot_lines(found, predicted, modes, axes[-1])
    return figure


def plot_map(
    spectrum: SpectralMap,
    supply: tuple[Array, Array],
    multiples: Sequence[int],
    modes: Sequence[ModeOfBogie],
    ax: "Axes",
    highest: float,
) -> "Axes":
    """Draw amplitudes as colours over time and frequency, supply lines dashed, modes dotted (green: frame modes)."""
    t, f = supply
    shown = np.log10(np.maximum(spectrum.amplitudes, 1e-12)).T
    top = float(shown[1:].max())
    mesh = ax.pcolormesh(
        spectrum.times, spectrum.lines, shown, shading="nearest", cmap="magma", vmin=top - DECADES, vmax=top
    )
    ax.figure.colorbar(mesh, ax=ax, label=f"log10 of the amplitude [{spectrum.unit}]")
    for n in multiples:
        ax.plot(t, n * f, color="white", linewidth=0.8, linestyle="--", alpha=0.7)
        inside = np.flatnonzero((n * f > 0.82 * highest) & (n * f < 0.9 * highest))
        k = inside[0] if len(inside) else int(0.93 * len(t))
        ax.annotate(f"{n} f", (t[k], n * f[k]), color="white", fontsize="small", ha="right", va="bottom")
    for mode in modes:
        ax.axhline(
            mode.frequency,
            color="#7fd0ff" if mode.flexible < 0.3 else "#8dff8d",
            linewidth=0.6,
            alpha=0.8,
            linestyle=":",
        )
    ax.set_xlim(spectrum.times[0], spectrum.times[-1])
    ax.set_ylim(0, highest)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("frequency [Hz]")
    ax.set_title(spectrum.name, fontsize="medium")
    return ax


def plot_lines(found: SupplyLines, predicted: SupplyLines, modes: Sequence[ModeOfBogie], ax: "Axes") -> "Axes":
    """Draw the amplitude of each line in a load over frequency, from the run and for constant speed."""
    for k, n in enumerate(found.load):
        color = f"C{k}"
        ax.semilogy(n * found.frequency, found.load[n], color=color, label=f"{n} f, of the start")
        ax.semilogy(n * predicted.frequency, predicted.load[n], color=color, linewidth=0.8, linestyle="--",
                    label=f"{n} f, running evenly")  # fmt: skip
    for mode in modes:
        ax.axvline(mode.frequency, color="C0" if mode.flexible < 0.3 else "C2", linewidth=0.5, alpha=0.5, linestyle=":")
    ax.set_xlim(0, 1.05 * min(found.load) * float(found.frequency.max()))
    ax.set_ylim(bottom=0.5)
    ax.set_xlabel("frequency of the line [Hz]")
    ax.set_ylabel("amplitude of the force [N]")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")
    return ax
