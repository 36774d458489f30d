"""Conversion between a reduced body and the content of a modal file."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from cms.body.error_estimates import ErrorEstimates
from cms.body.geometric_stiffness import UNIT_LOADS, GeometricStiffness, RotatedLoads, SpreadLoads
from cms.body.invariants import Moments
from cms.body.modal_file.contents import Attribute, Content, Contents, Dataset
from cms.body.modal_file.schema import ENTRIES, GROUPS, dataset_of, require_layout
from cms.body.recovery_table import RecoveryTable
from cms.body.reduced_body import ReducedBody
from cms.errors import ModalFileError
from fe_models.foundation.units import UNIT_SYSTEMS, Units
from fe_models.meshes.numbering import NO_NUMBERS, Numbering

__all__ = ["FORMAT", "body_of", "content_of", "require_same_frequencies", "require_same_invariants"]

FORMAT = "modal-file"
FREQUENCY_DEFECT = 1e-9  #: largest relative difference between stored frequencies and those computed from K and M
#: largest difference between stored invariants 1C-5C and those from the moments, relative to the largest entry
INVARIANT_DEFECT = 1e-12
#: unit loads of the geometric stiffness except those of the interfaces, which are stored with the interfaces
OF_FRAME = UNIT_LOADS[:3]
TURNED, SPREAD = "/geometric/turned", "/geometric/spread"  #: paths of the groups
OF_SPREAD = ("K", "turned", "turned_rigid")
EPSILON = np.cross(np.eye(3)[:, None], np.eye(3)[None])  #: (a × b)_c = EPSILON_abc a_a b_b, (3, 3, 3)
NUMBERS = {
    "/nodes/label": "nodes",
    "/nodes/on_skin": "on_skin",
    "/nodes/instance": "node_instance",
    "/surface/element": "elements",
    "/surface/instance": "element_instance",
}  #: field of `Numbering` for each dataset
INVARIANTS = ("J0", "C1", "C2", "C3", "C4", "C5")
#: for each group of `GROUPS`: field or derived property of its class, by the name of the dataset in the file
FIELDS = {
    group: {
        name: own
        for path in ENTRIES
        if (name := path.removeprefix(f"{group}/")) != path
        and ((own := layout.names.get(name, name)) in {each.name for each in fields(layout.holds)} | {*layout.follows})
    }
    for group, layout in GROUPS.items()
    if layout.holds is not None
}


# Body to content -----------------------------------------------------------------------------------------------------


def content_of(body: ReducedBody, version: int) -> Content:
    """Return the content of the modal file of a body."""
    moments, numbering = body.moments, body.numbering
    attributes: dict[str, Mapping[str, Attribute]] = {
        "/": {"name": body.name, "n_modes": body.n_q, "n_nodes": len(body.nodes)},
        "/moments": {"is_exact": int(moments.is_exact)}
        | ({"missing": " ".join(moments.missing)} if moments.missing else {}),
        "/invariants": {},
        "/stress": {"has_nodal": int(body.stress is not None), "has_points": int(body.point_stress is not None)},
        "/provenance": dict(body.provenance),
    }
    products, invariants = known_terms(moments.missing)
    values: dict[str, Any] = {f"/moments/{name}": getattr(moments, name) for name in ("m", "S", "R", "C1", *products)}
    values |= {f"/invariants/{name}": getattr(moments, name) for name in invariants}
    values |= {path: n for path, name in NUMBERS.items() if (n := getattr(numbering, name)).size}
    if numbering.instances:
        attributes["/instances"] = {}
        values["/instances/names"] = numbering.instances
    if body.stress is not None:
        values["/stress/nodal"] = body.stress
    if (geometric := body.geometric) is not None:  # loads at interfaces are stored with the interfaces
        attributes["/geometric"] = {}
        values |= {f"/geometric/{name}": getattr(geometric, name) for name in OF_FRAME}
        of_interfaces = {"K_geometric": geometric.interfaces}
        if geometric.turned is not None:
            attributes[TURNED] = {}
            values |= {f"{TURNED}/{name}": getattr(geometric.turned, name) for name in OF_FRAME}
            of_interfaces["K_turned"] = geometric.turned.interfaces
        for name, matrices in of_interfaces.items():
            values |= {f"/interfaces/{k}/{name}": K for k, K in zip(geometric.loaded, matrices, strict=True)}
        if geometric.spread is not None:
            attributes[SPREAD] = {}
            values |= {f"{SPREAD}/{name}": getattr(geometric.spread, name) for name in OF_SPREAD}
    for group, items in items_of(body).items():
        if group.endswith("/<i>"):
            attributes[group.removesuffix("/<i>")] = {"count": len(items)}
        for k, item in enumerate(items):
            path = group.replace("<i>", str(k))
            attributes[path] = {
                name: int(getattr(item, name)) if kind is bool else getattr(item, name)
                for name, (kind, _) in GROUPS[group].attributes.items()
                if name not in GROUPS[group].if_any or getattr(item, name)
            }
            values |= {
                f"{path}/{name}": getattr(item, own)
                for name, own in FIELDS[group].items()
                if name not in GROUPS[group].if_any or len(getattr(item, own))
            }
    datasets = {path: dataset_of(path, array, body.units) for path, array in values.items()}
    return Content(FORMAT, version, datasets, attributes)


def items_of(body: ReducedBody) -> dict[str, tuple[Any, ...]]:
    """Return the objects in each group of `GROUPS`, without the optional groups that the body does not have."""
    always = {
        "/units": (body.units,), "/frame": (body.frame,), "/modes": (body,), "/nodes": (body,), "/surface": (body,),
        "/interfaces/<i>": body.interfaces, "/load_cases/<i>": body.load_cases,
    }  # fmt: skip
    left_out = None if body.errors is None else body.errors.left_out
    parts = {"/kept": body.kept, "/columns": body.columns, "/errors": body.errors, "/nodal_sums": body.nodal_sums,
             "/errors/left_out": left_out,
             "/stress/points": body.point_stress, "/quadratic": None if body.quadratic is None else body}  # fmt: skip
    several = {"/sets/<i>": body.numbering.sets, "/recovery/<i>": tuple(body.recovery.values())}
    return (
        always
        | {group: (part,) for group, part in parts.items() if part is not None}
        | {group: items for group, items in several.items() if items}
    )


def known_terms(missing: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the products P and S_kl and the invariants that a file stores: all without missing terms.

    M* is stored instead of an incomplete S_kl; 2C is among the invariants.
    """
    products = (() if "3C" in missing else ("P",)) + (("M",) if "5C" in missing else ("S_kl",))
    return products, tuple(name for name in INVARIANTS if name not in {f"C{term[0]}" for term in missing})


# Content to body -----------------------------------------------------------------------------------------------------


def body_of(content: Content) -> ReducedBody:
    """Return the body that a file describes; data that older versions lack are None or empty."""
    require_layout(content)
    content = without_version_1(content)
    contents = Contents(content)
    has, part = contents.has, lambda group: item_of(contents, group)
    units = part("/units")
    if UNIT_SYSTEMS.get(units.name, units) != units:
        raise ModalFileError(f"units {units.name!r}: expected the factors of this system, got {units}")
    return ReducedBody(
        name=contents.attribute("/", "name", str),
        units=units,
        frame=part("/frame"),
        moments=moments_of(contents),
        **fields_of(contents, "/modes"),
        **fields_of(contents, "/nodes"),
        **fields_of(contents, "/surface"),
        interfaces=items_in(contents, "/interfaces"),
        provenance={name: str(value) for name, value in content.attributes.get("/provenance", {}).items()},
        columns=part("/columns") if has("/columns") else None,
        nodal_sums=part("/nodal_sums") if has("/nodal_sums") else None,
        errors=errors_of(contents) if has("/errors") else None,
        load_cases=items_in(contents, "/load_cases"),
        stress=contents.value("/stress/nodal") if has("/stress", "has_nodal") else None,
        point_stress=part("/stress/points") if has("/stress", "has_points") else None,
        geometric=geometric_of(contents) if has("/geometric") else None,
        quadratic=contents.value("/quadratic/g") if has("/quadratic") else None,
        numbering=numbering_of(contents),
        kept=part("/kept") if has("/kept") else None,
        recovery=recovery_of(contents, units),
    )


def without_version_1(content: Content) -> Content:
    """Return the content of a file of version 1 as later versions store it.

    Version 1 stores neither the dofs of a nodal frame, nor whether an interface of kind "nodes" has a rotation; the
    interface has one unless its stored rotation is zero.
    """
    if content.version >= 2:
        return content
    datasets = {**content.datasets, "/frame/dofs": Dataset(np.zeros((0, 2), np.int64))}
    attributes, contents = dict(content.attributes), Contents(content)
    for group in contents.numbered("/interfaces"):
        has_rotation = contents.attribute(group, "kind", str) != "nodes" or contents.value(f"{group}/Psi")[3:].any()
        attributes[group] = {**attributes[group], "has_rotation": int(has_rotation)}
    return replace(content, datasets=datasets, attributes=attributes)


def item_of(contents: Contents, group: str, k: int = 0) -> Any:
    """Return the object in a group."""
    holds = GROUPS[group].holds
    assert holds is not None
    return holds(**fields_of(contents, group, k))


def items_in(contents: Contents, group: str) -> tuple[Any, ...]:
    """Return the objects in the numbered groups inside a group."""
    return tuple(item_of(contents, f"{group}/<i>", k) for k in range(len(contents.numbered(group))))


def fields_of(contents: Contents, group: str, k: int = 0) -> dict[str, Any]:
    """Return the fields of the object in a group of `GROUPS`, or in the k-th of its groups."""
    path = group.replace("<i>", str(k))
    layout, known = GROUPS[group], contents.content.datasets
    stored = contents.content.attributes.get(path, {})
    attributes = {
        name: kind(contents.attribute(path, name, int if kind is bool else kind))
        for name, (kind, _) in layout.attributes.items()
        if name not in layout.if_any or name in stored
    }
    datasets = {
        own: () if name in layout.if_any and f"{path}/{name}" not in known else contents.value(f"{path}/{name}")
        for name, own in FIELDS[group].items()
        if name not in layout.follows
    }
    return attributes | datasets


def errors_of(contents: Contents) -> ErrorEstimates:
    """Return the estimated errors, with the left-out shapes if the file has them."""
    left_out = item_of(contents, "/errors/left_out") if contents.has("/errors/left_out") else None
    return replace(item_of(contents, "/errors"), left_out=left_out)


def numbering_of(contents: Contents) -> Numbering:
    """Return the user's numbers and sets; empty if the file has none, as before version 5."""
    known = contents.content.datasets
    arrays = {name: contents.value(path) if path in known else NO_NUMBERS for path, name in NUMBERS.items()}
    instances = contents.value("/instances/names") if contents.has("/instances") else ()
    return Numbering(**arrays, instances=instances, sets=items_in(contents, "/sets"))


def recovery_of(contents: Contents, units: Units) -> dict[str, RecoveryTable]:
    """Return the recovery tables by name.

    Raises
    ------
    ModalFileError
        If a dataset is missing, or stored units do not follow from the dimensions.
    """
    tables: dict[str, RecoveryTable] = {}
    for k, group in enumerate(contents.numbered("/recovery")):
        table = RecoveryTable(system=units, **fields_of(contents, "/recovery/<i>", k))
        if table.name in tables:
            raise ModalFileError(f"{group}: a second recovery table has the name {table.name!r}")
        for name in GROUPS["/recovery/<i>"].follows:
            if (own := getattr(table, name)) and contents.value(f"{group}/{name}") != own:
                raise ModalFileError(
                    f"dataset {group}/{name} does not follow from the dimensions of the rows; the file was written by "
                    "a faulty writer"
                )
        tables[table.name] = table
    return tables


def moments_of(contents: Contents) -> Moments:
    """Return the moments; if terms are missing, the stored invariants give the others."""
    missing: tuple[str, ...] = ()
    if "missing" in contents.content.attributes.get("/moments", {}):
        missing = tuple(contents.attribute("/moments", "missing", str).split())
    names = ("m", "S", "R", "C1", *known_terms(missing)[0])
    known = {name: contents.value(f"/moments/{name}") for name in names}
    if "P" not in known:
        C2 = contents.value("/invariants/C2")
        known["P"] = np.einsum("abc,ck->abk", EPSILON, C2) / 2
    if "S_kl" not in known:
        M = known.pop("M")
        S_kl = np.einsum("ab,kl->abkl", np.eye(3), M) / 3
        if "4C" not in missing:
            C4 = contents.value("/invariants/C4")
            S_kl -= np.einsum("abc,klc->abkl", EPSILON, C4) / 2
        known["S_kl"] = S_kl
    is_exact = bool(contents.attribute("/moments", "is_exact", int))
    return Moments(**known, is_exact=is_exact, missing=missing)


def geometric_of(contents: Contents) -> GeometricStiffness:
    """Return the geometric stiffness; the groups of the interfaces contain the matrices of loads at interfaces."""
    value, paths = contents.value, contents.numbered("/interfaces")
    is_loaded = [f"{path}/K_geometric" in contents.content.datasets for path in paths]
    if contents.content.version < 6:
        is_loaded = [True for _ in is_loaded]
    loaded = [path for path, is_own in zip(paths, is_loaded, strict=True) if is_own]
    n = value("/geometric/spin").shape[-1]

    def loads_of(group: str, name: str, shape: tuple[int, ...]) -> dict[str, np.ndarray]:
        """Return the matrices of all unit loads, by kind of load."""
        of_interfaces = [value(f"{path}/{name}") for path in loaded]
        stacked = np.stack(of_interfaces) if of_interfaces else np.zeros((0, 6, *shape))
        return {each: value(f"{group}/{each}") for each in OF_FRAME} | {"interfaces": stacked}

    turned = RotatedLoads(**loads_of(TURNED, "K_turned", (3, n))) if contents.has(TURNED) else None
    spread = SpreadLoads(**{name: value(f"{SPREAD}/{name}") for name in OF_SPREAD}) if contents.has(SPREAD) else None
    of_loads = loads_of("/geometric", "K_geometric", (n, n))
    return GeometricStiffness(**of_loads, turned=turned, spread=spread, is_loaded=tuple(is_loaded))


def require_same_invariants(content: Content, moments: Moments) -> None:
    """Raise `ModalFileError` unless the stored invariants agree with the moments; they serve other readers."""
    for name in known_terms(moments.missing)[1]:
        stored = Contents(content).value(f"/invariants/{name}")
        expected = getattr(moments, name)
        scale = np.abs(expected).max(initial=0.0)
        if stored.shape != expected.shape or not np.abs(stored - expected).max(initial=0.0) <= INVARIANT_DEFECT * scale:
            raise ModalFileError(
                f"dataset /invariants/{name} does not follow from the moments; the file was written by a faulty writer"
            )


def require_same_frequencies(content: Content, body: ReducedBody) -> None:
    """Raise `ModalFileError` unless the stored frequencies agree with K and M; they serve other readers."""
    stored, own = Contents(content).value("/modes/frequencies"), body.frequencies
    if stored.shape != own.shape or not np.allclose(stored, own, rtol=FREQUENCY_DEFECT, atol=0.0):
        raise ModalFileError(
            "dataset /modes/frequencies does not follow from /modes/K and /modes/M; the file was written by a faulty "
            "writer"
        )
