"""All datasets of a modal file with their dimensions and descriptions (specified in docs/modal_file.md).

The shapes are M-orthonormal, Phi.T M Phi = 1. A shape therefore has the dimension mass^(-1/2), and q has mass^(1/2)
length.
"""

import re
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from cms.body.modal_file.contents import Content, Contents, Dataset
from cms.body.modal_file.recovery import GROUP as RECOVERY
from cms.body.modal_file.recovery import recovery_of, recovery_values
from cms.errors import ModalFileError
from fe_models.foundation.units import Dimensions, Units, unit_text

__all__ = ["ENTRIES", "Dimensions", "Entry", "dataset_of", "in_units", "unit_text"]


NONE, MASS, LENGTH, RATE = Dimensions(), Dimensions(1), Dimensions(0, 1), Dimensions(0, 0, -1)
SHAPE, TURN = Dimensions(-0.5), Dimensions(-0.5, -1)  #: dimensions of translation and rotation per unit of q
VOLUME = Dimensions(0, 3)


@dataclass(frozen=True)
class Entry:
    """Description of one dataset, or of one dataset in each numbered group."""

    dimensions: Dimensions
    description: str
    #: dimensions of rows 3-5 if these are rotations while rows 0-2 are translations; None: as the other rows
    last_rows: Dimensions | None = None
    unit: str = ""  #: text in place of a unit, if each row or column has its own unit


def entry(description: str, dimensions: Dimensions = NONE, last_rows: Dimensions | None = None) -> Entry:
    """Return the description of a dataset, dimensionless by default."""
    return Entry(dimensions, description, last_rows)


# fmt: off
ENTRIES = {
    "/frame/origin": entry("origin of the body frame B in mesh coordinates", LENGTH),
    "/frame/axes": entry("columns: axes of B in mesh axes; c_mesh = origin + axes c_B"),
    "/frame/dofs": entry("dofs that a nodal frame holds: node of the mesh from 0, component (3-5 are rotations)"),
    "/modes/M": entry("modal mass Phi.T M Phi: the identity, zero rows for massless shapes"),
    "/modes/K": entry("modal stiffness Phi.T K Phi: diagonal of squared angular frequencies", Dimensions(0, 0, -2)),
    "/modes/D": entry("modal damping Phi.T D Phi", RATE),
    "/modes/frequencies": entry("of each mode with B held, cycles per time unit; infinite for massless shapes", RATE),
    "/modes/free_frequencies": entry("elastic frequencies of the unsupported body, ascending, cycles per time unit",
                                     RATE),
    "/modes/labels": entry("one per mode, in words"),
    "/modes/sources": entry("names of the groups of source columns"),
    "/modes/energy_shares": entry("share of each source (column) in a mode's energy (row)"),
    "/moments/m": entry("mass", MASS),
    "/moments/S": entry("first moment, int c_a", Dimensions(1, 1)),
    "/moments/R": entry("second moment, int c_a c_b", Dimensions(1, 2)),
    "/moments/C1": entry("1C, int phi_a,k", Dimensions(0.5)),
    "/moments/P": entry("int c_a phi_b,k; index order a, b, k", Dimensions(0.5, 1)),
    "/moments/S_kl": entry("int phi_a,k phi_b,l; index order a, b, k, l"),
    "/moments/M": entry("M*, int phi_k . phi_l, of a body whose S_kl is not known"),
    "/invariants/J0": entry("inertia tensor of the undeformed body about the origin of B", Dimensions(1, 2)),
    "/invariants/C1": entry("1C_k, int phi_k; index order a, k", Dimensions(0.5)),
    "/invariants/C2": entry("2C_k, int c x phi_k; index order a, k", Dimensions(0.5, 1)),
    "/invariants/C3": entry("3C_k, int (c.phi_k 1 - phi_k c^T); index order k, a, b", Dimensions(0.5, 1)),
    "/invariants/C4": entry("4C_kl, int phi_l x phi_k; index order k, l, a"),
    "/invariants/C5": entry("5C_kl, int (phi_k.phi_l 1 - phi_l phi_k^T); index order k, l, a, b"),
    "/nodes/position": entry("undeformed position of the kept nodes in B", LENGTH),
    "/nodes/id": entry("index of the kept nodes in the mesh, from 0"),
    "/nodes/Phi": entry("translation of the kept nodes in B; index order node, component, mode", SHAPE),
    "/nodes/label": entry("number of each kept node in the user's mesh or deck; -1: none"),
    "/nodes/on_skin": entry("1: a point of a skin that moves with the node of that number; 0: the node itself"),
    "/nodes/instance": entry("row of /instances/names that a node belongs to; -1: none"),
    "/surface/triangles": entry("kept nodes of each triangle, from 0"),
    "/surface/element": entry("number of the element behind each triangle in the user's mesh or deck; -1: none"),
    "/surface/instance": entry("row of /instances/names that the element belongs to; -1: none"),
    "/instances/names": entry("what repeats numbers: instances of parts, or bodies that were joined"),
    "/sets/<i>/members": entry("rows of /nodes, or of /surface for a set of elements"),
    "/kept/nodes": entry("rows of /nodes that have rotations"),
    "/kept/rotation": entry("rotation vector of these nodes in B; index order node, component, mode", TURN),
    "/kept/source": entry("where the rotation comes from: dofs, elements, or unknown (zero)"),
    "/interfaces/<i>/position": entry("undeformed reference point in B", LENGTH),
    "/interfaces/<i>/triad": entry("columns: undeformed axes of the interface in B"),
    "/interfaces/<i>/Psi": entry("translation and rotation of the reference point in B for each mode", SHAPE, TURN),
    "/interfaces/<i>/members": entry("kept nodes of the interface, from 0"),
    "/interfaces/<i>/K_geometric": entry("geometric stiffness of a unit force (0-2) and moment (3-5) at the reference "
                                         "point, axes of B; index order load, k, l",
                                         Dimensions(-1, -1), Dimensions(-1, -2)),
    "/interfaces/<i>/K_turned": entry("the same over a rotation about an axis of B and a mode; index order load, "
                                      "axis, k", Dimensions(-0.5), Dimensions(-0.5, -1)),
    "/columns/labels": entry("one per column of the mode set, in words"),
    "/columns/groups": entry("the source each column belongs to"),
    "/columns/A": entry("coordinates of the modes in the columns, scaled; index order column, mode", RATE),
    "/columns/F": entry("forces of the modes on the columns, scaled; A F: part of a column in a mode's energy", RATE),
    "/nodal_sums/w": entry("sum over the nodes of their weight w, the volume each stands for", VOLUME),
    "/nodal_sums/S": entry("sum of w c_a", Dimensions(0, 4)),
    "/nodal_sums/R": entry("sum of w c_a c_b", Dimensions(0, 5)),
    "/nodal_sums/U1": entry("sum of w phi_a,k; index order a, k", Dimensions(-0.5, 3)),
    "/nodal_sums/U2": entry("sum of w (c x phi_k)_a; index order a, k", Dimensions(-0.5, 4)),
    "/geometric/translation": entry("geometric stiffness K_t,a of the loads -rho e_a of a frame acceleration minus "
                                    "gravity; index order a, k, l", Dimensions(0, -1)),
    "/geometric/rotation": entry("K_r,a of the loads -rho e_a x c of an angular acceleration; index order a, k, l"),
    "/geometric/spin": entry("K_ab of -rho/2 [e_a x (e_b x c) + e_b x (e_a x c)], products of angular velocities; "
                             "index order ab (xx yy zz xy yz zx), k, l"),
    "/geometric/turned/translation": entry("K_t,a over a rotation about an axis of B and a mode; index order a, "
                                           "axis, k", Dimensions(0.5)),
    "/geometric/turned/rotation": entry("K_r,a likewise", Dimensions(0.5, 1)),
    "/geometric/turned/spin": entry("K_ab likewise", Dimensions(0.5, 1)),
    "/geometric/spread/K": entry("geometric stiffness of loads spread over the nodes by their weight, (w_i/w) e_a "
                                 "(0-2) and (w_i/w) e_a x c_i (3-5); index order load, k, l",
                                 Dimensions(-1, -1), Dimensions(-1)),
    "/geometric/spread/turned": entry("the same over a rotation about an axis of B and a mode; index order load, axis, "
                                      "k", Dimensions(-0.5), Dimensions(-0.5, 1)),
    "/geometric/spread/turned_rigid": entry("work of these loads, turned about an axis of B, on the rotations e_b x c; "
                                            "index order load, axis, b", Dimensions(0, 1), Dimensions(0, 2)),
    "/quadratic/g": entry("displacement of second order of the kept nodes in B, 1/2 sum q_k q_l g_kl; index order "
                          "node, component, k, l", Dimensions(-1, -1)),
    "/load_cases/<i>/force": entry("resultant force in B", Dimensions(1, 1, -2)),
    "/load_cases/<i>/torque": entry("resultant torque about the origin of B", Dimensions(1, 2, -2)),
    "/load_cases/<i>/h": entry("modal forces Phi.T f", Dimensions(0.5, 1, -2)),
    "/stress/nodal": entry("stress of each mode at the kept nodes in axes of B; index order node, component "
                           "(xx yy zz yz xz xy), mode", Dimensions(0.5, -2, -2)),
    "/stress/points/names": entry("one per stress point, in words"),
    "/stress/points/position": entry("undeformed position of the stress points in B", LENGTH),
    "/stress/points/modes": entry("stress of each mode at the stress points; index order as /stress/nodal",
                                  Dimensions(0.5, -2, -2)),
    "/recovery/<i>/labels": entry("one per row, each once"),
    "/recovery/<i>/quantities": entry("what each row is"),
    "/recovery/<i>/entities": entry("what each row belongs to: node, element, interface, point or body"),
    "/recovery/<i>/components": entry("component of each row, mesh axes or those of the element"),
    "/recovery/<i>/loads": entry("one per column of static"),
    "/recovery/<i>/numbers": entry("number of the node or element of each row; -1 where it has a name only"),
    "/recovery/<i>/dimensions": entry("exponents of mass, length and time of each row"),
    "/recovery/<i>/load_dimensions": entry("exponents of mass, length and time of the amplitude of each load"),
    "/recovery/<i>/units": entry("unit of each row"),
    "/recovery/<i>/load_units": entry("unit of the amplitude of each load"),
    "/recovery/<i>/dynamic": Entry(NONE, "factors of z = (d, theta, q), of its rate and of its acceleration; index "
                                   "order derivative, row, component of z", unit="of the row per that of z"),
    "/recovery/<i>/static": Entry(NONE, "residual static response to each load; index order row, load",
                                  unit="of the row per that of the load"),
}  #: description by path; `<i>` stands for the number of a group
# fmt: on


def entry_of(path: str) -> Entry:
    """Return the description of a dataset; raise `ModalFileError` if a modal file has no such dataset."""
    found = ENTRIES.get(re.sub(r"/\d+/", "/<i>/", path))
    if found is None:
        raise ModalFileError(f"dataset {path} is not among those of a modal file: {', '.join(ENTRIES)}")
    return found


def dataset_of(path: str, values: Any, units: Units) -> Dataset:
    """Return a dataset with its description and its unit in ASCII; both units if its rows differ."""
    known = entry_of(path)
    unit = known.unit or unit_text(units, known.dimensions)
    if known.last_rows is not None:
        unit = f"{unit} (rows 0-2), {unit_text(units, known.last_rows)} (rows 3-5)"
    return Dataset(values, unit, known.description)


def in_units(content: Content, old: Units, new: Units) -> Content:
    """Return the content of a modal file with its numbers converted to other units."""
    attributes = dict(content.attributes) | {"/units": {f.name: getattr(new, f.name) for f in fields(Units)}}
    weights = attributes.get("/nodal_sums", {})
    datasets = {}
    for path, dataset in content.datasets.items():
        if path.startswith(f"{RECOVERY}/"):
            continue
        found = entry_of(path)
        values = dataset.values
        if isinstance(values, np.ndarray) and values.dtype.kind == "f":
            dimensions = found.dimensions
            # the weights count nodes and are not volumes
            if path.startswith("/nodal_sums/") and not weights.get("is_volume", 1):
                dimensions = Dimensions(dimensions.mass, dimensions.length - VOLUME.length, dimensions.time)
            values = values * dimensions.factor(old, new)
            if found.last_rows is not None:
                if len(values) != 6:
                    raise ModalFileError(f"dataset {path}: expected six rows, got {len(values)}")
                values[3:] = dataset.values[3:] * found.last_rows.factor(old, new)
        datasets[path] = dataset_of(path, values, new)
    tables = {name: table.in_units(new) for name, table in recovery_of(Contents(content), old).items()}
    datasets |= {path: dataset_of(path, values, new) for path, values in recovery_values(tables).items()}
    return Content(content.format, content.version, datasets, attributes)
