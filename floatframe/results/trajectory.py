"""A computed motion, read from a results file or returned by `integrate`."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import Summary, presented, text_of
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError, ResultsError
from floatframe.model.state import State
from floatframe.results.head import BodyEntry, Head
from floatframe.results.results_file import ArraySource, open_results, validity_text
from floatframe.results.validity import ValidityNote, notes_from_json

__all__ = ["BodyMotion", "Drift", "Energies", "Reaction", "Trajectory", "read_trajectory"]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a body: motion of its frame B and its modal coordinates."""

    t: Array  #: output times, (n_t,) [s]
    r: Array  #: position of the frame origin, ground axes, (n_t, 3) [m]
    p: Array  #: Euler parameters (w, x, y, z) of R_GB, (n_t, 4)
    q: Array  #: modal coordinates, (n_t, n_q)
    v: Array  #: velocity of the frame origin, ground axes, (n_t, 3) [m/s]
    omega_B: Array  # noqa: N815  #: angular velocity, body axes, (n_t, 3) [rad/s]
    q_dot: Array  #: rates of the modal coordinates, (n_t, n_q)
    v_dot: Array  #: acceleration of the frame origin, ground axes, (n_t, 3) [m/s²]
    omega_B_dot: Array  # noqa: N815  #: (n_t, 3) [rad/s²]
    q_ddot: Array  #: second rates of the modal coordinates, (n_t, n_q)


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class Energies:
    """Energies of the whole system, each (n_t,) [J]."""

    kinetic: Array
    strain: Array
    gravity: Array  #: potential energy of gravity; zero if all mass is at the ground origin
    springs: Array
    work: Array  #: work done by point forces and drives since the start
    dissipated: Array  #: energy dissipated by dampers and modal damping since the start

    @property
    def total(self) -> Array:
        """Sum of kinetic and potential energy, (n_t,)."""
        return self.kinetic + self.strain + self.gravity + self.springs

    @property
    def balance(self) -> Array:
        """Total energy minus work plus dissipated energy, (n_t,); constant except for integration errors."""
        return self.total - self.work + self.dissipated


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class Reaction:
    """Force and moment that a joint or spring exerts on its marker A, in ground axes."""

    force: Array  #: force on marker A, (n_t, 3) [N]
    moment: Array  #: moment on marker A, (n_t, 3) [N m]; zero if the connection has no moment


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class Drift:
    """The constraint error of a joint, (n_t,) each."""

    distance: Array  #: error of distances [m]
    angle: Array  #: error of angles [rad]
    distance_rate: Array  #: rate of the distance error [m/s]
    angle_rate: Array  #: rate of the angle error [rad/s]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Trajectory:
    """A motion in memory, or on disk with arrays read on demand.

    Parameters
    ----------
    head
        Content of the results file besides arrays.
    source
        Arrays of the motion, in memory or in files.
    is_complete
        False for a run that was interrupted.
    path
        Results file, or None for a motion in memory.
    validity
        Notes of the run about its own validity, see `ValidityNote`.
    """

    head: Head
    source: ArraySource
    is_complete: bool
    path: Path | None = None
    validity: tuple[ValidityNote, ...] = ()

    def summary(self) -> Summary:
        """Return the content shown by `repr` and notebooks: times, bodies, joints and notes of the run."""
        second, t = self.units.time_symbol, self.t
        rows = [
            ("time", f"{t[0]:.6g} to {t[-1]:.6g} {second}, {len(t)} outputs" if len(t) else "no outputs"),
            ("units", self.units.name),
            ("joints and springs", text_of(self.connection_names)),
            *([("file", str(self.path))] if self.path is not None else []),
            *([("complete", "no: the run ended early")] if not self.is_complete else []),
            *(("note", text_of(note.words)) for note in self.validity[:3]),
        ]
        return Summary(
            f"Trajectory of {self.head.system!r}", rows, ("body", "modes"),
            [(body.name, str(body.n_q)) for body in self.head.bodies],
        )  # fmt: skip

    @cached_property
    def t(self) -> Array:
        """Output times, (n_t,) [s]."""
        return self.source.read("t")

    @property
    def units(self) -> Units:
        """Unit system of all numbers."""
        return unit_system(self.head.units)

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(body.name for body in self.head.bodies)

    @property
    def connection_names(self) -> tuple[str, ...]:
        """Names of the joints, then of the spring-dampers."""
        return self.head.joints + self.head.springs

    @property
    def files(self) -> tuple[str, ...]:
        """The recorded input files of the run: system file and modal files."""
        sources = (self.head.run.get("system_file", ""), *(body.source for body in self.head.bodies))
        return tuple(str(source) for source in sources if source)

    def entry(self, name: str) -> tuple[int, BodyEntry]:
        """Return index and entry of a body; `ResultsError` lists the choices if it does not exist."""
        for i, body in enumerate(self.head.bodies):
            if body.name == name:
                return i, body
        raise ResultsError(f"trajectory: no body {quoted(name)}{nearest(name, self.body_names)}")

    def body(self, name: str) -> BodyMotion:
        """Return the motion of a body."""
        i, entry = self.entry(name)
        n, u0 = entry.n_q, entry.u0
        u, u_dot = self.source.read("u"), self.source.read("u_dot")
        return BodyMotion(
            t=self.t,
            r=self.source.read("position")[:, i],
            p=self.source.read("euler_parameters")[:, i],
            q=self.source.read("q")[:, entry.q0 : entry.q0 + n],
            v=u[:, u0 : u0 + 3],
            omega_B=u[:, u0 + 3 : u0 + 6],
            q_dot=u[:, u0 + 6 : u0 + 6 + n],
            v_dot=u_dot[:, u0 : u0 + 3],
            omega_B_dot=u_dot[:, u0 + 3 : u0 + 6],
            q_ddot=u_dot[:, u0 + 6 : u0 + 6 + n],
        )

    def state(self, i_time: int) -> State:
        """Return the state at an output time (-1: the last), for example as the initial state of another motion.

        The other motion continues the states of elements and user forces, the counted angles (`State.w`,
        `State.angle`), and the errors that the watch has found up to the last time (`State.watched`).
        """
        r, p, q, u, w = (self.source.read(name)[i_time] for name in ("position", "euler_parameters", "q", "u", "w"))
        angle = None if self.head.angles is None else self.source.read("angle")[i_time]
        is_last = i_time in (-1, len(self.t) - 1)
        return State(r, p, q, u, w, angle, watched=self.head.summary.get("watched") if is_last else None)

    def ground(self, connection: str) -> BodyMotion | None:
        """Return the motion of the ground side of a connection; None if it is fixed, as in every computed motion."""
        return None

    def unknowns(self, chosen: Sequence[int]) -> Array:
        """Return some unknowns of connections by their numbers, (n_t, len(chosen))."""
        return self.source.read("w")[:, list(chosen)]

    def reaction(self, name: str) -> Reaction:
        """Return force and moment that a joint or spring-damper exerts on its marker A."""
        if name not in self.connection_names:
            raise ResultsError(f"trajectory: no joint or spring {quoted(name)}{nearest(name, self.connection_names)}")
        c = self.connection_names.index(name)
        w = self.unknowns(range(self.head.w0[c], self.head.w0[c + 1]))
        moment = w[:, 3:6] if w.shape[1] >= 6 else np.zeros((len(w), 3))
        return Reaction(w[:, :3], moment)

    def drift(self, name: str) -> Drift:
        """Return the constraint error of a joint."""
        if name not in self.head.joints:
            raise ResultsError(f"trajectory: no joint {quoted(name)}{nearest(name, self.head.joints)}")
        return Drift(*self.source.read("drift")[:, self.head.joints.index(name)].T)

    @cached_property
    def energies(self) -> Energies:
        """Energies of the system over time."""
        d = self.source.read("diagnostics")
        return Energies(d[:, 0], d[:, 1], d[:, 2], d[:, 3], d[:, 10], d[:, 11])

    @property
    def linear_momentum(self) -> Array:
        """Linear momentum in ground axes, (n_t, 3) [kg m/s]."""
        return self.source.read("diagnostics")[:, 4:7]

    @property
    def angular_momentum(self) -> Array:
        """Angular momentum about the ground origin, in ground axes, (n_t, 3) [kg m²/s]."""
        return self.source.read("diagnostics")[:, 7:10]


def read_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Return the trajectory in a results file, or the completed part of an interrupted run (`is_complete` is False).

    Parameters
    ----------
    path
        Name of the results file.

    Raises
    ------
    ResultsError
        If there is no such file, or it is of another kind, of a newer version, or damaged.
    """
    head, source, is_complete = open_results(path)
    try:
        notes = notes_from_json(validity_text(Path(path)))
    except ValueError as error:
        raise ResultsError(f"{path}: attribute 'validity': {error}; the file is damaged") from error
    return Trajectory(head, source, is_complete, Path(path), notes)
