"""The position, name and unit of each component of x, v and lambda."""

from collections.abc import Sequence
from dataclasses import dataclass

from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.errors import ModelError
from floatframe.model.joints.rows import is_held_length, is_held_velocity, kind_of

__all__ = ["Component", "Layout", "layout_of"]

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Component:
    """Name and unit of one component of a vector."""

    index: int
    owner: str  #: name of the body, joint or coupler
    name: str  #: name of the quantity
    unit: str

    def __str__(self) -> str:
        """Return the component as a line of a table."""
        return f"{self.index:5d}  {self.owner + ' ' + self.name:40s}  {self.unit}"


@dataclass(frozen=True)
class Layout:
    """The components of x, v and lambda, in their order."""

    x: tuple[Component, ...]  #: positions, (n_x,)
    v: tuple[Component, ...]  #: velocities, (n_v,); accelerations and rows of the residual have the same order
    lam: tuple[Component, ...]  #: constraint rows and their multipliers, (n_lam,)

    def index(self, vector: str, owner: str, name: str) -> int:
        """Return the index of a component in the vector "x", "v" or "lam".

        Raises
        ------
        ModelError
            If there is none; the message contains the nearest name.
        """
        components: Sequence[Component] = {"x": self.x, "v": self.v, "lam": self.lam}[vector]
        for component in components:
            if component.owner == owner and component.name == name:
                return component.index
        choices = [f"{component.owner} {component.name}" for component in components]
        asked = f"{owner} {name}"
        raise ModelError(f"layout: no component {quoted(asked)} of {vector}{nearest(asked, choices)}")

    def __str__(self) -> str:
        """Return the layout as a table."""
        parts = (("x", self.x), ("v", self.v), ("lambda", self.lam))
        return "\n".join(line for name, rows in parts for line in (f"{name} ({len(rows)},)", *map(str, rows)))


def layout_of(compiled: CompiledSystem, held: Sequence[int], units: Units) -> Layout:
    """Return the layout of a compiled system; `held`: indices of the constraint rows."""
    model = compiled.model
    m, s, F = units.length_symbol, units.time_symbol, units.force_symbol
    x: list[Component] = []
    v: list[Component] = []
    for i, body in enumerate(compiled.body_names):
        n = int(model.bodies.n_q[i])
        place = [(f"position {a}", m) for a in AXES] + [(f"euler parameter {a}", "1") for a in ("w", *AXES)]
        modal = f"{units.mass_symbol}^(1/2) {m}"
        x += named(len(x), body, [*place, *((f"mode {k + 1}", modal) for k in range(n))])
        rates = [(f"velocity {a}", f"{m}/{s}") for a in AXES] + [(f"omega {a}", f"rad/{s}") for a in AXES]
        v += named(len(v), body, [*rates, *((f"mode {k + 1} rate", f"{modal}/{s}") for k in range(n))])
    lam: list[Component] = []
    kinds = model.rows.kind
    counted: dict[str, int] = {}
    for row in held:
        owner = compiled.owners[row]
        counted[owner] = counted.get(owner, 0) + 1
        is_length = bool(is_held_length(kinds[row : row + 1])[0]) or bool(is_held_velocity(kinds[row : row + 1])[0])
        words = f"row {counted[owner]}: {kind_of(kinds[row]).name}"
        lam += named(len(lam), owner, [(words, F if is_length else f"{F} {m}")])
    return Layout(tuple(x), tuple(v), tuple(lam))


def named(first: int, owner: str, parts: Sequence[tuple[str, str]]) -> list[Component]:
    """Return the consecutive components of one owner."""
    return [Component(first + k, owner, name, unit) for k, (name, unit) in enumerate(parts)]
