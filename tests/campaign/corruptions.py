"""What can be wrong in one place of a modal file, each with the record that has to find it beside the model.

A corruption is a function of a sound body and a random generator that returns the spoilt body, or None where the body
holds nothing of the kind. Every one changes something: a body that comes back the same is no corruption (`spoilt`).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from cms.assessment.quality.of_reduction.fields import leaves
from cms.body.reduced_body import ReducedBody

__all__ = ["CORRUPTIONS", "spoilt"]

Corruption = Callable[[ReducedBody, np.random.Generator], ReducedBody | None]
ROUNDING = 1e-12  #: of an entry relative to the largest of its array: a change of less is none
QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def spoilt(name: str, body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    """Return the body with a corruption; None where it has nothing of the kind, or nothing changes by much."""
    made = CORRUPTIONS[name][1](body, rng)
    if made is None:
        return None
    own, other = leaves(body), leaves(made)
    changes = 0.0
    for path in set(own) | set(other):
        a, b = own.get(path, []), other.get(path, [])
        if len(a) != len(b):
            return made
        for x, y in zip(a, b, strict=True):
            if isinstance(x, np.ndarray) and isinstance(y, np.ndarray) and x.shape == y.shape and x.dtype.kind == "f":
                scale = np.maximum(np.abs(x), np.abs(y))
                scale = np.maximum(scale, ROUNDING * scale.max(initial=0.0))
                changes = max(changes, float((np.abs(x - y) / np.where(scale > 0, scale, 1.0)).max(initial=0.0)))
            elif isinstance(x, float) and isinstance(y, float):
                changes = max(changes, abs(x - y) / max(abs(x), abs(y), 1e-300))
            elif not (np.array_equal(x, y) if isinstance(x, np.ndarray) else x == y):
                return made
    return made if changes > 1e-3 else None


def of(path: str, change: Callable[[np.ndarray, np.random.Generator], Any]) -> Corruption:
    """Return the corruption of an array or word by the path of its field: in the first record of a tuple or table."""

    def put(record: Any, names: list[str], rng: np.random.Generator) -> Any:
        if record is None:
            return None
        if isinstance(record, tuple):
            made = None if not record else put(record[0], names, rng)
            return None if made is None else (made, *record[1:])
        if not hasattr(record, "__dataclass_fields__") and hasattr(record, "items"):
            key = next(iter(record), None)
            made = None if key is None else put(record[key], names, rng)
            return None if made is None else {**record, key: made}
        value = getattr(record, names[0])
        if len(names) > 1:
            made = put(value, names[1:], rng)
        else:
            made = None if value is None else change(np.array(value) if isinstance(value, np.ndarray) else value, rng)
        return None if made is None else replace(record, **{names[0]: made})

    return lambda body, rng: put(body, path.split("."), rng)


def times(factor: float) -> Callable[[np.ndarray, np.random.Generator], Any]:
    return lambda x, rng: factor * x


def shuffled(axis: int) -> Callable[[np.ndarray, np.random.Generator], Any]:
    def change(x: np.ndarray, rng: np.random.Generator) -> Any:
        return np.roll(x, 1 + rng.integers(x.shape[axis] - 1), axis) if x.shape[axis] > 1 else None

    return change


def exchanged(axis: int, order: list[int]) -> Callable[[np.ndarray, np.random.Generator], Any]:
    return lambda x, rng: np.take(x, order, axis)


def one_mode(axis: int) -> Callable[[np.ndarray, np.random.Generator], Any]:
    """Change the sign of one mode, the one in which most happens."""

    def change(x: np.ndarray, rng: np.random.Generator) -> Any:
        others = tuple(k for k in range(x.ndim) if k != axis % x.ndim)
        k = int(np.argmax(np.abs(x).max(axis=others))) if x.size else 0
        x[(slice(None),) * (axis % x.ndim) + (k,)] *= -1
        return x

    return change


def one_entry(size: float = 1.5) -> Callable[[np.ndarray, np.random.Generator], Any]:
    """Change the largest number."""

    def change(x: np.ndarray, rng: np.random.Generator) -> Any:
        if x.size:
            x[np.unravel_index(int(np.argmax(np.abs(x))), x.shape)] *= size
        return x

    return change


def shifted(share: float) -> Callable[[np.ndarray, np.random.Generator], Any]:
    return lambda x, rng: x + share * np.abs(x).max(initial=1e-3)


def turned(axes: np.ndarray, rng: np.random.Generator) -> Any:
    return axes @ QUARTER


def flipped_moments(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    """All moments of one mode with the other sign: the moments of the same mode the other way round."""
    P = np.abs(np.asarray(body.moments.P)).max(axis=(0, 1)) + np.abs(body.moments.C1).max(axis=0)
    s = np.ones(body.n_q)
    s[int(np.argmax(P))] = -1
    m = body.moments
    return replace(body, moments=replace(m, C1=m.C1 * s, P=m.P * s, S_kl=m.S_kl * np.outer(s, s)))


def moments_beside(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    """4C and the parts of 5C beside its diagonal with the other sign."""
    S = np.array(body.moments.S_kl)
    off = ~np.eye(3, dtype=bool)
    S[off] *= -1
    return replace(body, moments=replace(body.moments, S_kl=S))


def symmetric_P(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    """3C of the other sign, 2C as it is."""
    P = np.asarray(body.moments.P)
    anti = (P - P.swapaxes(0, 1)) / 2
    return replace(body, moments=replace(body.moments, P=anti - (P - anti)))


def momentum(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    """1C of the other sign, where it is not zero as in mean axes."""
    if body.frame.kind == "tisserand":
        return None
    return replace(body, moments=replace(body.moments, C1=-np.asarray(body.moments.C1)))


def sums_of_modes(field: str) -> Corruption:
    """Weighted sums of the modes moved by a part of what they could be."""

    def change(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
        sums = body.nodal_sums
        if sums is None:
            return None
        size = sums.w * np.abs(body.Phi).max(initial=0.0) * (1.0 if field == "U1" else np.ptp(body.nodes, axis=0).max())
        return replace(body, nodal_sums=replace(sums, **{field: getattr(sums, field) + 0.1 * size}))

    return change


def moved_moment(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    size = float(np.ptp(body.nodes, axis=0).max(initial=1e-3))
    return replace(body, moments=replace(body.moments, S=body.moments.S + 0.1 * body.moments.m * size))


def moved_sums(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    sums, size = body.nodal_sums, float(np.ptp(body.nodes, axis=0).max(initial=1e-3))
    return None if sums is None else replace(body, nodal_sums=replace(sums, S=sums.S + 0.1 * sums.w * size))


def moved_origin(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    size = float(np.ptp(body.nodes, axis=0).max(initial=1e-3))
    return replace(body, frame=replace(body.frame, origin=body.frame.origin + 0.1 * size))


def turned_frame(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    return replace(body, frame=replace(body.frame, axes=body.frame.axes @ QUARTER))


def other_frame(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    if body.is_held or not body.interfaces:
        return None
    kind = "tisserand" if body.frame.kind == "nodal" else "nodal"
    at = body.interfaces[0].name if kind == "nodal" else ""
    return replace(body, frame=replace(body.frame, kind=kind, at=at, dofs=np.zeros((0, 2), np.int64)))


def exchanged_interfaces(field: str) -> Corruption:
    """Two interfaces change what they have of a field."""

    def change(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
        if len(body.interfaces) < 2:
            return None
        a, b, *rest = body.interfaces
        new = replace(a, **{field: getattr(b, field)}), replace(b, **{field: getattr(a, field)})
        return replace(body, interfaces=(*new, *rest))

    return change


def other_kind(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    if not body.interfaces:
        return None
    first = body.interfaces[0]
    kind = "distributing" if first.kind == "rigid" else "rigid"
    return replace(body, interfaces=(replace(first, kind=kind), *body.interfaces[1:]))


def renamed(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    if not body.interfaces:
        return None
    return replace(body, interfaces=(replace(body.interfaces[0], name="pin of another"), *body.interfaces[1:]))


def without(field: str, value: Any = None, **more: Any) -> Corruption:
    """The body without a part that it was asked to hold, and with other fields that have to fit."""

    def change(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
        own = getattr(body, field)
        return None if own is None or not len(own) else replace(body, **{field: value}, **more)

    return change


def asymmetric_free(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    f = np.array(body.free_frequencies)
    return replace(body, free_frequencies=f * np.where(np.arange(len(f)) == 0, 1.01, 1.0))


def stiffer(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    return replace(body, K=np.asarray(body.K) * 1.1)


def heavier(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    return replace(body, M=np.asarray(body.M) * 1.1)


def of_table(change: Callable[[Any, np.random.Generator], Any]) -> Corruption:
    def spoil(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
        if not body.recovery:
            return None
        name = next(iter(body.recovery))
        made = change(body.recovery[name], rng)
        return None if made is None else replace(body, recovery={**body.recovery, name: made})

    return spoil


def rows_of(quantity: str, factor: float, order: int) -> Corruption:
    """The rows of one quantity times a factor."""

    def change(table: Any, rng: np.random.Generator) -> Any:
        rows = [k for k, each in enumerate(table.quantities) if each == quantity]
        if not rows:
            return None
        dynamic = np.array(table.dynamic)
        dynamic[order, rows] *= factor
        return replace(table, dynamic=dynamic)

    spoil = of_table(change)
    return lambda body, rng: None if quantity == "stress" and stress_is_rounding(body) else spoil(body, rng)


def stress_is_rounding(body: ReducedBody) -> bool:
    """Say whether rows of stress hold rounding alone: the middle surface of a plate has no stress where it bends."""
    table = next(iter(body.recovery.values()), None)
    rows = [] if table is None else [k for k, each in enumerate(table.quantities) if each == "stress"]
    if table is None or not rows:
        return False
    shape = np.abs(body.Phi).max(axis=(0, 1))
    found = (np.abs(np.array(table.dynamic)[0, rows, -body.n_q :]) / shape).max()
    size = np.linalg.norm(np.ptp(body.nodes, axis=0))
    return bool(found < 1e-6 * (np.diag(body.K) / shape**2).max() / size**2)


def no_remainder(table: Any, rng: np.random.Generator) -> Any:
    """No mode acceleration and no static part."""
    rows = [
        k for k, each in enumerate(table.quantities) if each not in ("acceleration", "interface force", "net force")
    ]
    dynamic = np.array(table.dynamic)
    dynamic[2, rows] = 0
    return replace(table, dynamic=dynamic, static=0 * np.asarray(table.static))


def exchanged_labels(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    if body.columns is None or len(set(body.labels)) < 2:
        return None
    return replace(body, labels=body.labels[1:] + body.labels[:1])


def other_triangles(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    return replace(body, surface=np.asarray(body.surface)[:, ::-1]) if len(body.surface) else None


def other_numbers(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    numbers = np.asarray(body.numbering.nodes)
    if not len(numbers):
        return None
    return replace(body, numbering=replace(body.numbering, nodes=np.roll(numbers, 1)))


def modal_forces(change: Callable[[np.ndarray, np.random.Generator], Any]) -> Corruption:
    """Modal forces of the first load case, if it works on a mode: one on dofs that the frame holds does not."""

    def spoil(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
        if not body.load_cases:
            return None
        first = body.load_cases[0]
        largest = np.linalg.norm(first.force) * np.abs(body.Phi).max(initial=0.0)
        if np.abs(first.h).max(initial=0.0) <= 1e-3 * largest:
            return None
        return of("load_cases.h", change)(body, rng)

    return spoil


def other_set(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    for k, each in enumerate(body.numbering.sets):
        if len(each.members) > 1:
            sets = list(body.numbering.sets)
            sets[k] = replace(each, members=np.asarray(each.members)[:-1])
            return replace(body, numbering=replace(body.numbering, sets=tuple(sets)))
    return None


def other_nodes(body: ReducedBody, rng: np.random.Generator) -> ReducedBody | None:
    return replace(body, node_ids=np.asarray(body.node_ids)[::-1]) if len(body.node_ids) > 1 else None


def damping_of_one_mode(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    D = np.array(body.D)
    k = int(np.argmax(np.diag(D)))
    D[k, k] *= 0.5
    return replace(body, D=D)


def other_mode_set(body: ReducedBody, rng: np.random.Generator) -> ReducedBody:
    return replace(body, provenance={**body.provenance, "mode set columns": "7000"})


#: what is wrong -> the record that names it, and how it is made
CORRUPTIONS: dict[str, tuple[str, Corruption]] = {
    "stress in MPa for Pa": ("stress-modes", of("stress", times(1e-6))),
    "stress of the modes shuffled": ("stress-modes", of("stress", shuffled(2))),
    "stress of the nodes shuffled": ("stress-modes", of("stress", shuffled(0))),
    "stress xx and yy exchanged": ("stress-modes", of("stress", exchanged(1, [1, 0, 2, 3, 4, 5]))),
    "stress yz and xy exchanged": ("stress-modes", of("stress", exchanged(1, [0, 1, 2, 5, 4, 3]))),
    "stress of one mode of wrong sign": ("stress-modes", of("stress", one_mode(2))),
    "stress left out": ("stress-modes", without("stress")),
    "stress at points twice": ("stress-modes", of("point_stress.modes", times(2.0))),
    "stress points elsewhere": ("stress-modes", of("point_stress.positions", shifted(0.2))),
    "damping ten times": ("damping-matrix", of("D", times(10.0))),
    "damping none": ("damping-matrix", of("D", times(0.0))),
    "damping of one mode half": ("damping-matrix", damping_of_one_mode),
    "1C of wrong sign": ("invariants", momentum),
    "P of wrong sign": ("invariants", of("moments.P", times(-1.0))),
    "P transposed": ("invariants", of("moments.P", lambda x, rng: x.swapaxes(0, 1))),
    "3C of wrong sign": ("invariants", symmetric_P),
    "P of one mode of wrong sign": ("invariants", of("moments.P", one_mode(2))),
    "all moments of a mode of wrong sign": ("invariants", flipped_moments),
    "4C and 5C beside the diagonal of wrong sign": ("invariants", moments_beside),
    "S_kl axes exchanged": ("invariants", of("moments.S_kl", exchanged(0, [1, 0, 2]))),
    "S_kl one entry": ("invariants", of("moments.S_kl", one_entry())),
    "moments said to be approximate": ("invariants", of("moments.is_exact", lambda x, rng: not x)),
    "mass 10 % more": ("mass-properties", of("moments.m", times(1.1))),
    "first moment moved": ("mass-properties", moved_moment),
    "second moment axes exchanged": ("mass-properties", of("moments.R", lambda x, rng: x[[1, 0, 2]][:, [1, 0, 2]])),
    "geometric stiffness of spin of wrong sign": ("geometric-stiffness", of("geometric.spin", times(-1.0))),
    "geometric stiffness of spin pairs shuffled": ("geometric-stiffness", of("geometric.spin", shuffled(0))),
    "geometric stiffness of interfaces shuffled": ("geometric-stiffness", of("geometric.interfaces", shuffled(0))),
    "geometric stiffness of forces shuffled": ("geometric-stiffness", of("geometric.interfaces", shuffled(1))),
    "geometric stiffness of an interface none": ("geometric-stiffness", of("geometric.interfaces", times(0.0))),
    "geometric stiffness of accelerations": ("geometric-stiffness", of("geometric.translation", times(2.0))),
    "geometric stiffness of angular accelerations": ("geometric-stiffness", of("geometric.rotation", times(2.0))),
    "turned loads of spin": ("geometric-stiffness", of("geometric.turned.spin", times(-1.0))),
    "turned loads of interfaces": ("geometric-stiffness", of("geometric.turned.interfaces", times(0.5))),
    "spread loads": ("geometric-stiffness", of("geometric.spread.K", times(-1.0))),
    "spread loads turned": ("geometric-stiffness", of("geometric.spread.turned", times(-1.0))),
    "spread loads of rotations": ("geometric-stiffness", of("geometric.spread.turned_rigid", times(3.0))),
    "quadratic modes of wrong sign": ("quadratic-modes", of("quadratic", times(-1.0))),
    "quadratic modes of nodes shuffled": ("quadratic-modes", of("quadratic", shuffled(0))),
    "quadratic modes of axes exchanged": ("quadratic-modes", of("quadratic", exchanged(1, [1, 0, 2]))),
    "load case: modal forces of wrong sign": ("load-cases", modal_forces(times(-1.0))),
    "load case: modal forces shuffled": ("load-cases", modal_forces(shuffled(0))),
    "load case: resultant twice": ("load-cases", of("load_cases.force", times(2.0))),
    "load case: torque of wrong sign": ("load-cases", of("load_cases.torque", times(-1.0))),
    "load case renamed": ("load-cases", of("load_cases.name", lambda x, rng: "another")),
    "load case of another kind": ("load-cases", of("load_cases.kind", lambda x, rng: "pressure of another")),
    "load cases left out": ("load-cases", without("load_cases", (), errors=None)),
    "triad turned by 90 degrees": ("interfaces", of("interfaces.triad", turned)),
    "triads exchanged": ("interfaces", exchanged_interfaces("triad")),
    "interface motions exchanged": ("interfaces", exchanged_interfaces("Psi")),
    "interface rotations of wrong sign": (
        "interfaces", of("interfaces.Psi", lambda x, rng: x * np.repeat([1.0, -1.0], 3)[:, None]),
    ),
    "interface places exchanged": ("interfaces", exchanged_interfaces("position")),
    "interface members exchanged": ("interfaces", exchanged_interfaces("members")),
    "interface names exchanged": ("interfaces", exchanged_interfaces("name")),
    "interface renamed": ("interfaces", renamed),
    "interface of another kind": ("interfaces", other_kind),
    "rotations of kept nodes of wrong sign": ("kept-rotations", of("kept.rotation", times(-1.0))),
    "rotations of kept nodes shuffled": ("kept-rotations", of("kept.rotation", shuffled(0))),
    "rotations of kept nodes of axes exchanged": ("kept-rotations", of("kept.rotation", exchanged(1, [1, 0, 2]))),
    "rotations of kept nodes left out": (
        "kept-rotations", lambda body, rng: None if body.kept is None else replace(body, kept=None),
    ),
    "recovery: no static part, no mode acceleration": ("recovery-rows", of_table(no_remainder)),
    "recovery: stress twice": ("recovery-rows", rows_of("stress", 2.0, 0)),
    "recovery: element stress twice": ("recovery-rows", rows_of("element stress", 2.0, 0)),
    "recovery: acceleration of wrong sign": ("recovery-rows", rows_of("acceleration", -1.0, 2)),
    "recovery: displacement twice": ("recovery-rows", rows_of("displacement", 2.0, 0)),
    "recovery: interface force of wrong sign": ("recovery-rows", rows_of("interface force", -1.0, 0)),
    "recovery: rows shuffled": ("recovery-rows", of("recovery.dynamic", shuffled(1))),
    "recovery: loads shuffled": ("recovery-rows", of("recovery.static", shuffled(1))),
    "recovery: labels of rows shuffled": ("recovery-rows", of("recovery.labels", lambda x, rng: x[1:] + x[:1])),
    "recovery: another dimension": ("recovery-rows", of("recovery.dimensions", shifted(1.0))),
    "recovery left out": ("recovery-rows", without("recovery", {})),
    "nodal sums: weight twice": ("nodal-sums", of("nodal_sums.w", times(2.0))),
    "nodal sums: second moment": ("nodal-sums", of("nodal_sums.R", times(2.0))),
    "nodal sums: first moment": ("nodal-sums", moved_sums),
    "nodal sums of the modes": ("nodal-sums", sums_of_modes("U1")),
    "nodal sums of turning modes": ("nodal-sums", sums_of_modes("U2")),
    "errors of the frequencies a tenth": ("error-estimates", of("errors.frequency", times(0.1))),
    "load cases on left-out shapes a tenth": ("error-estimates", of("errors.left_out.load_cases", times(0.1))),
    "loads that leave more out": ("error-estimates", of("errors.left_out.interfaces", lambda x, rng: x + 1.0)),
    "inertia of left-out shapes a tenth": ("error-estimates", of("errors.left_out.inertia", times(0.1))),
    "left-out shapes too slow": ("error-estimates", of("errors.left_out.mass", times(4.0))),
    "errors of the statics none": ("error-estimates", of("errors.inertia", times(0.0))),
    "labels of the modes shuffled": ("sources", exchanged_labels),
    "energy shares shuffled": ("sources", of("energy_shares", shuffled(0))),
    "columns: coordinates of wrong sign": ("sources", of("columns.A", one_mode(1))),
    "columns: forces of wrong sign": ("sources", of("columns.F", one_mode(1))),
    "columns: labels shuffled": ("sources", of("columns.labels", lambda x, rng: x[1:] + x[:1])),
    "nodes moved": ("points", of("nodes", shifted(0.1))),
    "nodes shuffled": ("points", of("nodes", shuffled(0))),
    "nodes of other numbers in the model": ("points", other_nodes),
    "numbers of the user shuffled": ("points", other_numbers),
    "a set that lost a node": ("points", other_set),
    "surface turned inside out": ("points", other_triangles),
    "origin of the frame moved": ("points", moved_origin),
    "axes of the frame turned": ("points", turned_frame),
    "frame of another kind": ("frame", other_frame),
    "shapes twice": ("same-body", of("Phi", times(2.0))),
    "shapes of the modes shuffled": ("same-body", of("Phi", shuffled(2))),
    "shapes of the nodes shuffled": ("same-body", of("Phi", shuffled(0))),
    "shape of one mode of wrong sign": ("same-body", of("Phi", one_mode(2))),
    "stiffness 10 % more": ("same-body", stiffer),
    "modal mass 10 % more": ("same-body", heavier),
    "a free frequency 1 % more": ("same-body", asymmetric_free),
    "name of another body": ("origin", of("name", lambda x, rng: "another")),
    "columns of another mode set": ("origin", other_mode_set),
}  # fmt: skip
