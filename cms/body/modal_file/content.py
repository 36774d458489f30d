"""Conversion between a reduced body and the content of a modal file."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from cms.body.geometric_stiffness import UNIT_LOADS, GeometricStiffness, RotatedLoads, SpreadLoads
from cms.body.invariants import Moments, NodalSums
from cms.body.kept_points import KeptPoints
from cms.body.modal_file.contents import Attribute, Content, Contents
from cms.body.modal_file.entries import dataset_of
from cms.body.modal_file.recovery import recovery_attributes, recovery_of, recovery_values
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.body.source_columns import SourceColumns
from cms.body.stress import PointStress
from cms.errors import ModalFileError
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.foundation.arrays import require_shape
from fe_models.foundation.units import UNIT_SYSTEMS, Units
from fe_models.meshes.numbering import NO_NUMBERS, NamedSet, Numbering

__all__ = ["FORMAT", "Contents", "body_of", "content_of", "require_same_frequencies", "require_same_invariants"]

FORMAT = "modal-file"
SI = UNIT_SYSTEMS["m-kg-s"]
FREQUENCY_DEFECT = 1e-9  #: largest relative difference between stored frequencies and those computed from K and M
#: largest difference between stored invariants 1C-5C and those from the moments, relative to the largest entry
INVARIANT_DEFECT = 1e-12
#: unit loads of the geometric stiffness except those of the interfaces, which are stored with the interfaces
OF_FRAME = UNIT_LOADS[:3]
TURNED, SPREAD = "/geometric/turned", "/geometric/spread"  #: paths of the groups
EPSILON = np.cross(np.eye(3)[:, None], np.eye(3)[None])  #: (a × b)_c = EPSILON_abc a_a b_b, (3, 3, 3)
NUMBERS = {
    "/nodes/label": "nodes",
    "/nodes/on_skin": "on_skin",
    "/nodes/instance": "node_instance",
    "/surface/element": "elements",
    "/surface/instance": "element_instance",
}  #: field of `Numbering` for each dataset
SET_KEYS = {"name": str, "kind": str, "size": int}  #: attributes of a set
INVARIANTS = ("J0", "C1", "C2", "C3", "C4", "C5")


# Body to content -----------------------------------------------------------------------------------------------------


def content_of(body: ReducedBody, version: int) -> Content:
    """Return the content of the modal file of a body."""
    moments, sums, columns, points = body.moments, body.nodal_sums, body.columns, body.point_stress
    values: dict[str, Any] = {
        "/frame/origin": body.frame.origin,
        "/frame/axes": body.frame.axes,
        "/frame/dofs": body.frame.dofs,
        "/modes/M": body.M,
        "/modes/K": body.K,
        "/modes/D": body.D,
        "/modes/frequencies": body.frequencies,
        "/modes/free_frequencies": body.free_frequencies,
        "/modes/labels": body.labels,
        "/modes/sources": body.sources,
        "/modes/energy_shares": body.energy_shares,
        "/moments/m": np.array(moments.m),
        "/nodes/position": body.nodes,
        "/nodes/id": body.node_ids,
        "/nodes/Phi": body.Phi,
        "/surface/triangles": body.surface,
    }
    values |= {path: n for path, name in NUMBERS.items() if (n := getattr(body.numbering, name)).size}
    if body.numbering.instances:
        values["/instances/names"] = body.numbering.instances
    values |= {f"/sets/{k}/members": each.members for k, each in enumerate(body.numbering.sets)}
    if body.kept is not None:
        values |= {f"/kept/{name}": getattr(body.kept, name) for name in ("nodes", "rotation", "source")}
    products, invariants = known_terms(moments.missing)
    values |= {f"/moments/{name}": getattr(moments, name) for name in ("S", "R", "C1", *products)}
    values |= {f"/invariants/{name}": getattr(moments, name) for name in invariants}
    for k, interface in enumerate(body.interfaces):
        of_interface = ("position", "triad", "Psi", "members")
        values |= {f"/interfaces/{k}/{name}": getattr(interface, name) for name in of_interface}
    if (geometric := body.geometric) is not None:  # that of interfaces is stored with the interfaces
        values |= {f"/geometric/{name}": getattr(geometric, name) for name in OF_FRAME}
        loads = tuple(zip(geometric.loaded, geometric.interfaces, strict=True))
        values |= {f"/interfaces/{k}/K_geometric": K for k, K in loads}
        if geometric.turned is not None:
            values |= {f"{TURNED}/{name}": getattr(geometric.turned, name) for name in OF_FRAME}
            loads = tuple(zip(geometric.loaded, geometric.turned.interfaces, strict=True))
            values |= {f"/interfaces/{k}/K_turned": K for k, K in loads}
        if geometric.spread is not None:
            names = ("K", "turned", "turned_rigid")
            values |= {f"{SPREAD}/{name}": getattr(geometric.spread, name) for name in names}
    if body.quadratic is not None:
        values["/quadratic/g"] = body.quadratic
    if columns is not None:
        values |= {f"/columns/{name}": getattr(columns, name) for name in ("labels", "groups", "A", "F")}
    if sums is not None:
        values["/nodal_sums/w"] = np.array(sums.w)
        values |= {f"/nodal_sums/{name}": getattr(sums, name) for name in ("S", "R", "U1", "U2")}
    for k, case in enumerate(body.load_cases):
        values |= {f"/load_cases/{k}/{name}": getattr(case, name) for name in ("force", "torque", "h")}
    if body.stress is not None:
        values["/stress/nodal"] = body.stress
    if points is not None:
        values["/stress/points/names"], values["/stress/points/position"] = points.names, points.positions
        values["/stress/points/modes"] = points.modes
    if body.recovery:
        values |= recovery_values(body.recovery)
    datasets = {path: dataset_of(path, array, body.units) for path, array in values.items()}
    return Content(FORMAT, version, datasets, attributes_of(body))


def attributes_of(body: ReducedBody) -> dict[str, Mapping[str, Attribute]]:
    """Return the attributes of all groups."""
    attributes: dict[str, Mapping[str, Attribute]] = {
        "/": {"name": body.name, "n_modes": body.n_q, "n_nodes": len(body.nodes)},
        "/units": {field.name: getattr(body.units, field.name) for field in fields(Units)},
        "/frame": {"kind": body.frame.kind, "at": body.frame.at},
        "/modes": {},
        "/moments": {"is_exact": int(body.moments.is_exact)}
        | ({"missing": " ".join(body.moments.missing)} if body.moments.missing else {}),
        "/invariants": {},
        "/nodes": {},
        "/surface": {},
        "/interfaces": {"count": len(body.interfaces)},
        "/load_cases": {"count": len(body.load_cases)},
        "/stress": {"has_nodal": int(body.stress is not None), "has_points": int(body.point_stress is not None)},
        "/provenance": dict(body.provenance),
    }
    for k, interface in enumerate(body.interfaces):
        attributes[f"/interfaces/{k}"] = {
            "name": interface.name,
            "kind": interface.kind,
            "has_rotation": int(interface.has_rotation),
        }
    for k, case in enumerate(body.load_cases):
        attributes[f"/load_cases/{k}"] = {"name": case.name, "kind": case.kind}
    if body.numbering.instances:
        attributes["/instances"] = {}
    if body.numbering.sets:
        attributes["/sets"] = {"count": len(body.numbering.sets)}
    for k, each in enumerate(body.numbering.sets):
        attributes[f"/sets/{k}"] = {"name": each.name, "kind": each.kind, "size": each.size}
    if body.kept is not None:
        attributes["/kept"] = {}
    if body.columns is not None:
        attributes["/columns"] = {}
    if body.geometric is not None:
        attributes["/geometric"] = {}
        attributes |= {TURNED: {}} if body.geometric.turned is not None else {}
        attributes |= {SPREAD: {}} if body.geometric.spread is not None else {}
    if body.quadratic is not None:
        attributes["/quadratic"] = {}
    if body.recovery:
        attributes |= recovery_attributes(body.recovery)
    if body.nodal_sums is not None:
        attributes["/nodal_sums"] = {"is_volume": int(body.nodal_sums.is_volume)}
    return attributes


def known_terms(missing: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the products P and S_kl and the invariants that a file stores: all without missing terms.

    M* is stored instead of an incomplete S_kl; 2C is among the invariants.
    """
    products = (() if "3C" in missing else ("P",)) + (("M",) if "5C" in missing else ("S_kl",))
    return products, tuple(name for name in INVARIANTS if name not in {f"C{term[0]}" for term in missing})


# Content to body -----------------------------------------------------------------------------------------------------


def body_of(content: Content) -> ReducedBody:
    """Return the body that a file describes; data that older versions lack are None or empty."""
    contents = Contents(content)
    array, strings, attribute = contents.array, contents.strings, contents.attribute
    is_1 = content.version < 2  # version 1 stored neither dofs nor whether an interface has a rotation
    moments, units = moments_of(contents), units_of(contents)
    return ReducedBody(
        name=attribute("/", "name", str),
        units=units,
        frame=BodyFrame(
            kind=attribute("/frame", "kind", str),
            origin=array("/frame/origin"),
            axes=array("/frame/axes"),
            at=attribute("/frame", "at", str),
            dofs=np.zeros((0, 2), np.int64) if is_1 else array("/frame/dofs"),
        ),
        **contents.arrays("/modes", "M", "K", "D", "free_frequencies", "energy_shares"),
        labels=strings("/modes/labels"),
        sources=strings("/modes/sources"),
        moments=moments,
        nodes=array("/nodes/position"),
        node_ids=array("/nodes/id"),
        Phi=array("/nodes/Phi"),
        surface=array("/surface/triangles"),
        interfaces=tuple(interface_of(contents, group) for group in contents.numbered("/interfaces")),
        provenance={name: str(value) for name, value in content.attributes.get("/provenance", {}).items()},
        columns=columns_of(contents) if contents.has("/columns") else None,
        nodal_sums=nodal_sums_of(contents) if contents.has("/nodal_sums") else None,
        load_cases=tuple(
            ReducedLoadCase(
                attribute(group, "name", str), attribute(group, "kind", str),
                **contents.arrays(group, "force", "torque", "h"),
            )
            for group in contents.numbered("/load_cases")
        ),
        stress=array("/stress/nodal") if contents.has("/stress", "has_nodal") else None,
        point_stress=PointStress(
            strings("/stress/points/names"), array("/stress/points/position"), array("/stress/points/modes")
        )
        if contents.has("/stress", "has_points")
        else None,
        geometric=geometric_of(contents) if contents.has("/geometric") else None,
        quadratic=array("/quadratic/g") if contents.has("/quadratic") else None,
        numbering=numbering_of(contents),
        kept=kept_of(contents) if contents.has("/kept") else None,
        recovery=recovery_of(contents, units),
    )  # fmt: skip


def numbering_of(contents: Contents) -> Numbering:
    """Return the user's numbers and sets; empty if the file has none, as before version 5."""
    known = contents.content.datasets
    arrays = {name: contents.array(path) if path in known else NO_NUMBERS for path, name in NUMBERS.items()}
    sets = []
    for group in contents.numbered("/sets"):
        name, kind, size = (contents.attribute(group, key, what) for key, what in SET_KEYS.items())
        sets.append(NamedSet(name, kind, contents.array(f"{group}/members"), size))
    instances = contents.strings("/instances/names") if contents.has("/instances") else ()
    return Numbering(**arrays, instances=instances, sets=tuple(sets))


def kept_of(contents: Contents) -> KeptPoints:
    """Return the points with rotations."""
    return KeptPoints(contents.array("/kept/nodes"), contents.array("/kept/rotation"), contents.strings("/kept/source"))


def moments_of(contents: Contents) -> Moments:
    """Return the moments; if terms are missing, the stored invariants give the others."""
    missing: tuple[str, ...] = ()
    if "missing" in contents.content.attributes.get("/moments", {}):
        missing = tuple(contents.attribute("/moments", "missing", str).split())
    known = contents.arrays("/moments", "S", "R", "C1", *known_terms(missing)[0])
    if "P" not in known:
        C2 = contents.array("/invariants/C2")
        require_shape("dataset /invariants/C2", C2, np.shape(known["C1"]))
        known["P"] = np.einsum("abc,ck->abk", EPSILON, C2) / 2
    if "S_kl" not in known:
        M = known.pop("M")
        S_kl = np.einsum("ab,kl->abkl", np.eye(3), M) / 3
        if "4C" not in missing:
            C4 = contents.array("/invariants/C4")
            require_shape("dataset /invariants/C4", C4, (*M.shape, 3))
            S_kl -= np.einsum("abc,klc->abkl", EPSILON, C4) / 2
        known["S_kl"] = S_kl
    is_exact = bool(contents.attribute("/moments", "is_exact", int))
    return Moments(m=contents.number("/moments/m"), **known, is_exact=is_exact, missing=missing)


def interface_of(contents: Contents, group: str) -> ReducedInterface:
    """Return one interface; version 1 did not distinguish a Psi without rotation from a zero rotation."""
    kind = contents.attribute(group, "kind", str)
    arrays = contents.arrays(group, "position", "triad", "Psi", "members")
    if contents.content.version < 2:
        has_rotation = kind != "nodes" or bool(np.asarray(arrays["Psi"])[3:].any())
    else:
        has_rotation = bool(contents.attribute(group, "has_rotation", int))
    return ReducedInterface(contents.attribute(group, "name", str), kind, **arrays, has_rotation=has_rotation)


def columns_of(contents: Contents) -> SourceColumns:
    """Return the columns of the mode set."""
    arrays = contents.arrays("/columns", "A", "F")
    return SourceColumns(contents.strings("/columns/labels"), contents.strings("/columns/groups"), **arrays)


def nodal_sums_of(contents: Contents) -> NodalSums:
    """Return the weighted sums over the nodes."""
    return NodalSums(
        w=contents.number("/nodal_sums/w"),
        **contents.arrays("/nodal_sums", "S", "R", "U1", "U2"),
        is_volume=bool(contents.attribute("/nodal_sums", "is_volume", int)),
    )


def geometric_of(contents: Contents) -> GeometricStiffness:
    """Return the geometric stiffness; that of loaded interfaces is stored with the interfaces."""
    known = contents.content.datasets
    is_loaded = [f"{path}/K_geometric" in known for path in contents.numbered("/interfaces")]
    if contents.content.version < 6:
        is_loaded = [True for _ in is_loaded]
    n = contents.array("/geometric/spin").shape[-1]
    turned = spread = None
    if contents.has(TURNED):
        turned = RotatedLoads(**loads_of(contents, TURNED, "K_turned", (3, n), is_loaded))
    if contents.has(SPREAD):
        shapes = {"K": (6, n, n), "turned": (6, 3, n), "turned_rigid": (6, 3, 3)}
        spread = SpreadLoads(**{name: shaped(contents, f"{SPREAD}/{name}", shape) for name, shape in shapes.items()})
    of_loads = loads_of(contents, "/geometric", "K_geometric", (n, n), is_loaded)
    return GeometricStiffness(**of_loads, turned=turned, spread=spread, is_loaded=tuple(is_loaded))


def loads_of(
    contents: Contents, group: str, of_interface: str, shape: tuple[int, int], is_loaded: list[bool]
) -> dict[str, np.ndarray]:
    """Return the matrices of all unit loads, by kind of load."""
    of_interfaces = [
        shaped(contents, f"{path}/{of_interface}", (6, *shape))
        for path, is_own in zip(contents.numbered("/interfaces"), is_loaded, strict=True)
        if is_own
    ]
    loads = contents.arrays(group, *OF_FRAME)
    return loads | {"interfaces": np.stack(of_interfaces) if of_interfaces else np.zeros((0, 6, *shape))}


def shaped(contents: Contents, path: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the numbers of a dataset after checking its shape."""
    array = contents.array(path)
    require_shape(f"dataset {path}", array, shape)
    return array


def units_of(contents: Contents) -> Units:
    """Return the units of a file, after checking that the factors of a named unit system are correct."""
    kinds = {field.name: type(getattr(SI, field.name)) for field in fields(Units)}
    units = Units(**{name: contents.attribute("/units", name, kind) for name, kind in kinds.items()})
    if UNIT_SYSTEMS.get(units.name, units) != units:
        raise ModalFileError(f"units {units.name!r}: expected the factors of this system, got {units}")
    return units


def require_same_invariants(content: Content, moments: Moments) -> None:
    """Raise `ModalFileError` unless the stored invariants agree with the moments; they serve other readers."""
    for name in known_terms(moments.missing)[1]:
        stored = Contents(content).array(f"/invariants/{name}")
        expected = getattr(moments, name)
        scale = np.abs(expected).max(initial=0.0)
        if stored.shape != expected.shape or not np.abs(stored - expected).max(initial=0.0) <= INVARIANT_DEFECT * scale:
            raise ModalFileError(
                f"dataset /invariants/{name} does not follow from the moments; the file was written by a faulty writer"
            )


def require_same_frequencies(content: Content, body: ReducedBody) -> None:
    """Raise `ModalFileError` unless the stored frequencies agree with K and M; they serve other readers."""
    stored, own = Contents(content).array("/modes/frequencies"), body.frequencies
    if stored.shape != own.shape or not np.allclose(stored, own, rtol=FREQUENCY_DEFECT, atol=0.0):
        raise ModalFileError(
            "dataset /modes/frequencies does not follow from /modes/K and /modes/M; the file was written by a faulty "
            "writer"
        )
