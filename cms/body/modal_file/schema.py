"""Layout of a modal file: shape, unit and description of every dataset, and meaning and class of every group.

One table serves writing, reading, checks, conversion of units, and the reference page of the site.

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
from fe_models.foundation.units import Dimensions, Units, unit_text
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
        "(n_fixed, 2) integer",
        "dofs that a nodal frame fixes: node of the mesh from 0, component 0-2 translation, 3-5 rotation, mesh axes; "
        "six rows or none",
    ),
    "/modes/M": Entry("(n_q, n_q)", "modal mass Phi.T M Phi: the identity, zero rows for massless shapes"),
    "/modes/K": Entry(
        "(n_q, n_q)", "modal stiffness Phi.T K Phi: diagonal of squared angular frequencies", Dimensions(0, 0, -2),
    ),
    "/modes/D": Entry("(n_q, n_q)", "modal viscous damping Phi.T D Phi", RATE),
    "/modes/frequencies": Entry(
        "(n_q,)",
        "frequency of each mode with B fixed, sqrt(K_kk / M_kk) / 2 pi, cycles per time unit; infinite for massless "
        "shapes", RATE,
    ),
    "/modes/free_frequencies": Entry(
        "(n_free,)",
        "elastic frequencies without joints, ascending, cycles per time unit; of a held body with its supports", RATE,
    ),
    "/modes/labels": Entry("(n_q,) text", "description of each mode: the sources of its energy"),
    "/modes/sources": Entry("(n_sources,) text", "names of the groups of source columns"),
    "/modes/energy_shares": Entry("(n_q, n_sources)", "share of each source (column) in the energy of each mode (row)"),
    "/moments/m": Entry("()", "mass", MASS),
    "/moments/S": Entry("(3,)", "first moment, int c_a", Dimensions(1, 1)),
    "/moments/R": Entry("(3, 3)", "second moment, int c_a c_b", Dimensions(1, 2)),
    "/moments/C1": Entry("(3, n_q)", "1C, int phi_a,k", Dimensions(0.5)),
    "/moments/P": Entry("(3, 3, n_q)", "int c_a phi_b,k; index order a, b, k", Dimensions(0.5, 1)),
    "/moments/S_kl": Entry("(3, 3, n_q, n_q)", "int phi_a,k phi_b,l; index order a, b, k, l"),
    "/moments/M": Entry("(n_q, n_q)", "M*, int phi_k . phi_l; exists in place of S_kl if 5C is missing"),
    "/invariants/J0": Entry("(3, 3)", "inertia tensor of the undeformed body about the origin of B", Dimensions(1, 2)),
    "/invariants/C1": Entry("(3, n_q)", "1C_k, int phi_k; index order a, k", Dimensions(0.5)),
    "/invariants/C2": Entry("(3, n_q)", "2C_k, int c x phi_k; index order a, k", Dimensions(0.5, 1)),
    "/invariants/C3": Entry(
        "(n_q, 3, 3)", "3C_k, int (c.phi_k 1 - phi_k c^T); index order k, a, b", Dimensions(0.5, 1),
    ),
    "/invariants/C4": Entry("(n_q, n_q, 3)", "4C_kl, int phi_l x phi_k; index order k, l, a"),
    "/invariants/C5": Entry("(n_q, n_q, 3, 3)", "5C_kl, int (phi_k.phi_l 1 - phi_l phi_k^T); index order k, l, a, b"),
    "/nodes/position": Entry(
        "(n_kept, 3)",
        "undeformed position in B of the kept nodes: surface, members of interfaces, reference nodes", LENGTH,
    ),
    "/nodes/id": Entry("(n_kept,) integer", "index of the kept nodes in the original model, from 0"),
    "/nodes/Phi": Entry(
        "(n_kept, 3, n_q)", "translation of the kept nodes in B; index order node, component, mode", SHAPE,
    ),
    "/nodes/label": Entry(
        "(n_kept,) integer", "version 5, optional: number of each kept node in the user's mesh or deck; -1: none",
    ),
    "/nodes/on_skin": Entry(
        "(n_kept,) integer",
        "version 5, optional: 1: a point on the skin of beams or shells, which moves with the node of that number; 0: "
        "the node itself",
    ),
    "/nodes/instance": Entry("(n_kept,) integer", "version 5, optional: row of /instances/names; -1: none"),
    "/surface/triangles": Entry(
        "(n_tri, 3) integer", "rows of /nodes at the corners of each triangle; outward by the right-hand rule",
    ),
    "/surface/element": Entry(
        "(n_tri,) integer",
        "version 5, optional: number of the element behind each triangle in the user's mesh or deck; -1: none",
    ),
    "/surface/instance": Entry("(n_tri,) integer", "version 5, optional: row of /instances/names; -1: none"),
    "/instances/names": Entry(
        "(n_instances,) text", "instances or joined bodies that repeat numbers; node 12 of PART-1-1 is PART-1-1.12",
    ),
    "/sets/<i>/members": Entry(
        "(n_members,) integer", "rows of /nodes, or of /surface for a set of elements; includes points of a skin",
    ),
    "/kept/nodes": Entry("(n_points,) integer", "rows of /nodes that have rotations, ascending"),
    "/kept/rotation": Entry(
        "(n_points, 3, n_q)",
        "rotation vector of these nodes in B, first order; zero if unknown; index order node, component, mode", TURN,
    ),
    "/kept/source": Entry(
        "(n_points,) text",
        "source of the rotation: dofs (of the model), elements (half the curl of the displacement) or unknown",
    ),
    "/interfaces/<i>/position": Entry("(3,)", "undeformed reference point in B", LENGTH),
    "/interfaces/<i>/triad": Entry("(3, 3)", "columns: undeformed axes of the interface in B"),
    "/interfaces/<i>/Psi": Entry(
        "(6, n_q)", "translation (0-2) and rotation (3-5) of the reference point in B for each mode", SHAPE, TURN,
    ),
    "/interfaces/<i>/members": Entry("(n_members,) integer", "rows of /nodes of the member nodes"),
    "/interfaces/<i>/K_geometric": Entry(
        "(6, n_q, n_q)",
        "with /geometric: geometric stiffness of a unit force (0-2) and moment (3-5) at the reference point, axes of "
        "B; index order load, k, l", Dimensions(-1, -1), Dimensions(-1, -2),
    ),
    "/interfaces/<i>/K_turned": Entry(
        "(6, 3, n_q)",
        "with /geometric/turned: product of K_geometric with a rotation about an axis of B and a mode; index order "
        "load, axis, k", Dimensions(-0.5), Dimensions(-0.5, -1),
    ),
    "/columns/labels": Entry("(n_columns,) text", "descriptions of the columns of the mode set"),
    "/columns/groups": Entry("(n_columns,) text", "source of each column, one of /modes/sources"),
    "/columns/A": Entry(
        "(n_columns, n_q)", "coefficients of the modes in the columns; each row has its own scale", RATE,
    ),
    "/columns/F": Entry(
        "(n_columns, n_q)",
        "forces of the modes on the columns; A_ck F_ck is the part of column c in the energy phi_k^T K phi_k", RATE,
    ),
    "/errors/frequency": Entry(
        "(n_judged,)",
        "estimate of f_reduced / f - 1 for the lowest of /modes/free_frequencies; the exact error is not smaller",
    ),
    "/errors/bound": Entry("(n_judged,)", "bound of |(f_reduced / f)^2 - 1| for some exact frequency f"),
    "/errors/shape": Entry("(n_judged,)", "estimated relative error of the shape in the norm of strain energy"),
    "/errors/response": Entry(
        "(n_judged,)",
        "optional: estimated relative error of the receptance between interfaces around each frequency",
    ),
    "/errors/interface_loads": Entry("(n_loads,) text", "names of the unit loads at the interfaces"),
    "/errors/interface": Entry(
        "(n_loads,)", "error of the static response to each load in the norm of strain energy; NaN: no deformation",
    ),
    "/errors/inertia": Entry("(n_r,)", "the same for each rigid-body acceleration with fixed interfaces"),
    "/errors/mesh": Entry(
        "(n_judged,)",
        "optional: estimated relative error of these frequencies by the mesh; NaN: not known; 10: 10 or more",
    ),
    "/errors/largest": Entry("(n_judged,)", "optional: largest f_reduced / f - 1; NaN: no limit"),
    "/errors/left_out/mass": Entry(
        "(n_shapes,)", "1 / omega^2 of each vibration shape of modes and left-out shapes together; 0: massless",
        Dimensions(0, 0, 2),
    ),
    "/errors/left_out/shares": Entry("(n_left, n_shapes)", "part of each left-out shape in each vibration shape"),
    "/errors/left_out/inertia": Entry(
        "(n_q, n_left)", "force on each left-out shape by modal accelerations, -Phi.T M W", Dimensions(0, 0, 1),
    ),
    "/errors/left_out/interfaces": Entry(
        "(6, n_interfaces, n_left)",
        "force on each left-out shape by a unit force (0-2) and moment (3-5) on each interface, axes of B",
        Dimensions(-0.5, 0, 1), Dimensions(-0.5, -1, 1),
    ),
    "/errors/left_out/spin": Entry(
        "(6, n_left)",
        "force on each left-out shape by products of angular velocities (xx yy zz xy yz zx); zero if unknown",
        Dimensions(0.5, 1, 1),
    ),
    "/errors/left_out/load_cases": Entry(
        "(n_cases, n_left)", "force on each left-out shape by each load case", Dimensions(0.5, 1, -1),
    ),
    "/nodal_sums/w": Entry("()", "sum of the weights w of the nodes, their shares of the volume", VOLUME),
    "/nodal_sums/S": Entry("(3,)", "sum of w c_a", Dimensions(0, 4)),
    "/nodal_sums/R": Entry("(3, 3)", "sum of w c_a c_b", Dimensions(0, 5)),
    "/nodal_sums/U1": Entry("(3, n_q)", "sum of w phi_a,k; index order a, k", Dimensions(-0.5, 3)),
    "/nodal_sums/U2": Entry("(3, n_q)", "sum of w (c x phi_k)_a; index order a, k", Dimensions(-0.5, 4)),
    "/geometric/translation": Entry(
        "(3, n_q, n_q)",
        "K_t,a of the loads -rho e_a of a frame acceleration minus gravity; index order a, k, l", Dimensions(0, -1),
    ),
    "/geometric/rotation": Entry(
        "(3, n_q, n_q)", "K_r,a of the loads -rho e_a x c of an angular acceleration; index order a, k, l",
    ),
    "/geometric/spin": Entry(
        "(6, n_q, n_q)",
        "K_ab of -rho/2 [e_a x (e_b x c) + e_b x (e_a x c)], products of angular velocities; index order ab (xx "
        "yy zz xy yz zx), k, l",
    ),
    "/geometric/turned/translation": Entry("(3, 3, n_q)", "of K_t,a; index order a, axis, k", Dimensions(0.5)),
    "/geometric/turned/rotation": Entry("(3, 3, n_q)", "of K_r,a; index order a, axis, k", Dimensions(0.5, 1)),
    "/geometric/turned/spin": Entry("(6, 3, n_q)", "of K_ab; index order ab, axis, k", Dimensions(0.5, 1)),
    "/geometric/spread/K": Entry(
        "(6, n_q, n_q)",
        "geometric stiffness of the loads (w_i/w) e_a (0-2) and (w_i/w) e_a x c_i (3-5) on all nodes, w_i as in "
        "/nodal_sums; index order load, k, l", Dimensions(-1, -1), Dimensions(-1),
    ),
    "/geometric/spread/turned": Entry(
        "(6, 3, n_q)", "product of K with a rotation about an axis of B and a mode; index order load, axis, k",
        Dimensions(-0.5), Dimensions(-0.5, 1),
    ),
    "/geometric/spread/turned_rigid": Entry(
        "(6, 3, 3)",
        "work of these loads, rotated about an axis of B, on the rotations e_b x c; index order load, axis, b",
        Dimensions(0, 1), Dimensions(0, 2),
    ),
    "/quadratic/g": Entry(
        "(n_kept, 3, n_q, n_q)",
        "displacement of second order of the kept nodes in B, 1/2 sum q_k q_l g_kl; index order node, component, "
        "k, l", Dimensions(-1, -1),
    ),
    "/load_cases/<i>/force": Entry("(3,)", "resultant force in B, for an amplitude of 1", Dimensions(1, 1, -2)),
    "/load_cases/<i>/torque": Entry(
        "(3,)", "resultant torque about the origin of B, undeformed body", Dimensions(1, 2, -2),
    ),
    "/load_cases/<i>/h": Entry("(n_q,)", "modal forces Phi.T f", Dimensions(0.5, 1, -2)),
    "/stress/nodal": Entry(
        "(n_kept, 6, n_q)",
        "optional: stress of each mode at the kept nodes in axes of B; index order node, component (xx yy zz yz xz "
        "xy), mode", Dimensions(0.5, -2, -2),
    ),
    "/stress/points/names": Entry("(n_points,) text", "names of the stress points"),
    "/stress/points/position": Entry("(n_points, 3)", "undeformed position of the stress points in B", LENGTH),
    "/stress/points/modes": Entry(
        "(n_points, 6, n_q)",
        "stress of each mode at the stress points; index order as /stress/nodal", Dimensions(0.5, -2, -2),
    ),
    "/recovery/<i>/labels": Entry("(n_rows,) text", "unique names of the rows, such as node 17 acceleration ux"),
    "/recovery/<i>/quantities": Entry(
        "(n_rows,) text",
        "quantity of each row, such as beam force: one of those of [recovery.NAME] in a job, or its name in another "
        "program",
    ),
    "/recovery/<i>/entities": Entry(
        "(n_rows,) text", "object to which each row belongs: node, element, interface, point or body",
    ),
    "/recovery/<i>/components": Entry(
        "(n_rows,) text", "component of each row, such as ux, xx or end A My; mesh axes or those of the element",
    ),
    "/recovery/<i>/loads": Entry("(n_loads,) text", "names of the loads, columns of static; missing if there are none"),
    "/recovery/<i>/numbers": Entry(
        "(n_rows,) integer", "number of the node or element of each row; -1 if it only has a name",
    ),
    "/recovery/<i>/dimensions": Entry("(n_rows, 3)", "exponents of mass, length and time of each row"),
    "/recovery/<i>/load_dimensions": Entry(
        "(n_loads, 3)", "exponents of mass, length and time of the amplitude of each load",
    ),
    "/recovery/<i>/units": Entry("(n_rows,) text", "unit of each row; follows from the dimensions"),
    "/recovery/<i>/load_units": Entry(
        "(n_loads,) text", "unit of the amplitude of each load; missing if there are none",
    ),
    "/recovery/<i>/dynamic": Entry(
        "(3, n_rows, 6 + n_q)",
        "factors of z = (d, theta, q), of its rate and of its acceleration; index order derivative, row, "
        "component of z", unit="of the row per that of z",
    ),
    "/recovery/<i>/static": Entry(
        "(n_rows, n_loads)",
        "residual static response to each load of amplitude one; index order row, load",
        unit="of the row per that of the load",
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
    """Meaning of a group, and the class whose fields are its attributes and datasets, by the same names."""

    meaning: str
    holds: type[Any] | None = None  #: None: `content.py` reads and writes the group
    #: type and meaning of each attribute; bool is stored as 0 or 1
    attributes: Mapping[str, tuple[type, str]] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)  #: field of each dataset that has another name
    follows: tuple[str, ...] = ()  #: derived datasets, for other readers
    if_any: tuple[str, ...] = ()  #: lists and attributes that are left out if they are empty


GROUPS = {
    "/": Group(
        "The root of the file.",
        attributes={
            "format": (str, "modal-file"),
            "version": (
                int,
                "format version, the lowest that can hold the body; readers refuse versions above their own",
            ),
            "name": (str, "name of the body"),
            "n_modes": (int, "n_q"),
            "n_nodes": (int, "n_kept"),
            "digest": (str, "sha256 over all contents, 64 hexadecimal digits"),
        },
    ),
    "/units": Group(
        "The coherent unit system of all numbers.",
        Units,
        {
            "name": (str, "such as mm-t-s"),
            "length": (float, "SI value of one unit [m]"),
            "mass": (float, "SI value of one unit [kg]"),
            "time": (float, "SI value of one unit [s]"),
            "length_symbol": (str, "such as mm"),
            "mass_symbol": (str, "such as t"),
            "time_symbol": (str, "such as s"),
            "force_symbol": (str, "such as N"),
            "stress_symbol": (str, "such as MPa"),
        },
    ),
    "/frame": Group(
        "The body frame B.",
        BodyFrame,
        {
            "kind": (
                str,
                "nodal, tisserand or buckens; held (version 3): fixed to the ground, not for a floating frame",
            ),
            "at": (str, "interface that carries a nodal frame; empty: none, or other dofs"),
        },
    ),
    "/modes": Group(
        "Matrices and frequencies of the modes.",
        ReducedBody,
        follows=("frequencies",),
    ),
    "/moments": Group(
        "Integrals over the mass.",
        attributes={
            "is_exact": (int, "1: integrals of the elements; 0: approximated from bare matrices"),
            "missing": (
                str,
                "optional, since version 4: the unknown terms among 3C 4C 5C, whose datasets do not exist",
            ),
        },
    ),
    "/invariants": Group("The moments again, in the usual form."),
    "/nodes": Group(
        "The kept nodes.",
        ReducedBody,
        names={"position": "nodes", "id": "node_ids"},
    ),
    "/surface": Group("The surface for drawing.", ReducedBody, names={"triangles": "surface"}),
    "/instances": Group("Optional, since version 5."),
    "/sets/<i>": Group(
        "Optional, since version 5: a set of the user.",
        NamedSet,
        {
            "name": (str, "name of the set in the user's mesh or deck"),
            "kind": (str, "nodes or elements"),
            "size": (int, "size of the whole set, of which the file keeps a part"),
        },
    ),
    "/kept": Group("Optional, since version 5: nodes with rotations.", KeptPoints),
    "/interfaces/<i>": Group(
        "An interface.",
        ReducedInterface,
        {
            "name": (str, "name of the interface, any text"),
            "kind": (str, "rigid (RBE2), distributing (RBE3) or nodes"),
            "has_rotation": (bool, "0: rows 3-5 of Psi are zero because the members lie on one line; else 1"),
        },
    ),
    "/geometric": Group(
        "Optional: geometric stiffness. With it every interface has its K_geometric, except in version 6 those whose "
        "loads were left out and do not stiffen the body.",
    ),
    "/geometric/turned": Group(
        "Optional, since version 4: products of the geometric stiffness with a rotation about an axis of B and a mode. "
        "With it every K_geometric has its K_turned.",
    ),
    "/geometric/spread": Group(
        "Optional, since version 4, only with /geometric/turned and /nodal_sums: loads spread over the nodes.",
    ),
    "/quadratic": Group("Optional, only with /geometric.", ReducedBody, names={"g": "quadratic"}),
    "/load_cases/<i>": Group(
        "A load case.",
        ReducedLoadCase,
        {
            "name": (str, "name of the load case, any text"),
            "kind": (str, "kind of load, such as pressure, gravity or force"),
        },
    ),
    "/stress": Group(
        "Stress per unit of q.",
        attributes={
            "has_nodal": (int, "1: /stress/nodal exists"),
            "has_points": (int, "1: /stress/points exists"),
        },
    ),
    "/stress/points": Group(
        "Optional: further points, such as outer points of beam sections.",
        PointStress,
        names={"position": "positions"},
    ),
    "/recovery/<i>": Group(
        "Optional, since version 5: a recovery table.",
        RecoveryTable,
        {
            "name": (str, "name of the table, unique, any text"),
            "truncated": (str, "description of what its rows leave out"),
        },
        follows=("units", "load_units"),
        if_any=("loads", "load_units"),
    ),
    "/errors": Group(
        "Optional: estimated errors.",
        ErrorEstimates,
        {
            "method": (str, "how the errors were estimated"),
            "date": (str, "day of the estimate, such as 2027-01-31"),
            "mesh_sign": (
                str,
                "optional: +: the frequencies with errors by the mesh are too high; +-: too high or too low; signed: "
                "too high where the error is positive",
            ),
            "mesh_method": (str, "optional: how the errors by the mesh were estimated, or why they are not known"),
        },
        if_any=("response", "interface_loads", "mesh", "mesh_sign", "mesh_method", "largest"),
    ),
    "/errors/left_out": Group("Optional: shapes that the modes leave out.", LeftOutModes),
    "/columns": Group("Optional: columns of the mode set.", SourceColumns),
    "/nodal_sums": Group(
        "Optional: sums over the nodes, from which a Buckens frame follows.",
        NodalSums,
        {
            "is_volume": (
                bool,
                "1: w is a volume; 0: every node has the weight 1, and the factor length^3 is absent "
                "from all units of this group",
            ),
        },
    ),
    "/provenance": Group("Origin of the body, as attributes of any name: mesh and its digest, options, versions."),
}  #: every group of a modal file
