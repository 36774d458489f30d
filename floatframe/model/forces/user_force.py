"""User forces: expressions or functions of coordinates, time and their own states (control).

Evaluated in `floatframe.engine.kernels.connections.user_force`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.coordinates import Coordinate, coordinate_of
from floatframe.model.checked_values import number
from floatframe.model.functions.expressions import CONSTANTS, FUNCTIONS, compile_expression
from floatframe.model.functions.time_functions import NOT_OF_TIME, TimeFunction
from floatframe.model.functions.time_switches import TimeParts, time_parts

__all__ = ["UserForce"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class UserForce:
    """Forces Q along coordinates x, and states z with z_dot = g, as functions of t, x, x_dot and z.

    In expressions (see `functions.expressions`), `phi` is the value of the coordinate of that name, `phi_dot` is its
    rate, and `t` is the time. States, parameters and tables have their own names:

        UserForce("pid", {"phi": "hub.angle"},
                  forces={"phi": "-kp*(phi - aim(t)) - kd*phi_dot - ki*e"},
                  rates={"e": "phi - aim(t)"}, states={"e": 0.0},
                  parameters={"kp": 40.0, "kd": 4.0, "ki": 10.0}, functions={"aim": smooth_step(0, 1, 0, 0.5)})

    With a function, `forces` names the coordinates along which forces act. It is called as function(t, x, v, z, Q,
    z_dot) with arrays in the order of coordinates and states, and writes Q, (n_forces,), and z_dot, (n_states,). A
    function compiled by `numba.njit` runs at full speed, a Python function slowly. Its derivatives are computed by
    finite differences. It must depend only on its arguments, because it is called more than once per step.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    coordinates
        Observed coordinates, along which forces may act, by name; "hub.angle" is that of a joint.
    forces
        Expressions by coordinate; with `function`, the names of the coordinates.
    rates
        Expressions of the rates of the states.
    states
        Initial values of the states.
    parameters
        Constants in expressions.
    functions
        Functions of one variable in expressions.
    function
        Function for forces and rates, in place of expressions.
    knots
        Times at which the function jumps; steps of a run end there [s].
    switches
        Expressions at whose zeros forces and rates jump. In other expressions, the name of a switch stands for its
        sign, 1 (also at zero) or -1. The sign is constant within a step, and steps of a run end at the zeros.
    length
        Length scale on which the function changes [m]; None: the size of the smaller body.
    """

    name: str
    coordinates: Mapping[str, Coordinate | str]
    forces: Mapping[str, str] | Sequence[str] = field(default_factory=dict)
    rates: Mapping[str, str] = field(default_factory=dict)
    states: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    functions: Mapping[str, TimeFunction] = field(default_factory=dict, metadata=NOT_OF_TIME)
    function: Callable[..., None] | None = None
    knots: Sequence[float] = ()
    switches: Mapping[str, str] = field(default_factory=dict)
    length: float | None = None

    def __post_init__(self) -> None:
        where = f"force {self.name!r}"
        if not isinstance(self.coordinates, Mapping) or not self.coordinates:
            raise ModelError(f"{where}: coordinates: expected a dict with at least one coordinate by name")
        coordinates = {k: coordinate_of(f"{where}: coordinates: {k}", each) for k, each in self.coordinates.items()}
        object.__setattr__(self, "coordinates", coordinates)
        require_words(where, self.inputs)
        require_words(where, [*self.inputs, *self.parameters])
        require_words(where, [*self.inputs, *self.parameters, *self.functions])
        require_words(where, [*self.inputs, *self.parameters, *self.functions, *self.switches])
        for part in ("states", "parameters"):
            values = {k: number(f"{where}: {part}: {k}", v) for k, v in getattr(self, part).items()}
            object.__setattr__(self, part, values)
        object.__setattr__(self, "knots", tuple(number(f"{where}: knots", each) for each in self.knots))
        if self.length is not None:
            object.__setattr__(self, "length", number(f"{where}: length", self.length, above=0.0))
        for key, function in self.functions.items():
            if not isinstance(function, TimeFunction):
                raise ModelError(
                    f"{where}: functions: {key}: expected a function of floatframe.functions, got {function!r}"
                )
        for key in self.forces:
            if key not in self.coordinates:
                raise ModelError(f"{where}: forces: no coordinate {key!r}; choices: {', '.join(self.coordinates)}")
        self._either(where)

    def _either(self, where: str) -> None:
        """Raise `ModelError` unless either all expressions or one function are given."""
        if self.function is not None:
            if not callable(self.function):
                raise ModelError(f"{where}: function: expected a callable, got {self.function!r}")
            if isinstance(self.forces, Mapping) or self.rates or self.parameters or self.functions or self.switches:
                raise ModelError(
                    f"{where}: with a function, forces names coordinates, as in forces=('phi',), and there are no "
                    "rates, parameters, functions and switches"
                )
            return
        if not isinstance(self.forces, Mapping):
            raise ModelError(f"{where}: forces: expected expressions by coordinate, or a function, got {self.forces!r}")
        if set(self.rates) != set(self.states):
            raise ModelError(
                f"{where}: expected a rate and an initial value for each state, got rates of "
                f"{sorted(self.rates)} and states {sorted(self.states)}"
            )
        if not self.forces and not self.rates:
            raise ModelError(f"{where}: expected forces or states, got none")

    @property
    def inputs(self) -> list[str]:
        """Names of the inputs of expressions, in order: t, coordinates, their rates, states."""
        names = list(self.coordinates)
        return ["t", *names, *(f"{name}_dot" for name in names), *self.states]

    def parts_of_time(self) -> TimeParts:
        """Return the parts of the expressions that depend only on time."""
        parts = TimeParts()
        if self.function is not None or not isinstance(self.forces, Mapping):
            return parts
        numbers = {key: k for k, key in enumerate(self.functions)}
        for text in (*self.forces.values(), *self.rates.values()):
            where = f"force {self.name!r}"
            tape = compile_expression(
                where, text, self.inputs, parameters=self.parameters, functions=numbers, switches=self.switches
            )
            parts += time_parts(tape, {0: np.asarray}, list(self.functions.values()))
        return parts


def require_words(where: str, names: Sequence[str]) -> None:
    """Raise `ModelError` unless all names are valid in an expression and unique."""
    for k, name in enumerate(names):
        if not isinstance(name, str) or not name.isidentifier():
            raise ModelError(f"{where}: expected a name of letters, digits and _, got {name!r}")
        if name in names[:k] or name in CONSTANTS or name in FUNCTIONS:
            raise ModelError(f"{where}: the name {name!r} is used twice, or is the name of a function; choose another")
