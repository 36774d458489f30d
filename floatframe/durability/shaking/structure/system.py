"""A system on bases: its connections to the ground are moved, about the equilibrium at rest.

`linearize` returns the equations with the base motion as an input, and z relative to the quasi-static motion with the
base. Here they are transformed to the modes of (K, M), and the forces of each base are the sum of the reactions of its
connections.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import STRESS_COMPONENTS, Array
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.equilibrium import static_equilibrium
from floatframe.analyses.linear.channels import Column
from floatframe.analyses.linear.inputs import BaseMotion
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.snapshot import Equilibrium
from floatframe.durability.shaking.structure.body import force_outputs, unit_of
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.model import DIRECTIONS, Base, Output, ShakenModel, rigid_rows
from floatframe.durability.shaking.structure.places import Observed
from floatframe.durability.shaking.structure.recovery_rows import recovery_outputs
from floatframe.engine.compiling.markers import joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.forces import Gravity
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.sensors import (
    InterfaceForceSensor,
    PlaceSensor,
    ReactionSensor,
    RecoverySensor,
    SpringSensor,
    StressSensor,
)
from floatframe.results.sensors.measurement import unit_words
from floatframe.results.small_motions import rows as small_rows
from floatframe.results.small_motions.small_motions import SmallMotions

__all__ = ["bases_of_system", "shaken_system"]

MARKERS = ("marker_a", "marker_b")
SYMMETRIC = 1e-8  #: relative asymmetry of M and K that counts as rounding error
FREE = 1e-10  #: omega², relative to the highest one, below which a motion is free
ROUNDING = 1e-9  #: rounding error of a motion that the base carries rigidly


def grounded(system: System) -> dict[str, object]:
    """Return the joints and forces with a marker on the ground, by name."""
    named = [*system.joints, *(force for force in system.forces if not isinstance(force, Gravity))]
    return {each.name: each for each in named if any(is_ground(getattr(each, key, None)) for key in MARKERS)}


def is_ground(place: object) -> bool:
    """Whether a marker, or a body in its place, is on the ground."""
    if place is None:
        return False
    return body_name(place.body if isinstance(place, Marker) else place) == GROUND.name  # type: ignore[arg-type]


def bases_of_system(
    system: System, bases: Mapping[str, Sequence[str]] | str | None, points: Mapping[str, Array] | None = None
) -> tuple[Base, ...]:
    """Return the bases of a system, ground coordinates.

    Parameters
    ----------
    bases
        Joints, springs and bushings on the ground that each base holds, by name of the base; or one of their names;
        None: one base with all of them.
    points
        Reference point of a base by name; default: mean of the markers that it holds.
    """
    there = grounded(system)
    if not there:
        raise ModelError(
            f"shake: system {system.name!r} has no joint, spring or bushing on the ground that could move it"
        )
    if bases is None:
        bases = {"base": tuple(there)}
    elif isinstance(bases, str):
        bases = {bases: (bases,)}
    found = []
    for name, held in bases.items():
        for each in held:
            if each not in there:
                raise ModelError(
                    f"shake: base {name!r}: nothing on the ground is called {quoted(each)}{nearest(each, list(there))}"
                )
        held = tuple(held) or tuple(there)
        places = [marker_a(system, there[each], compiled_system(system).placed)[0] for each in held]
        found.append(Base(name, held, np.asarray((points or {}).get(name, np.mean(places, axis=0)), dtype=float)))
    taken = [each for base in found for each in base.holds]
    twice = sorted({each for each in taken if taken.count(each) > 1})
    if twice:
        raise ModelError(f"shake: {twice[0]!r} is held by two bases")
    return tuple(found)


def marker_a(system: System, connection: object, state: State) -> tuple[Array, float]:
    """Return the position of marker A, (3,), and the sign from its force to the base's force on the structure."""
    a, _ = joint_markers(system, connection, compiled_system(system).placed)  # type: ignore[arg-type]
    return marker_pose(a, state, n_q_of(system))[0], -1.0 if a.body < 0 else 1.0


class RecoveryFromBase(RecoverySensor):
    """Rows of a recovery table, with displacements and velocities relative to the first base."""

    def places_and_rates(self, small: SmallMotions, z: small_rows.Rows) -> tuple[small_rows.Rows, small_rows.Rows]:
        """Return the motion of the body relative to the first base, whose inputs come first, and its rate."""
        x = np.array(z.x)
        for k, base in enumerate(small.bases[: len(DIRECTIONS)]):
            x[:, small.n_u + k] -= x[:, : small.n_u] @ small.rigid(base)
        own = small.by_motion(x)
        return own, own.rate


@dataclass(frozen=True, eq=False)
class Rows:
    """Outputs as combinations of the outputs of the linearised system: y = W y_linear."""

    outputs: list[Output]
    columns: list[Column]
    weights: Array  #: W, (n_out, n_columns)
    is_relative: bool = (
        False  #: whether the rigid motion with the first base is subtracted, so that positions become displacements
    )


def shaken_system(
    system: System,
    bases: Sequence[Base],
    damping: Damping,
    observed: Sequence[Observed] = (),
    forces: Sequence[str] = (),
) -> ShakenModel:
    """Return a system on its bases, linear about its equilibrium at rest.

    Damping ratios replace all dampers. The damping of a mode then acts at the same places as its stiffness: a reaction
    contains 2 zeta/omega times the rate of its elastic part, and the net force of the bases is the rate of the
    momentum. With `own`, the dampers and the damping of the bodies act, and couple the modes.

    Raises
    ------
    ModelError
        If a motion remains free with fixed bases, or forces are circulatory (K is not symmetric).
    """
    where, bases = f"shake: system {system.name!r}", tuple(bases)
    if forces:
        raise ModelError(
            f"{where}: force {forces[0]!r}: forces in addition to the bases are supported only for single bodies"
        )
    about = static_equilibrium(system)
    inputs = [
        BaseMotion(f"{base.name}:{name}", np.eye(3)[k % 3], "translation" if k < 3 else "rotation", base.point,
                   None if len(bases) == 1 and set(base.holds) == set(grounded(system)) else base.holds)
        for base in bases
        for k, name in enumerate(DIRECTIONS)
    ]  # fmt: skip
    rows = [base_rows(system, base, about.state) for base in bases]
    total = sum(each.mass if hasattr(each, "mass") else each.reduced.moments.m for each in system.bodies)
    if len(bases) > 1:
        rows.append(net_rows(bases, rows, system))
    rows.append(mean_rows(rows[-1], float(total), system))
    rows += [row for each in observed for row in observed_rows(system, about, each)]
    columns = {column.name: column for row in rows for column in row.columns}
    linear, _ = linearize(system, about, inputs=inputs, outputs=list(columns.values())).with_mass()
    if linear.states:
        raise ModelError(
            f"{where}: state {linear.states[0]!r}: elements and user forces with states of their own are not supported "
            "in a modal structure; take forces without states, or integrate the motion"
        )
    require_symmetric(where, linear)
    omega, Z = modes(where, linear)
    C = (
        Z.T @ linear.C @ Z
        if damping.own
        else np.diag(2 * damping.ratios(omega / (2 * np.pi) / system.units.time) * omega)
    )
    B = np.stack([cleaned(Z.T @ b, Z.T, b) for b in (linear.B, linear.B_rate, linear.B_acceleration)])
    at = {name: k for k, name in enumerate(linear.outputs)}
    L = np.stack([linear.L, linear.L_rate, linear.L_acceleration])
    D = np.stack([linear.D, linear.D_rate, linear.D_acceleration])
    if not damping.own:  # removes the contribution of dampers from forces; velocities stay
        by_damper = [
            not is_velocity(system, columns[n], u) for n, u in zip(linear.outputs, linear.output_units, strict=True)
        ]
        B[1], L[1, by_damper], D[1, by_damper] = 0.0, 0.0, 0.0
    E_rows, D_rows = [], []
    for row in rows:
        chosen = [at[column.name] for column in row.columns]
        seen = L[:, chosen] @ Z
        if not damping.own:
            carried = [is_carried(column) for column in row.columns]
            seen[1, carried] += seen[0, carried] * (np.diag(C) / omega**2)
        e, d = row.weights @ seen, row.weights @ D[:, chosen]
        if row.is_relative:
            d[0, :, :6] -= rigid_rows(linear.output_values[chosen], bases[0])[:3]
        if len(bases) == 1 and row.outputs[0].kind in ("displacement", "rotation", "stress"):
            d[0][np.abs(d[0]) < ROUNDING * np.abs(row.weights).max()] = 0.0
        E_rows.append(e)
        D_rows.append(d)
    return ShakenModel(
        name=system.name,
        units=system.units,
        bases=bases,
        inputs=tuple(channel.name for channel in inputs),
        rates=np.full(len(inputs), 2),
        omega=omega,
        C=C,
        B=B,
        E=np.concatenate(E_rows, axis=1),
        D=np.concatenate(D_rows, axis=1),
        outputs=tuple(output for row in rows for output in row.outputs),
        mass=rigid_mass(linear, about.state, bases),
        notes=(f"system {system.name!r}: linear about its equilibrium at rest",),
    )


def is_carried(column: Column) -> bool:
    """Return whether an output is a connection force, which includes the damping force of a mode."""
    return isinstance(column.sensor, (ReactionSensor, InterfaceForceSensor)) or (
        isinstance(column.sensor, SpringSensor) and column.column == "tension"
    )


def is_velocity(system: System, column: Column, unit: str) -> bool:
    """Return whether an output is a velocity, which depends on rates even without dampers."""
    if isinstance(column.sensor, RecoverySensor):
        _, table, _ = column.sensor.found(system)
        return table.quantities[table.labels.index(column.column)] == "velocity"
    return unit in (unit_words(system.units, "speed"), unit_words(system.units, "angular speed"))


def cleaned(product: Array, left: Array, right: Array) -> Array:
    """Return a product with rounding errors set to zero, because rigid motions with a base have no stiffness."""
    bound = np.abs(left) @ np.abs(right)
    return np.where(np.abs(product) <= ROUNDING * bound, 0.0, product)


def require_symmetric(where: str, linear: LinearSystem) -> None:
    """Raise `ModelError` if mass or stiffness are not symmetric."""
    for name in ("M", "K"):
        matrix = np.asarray(getattr(linear, name))
        defect = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
        if defect > SYMMETRIC:
            raise ModelError(
                f"{where}: {name} about its equilibrium is not symmetric (by {defect:.1e}): follower forces or "
                "couplers feed energy in, so that it has no real modes; take `floatframe response` with a base motion "
                "as its input"
            )


def modes(where: str, linear: LinearSystem) -> tuple[Array, Array]:
    """Return angular frequencies and modes of unit mass with fixed bases."""
    M, K = ((np.asarray(a) + np.asarray(a).T) / 2 for a in (linear.M, linear.K))
    omega2, Z = la.eigh(K, M)
    free = int((omega2 <= FREE * omega2[-1]).sum())
    if free:
        raise ModelError(
            f"{where}: {free} motion{'s' if free > 1 else ''} with fixed bases without energy, or away from the "
            "equilibrium; hold them by joints or springs"
        )
    return np.sqrt(omega2), Z


def rigid_mass(linear: LinearSystem, state: State, bases: Sequence[Base]) -> Array:
    """Return the rigid mass matrix for the motions of the bases, (6 n, 6 n)."""
    carried = []
    for base in bases:
        parts = []
        for k, (rows, mass) in enumerate(linear.bodies()):
            motion = np.zeros((len(mass), 6))
            R = rotation_matrix(state.p[k])
            motion[:6] = la.block_diag(R.T, R.T) @ rigid_rows(state.r[k], base)
            parts.append(motion)
            assert rows.stop - rows.start == len(mass)
        carried.append(np.concatenate(parts))
    T = np.hstack(carried)
    M = la.block_diag(*(mass for _, mass in linear.bodies()))
    return np.asarray(T.T @ M @ T)


def base_rows(system: System, base: Base, state: State) -> Rows:
    """Return the force and moment of a base about its point: the sum of the reactions of its connections."""
    there = grounded(system)
    columns: list[Column] = []
    weights = np.zeros((6, 6 * len(base.holds)))
    for j, name in enumerate(base.holds):
        sensor = ReactionSensor(f"reaction of {name}", name)
        columns += [Column(sensor, f"{kind} {axis}") for kind in ("force", "moment") for axis in "xyz"]
        place, sign = marker_a(system, there[name], state)
        weights[:, 6 * j : 6 * j + 6] = sign * rigid_rows(place, base).T
    return Rows(force_outputs(base.name, "about its point", system.units), columns, weights)


def net_rows(bases: Sequence[Base], rows: Sequence[Rows], system: System) -> Rows:
    """Return force and moment of all bases about the point of the first."""
    weights = np.hstack(
        [rigid_rows(base.point, bases[0]).T @ row.weights for base, row in zip(bases, rows, strict=True)]
    )
    columns = [column for row in rows for column in row.columns]
    return Rows(force_outputs("net", f"about the point of base {bases[0].name}", system.units), columns, weights)


def mean_rows(net: Rows, mass: float, system: System) -> Rows:
    """Return the net force divided by the mass."""
    unit = unit_of("acceleration", system.units)
    outputs = [
        Output(
            f"mean acceleration {axis}",
            "acceleration",
            unit,
            "mean acceleration",
            "net force of the bases divided by the mass",
        )
        for axis in DIRECTIONS[:3]
    ]
    return Rows(outputs, net.columns, net.weights[:3] / mass)


def observed_rows(system: System, about: Equilibrium, each: Observed) -> list[Rows]:
    """Return the outputs of a place on a body of the system, or of a sensor."""
    where = f"shake: output {each.name!r}"
    if each.sensor is not None:
        return [sensor_rows(system, about, each)]
    if each.recovery is not None:
        raise ModelError(f"{where}: recovery tables exist only for single bodies; this is a system")
    if each.body is None:
        raise ModelError(
            f"{where}: expected body = the name of a body, one of {', '.join(body.name for body in system.bodies)}"
        )
    way = {key: getattr(each, key) for key in ("position", "node", "element", "set") if getattr(each, key) is not None}
    words = ", ".join([each.body, *([each.interface] if each.interface else []), *(f"{k} {v}" for k, v in way.items())])
    found = []
    for wish in each.quantities:
        group, unit = f"{each.name} {wish}", unit_of(wish, system.units)
        if wish == "stress":
            stress = StressSensor(group, each.body, point=each.point, tolerance=each.tolerance, **way)
            outputs = [
                Output(f"{group} {c}", wish, unit, group, f"{words}, axes of the body") for c in STRESS_COMPONENTS
            ]
            found.append(Rows(outputs, [Column(stress, c) for c in STRESS_COMPONENTS], np.eye(6)))
            continue
        marker = Marker(each.body, each.interface, tolerance=each.tolerance, **way)
        place = PlaceSensor(group, marker, "position" if wish == "displacement" else "acceleration")
        outputs = [Output(f"{group} {axis}", wish, unit, group, words) for axis in "xyz"]
        found.append(Rows(outputs, [Column(place, axis) for axis in "xyz"], np.eye(3), wish == "displacement"))
    return found


def sensor_rows(system: System, about: Equilibrium, each: Observed) -> Rows:
    """Return all columns of a sensor of the system that are linear here."""
    sensor = next((own for own in system.sensors if own.name == each.sensor), None)
    if sensor is None:
        names = [own.name for own in system.sensors]
        raise ModelError(
            f"shake: output {each.name!r}: no sensor {quoted(str(each.sensor))}{nearest(str(each.sensor), names)}"
        )
    named: dict[str, Output] = {}
    if isinstance(sensor, RecoverySensor):
        sensor = RecoveryFromBase(sensor.name, sensor.body, sensor.table, sensor.rows)
        named = {output.name: output for output in recovery_outputs(each, sensor.found(system)[1])}
    linear = linearize(system, about, inputs=[], outputs=[sensor])  # type: ignore[list-item]
    outputs, columns = [], []
    for name, unit in zip(linear.outputs, linear.output_units, strict=True):
        column = name.removeprefix(f"{sensor.name}.")
        kind, group = kind_of(unit, system), each.name
        if column in named:
            kind, group = named[column].kind, f"{each.name} {named[column].group}"
        outputs.append(Output(f"{each.name} {column}", kind, unit, group, f"sensor {sensor.name}"))
        columns.append(Column(sensor, column, name=f"shaken {name}"))  # type: ignore[arg-type]
    return Rows(outputs, columns, np.eye(len(columns)))


def kind_of(unit: str, system: System) -> str:
    """Return the kind of an output by its unit."""
    kinds = ("acceleration", "angular acceleration", "displacement", "rotation", "force", "moment", "stress")
    return next((kind for kind in kinds if unit_of(kind, system.units) == unit), "sensor")
