"""The table [run] of a system file: the integrator of the motion and its options."""

import os
from dataclasses import dataclass, replace
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.toml_file import PathBeside, Table, choice
from fe_models.foundation.words import nearest
from floatframe.analyses.equilibrium import static_equilibrium
from floatframe.engine.compiling.file_frames import state_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.tree.formulation import FORMULATIONS
from floatframe.errors import SystemFileError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha, hht, newmark, trapezoidal
from floatframe.integrators.integrator import Integrator
from floatframe.integrators.registry import INTEGRATORS
from floatframe.integrators.relative import RelativeGeneralizedAlpha, in_formulation
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.trajectory import read_trajectory
from floatframe.simulation.foreign_units import Coupling
from floatframe.simulation.step_watch import WATCHES

__all__ = ["RunOptions", "RunSection", "formulation_of", "required_run"]

MOST_TIMES = 1e8  #: largest number of output times of a driven motion
STARTS = ("placed", "equilibrium")
NOT_OF_A_METHOD = ("t_end", "h", "output_every", "scheme", "formulation", "start", "continues", "watch")
#: schemes that also work in joint coordinates
OF_BOTH_FORMULATIONS = (GeneralizedAlpha, hht, newmark, trapezoidal)


def keys_of(scheme: str) -> tuple[str, ...]:
    """Return the keys of the method of that name; a special case of generalized-alpha has its keys too."""
    names = [name for name in signature(INTEGRATORS[scheme]).parameters if name not in ("options", "parameters")]
    if "options" in signature(INTEGRATORS[scheme]).parameters:
        names += [name for name in signature(GeneralizedAlpha).parameters if name not in ("rho_inf", "parameters")]
    return tuple(names)


class RunSection(Table):
    """[run]: the integrator and its options."""

    t_end: Annotated[float, Field(gt=0)] = Field(description="a number above 0, the end time")
    h: Annotated[float, Field(gt=0)] = Field(description="a number above 0, the step size")
    output_every: Annotated[int, Field(ge=1)] = Field(
        1, description="a whole number above 0, the number of steps between written results"
    )
    scheme: choice("scheme", lambda: tuple(INTEGRATORS)) = Field(  # type: ignore[valid-type]
        "generalized-alpha", description=f"one of {', '.join(INTEGRATORS)}"
    )
    formulation: choice("formulation", lambda: FORMULATIONS) = Field(  # type: ignore[valid-type]
        "absolute", description=f"one of {', '.join(FORMULATIONS)}: coordinates of bodies, or of joints"
    )
    rho_inf: Annotated[float, Field(ge=0, le=1)] | None = Field(
        None, description="a number between 0 and 1, the spectral radius at infinite frequency"
    )
    alpha: Annotated[float, Field(ge=-1 / 3, le=0)] | None = Field(
        None, description="a number between -1/3 and 0, numerical damping of the scheme hht"
    )
    beta: Annotated[float, Field(gt=0)] | None = Field(
        None, description="a number above 0, a parameter of the scheme newmark"
    )
    gamma: Annotated[float, Field(ge=0.5)] | None = Field(
        None, description="a number, 1/2 or more, a parameter of the scheme newmark"
    )
    rtol: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        None, description="a number between 0 and 1, the relative tolerance of the scheme ida"
    )
    atol: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        None, description="a number between 0 and 1, the absolute tolerance of the scheme ida"
    )
    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        None, description="a number between 0 and 1, the tolerance of Newton's method"
    )
    max_iterations: Annotated[int, Field(ge=1)] | None = Field(
        None, description="a whole number above 0, the most iterations of Newton's method in a step"
    )
    error_tolerance: Annotated[float, Field(gt=0)] | None = Field(
        None,
        description="a number above 0, error of a body in a step over the size of its assembly; none: fixed steps",
    )
    h_min: Annotated[float, Field(gt=0)] | None = Field(
        None,
        description="a number above 0, the smallest step when one that fails or meets a contact is divided",
    )

    start: choice("start", lambda: STARTS) = Field(  # type: ignore[valid-type]
        "placed",
        description=f"one of {', '.join(STARTS)}: bodies as placed, or in static equilibrium with their velocities",
    )
    continues: PathBeside | None = Field(
        None, alias="from", description="a results file (.h5): the run begins in its last state, instead of start"
    )
    watch: choice("watch", lambda: WATCHES) = Field(  # type: ignore[valid-type]
        "stop",
        description="stop, tell or off: what a run does if its steps distort the motion or add energy to it",
    )

    @model_validator(mode="after")
    def _fits_the_scheme(self) -> "RunSection":
        allowed = keys_of(self.scheme)
        if self.formulation != "absolute" and INTEGRATORS[self.scheme] not in OF_BOTH_FORMULATIONS:
            raise ValueError(f"the scheme {self.scheme} works only in absolute coordinates; remove formulation")
        for key in type(self).model_fields:
            if key not in NOT_OF_A_METHOD and getattr(self, key) is not None and key not in allowed:
                raise ValueError(f"the scheme {self.scheme} has no key {key}{nearest(key, allowed)}")
        return self

    def options(self) -> "RunOptions":
        """Return the options that the table describes."""
        parameters: dict[str, Any] = {
            key: getattr(self, key) for key in keys_of(self.scheme) if getattr(self, key, None) is not None
        }
        integrator = in_formulation(INTEGRATORS[self.scheme](**parameters), self.formulation)
        return RunOptions(
            self.t_end, self.h, self.output_every, integrator,
            watch=self.watch, start=self.start, continues=self.continues,
        )  # fmt: skip


@presented
@dataclass(frozen=True)
class RunOptions:
    """The options in the table [run]."""

    t_end: float
    h: float
    output_every: int
    integrator: Integrator
    coupling: Coupling | None = None  #: coupling to FMUs of other programs; None: explicit, in steps of h
    watch: str = "stop"  #: what a run does if its steps distort the motion, see `integrate`
    start: str = "placed"  #: "placed", or "equilibrium": at rest under all forces, with the velocities as placed
    continues: Path | None = None  #: results file in whose last state the run begins

    def start_state(self, system: System) -> State | None:
        """Return the state in which a run of the system begins; None: the bodies as placed.

        Raises
        ------
        ConvergenceError
            If there is no equilibrium near the bodies as placed.
        SystemFileError
            If the results file has other units, bodies, modes, joints or springs.
        """
        if self.continues is not None:
            return last_state_of(self.continues, system)
        if self.start == "placed":
            return None
        compiled = compiled_system(system)
        found = static_equilibrium(system, formulation=formulation_of(self))
        return replace(found.state, u=state_of_file(compiled, compiled.placed).u)

    def output_times(self) -> Array:
        """Return the output times of a run, (n_t,) [s]; `SystemFileError` if there are too many for the memory."""
        wanted = self.t_end / (self.h * self.output_every)
        if not wanted <= MOST_TIMES:
            raise SystemFileError(
                f"run: t_end = {self.t_end:g} with h = {self.h:g} and output_every = {self.output_every} are "
                f"{wanted:.1e} times, expected up to {MOST_TIMES:.0e}; choose a smaller t_end or a greater h"
            )
        return np.linspace(0.0, self.t_end, max(1, round(wanted)) + 1)


def last_state_of(path: Path, system: System) -> State:
    """Return the last state in a results file; `SystemFileError` if it does not fit the system."""
    motion, compiled = read_trajectory(path), compiled_system(system)
    n_q = compiled.model.bodies.n_q
    for kind, expected, found in (
        ("units", [system.units.name], [motion.units.name]),
        (
            "bodies",
            [f"{body.name} ({n} modes)" for body, n in zip(system.bodies, n_q, strict=True)],
            [f"{entry.name} ({entry.n_q} modes)" for entry in motion.head.bodies],
        ),
        ("joints and springs", compiled.joint_names + compiled.spring_names, motion.connection_names),
        ("unknowns of connections", [str(compiled.model.connections.w0[-1])], [str(motion.head.w0[-1])]),
    ):
        if list(expected) != list(found):
            raise SystemFileError(
                f"run.from: {path}: expected {kind} {', '.join(expected) or 'none'}; the file has "
                f"{', '.join(found) or 'none'}"
            )
    return motion.state(-1)


def formulation_of(run: RunOptions | None) -> str:
    """Return the formulation of a run, which its analyses use too; "absolute" if there is no run."""
    return "relative" if run is not None and isinstance(run.integrator, RelativeGeneralizedAlpha) else "absolute"


def required_run(run: RunOptions | None, path: str | os.PathLike[str], *, begins_there: bool = False) -> RunOptions:
    """Return the run of a system file.

    Parameters
    ----------
    run
        The run, if the file has a table [run].
    path
        The file.
    begins_there
        Whether the caller begins in `RunOptions.start_state`, or integrates no motion.

    Raises
    ------
    SystemFileError
        If there is no run, or if it does not begin with the bodies as placed although the caller does.
    """
    if run is None:
        raise SystemFileError(f"{path}: run: missing; expected a table [run] with t_end and h, for a motion over time")
    if not begins_there and (run.start != "placed" or run.continues is not None):
        key = "start" if run.continues is None else "from"
        raise SystemFileError(f"{path}: run.{key}: this computation begins with the bodies as placed; remove the key")
    return run
