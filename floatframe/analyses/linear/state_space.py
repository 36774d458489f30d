"""The state space of a linearised system with named states: joint coordinates, modes, body motions.

The states are x = R z and their rates, where R is a square matrix whose rows are named motions. With T = diag(R, R),
they follow from the state space over (z, z_dot) of `LinearSystem.state_space`:

    A = T A_z T⁻¹,  B = T B_z,  C = C_z T⁻¹,  D = D_z.
"""

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.extras import extra_module
from fe_models.foundation.paths import replace_file
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.linear.linearization import LinearSystem, NamedMotions
from floatframe.analyses.system_matrices import settled
from floatframe.errors import ModelError

if TYPE_CHECKING:
    from scipy.signal import StateSpace

__all__ = ["WRITERS", "NamedStateSpace", "named_state_space", "write_state_space"]

CLEAR = 0.02  #: smallest independent part of a motion for a well-conditioned state
NEW = 1e-9  #: independent part above rounding errors, used if no motion reaches `CLEAR`


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class NamedStateSpace:
    """State space x_dot = A x + B u, y = C x + D u, with name and unit of each state, input and output.

    Parameters
    ----------
    A
        Rates per state, (n_x, n_x).
    B
        Rates per input, (n_x, n_inputs).
    C
        Outputs per state, (n_outputs, n_x).
    D
        Outputs per input, (n_outputs, n_inputs).
    states
        Names of the states.
    state_units
        Unit of each state.
    inputs
        Names of the inputs.
    input_units
        Unit of each input.
    outputs
        Names of the outputs.
    output_units
        Unit of each output.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in "ABCD":
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), dtype=float)))

    def scipy(self) -> "StateSpace":
        """Return the state space as `scipy.signal.StateSpace`, which has no names."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)

    def control(self) -> Any:
        """Return the state space as `control.StateSpace` of python-control, with "." in names replaced by " ".

        Raises
        ------
        MissingExtraError
            If python-control is not installed.
        """
        control = extra_module("control", extra="control", purpose="a state space of python-control")
        names = {
            kind: [name.replace(".", " ") for name in getattr(self, kind)] for kind in ("states", "inputs", "outputs")
        }
        return control.ss(self.A, self.B, self.C, self.D, **names)


def named_state_space(linear: LinearSystem) -> NamedStateSpace:
    """Return the state space of a linearised system with named states.

    (1) massless motions are eliminated, because they follow the others
    (2) named motions are chosen until there are as many as independent motions: first joint coordinates, then modal
        coordinates, then motions of body frames; each time the motion with the largest part that is independent of the
        motions already chosen, in the norm of the mass matrix
    (3) the states are the chosen motions, their rates, the states of elements and user forces, and the integrals of
        inputs that are velocities or accelerations

    Parameters
    ----------
    linear
        A linearised system from `linearize`.

    Raises
    ------
    ModelError
        If the system has no names of motions, because it was not made by `linearize`.
    """
    if linear.motions is None:
        raise ModelError("named_state_space: expected a system returned by linearize, got one without names of motions")
    system, T_mass = linear.with_mass()
    motions = linear.motions
    n_z, rows = system.n_z, settled(motions.rows @ T_mass, (motions.rows, T_mass))  # (1)
    chosen = independent_rows(rows[:, :n_z], system.M[:n_z, :n_z], motions)  # (2)
    R = rows[chosen, :n_z]
    space, n = linear.state_space(), len(chosen)
    kept = system.kept_inputs()
    T = la.block_diag(R, R, np.eye(len(system.states) + len(kept)))  # (3)
    by_states, states = rows[chosen, n_z:], slice(2 * n, 2 * n + len(system.states))
    if by_states.any():  # displacements along velocity constraints are positions too
        T[:n, states] = by_states
        T[n : 2 * n] += by_states @ space.A[states]
    backward = np.linalg.inv(T)  # well conditioned by (2)
    A = T @ space.A @ backward
    A[:n] = np.eye(n, len(A), k=n)  # exact, without rounding errors
    names = [motions.names[k] for k in chosen]
    units = [motions.units[k] for k in chosen]
    of_inputs = [kept_name(linear, k, r, motions.time_unit) for k, r in kept]
    return NamedStateSpace(
        A=A,
        B=T @ space.B,
        C=space.C @ backward,
        D=space.D,
        states=(*names, *(f"{name} rate" for name in names), *linear.states, *(name for name, _ in of_inputs)),
        state_units=(
            *units,
            *(f"{unit}/{motions.time_unit}" for unit in units),
            *linear.state_units,
            *(unit for _, unit in of_inputs),
        ),
        inputs=linear.inputs,
        input_units=linear.input_units,
        outputs=linear.outputs,
        output_units=linear.output_units,
    )


def kept_name(linear: LinearSystem, k: int, r: int, time_unit: str) -> tuple[str, str]:
    """Return name and unit of a state that is an integral of input k: s or s'."""
    per_time = ("", f"/{time_unit}", f"/{time_unit}²")
    of_s = linear.input_units[k].removesuffix(per_time[linear.input_rates[k]])
    return f"{linear.inputs[k]} {('displacement', 'velocity')[r]}", of_s + per_time[r]


def independent_rows(rows: Array, M: Array, motions: NamedMotions) -> list[int]:
    """Return the ordered indices of rows that become states, step (2) of `named_state_space`."""
    n = rows.shape[1]
    scaled = la.solve_triangular(la.cholesky(M, lower=True), rows.T, lower=True).T
    size = np.linalg.norm(scaled, axis=1)
    scaled = np.divide(scaled, size[:, None], out=np.zeros_like(scaled), where=size[:, None] > 0)
    chosen: list[int] = []
    for least in (CLEAR, NEW):
        for rank in sorted(set(motions.ranks)):
            candidates = [k for k, of in enumerate(motions.ranks) if of == rank and k not in chosen]
            while len(chosen) < n and candidates:
                best = max(candidates, key=lambda k: float(np.linalg.norm(scaled[k])))
                if np.linalg.norm(scaled[best]) < least:
                    break
                direction = scaled[best] / np.linalg.norm(scaled[best])
                for _ in range(2):  # twice, to remove the rounding errors of the first time
                    scaled = scaled - np.outer(scaled @ direction, direction)
                candidates.remove(best)
                chosen.append(best)
    if len(chosen) < n:
        raise ModelError(f"named_state_space: found {len(chosen)} independent named motions, expected {n}")
    return sorted(chosen)


def write_state_space(linear: LinearSystem, path: Path) -> NamedStateSpace:
    """Write A, B, C, D with names and units, and M, C, K for z, to a file.

    Parameters
    ----------
    linear
        The linearised system.
    path
        File with the suffix .npz, .mat (MATLAB 5) or .h5.

    Raises
    ------
    ModelError
        If the file has another suffix.
    """
    kind = path.suffix.lower()
    if kind not in WRITERS:
        raise ModelError(f"{path}: expected a file name that ends in {', '.join(WRITERS)}")
    space = named_state_space(linear)
    arrays = {
        "A": space.A, "B": space.B, "C": space.C, "D": space.D, "M_z": linear.M, "C_z": linear.C, "K_z": linear.K,
        "B_z": linear.B, "B_rate_z": linear.B_rate, "B_acceleration_z": linear.B_acceleration, "L": linear.L,
        "L_rate": linear.L_rate, "L_acceleration": linear.L_acceleration, "D_z": linear.D, "D_rate_z": linear.D_rate,
        "D_acceleration_z": linear.D_acceleration, "N": linear.N, "Y": linear.Y, "output_values": linear.output_values,
    }  # fmt: skip
    parts = ("states", "state_units", "inputs", "input_units", "outputs", "output_units")
    replace_file(path, WRITERS[kind](arrays, {part: getattr(space, part) for part in parts}))
    return space


def npz_bytes(arrays: dict[str, Any], words: dict[str, Any]) -> bytes:
    """Return the content of an .npz file."""
    data = io.BytesIO()
    named: dict[str, Any] = {name: np.array(texts, dtype=str) for name, texts in words.items()}
    np.savez(data, **arrays, **named)
    return data.getvalue()


def mat_bytes(arrays: dict[str, Any], words: dict[str, Any]) -> bytes:
    """Return the content of a .mat file (MATLAB 5), with matrices and cell arrays of texts."""
    from scipy.io import savemat

    cells = {name: np.array([*texts, ""], dtype=object)[:-1] for name, texts in words.items()}
    data = io.BytesIO()
    savemat(data, {**{name: np.array(array) for name, array in arrays.items()}, **cells})
    return data.getvalue()


def h5_bytes(arrays: dict[str, Any], words: dict[str, Any]) -> bytes:
    """Return the content of an HDF5 file, with matrices as datasets and names and units as root attributes."""
    import h5py

    data = io.BytesIO()
    with h5py.File(data, "w") as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array)
        for name, texts in words.items():
            file.attrs[name] = list(texts) if texts else h5py.Empty("S1")
    return data.getvalue()


WRITERS: dict[str, Callable[[dict[str, Any], dict[str, Any]], bytes]] = {
    ".npz": npz_bytes,
    ".mat": mat_bytes,
    ".h5": h5_bytes,
}
