"""Modes of a body at its ports, and its frequency response."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from cms.assessment.quality.errors import QualityError
from cms.body.reduced_body import ReducedBody
from cms.reduction.free_pencil import free_elastic_modes, free_pencil, port_rows
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array, frozen
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "FrequencyResponse", "PortModel", "file_resonances", "frf", "modal_response", "port_model", "resonances",
    "response_unit",
]  # fmt: skip

CHUNK = 2**22  #: number of complex entries of the equation systems that are solved together


@dataclass(frozen=True, eq=False)
class PortModel:
    """Rigid and elastic free modes of a body at its ports, mesh axes."""

    names: tuple[str, ...]  #: names of the ports
    omega2: Array  #: squared elastic frequencies, or stiffness of massless shapes, (n,) [1/time²]
    is_massive: np.ndarray  #: whether each mode has mass, (n,) bool
    modes: Array  #: motion of the ports in the modes, (6 n_ports, n)
    rigid: Array  #: motion of the ports in the M-orthonormal rigid-body motions, (6 n_ports, n_r)

    def __post_init__(self) -> None:
        for name in ("omega2", "modes", "rigid"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@presented
@dataclass(frozen=True, eq=False)
class FrequencyResponse(Tabular):
    """Receptance between ports: displacement / force, rotation / moment, in units and axes of the mesh of the body."""

    frequencies: Array  #: frequencies, (n_f,) [Hz]
    H: np.ndarray  #: complex receptance, (n_f, n_outputs, n_inputs) [m/N, 1/N, 1/(N m)]
    outputs: tuple[str, ...]  #: names of the motions, such as "small_end ux"
    inputs: tuple[str, ...]  #: names of the forces, such as "big_end ux"
    damping: str  #: description of the damping
    time: float = 1.0  #: time unit of the body [s]
    units: Units | None = None  #: units of the body, for tables; None: tables have no units of length and force

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequencies", frozen(self.frequencies))
        self.H.flags.writeable = False

    @property
    def omega(self) -> Array:
        """Angular frequencies [1/time unit of the body], (n_f,)."""
        return 2 * np.pi * self.frequencies * self.time

    @property
    def inertance(self) -> np.ndarray:
        """Acceleration per force, -omega² H, complex, (n_f, n_outputs, n_inputs)."""
        return -(self.omega**2)[:, None, None] * self.H

    @property
    def mobility(self) -> np.ndarray:
        """Velocity per force, i omega H, complex, (n_f, n_outputs, n_inputs)."""
        return 1j * self.omega[:, None, None] * self.H

    def between(self, excited: str, answering: str) -> "FrequencyResponse":
        """Return the 6 x 6 block from forces on one interface to motions of another."""
        rows = [k for k, label in enumerate(self.outputs) if label.rsplit(" ", 1)[0] == answering]
        columns = [k for k, label in enumerate(self.inputs) if label.rsplit(" ", 1)[0] == excited]
        for name, found, labels in ((answering, rows, self.outputs), (excited, columns, self.inputs)):
            if not found:
                hint = nearest(name, {i.rsplit(" ", 1)[0] for i in labels})
                raise QualityError(f"frequency response: no interface {quoted(name)}{hint}")
        return FrequencyResponse(
            self.frequencies,
            self.H[:, rows][:, :, columns].copy(),
            tuple(self.outputs[k] for k in rows),
            tuple(self.inputs[k] for k in columns),
            self.damping,
            self.time,
            self.units,
        )

    def values(self, *, is_inertance: bool) -> Array:
        """Return the inertance or the receptance, (n_f, n_out, n_in)."""
        return self.inertance if is_inertance else self.H

    def to_table(self) -> Table:
        """Return the frequency, and the complex receptance of every motion and force: "right uy / left uy"."""
        columns: dict[str, np.ndarray] = {"frequency": self.frequencies}
        units = {"frequency": "Hz"}
        for o, output in enumerate(self.outputs):
            for i, given in enumerate(self.inputs):
                columns[f"{output} / {given}"] = self.H[:, o, i]
                if self.units is not None:
                    units[f"{output} / {given}"] = response_unit(self.units, output, given)
        return Table(columns, units)


def response_unit(units: Units, motion: str, force: str, *, is_inertance: bool = False) -> str:
    """Return the unit of a motion such as "right uy" per force or moment such as "left ry"."""
    top = units.length_symbol if motion.rsplit(" ", 1)[-1] in MOTION_COMPONENTS[:3] else "rad"
    top += f"/{units.time_symbol}²" if is_inertance else ""
    is_force = force.rsplit(" ", 1)[-1] in MOTION_COMPONENTS[:3]
    return f"{top}/{units.force_symbol}" if is_force else f"{top}/({units.force_symbol} {units.length_symbol})"


def port_model(reduced: ReducedBody) -> PortModel:
    """Return the free modes of a reduced body at its interfaces, from its modal file alone."""
    omega2, X, is_massive = free_elastic_modes(reduced)
    rows = mesh_port_rows(reduced)
    N = np.zeros((0, 0))
    if not reduced.is_held:
        N = np.linalg.inv(np.linalg.cholesky(free_pencil(reduced).M[:6, :6])).T
    names = tuple(interface.name for interface in reduced.interfaces)
    return PortModel(names, omega2, is_massive, rows @ X, rows[:, : len(N)] @ N)


def mesh_port_rows(reduced: ReducedBody) -> Array:
    """Return the motions of all reference points due to x, in mesh axes, (6 n_ports, n_r + n_q)."""
    if not reduced.interfaces:
        raise QualityError(f"body {reduced.name!r}: has no interface; forces and motions need a place")
    turn = np.kron(np.eye(2), reduced.frame.axes)
    return np.vstack([turn @ port_rows(reduced, interface.name) for interface in reduced.interfaces])


def modal_response(
    model: PortModel, frequencies: Array, *, damping: float = 0.0, time: float = 1.0
) -> FrequencyResponse:
    """Sum the modes: H = -R Rᵀ / omega² + sum_k p_k p_kᵀ / (omega_k² - omega² + 2 i zeta omega_k omega).

    Parameters
    ----------
    frequencies
        Frequencies above 0, (n_f,) [Hz].
    damping
        Damping ratio zeta of every elastic free mode.
    time
        Time unit of the body [s].

    Raises
    ------
    QualityError
        If a frequency is not above 0, or the damping is negative.
    """
    require_frequencies(frequencies)
    require_damping(damping)
    omega = (2 * np.pi * time * np.asarray(frequencies))[:, None]
    omega_k = np.sqrt(np.maximum(model.omega2, 0.0))
    dynamic = model.is_massive * (2j * damping * omega_k * omega - omega**2)
    gain = 1 / (model.omega2 + dynamic)
    H = (model.modes[None] * gain[:, None, :]) @ model.modes.T
    H = H - (model.rigid @ model.rigid.T)[None] / (omega**2)[:, :, None]
    labels = tuple(f"{name} {component}" for name in model.names for component in MOTION_COMPONENTS)
    words = f"{100 * damping:.3g} % in every free-free mode" if damping else "no damping"
    return FrequencyResponse(np.asarray(frequencies, dtype=float), H, labels, labels, words, time)


def resonances(model: PortModel, *, damping: float, time: float = 1.0) -> tuple[Array, Array]:
    """Return frequencies and damping ratios of the elastic modes with mass, (n_massive,) [Hz] and [-]."""
    omega2 = model.omega2[model.is_massive]
    frequencies = np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi) / time
    return frequencies, np.full(len(frequencies), damping)


def file_resonances(reduced: ReducedBody, *, damping: float | None = None) -> tuple[Array, Array]:
    """Return frequencies and damping ratios of the free body without joints, (n_massive,) [Hz] and [-].

    By default each ratio follows from D of the file, xᵀ D x / 2 omega (light damping).

    Parameters
    ----------
    damping
        Damping ratio of every mode; None: from D.
    """
    if damping is not None:
        require_damping(damping)
    omega2, X, is_massive = free_elastic_modes(reduced)
    omega = np.sqrt(np.maximum(omega2[is_massive], 0.0))
    D = free_pencil(reduced).D
    own = np.einsum("nk,nm,mk->k", X[:, is_massive], D, X[:, is_massive]) / (2 * np.where(omega > 0, omega, np.inf))
    ratios = np.maximum(own, 0.0) if damping is None else np.full(len(omega), damping)
    return omega / (2 * np.pi) / reduced.units.time, ratios


def frf(reduced: ReducedBody, frequencies: ArrayLike, *, damping: float | None = None) -> FrequencyResponse:
    """Return the response of the free reduced body between all its interfaces, from its modal file alone.

    Parameters
    ----------
    reduced
        The reduced body.
    frequencies
        Frequencies above 0, (n_f,) [Hz].
    damping
        Damping ratio of every elastic free mode; None: D of the file.

    Returns
    -------
    FrequencyResponse
        Receptance between all interfaces; `between("left", "right")` takes two of them.
    """
    time = reduced.units.time
    frequencies = np.asarray(frequencies, dtype=float)
    if damping is not None:
        found = modal_response(port_model(reduced), frequencies, damping=damping, time=time)
        return replace(found, units=reduced.units)
    require_frequencies(frequencies)
    pencil, rows = free_pencil(reduced), mesh_port_rows(reduced)
    omega = 2 * np.pi * time * np.asarray(frequencies, dtype=float)
    n = len(pencil.M)
    H = np.empty((len(omega), len(rows), len(rows)), dtype=complex)
    step = max(1, CHUNK // n**2)
    for first in range(0, len(omega), step):
        w = omega[first : first + step, None, None]
        A = pencil.K + 1j * w * pencil.D - w**2 * pencil.M
        H[first : first + step] = rows @ np.linalg.solve(A, np.broadcast_to(rows.T, (len(w), *rows.T.shape)))
    labels = tuple(f"{i.name} {component}" for i in reduced.interfaces for component in MOTION_COMPONENTS)
    words = "the damping of the file" if reduced.D.any() else "no damping"
    return FrequencyResponse(np.asarray(frequencies, dtype=float), H, labels, labels, words, time, reduced.units)


def require_damping(damping: float) -> None:
    """Raise an error for a damping ratio that is negative or not finite."""
    if not 0 <= damping < np.inf:
        raise QualityError(f"frequency response: damping = {damping}; expected a ratio of 0 or more (0.01 is 1 %)")


def require_frequencies(frequencies: Array) -> None:
    """Raise an error for nonpositive frequencies: the response of a free body is infinite at 0."""
    values = np.asarray(frequencies)
    if values.ndim != 1 or not len(values) or not (np.isfinite(values) & (values > 0)).all():
        raise QualityError("frequency response: expected frequencies above 0 [Hz]; a free body has none at 0")
