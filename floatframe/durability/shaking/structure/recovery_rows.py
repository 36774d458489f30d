"""Rows of a recovery table of a body as outputs: element forces, stresses and motions requested at the reduction.

y = D_0 z + D_1 z_dot + D_2 z_ddot + L p (`cms.body.RecoveryTable`), z = (d, theta, q). If an interface is the only one
of its base, its loads are p = W lam, the force of the base, with W from the point of the base to that of the interface;
other forces are inputs. The rigid motion with the first base is subtracted from positions and velocities.
"""

import numpy as np
import scipy.linalg as la

from cms.body.recovery_table import RecoveryTable
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import STRESS_COMPONENTS, Array
from fe_models.foundation.words import nearest, quoted
from floatframe.durability.shaking.structure.model import DIRECTIONS, Base, Output, rigid_rows
from floatframe.durability.shaking.structure.places import Observed
from floatframe.errors import ModelError

__all__ = ["interface_loads", "recovery_outputs", "recovery_table"]

WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")


def recovery_table(body: ReducedBody, each: Observed) -> RecoveryTable:
    """Return the table of an output; `ModelError` with the nearest name if there is none."""
    if each.recovery not in body.recovery:
        raise ModelError(
            f"shake: output {each.name!r}: body {body.name!r} has no recovery table {quoted(str(each.recovery))}"
            f"{nearest(str(each.recovery), list(body.recovery))}"
        )
    return body.recovery[str(each.recovery)]


def recovery_outputs(each: Observed, table: RecoveryTable) -> list[Output]:
    """Return the outputs of a table: kinds by quantity and component, the six components of a stress as such."""
    outputs = []
    for k, (label, quantity, component, unit) in enumerate(
        zip(table.labels, table.quantities, table.components, table.units, strict=True)
    ):
        kind = quantity
        if quantity in ("acceleration", "displacement") and component.startswith("r"):
            kind = {"acceleration": "angular acceleration", "displacement": "rotation"}[quantity]
        elif quantity == "stress" and not is_whole(table, k):
            kind = "stress component"
        elif "force" in quantity and component[-2:-1].lower() == "m":
            kind = "moment"
        elif "force" in quantity:
            kind = "force"
        group = label.removesuffix(f" {component}")
        outputs.append(Output(label, kind, unit, group, f"recovery {each.recovery}"))
    return outputs


def is_whole(table: RecoveryTable, k: int) -> bool:
    """Return whether a row begins the six components of a stress."""
    if table.components[k] not in STRESS_COMPONENTS:
        return False
    first = k - STRESS_COMPONENTS.index(table.components[k])
    return first >= 0 and table.components[first : first + 6] == STRESS_COMPONENTS


def interface_loads(
    body: ReducedBody, table: RecoveryTable, bases: tuple[Base, ...], forces: tuple[str, ...]
) -> tuple[Array, Array]:
    """Return the response to the forces of the bases, (n_rows, 6 n_bases), and to further forces, (n_rows, n_forces).

    Raises
    ------
    ModelError
        If a base holds several interfaces and rows depend on how its force is shared among them.
    """
    A = la.block_diag(body.frame.axes, body.frame.axes).T  # from mesh axes to axes of B

    def columns(name: str) -> Array:
        wanted = [f"{name} {component}" for component in WRENCH]
        if not set(wanted) <= set(table.loads):
            return np.zeros((table.n_rows, 6))
        return np.asarray(table.static[:, [table.loads.index(load) for load in wanted]] @ A)

    of_bases = np.zeros((table.n_rows, 6 * len(bases)))
    for k, base in enumerate(bases):
        own = [columns(name) for name in base.holds]
        if len(own) > 1 and any(part.any() for part in own):
            raise ModelError(
                f"shake: recovery {table.name!r}: its rows depend on how the force of base {base.name!r} is shared "
                "among "
                f"{', '.join(base.holds)}; give each interface a base of its own, or make the table without loads at "
                "these interfaces"
            )
        if own:
            interface = body.interface(base.holds[0])
            point = body.frame.origin + body.frame.axes @ interface.position
            of_bases[:, 6 * k : 6 * k + 6] = own[0] @ np.linalg.inv(rigid_rows(point, base).T)
    of_forces = np.zeros((table.n_rows, len(forces)))
    for k, force in enumerate(forces):
        if force in table.loads:
            of_forces[:, k] = table.static[:, table.loads.index(force)]
        elif not force.startswith("load case "):
            name, _, direction = force.rpartition(":")
            of_forces[:, k] = columns(name)[:, DIRECTIONS.index(direction)]
    return of_bases, of_forces
