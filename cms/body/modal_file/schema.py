"""Layout of a modal file: shape, unit and description of every dataset, and the class behind every group.

One table serves writing, reading, checks and conversion of units; docs/modal_file.md repeats it for other readers.

The shapes are M-orthonormal, Phi.T M Phi = 1. A shape therefore has the dimension mass^(-1/2), and q has mass^(1/2)
length.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from cms.body.error_estimates import ErrorEstimates
from cms.body.invariants import NodalSums
from cms.body.kept_points import KeptPoints
from cms.body.left_out_modes import LeftOutModes
from cms.body.modal_file.contents import Content, Contents, Dataset
from cms.body.recovery_table import RecoveryTable
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.body.source_columns import SourceColumns
from cms.body.stress import PointStress
from cms.errors import ModalFileError
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.foundation.arrays import require_shape
from fe_models.foundation.units import UNIT_SYSTEMS, Dimensions, Units, unit_text
from fe_models.meshes.numbering import NamedSet

__all__ = ["ENTRIES", "GROUPS", "Entry", "Group", "dataset_of", "in_units", "require_layout"]

NONE, MASS, LENGTH, RATE = Dimensions(), Dimensions(1), Dimensions(0, 1), Dimensions(0, 0, -1)
SHAPE, TURN = Dimensions(-0.5), Dimensions(-0.5, -1)  #: dimensions of translation and rotation per unit of q
VOLUME = Dimensions(0, 3)
#: attributes of the root that store sizes; every other size belongs to the group of its datasets
SIZES = {"n_q": "n_modes", "n_kept": "n_nodes"}


# datasets -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Entry:
    """Description of one dataset, or of one dataset in each numbered group."""

    shape: str  #: such as "(n_q, 3)", followed by "text" or "integer" if the values are not real numbers
    description: str
    dimensions: Dimensions = NONE
    #: dimensions of rows 3-5 if these are rotations while rows 0-2 are translations; None: as the other rows
    last_rows: Dimensions | None = None
    unit: str = ""  #: text in place of a unit, if each row or column has its own unit

    @property
    def is_text(self) -> bool:
        """Whether the values are strings."""
        return self.shape.endswith("text")

    @property
    def sizes(self) -> list[str]:
        """The size of each axis: a number, a name, or a sum of both."""
        return [size.strip() for size in self.shape[1 : self.shape.index(")")].split(",") if size.strip()]


# fmt: off
ENTRIES = {
    "/frame/origin": Entry("(3,)", "origin of the body frame B in mesh coordinates", LENGTH),
    "/frame/axes": Entry("(3, 3)", "columns: axes of B in mesh axes; c_mesh = origin + axes c_B"),
    "/frame/dofs": Entry(
        "(n_fixed, 2) integer", "dofs that a nodal frame holds: node of the mesh from 0, component (3-5 are rotations)",
    ),
    "/modes/M": Entry("(n_q, n_q)", "modal mass Phi.T M Phi: the identity, zero rows for massless shapes"),
    "/modes/K": Entry(
        "(n_q, n_q)", "modal stiffness Phi.T K Phi: diagonal of squared angular frequencies", Dimensions(0, 0, -2),
    ),
    "/modes/D": Entry("(n_q, n_q)", "modal damping Phi.T D Phi", RATE),
    "/modes/frequencies": Entry(
        "(n_q,)", "of each mode with B held, cycles per time unit; infinite for massless shapes", RATE,
    ),
    "/modes/free_frequencies": Entry(
        "(n_free,)", "elastic frequencies of the unsupported body, ascending, cycles per time unit", RATE,
    ),
    "/modes/labels": Entry("(n_q,) text", "one per mode, in words"),
    "/modes/sources": Entry("(n_sources,) text", "names of the groups of source columns"),
    "/modes/energy_shares": Entry("(n_q, n_sources)", "share of each source (column) in a mode's energy (row)"),
    "/moments/m": Entry("()", "mass", MASS),
    "/moments/S": Entry("(3,)", "first moment, int c_a", Dimensions(1, 1)),
    "/moments/R": Entry("(3, 3)", "second moment, int c_a c_b", Dimensions(1, 2)),
    "/moments/C1": Entry("(3, n_q)", "1C, int phi_a,k", Dimensions(0.5)),
    "/moments/P": Entry("(3, 3, n_q)", "int c_a phi_b,k; index order a, b, k", Dimensions(0.5, 1)),
    "/moments/S_kl": Entry("(3, 3, n_q, n_q)", "int phi_a,k phi_b,l; index order a, b, k, l"),
    "/moments/M": Entry("(n_q, n_q)", "M*, int phi_k . phi_l, of a body whose S_kl is not known"),
    "/invariants/J0": Entry("(3, 3)", "inertia tensor of the undeformed body about the origin of B", Dimensions(1, 2)),
    "/invariants/C1": Entry("(3, n_q)", "1C_k, int phi_k; index order a, k", Dimensions(0.5)),
    "/invariants/C2": Entry("(3, n_q)", "2C_k, int c x phi_k; index order a, k", Dimensions(0.5, 1)),
    "/invariants/C3": Entry(
        "(n_q, 3, 3)", "3C_k, int (c.phi_k 1 - phi_k c^T); index order k, a, b", Dimensions(0.5, 1),
    ),
    "/invariants/C4": Entry("(n_q, n_q, 3)", "4C_kl, int phi_l x phi_k; index order k, l, a"),
    "/invariants/C5": Entry("(n_q, n_q, 3, 3)", "5C_kl, int (phi_k.phi_l 1 - phi_l phi_k^T); index order k, l, a, b"),
    "/nodes/position": Entry("(n_kept, 3)", "undeformed position of the kept nodes in B", LENGTH),
    "/nodes/id": Entry("(n_kept,) integer", "index of the kept nodes in the mesh, from 0"),
    "/nodes/Phi": Entry(
        "(n_kept, 3, n_q)", "translation of the kept nodes in B; index order node, component, mode", SHAPE,
    ),
    "/nodes/label": Entry("(n_kept,) integer", "number of each kept node in the user's mesh or deck; -1: none"),
    "/nodes/on_skin": Entry(
        "(n_kept,) integer", "1: a point of a skin that moves with the node of that number; 0: the node itself",
    ),
    "/nodes/instance": Entry("(n_kept,) integer", "row of /instances/names that a node belongs to; -1: none"),
    "/surface/triangles": Entry("(n_tri, 3) integer", "kept nodes of each triangle, from 0"),
    "/surface/element": Entry(
        "(n_tri,) integer", "number of the element behind each triangle in the user's mesh or deck; -1: none",
    ),
    "/surface/instance": Entry("(n_tri,) integer", "row of /instances/names that the element belongs to; -1: none"),
    "/instances/names": Entry(
        "(n_instances,) text", "what repeats numbers: instances of parts, or bodies that were joined",
    ),
    "/sets/<i>/members": Entry("(n_members,) integer", "rows of /nodes, or of /surface for a set of elements"),
    "/kept/nodes": Entry("(n_points,) integer", "rows of /nodes that have rotations"),
    "/kept/rotation": Entry(
        "(n_points, 3, n_q)", "rotation vector of these nodes in B; index order node, component, mode", TURN,
    ),
    "/kept/source": Entry("(n_points,) text", "where the rotation comes from: dofs, elements, or unknown (zero)"),
    "/interfaces/<i>/position": Entry("(3,)", "undeformed reference point in B", LENGTH),
    "/interfaces/<i>/triad": Entry("(3, 3)", "columns: undeformed axes of the interface in B"),
    "/interfaces/<i>/Psi": Entry(
        "(6, n_q)", "translation and rotation of the reference point in B for each mode", SHAPE, TURN,
    ),
    "/interfaces/<i>/members": Entry("(n_members,) integer", "kept nodes of the interface, from 0"),
    "/interfaces/<i>/K_geometric": Entry(
        "(6, n_q, n_q)",
        "geometric stiffness of a unit force (0-2) and moment (3-5) at the reference point, axes of B; index "
        "order load, k, l", Dimensions(-1, -1), Dimensions(-1, -2),
    ),
    "/interfaces/<i>/K_turned": Entry(
        "(6, 3, n_q)",
        "the same over a rotation about an axis of B and a mode; index order load, axis, k",
        Dimensions(-0.5), Dimensions(-0.5, -1),
    ),
    "/columns/labels": Entry("(n_columns,) text", "one per column of the mode set, in words"),
    "/columns/groups": Entry("(n_columns,) text", "the source each column belongs to"),
    "/columns/A": Entry(
        "(n_columns, n_q)", "coordinates of the modes in the columns, scaled; index order column, mode", RATE,
    ),
    "/columns/F": Entry(
        "(n_columns, n_q)",
        "forces of the modes on the columns, scaled; A F: part of a column in a mode's energy", RATE,
    ),
    "/errors/frequency": Entry(
        "(n_judged,)", "estimate of f_reduced / f - 1 of the lowest free frequencies; the exact error is not smaller",
    ),
    "/errors/bound": Entry("(n_judged,)", "bound of |(f_reduced / f)^2 - 1| for some exact frequency f"),
    "/errors/shape": Entry(
        "(n_judged,)", "estimated error of the shape in the norm of strain energy, relative to the shape",
    ),
    "/errors/response": Entry(
        "(n_judged,)", "estimated relative error of the receptance between the interfaces around each frequency",
    ),
    "/errors/interface_loads": Entry("(n_loads,) text", "one per unit load at the interfaces, in words"),
    "/errors/interface": Entry(
        "(n_loads,)", "error of the static response to each of these loads in the norm of strain energy; NaN: the load "
        "does not deform the body",
    ),
    "/errors/inertia": Entry("(n_r,)", "the same for each rigid-body acceleration with fixed interfaces"),
    "/errors/mesh": Entry(
        "(n_judged,)", "estimated relative error of these frequencies of the finite element model by its mesh; NaN: "
        "not known; 10: 10 or more",
    ),
    "/errors/largest": Entry(
        "(n_judged,)", "largest f_reduced / f - 1 of these frequencies with modes that the set may lack; NaN: not "
        "limited",
    ),
    "/errors/left_out/mass": Entry(
        "(n_shapes,)", "1 / omega^2 of each vibration shape of modes and left-out shapes together; 0: massless",
        Dimensions(0, 0, 2),
    ),
    "/errors/left_out/shares": Entry("(n_left, n_shapes)", "part of each left-out shape in each vibration shape"),
    "/errors/left_out/inertia": Entry(
        "(n_q, n_left)", "-Phi.T M W, force on each left-out shape by modal accelerations; W.T K W = 1, W.T K Phi = 0",
        Dimensions(0, 0, 1),
    ),
    "/errors/left_out/interfaces": Entry(
        "(6, n_interfaces, n_left)",
        "force on each left-out shape by a unit force (0-2) and moment (3-5) on each interface, axes of B",
        Dimensions(-0.5, 0, 1), Dimensions(-0.5, -1, 1),
    ),
    "/errors/left_out/spin": Entry(
        "(6, n_left)", "force on each left-out shape by products of angular velocities (xx yy zz xy yz zx)",
        Dimensions(0.5, 1, 1),
    ),
    "/errors/left_out/load_cases": Entry(
        "(n_cases, n_left)", "force on each left-out shape by each load case", Dimensions(0.5, 1, -1),
    ),
    "/nodal_sums/w": Entry("()", "sum over the nodes of their weight w, the volume each stands for", VOLUME),
    "/nodal_sums/S": Entry("(3,)", "sum of w c_a", Dimensions(0, 4)),
    "/nodal_sums/R": Entry("(3, 3)", "sum of w c_a c_b", Dimensions(0, 5)),
    "/nodal_sums/U1": Entry("(3, n_q)", "sum of w phi_a,k; index order a, k", Dimensions(-0.5, 3)),
    "/nodal_sums/U2": Entry("(3, n_q)", "sum of w (c x phi_k)_a; index order a, k", Dimensions(-0.5, 4)),
    "/geometric/translation": Entry(
        "(3, n_q, n_q)",
        "geometric stiffness K_t,a of the loads -rho e_a of a frame acceleration minus gravity; index order a, k,"
        " l", Dimensions(0, -1),
    ),
    "/geometric/rotation": Entry(
        "(3, n_q, n_q)", "K_r,a of the loads -rho e_a x c of an angular acceleration; index order a, k, l",
    ),
    "/geometric/spin": Entry(
        "(6, n_q, n_q)",
        "K_ab of -rho/2 [e_a x (e_b x c) + e_b x (e_a x c)], products of angular velocities; index order ab (xx "
        "yy zz xy yz zx), k, l",
    ),
    "/geometric/turned/translation": Entry(
        "(3, 3, n_q)", "K_t,a over a rotation about an axis of B and a mode; index order a, axis, k", Dimensions(0.5),
    ),
    "/geometric/turned/rotation": Entry("(3, 3, n_q)", "K_r,a likewise", Dimensions(0.5, 1)),
    "/geometric/turned/spin": Entry("(6, 3, n_q)", "K_ab likewise", Dimensions(0.5, 1)),
    "/geometric/spread/K": Entry(
        "(6, n_q, n_q)",
        "geometric stiffness of loads spread over the nodes by their weight, (w_i/w) e_a (0-2) and (w_i/w) e_a x "
        "c_i (3-5); index order load, k, l", Dimensions(-1, -1), Dimensions(-1),
    ),
    "/geometric/spread/turned": Entry(
        "(6, 3, n_q)",
        "the same over a rotation about an axis of B and a mode; index order load, axis, k",
        Dimensions(-0.5), Dimensions(-0.5, 1),
    ),
    "/geometric/spread/turned_rigid": Entry(
        "(6, 3, 3)",
        "work of these loads, turned about an axis of B, on the rotations e_b x c; index order load, axis, b",
        Dimensions(0, 1), Dimensions(0, 2),
    ),
    "/quadratic/g": Entry(
        "(n_kept, 3, n_q, n_q)",
        "displacement of second order of the kept nodes in B, 1/2 sum q_k q_l g_kl; index order node, component, "
        "k, l", Dimensions(-1, -1),
    ),
    "/load_cases/<i>/force": Entry("(3,)", "resultant force in B", Dimensions(1, 1, -2)),
    "/load_cases/<i>/torque": Entry("(3,)", "resultant torque about the origin of B", Dimensions(1, 2, -2)),
    "/load_cases/<i>/h": Entry("(n_q,)", "modal forces Phi.T f", Dimensions(0.5, 1, -2)),
    "/stress/nodal": Entry(
        "(n_kept, 6, n_q)",
        "stress of each mode at the kept nodes in axes of B; index order node, component (xx yy zz yz xz xy), "
        "mode", Dimensions(0.5, -2, -2),
    ),
    "/stress/points/names": Entry("(n_points,) text", "one per stress point, in words"),
    "/stress/points/position": Entry("(n_points, 3)", "undeformed position of the stress points in B", LENGTH),
    "/stress/points/modes": Entry(
        "(n_points, 6, n_q)",
        "stress of each mode at the stress points; index order as /stress/nodal", Dimensions(0.5, -2, -2),
    ),
    "/recovery/<i>/labels": Entry("(n_rows,) text", "one per row, each once"),
    "/recovery/<i>/quantities": Entry("(n_rows,) text", "what each row is"),
    "/recovery/<i>/entities": Entry(
        "(n_rows,) text", "what each row belongs to: node, element, interface, point or body",
    ),
    "/recovery/<i>/components": Entry("(n_rows,) text", "component of each row, mesh axes or those of the element"),
    "/recovery/<i>/loads": Entry("(n_loads,) text", "one per column of static"),
    "/recovery/<i>/numbers": Entry(
        "(n_rows,) integer", "number of the node or element of each row; -1 where it has a name only",
    ),
    "/recovery/<i>/dimensions": Entry("(n_rows, 3)", "exponents of mass, length and time of each row"),
    "/recovery/<i>/load_dimensions": Entry(
        "(n_loads, 3)", "exponents of mass, length and time of the amplitude of each load",
    ),
    "/recovery/<i>/units": Entry("(n_rows,) text", "unit of each row"),
    "/recovery/<i>/load_units": Entry("(n_loads,) text", "unit of the amplitude of each load"),
    "/recovery/<i>/dynamic": Entry(
        "(3, n_rows, 6 + n_q)",
        "factors of z = (d, theta, q), of its rate and of its acceleration; index order derivative, row, "
        "component of z", unit="of the row per that of z",
    ),
    "/recovery/<i>/static": Entry(
        "(n_rows, n_loads)",
        "residual static response to each load; index order row, load", unit="of the row per that of the load",
    ),
}  #: description by path; `<i>` stands for the number of a group
# fmt: on


def entry_of(path: str) -> Entry | None:
    """Return the description of a dataset; None if a modal file has no such dataset."""
    return ENTRIES.get(re.sub(r"/\d+/", "/<i>/", path))


def dataset_of(path: str, values: Any, units: Units) -> Dataset:
    """Return a dataset with its description and its unit in ASCII; both units if its rows differ."""
    known = entry_of(path)
    if known is None:
        raise ModalFileError(f"dataset {path} is not among those of a modal file: {', '.join(ENTRIES)}")
    unit = known.unit or unit_text(units, known.dimensions)
    if known.last_rows is not None:
        unit = f"{unit} (rows 0-2), {unit_text(units, known.last_rows)} (rows 3-5)"
    return Dataset(values if isinstance(values, tuple) else np.asarray(values), unit, known.description)


def require_layout(content: Content) -> None:
    """Raise an error that names the dataset, unless all known datasets have their kind of values and their shape.

    Datasets that are not in the table are ignored.
    """
    root = Contents(content)
    found = {("", name): root.attribute("/", key, int) for name, key in SIZES.items()}
    for path, dataset in content.datasets.items():
        known = entry_of(path)
        if known is None:
            continue
        if isinstance(dataset.values, tuple) != known.is_text:
            expected, got = ("text", "numbers") if known.is_text else ("numbers", "text")
            raise ModalFileError(f"dataset {path}: expected {expected}, got {got}")
        values = np.asarray(dataset.values)
        group = path.rpartition("/")[0]
        shape = []
        for axis, size in enumerate(known.sizes):
            constant, _, name = size.rpartition("+") if "+" in size else ("", "", size)
            if name.strip().isdigit():
                shape.append(int(name))
                continue
            name, offset = name.strip(), int(constant or 0)
            own = values.shape[axis] - offset if axis < values.ndim else 0
            shape.append(offset + found.setdefault(("" if name in SIZES else group, name), own))
        require_shape(f"dataset {path}", values, tuple(shape))


def in_units(content: Content, old: Units, new: Units) -> Content:
    """Return the content of a modal file with its numbers converted to other units, without recovery tables."""
    attributes = {group: own for group, own in content.attributes.items() if not group.startswith("/recovery")}
    attributes["/units"] = {each.name: getattr(new, each.name) for each in fields(Units)}
    weights = attributes.get("/nodal_sums", {})
    datasets = {}
    for path, dataset in content.datasets.items():
        found = entry_of(path)
        if found is None or path.startswith("/recovery/"):
            continue
        values = dataset.values
        if isinstance(values, np.ndarray) and values.dtype.kind == "f":
            dimensions = found.dimensions
            # the weights count nodes and are not volumes
            if path.startswith("/nodal_sums/") and not weights.get("is_volume", 1):
                dimensions = Dimensions(dimensions.mass, dimensions.length - VOLUME.length, dimensions.time)
            values = values * dimensions.factor(old, new)
            if found.last_rows is not None:
                values[3:] = dataset.values[3:] * found.last_rows.factor(old, new)
        datasets[path] = dataset_of(path, values, new)
    return Content(content.format, content.version, datasets, attributes)


# groups ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Group:
    """Class behind a group: its fields are the attributes and the datasets of the group, by the same names."""

    holds: type
    attributes: Mapping[str, type] = field(default_factory=dict)  #: type of each attribute; bool is stored as 0 or 1
    names: Mapping[str, str] = field(default_factory=dict)  #: field of each dataset that has another name
    follows: tuple[str, ...] = ()  #: derived datasets, for other readers
    if_any: tuple[str, ...] = ()  #: lists and attributes that are left out if they are empty


NAME_AND_KIND = {"name": str, "kind": str}
GROUPS = {
    "/units": Group(Units, {each.name: type(getattr(UNIT_SYSTEMS["m-kg-s"], each.name)) for each in fields(Units)}),
    "/frame": Group(BodyFrame, {"kind": str, "at": str}),
    "/modes": Group(ReducedBody, follows=("frequencies",)),
    "/nodes": Group(ReducedBody, names={"position": "nodes", "id": "node_ids"}),
    "/surface": Group(ReducedBody, names={"triangles": "surface"}),
    "/interfaces/<i>": Group(ReducedInterface, NAME_AND_KIND | {"has_rotation": bool}),
    "/load_cases/<i>": Group(ReducedLoadCase, NAME_AND_KIND),
    "/sets/<i>": Group(NamedSet, NAME_AND_KIND | {"size": int}),
    "/kept": Group(KeptPoints),
    "/columns": Group(SourceColumns),
    "/errors": Group(
        ErrorEstimates,
        {"method": str, "date": str, "mesh_sign": str, "mesh_method": str},
        if_any=("response", "interface_loads", "mesh", "mesh_sign", "mesh_method", "largest"),
    ),
    "/errors/left_out": Group(LeftOutModes),
    "/nodal_sums": Group(NodalSums, {"is_volume": bool}),
    "/quadratic": Group(ReducedBody, names={"g": "quadratic"}),
    "/stress/points": Group(PointStress, names={"position": "positions"}),
    "/recovery/<i>": Group(
        RecoveryTable,
        {"name": str, "truncated": str},
        follows=("units", "load_units"),
        if_any=("loads", "load_units"),
    ),
}  #: groups whose content is one object of a class
