"""Sensors of stress and strain on flexible bodies, from all stress modes of their files, including static modes."""

from dataclasses import dataclass, replace

import numpy as np

from cms.body.address import KINDS_OF_ADDRESS, Address, FoundNodes
from cms.body.reduced_body import ReducedBody
from cms.body.stress import stress_of, von_mises
from cms.errors import BodyError
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.arrays import STRESS_COMPONENTS, Array, GivenArrayOrNone, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, number_list, quoted
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.checked_values import array_of_shape, number, unit_vector
from floatframe.model.system import System
from floatframe.results.place_motion import largest_von_mises, stress_modes
from floatframe.results.recovery import require_same_modes
from floatframe.results.sensors.linear_columns import differentiated
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.sensors.places import found_at
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["ElongationSensor", "StrainGauge", "StressSensor", "VonMisesSensor", "address_of"]


def flexible_body(system: System, sensor: str, name: str) -> FlexibleBody:
    """Return a flexible body of the system; `ModelError` suggests the closest name if it does not exist."""
    choices = [body.name for body in system.bodies if isinstance(body, FlexibleBody)]
    for body in system.bodies:
        if body.name == name and isinstance(body, FlexibleBody):
            return body
    raise ModelError(f"sensor {sensor!r}: no flexible body {quoted(name)}{nearest(name, choices)}")


def modes_at(
    body: FlexibleBody, sensor: str, position: Array | None, point: str | None, *, address: Address | None = None
) -> Array:
    """Return the stress modes, (6, n_q), at a kept node given by position or address, or at a named stress point."""
    reduced = body.reduced
    if point is None:
        given = Address(position=position) if address is None else address
        modes = stress_modes(body.name, reduced)
        found = found_at(body, f"sensor {sensor!r}", given, of_stress=True)
        if len(found.rows) > 1:
            raise ModelError(
                f"sensor {sensor!r}: {found.asked} has stress at {len(found.rows)} points of the surface; select one "
                "by its position, or name a stress point"
            )
        return np.asarray(modes[found.rows[0]])
    names = () if reduced.point_stress is None else reduced.point_stress.names
    if reduced.point_stress is None or point not in names:
        raise ModelError(
            f"sensor {sensor!r}: body {body.name!r} has no stress point {quoted(point)}{nearest(point, list(names))}"
        )
    return np.asarray(reduced.point_stress.modes[list(names).index(point)])


def address_of(sensor: "StressSensor | StrainGauge | VonMisesSensor") -> Address | None:
    """Return the surface address at which a sensor measures; None for a stress point or the whole body.

    Raises
    ------
    ModelError
        If several places are given.
    """
    given = {kind: value for kind in KINDS_OF_ADDRESS if (value := getattr(sensor, kind, None)) is not None}
    if not given:
        return None
    try:
        return Address(**given, tolerance=getattr(sensor, "tolerance", TOLERANCE))
    except BodyError as error:
        raise ModelError(f"sensor {sensor.name!r}: {error}") from error


def require_one_place(sensor: "StressSensor | StrainGauge") -> None:
    """Raise `ModelError` unless a sensor has either a stress point or one position on the surface."""
    if (address_of(sensor) is None) == (sensor.point is None):
        raise ModelError(
            f"sensor {sensor.name!r}: expected either a position or a stress point, or a node, element or set"
        )


def with_position(sensor: "StressSensor | StrainGauge") -> None:
    """Check and freeze the position of a sensor, if it has one."""
    if sensor.position is not None:
        position = array_of_shape(f"sensor {sensor.name!r}: position", sensor.position, (3,))
        object.__setattr__(sensor, "position", position)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class StressSensor:
    """Stress at a node or stress point: six components in body axes, and the von Mises stress.

    If the place has several points (an element, a set, the skin around a node of a beam or shell), the point with the
    largest von Mises stress during the motion is measured.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    position
        Position in mesh axes, where a kept node must be, (3,) [m].
    point
        Alternatively, the name of a stress point of the file.
    node
        Alternatively, the user's number of a node.
    element
        Alternatively, the number of an element on the surface.
    set
        Alternatively, the name of a set.
    tolerance
        Largest distance of the node from the position, relative to the size of the body.
    """

    name: str
    body: str
    position: GivenArrayOrNone = given(None)
    point: str | None = None
    node: int | str | None = None
    element: int | str | None = None
    set: str | None = None
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        with_position(self)
        require_one_place(self)

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the stress components and the von Mises stress over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        modes, places = self.modes_of(body, trajectory)
        return replace(self.measured_at(modes, system, trajectory), places=places)

    def measured_at(self, modes: Array, system: System, trajectory: Trajectory) -> Measurement:
        """Return the stress components and the von Mises stress over time at the point of these stress modes."""
        stress = stress_of(modes[None], trajectory.body(self.body).q)[0].T
        columns = {component: stress[:, k] for k, component in enumerate(STRESS_COMPONENTS)}
        columns["von Mises"] = von_mises(stress)
        return Measurement(self.name, trajectory.t, columns, dict.fromkeys(columns, system.units.stress_symbol))

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return the derivatives at the point that is chosen now; motions near by may choose another one."""
        modes, _ = self.modes_of(flexible_body(small.system, self.name, self.body), small.now)
        return differentiated(lambda *given: self.measured_at(modes, *given), small)

    def modes_of(self, body: FlexibleBody, trajectory: Trajectory) -> tuple[Array, tuple[str, ...]]:
        """Return stress modes, (6, n_q), and description of the point; for several points, of the most stressed one."""
        address = address_of(self)
        if address is None:
            return modes_at(body, self.name, None, self.point), ()
        modes = stress_modes(body.name, body.reduced)
        found = found_at(body, f"sensor {self.name!r}", address, of_stress=True)
        row = int(found.rows[0])
        if len(found.rows) > 1:
            largest, where = largest_von_mises(trajectory, self.body, body.reduced, rows=found.rows)
            row = int(where[int(largest.argmax())])
        return np.asarray(modes[row]), (f"{found.description()}; measured at node {body.reduced.node_name(row)}",)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class VonMisesSensor:
    """The largest von Mises stress over the kept nodes of a body, or of a part of it, and the node where it occurs.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    node
        User's number of a node, to which the search is restricted.
    element
        Number of an element on the surface, to whose nodes the search is restricted.
    set
        Name of a set, to whose nodes the search is restricted.
    """

    name: str
    body: str
    node: int | str | None = None
    element: int | str | None = None
    set: str | None = None

    def __post_init__(self) -> None:
        address_of(self)

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the largest stress over time and the number of its node in the user's mesh.

        In older files without numbers, the column contains the index in the model. If instances have equal numbers, a
        further column contains the index of the instance.
        """
        body = flexible_body(system, self.name, self.body)
        reduced, address = body.reduced, address_of(self)
        stress_modes(body.name, reduced)
        found = None if address is None else found_at(body, f"sensor {self.name!r}", address, of_stress=True)
        rows = None if found is None else found.rows
        largest, where = largest_von_mises(trajectory, self.body, reduced, rows=rows)
        numbering, units = reduced.numbering, {"largest": system.units.stress_symbol}
        columns = {"largest": largest}
        if numbering.nodes.size:
            columns["node"], units["node"] = numbering.nodes[where].astype(float), "number in the mesh"
        else:
            columns["node"], units["node"] = reduced.node_ids[where].astype(float), "index in the model, from 0"
        if numbering.node_instance.size:
            names = ", ".join(f"{k}: {name}" for k, name in enumerate(numbering.instances))
            columns["instance"], units["instance"] = numbering.node_instance[where].astype(float), names
        hot = int(where[int(largest.argmax())]) if len(where) else None
        words = () if hot is None else (f"largest at {node_words(reduced, hot)}",)
        place = (found.description(),) if found else ()
        numbers = tuple(name for name in columns if name != "largest")
        return Measurement(self.name, trajectory.t, columns, units, (*place, *words), numbers)

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return the derivative at the node where the stress is largest now; motions near by may have another one."""
        now = self.measure(small.system, small.now)
        body, address = flexible_body(small.system, self.name, self.body), address_of(self)
        rows = None if address is None else found_at(body, f"sensor {self.name!r}", address, of_stress=True).rows
        _, where = largest_von_mises(small.now, self.body, body.reduced, rows=rows)
        modes = stress_modes(self.body, body.reduced)[where[:1]]

        def measured(_: System, trajectory: Trajectory) -> Measurement:
            stress = stress_of(modes, trajectory.body(self.body).q)[0].T
            numbers = {name: np.repeat(now.columns[name], len(stress)) for name in now.numbers}
            return replace(now, t=trajectory.t, columns={"largest": von_mises(stress)} | numbers)

        return differentiated(measured, small)


def node_words(reduced: ReducedBody, row: int) -> str:
    """Return name and position (mesh axes) of a kept node as text."""
    x = reduced.frame.origin + reduced.frame.axes @ reduced.nodes[row]
    return f"node {reduced.node_name(row)} at [{number_list(x)}]"


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class StrainGauge:
    """Strain along a direction at a node, computed from its stress by Hooke's law of an isotropic material.

    epsilon = ((1 + nu) d·sigma d - nu tr(sigma)) / E

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    direction
        Direction of the strain, mesh axes, (3,).
    young
        Young's modulus [Pa].
    poisson
        Poisson's ratio of the material [-].
    position
        Position in mesh axes, where a kept node must be, (3,) [m].
    point
        Alternatively, the name of a stress point of the file.
    node
        Alternatively, the user's number of a node.
    tolerance
        Largest distance of the node from the position, relative to the size of the body.
    """

    name: str
    body: str
    direction: Array
    young: float
    poisson: float
    position: GivenArrayOrNone = given(None)
    point: str | None = None
    node: int | str | None = None
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        where = f"sensor {self.name!r}"
        object.__setattr__(self, "direction", unit_vector(f"{where}: direction", self.direction))
        object.__setattr__(self, "young", number(f"{where}: young", self.young, above=0.0))
        object.__setattr__(self, "poisson", number(f"{where}: poisson", self.poisson, at_least=-1.0))
        with_position(self)
        require_one_place(self)

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the strain over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        strain = trajectory.body(self.body).q @ self.strain_modes(body)
        return Measurement(self.name, trajectory.t, {"strain": strain}, {"strain": "-"})

    def strain_modes(self, body: FlexibleBody) -> Array:
        """Return the strain for a unit of each modal coordinate, (n_q,)."""
        modes = modes_at(body, self.name, None, self.point, address=address_of(self))
        x, y, z = self.direction @ body.reduced.frame.axes
        along = np.array([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y]) @ modes
        return np.asarray(((1 + self.poisson) * along - self.poisson * modes[:3].sum(axis=0)) / self.young)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ElongationSensor:
    """An extensometer: change of distance between two nodes divided by the distance; it needs no stress modes.

    It is of first order, like the strains of the body: e · (u_b - u_a) / |d| along the undeformed line d = |d| e. The
    distance of the displaced nodes is not used: a local rotation by theta moves b by |d| theta normal to the line and
    by -|d| theta²/2 along it, but first-order displacements lack the second part (only quadratic modes contain it), so
    that the rotation would count as strain.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    position_a
        Position in mesh axes, (3,) [m], where a kept node must be, or an address such as a node number.
    position_b
        The other place, as `position_a`.
    tolerance
        Largest distance of nodes from positions, relative to the size of the body.
    """

    name: str
    body: str
    position_a: Array | Address
    position_b: Array | Address
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        for key in ("position_a", "position_b"):
            given = getattr(self, key)
            if not isinstance(given, Address):
                object.__setattr__(self, key, array_of_shape(f"sensor {self.name!r}: {key}", given, (3,)))

    def ends(self, body: FlexibleBody) -> tuple[FoundNodes, FoundNodes]:
        """Return the kept nodes at both ends; an element or set stands for the mean of its nodes."""
        a, b = (
            found_at(
                body,
                f"sensor {self.name!r}: {key}",
                given if isinstance(given, Address) else Address(position=given, tolerance=self.tolerance),
            )
            for key, given in (("position_a", self.position_a), ("position_b", self.position_b))
        )
        return a, b

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the mean strain between the nodes over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        d, by_q = self.line(body)
        strain = trajectory.body(self.body).q @ (d @ by_q) / (d @ d)
        return Measurement(self.name, trajectory.t, {"strain": strain}, {"strain": "-"})

    def line(self, body: FlexibleBody) -> tuple[Array, Array]:
        """Return the undeformed vector from node to node, (3,), and its derivative by q, (3, n_q)."""
        reduced: ReducedBody = body.reduced
        a, b = (each.rows for each in self.ends(body))
        if np.array_equal(a, b):
            raise ModelError(
                f"sensor {self.name!r}: both positions have the same nearest node; move them further apart"
            )
        by_q = np.asarray(reduced.Phi[b].mean(axis=0) - reduced.Phi[a].mean(axis=0))
        return np.asarray(reduced.nodes[b].mean(axis=0) - reduced.nodes[a].mean(axis=0)), by_q
