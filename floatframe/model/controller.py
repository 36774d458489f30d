"""Sampled controllers: functions of measured values, called at a fixed period, with constant outputs in between.

    pid = Controller("pid", period=1e-3, inputs=["hub.angle", "hub.angle.rate"], outputs=["motor"],
                     function=law, state=[0.0])

    def law(t, x, state):
        e = aim(t) - x[0]
        return 40.0 * e - 4.0 * x[1] + 10.0 * state[0], state + 1e-3 * e

At the times t_k = t_start + k period of a run, the inputs are measured, the function is called once, and its outputs
act from there to t_(k+1): the motor of a joint force, the factor of another force.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, GivenArrayOrNone, frozen, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["Controller"]

MATRICES = ("A", "B", "C", "D", "dt")  #: attributes of a discrete state space


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Controller:
    """A sampled controller with memory.

    Parameters
    ----------
    name
        Name of the controller, unique in the system.
    period
        Time between two calls, a whole multiple of the step size of a run [s].
    inputs
        Measured values, the argument x of the function: columns of sensors, "tip.x", and coordinates of joints,
        "hub.angle" or "hub.angle.rate".
    outputs
        Names of forces, "motor" or "motor.torque": the output is the motor of a joint force (in place of its own), or
        the factor of a point force or a body load.
    function
        Called as function(t, x) and returns the outputs, (n_outputs,), or one number; with `state` as function(t, x,
        state), and returns the outputs and the next state. The array x is (n_inputs,).
    state
        Memory at the start, an array that keeps its shape; None: the controller has none.

    Raises
    ------
    ModelError
        If a name or a number is impossible.
    """

    name: str
    period: float
    inputs: Sequence[str]
    outputs: Sequence[str]
    function: Callable[..., Any]
    state: GivenArrayOrNone = given(None)

    def __post_init__(self) -> None:
        where = f"controller {self.name!r}"
        object.__setattr__(self, "period", number(f"{where}: period", self.period, above=0.0))
        for part in ("inputs", "outputs"):
            names = getattr(self, part)
            names = (names,) if isinstance(names, str) else tuple(names)
            if not names or len(set(names)) < len(names):
                raise ModelError(f"{where}: {part}: expected names, each once, got {list(names)}")
            object.__setattr__(self, part, names)
        if all(hasattr(self.function, part) for part in MATRICES):
            raise ModelError(
                f"{where}: function: got a state space; take Controller.of_state_space({self.name!r}, model, "
                "inputs=..., outputs=...)"
            )
        if not callable(self.function):
            raise ModelError(f"{where}: function: expected a callable, got {self.function!r}")
        if self.state is not None:
            state = np.asarray(self.state, dtype=float)
            if not np.isfinite(state).all():
                raise ModelError(f"{where}: state: expected finite numbers, got {state.tolist()}")
            object.__setattr__(self, "state", frozen(state))

    @classmethod
    def of_state_space(
        cls, name: str, model: Any, *, inputs: Sequence[str], outputs: Sequence[str], state: Array | None = None
    ) -> "Controller":
        """Return the controller u = C z + D x, z_next = A z + B x of a discrete state space.

        Parameters
        ----------
        name
            Name of the controller.
        model
            A discrete state space of python-control or scipy.signal: matrices A, B, C, D, and the period dt.
        inputs, outputs
            Names of the inputs and outputs, in the order of the model.
        state
            Initial state z; None: zero.

        Raises
        ------
        ModelError
            If the model is not discrete with a period, or the numbers of inputs and outputs differ from it.
        """
        where = f"controller {name!r}"
        missing = [part for part in MATRICES if not hasattr(model, part)]
        if missing:
            raise ModelError(
                f"{where}: model: expected a discrete state space with A, B, C, D and dt, got {type(model).__name__}"
            )
        if isinstance(model.dt, bool) or not model.dt:
            raise ModelError(
                f"{where}: model: expected a discrete state space with a period, got dt = {model.dt}; sample it, as in "
                "control.sample_system(model, 1e-3)"
            )
        A, B, C, D = (np.atleast_2d(np.asarray(getattr(model, part), dtype=float)) for part in "ABCD")
        for part, words, n in ((inputs, "inputs", B.shape[1]), (outputs, "outputs", C.shape[0])):
            if not isinstance(part, str) and len(part) != n:
                raise ModelError(f"{where}: {words}: the model has {n}, got {len(part)}")
        z = np.zeros(len(A)) if state is None else np.asarray(state, dtype=float)
        if z.shape != (len(A),):
            raise ModelError(f"{where}: state: expected {len(A)} numbers, got shape {z.shape}")
        return cls(name, float(model.dt), inputs, outputs, lambda t, x, z: (C @ z + D @ x, A @ z + B @ x), z)

    @property
    def identity(self) -> tuple[Any, ...]:
        """The data that identify the controller, without its function."""
        start = None if self.state is None else self.state.tolist()
        return self.name, self.period, self.inputs, self.outputs, start

    def outputs_at(self, t: float, x: Array, state: Array | None) -> tuple[Array, Array | None]:
        """Call the function: return the outputs, (n_outputs,), and the next state.

        Raises
        ------
        ModelError
            If it raises an error, or returns no output, one of another size, or one that is not finite.
        """
        where = f"controller {self.name!r} at t = {t:.9g}"
        n = len(self.outputs)
        form = f"{n} output{'s' if n > 1 else ''}" + ("" if state is None else " and the next state")
        try:
            found = self.function(t, x) if state is None else self.function(t, x, state)
        except Exception as error:
            raise ModelError(f"{where}: its function raised {type(error).__name__}: {error}") from error
        if state is not None:
            if not isinstance(found, tuple) or len(found) != 2:
                raise ModelError(f"{where}: its function returned {kind_of(found)}; expected {form}")
            found, then = found
            after = array_of(f"{where}: the state that its function returned", then, state.shape)
        outputs = array_of(f"{where}: the output of its function", found, (n,), form)
        return outputs, None if state is None else after


def kind_of(value: Any) -> str:
    """Describe a returned value."""
    return "nothing" if value is None else f"{type(value).__name__} {value!r}"[:80]


def array_of(where: str, value: Any, shape: tuple[int, ...], expected: str = "") -> Array:
    """Return a finite array of a shape; one number stands for an array of one."""
    wanted = expected or f"an array of shape {shape}"
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"{where}: expected {wanted}, got {kind_of(value)}") from None
    if value is None or array.size != int(np.prod(shape)) or (array.ndim and array.shape != shape):
        raise ModelError(f"{where}: expected {wanted}, got {kind_of(value)}")
    if not np.isfinite(array).all():
        raise ModelError(f"{where}: expected finite numbers, got {array.tolist()}")
    return array.reshape(shape)
