"""The reduced body: content of the modal file and input of the multibody engine. Only pictures depend on mesh size."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from cms.body.error_estimates import ErrorEstimates
from cms.body.geometric_stiffness import GeometricStiffness
from cms.body.invariants import Moments, NodalSums
from cms.body.kept_points import KeptPoints
from cms.body.recovery_table import RecoveryTable
from cms.body.source_columns import SourceColumns
from cms.body.stress import PointStress
from cms.errors import BodyError
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.body.unit_check import BodyNumbers, hull_volume, implausible_numbers
from fe_models.foundation.arrays import Array, IntArray, require_shape
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import Summary, listed, presented
from fe_models.foundation.records import ArrayShape, FrozenMapping, checked_fields, frozen_copies
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, number_list, quoted
from fe_models.meshes.numbering import NONE, Numbering

__all__ = ["BodyFrame", "ReducedBody", "ReducedInterface", "unit_findings"]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class BodyFrame:
    """The frame B in which elastic displacement is measured, as its position in the undeformed mesh.

    c_mesh = origin + axes @ c_B.

    Parameters
    ----------
    kind
        "nodal", "tisserand", "buckens", or "held": the body is held to the ground, and its frame cannot move.
    origin
        Origin in mesh coordinates, (3,) [m].
    axes
        Axes of B as columns, in mesh axes, (3, 3).
    at
        Interface that defines a nodal frame; "": other dofs.
    dofs
        Dofs that a nodal frame holds, (mesh node, component), (6, 2); empty: another kind, or not recorded.
    """

    kind: str
    origin: Annotated[Array, ArrayShape((3,))]
    axes: Annotated[Array, ArrayShape((3, 3), is_triad=True)] = field(default_factory=lambda: np.eye(3))
    at: str = ""
    dofs: Annotated[IntArray, ArrayShape((None, 2))] = field(default_factory=lambda: np.zeros((0, 2), np.int64))


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ReducedInterface:
    """Interface of a reduced body: its reference point in B and how this point moves with q.

    Parameters
    ----------
    name
        Name of the interface, unique on the body.
    kind
        "rigid", "distributing" or "nodes" (then Psi is the mean motion of the members).
    position
        Undeformed reference point in B, (3,) [m].
    triad
        Undeformed axes as columns in B, (3, 3).
    Psi
        Translation and rotation of the point in B for each mode, (6, n_q) [-, 1/m].
    members
        Member nodes, indices into `ReducedBody.nodes`, (n_members,).
    has_rotation
        Whether Psi has rotations; False: rows 3-5 are zero, because the members are collinear, and rows 0-2 are their
        mean translation.
    """

    name: str
    kind: str
    position: Annotated[Array, ArrayShape((3,))]
    triad: Annotated[Array, ArrayShape((3, 3), is_triad=True)]
    Psi: Annotated[Array, ArrayShape((6, "n_q"))]
    members: Annotated[IntArray, ArrayShape(("n_members",))]
    has_rotation: bool = True


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ReducedBody(Tabular):
    """A body as r = c + Phi q in its frame B, with M-orthonormal, K-diagonal shapes (docs/theory.md §3-5).

    The unit of q follows from Phi.T M Phi = 1: sqrt(kg) m. Phi q is a length.

    Parameters
    ----------
    name
        Name of the body.
    units
        Unit system of all numbers of the body.
    frame
        The body frame B.
    M
        Phi.T M Phi, (n_q, n_q): identity, with zero diagonal entries for massless static shapes.
    K
        Phi.T K Phi, (n_q, n_q): diagonal of omega² [1/s²].
    D
        Modal damping, (n_q, n_q) [1/s]; zero if none was requested.
    labels
        Label of each mode: the sources of its energy.
    energy_shares
        Share of each group of source columns in the energy of each mode, (n_q, n_sources).
    sources
        Names of the groups of source columns, (n_sources,).
    moments
        Moments of mass of the body and its shapes in B.
    free_frequencies
        Elastic frequencies of the unsupported reduced body (for a held body: with its supports), ascending [Hz].
    nodes
        Kept nodes (surface, interfaces) in B, (n_kept, 3) [m].
    node_ids
        Indices of the kept nodes in the original model, (n_kept,); `numbering` has the user's numbers.
    Phi
        Translations of the kept nodes in B, (n_kept, 3, n_q).
    surface
        Triangles of kept nodes, (n_tri, 3).
    interfaces
        Places at which neighbours connect to the body.
    provenance
        Versions, digests, options, solver.
    columns
        Columns of the mode set; None: not recorded.
    nodal_sums
        Data for a Buckens frame; None: not recorded.
    load_cases
        Named loads over the modes.
    stress
        Stress of the modes at the kept nodes, xx yy zz yz xz xy in axes of B, (n_kept, 6, n_q) [Pa per unit of q];
        None: left out or unknown. It is zero at reference nodes, which belong to no element.
    point_stress
        Stress of the modes at named points; None: left out, or there are none.
    geometric
        Geometric stiffness; None: left out, or not known.
    quadratic
        Quadratic modes g_kl of the kept nodes in B, (n_kept, 3, n_q, n_q) [1/(kg m)], with the displacement
        ½ Σ q_k q_l g_kl; None: left out.
    numbering
        The user's numbers of kept nodes and elements, and the sets.
    kept
        Kept nodes that have rotations; None: there are none.
    recovery
        Recovery matrices by name.
    errors
        Estimated errors relative to the finite element model; None: not estimated.
    """

    name: str
    units: Units
    frame: BodyFrame
    M: Annotated[Array, ArrayShape(("n_q", "n_q"))]
    K: Annotated[Array, ArrayShape(("n_q", "n_q"))]
    D: Annotated[Array, ArrayShape(("n_q", "n_q"))]
    labels: Annotated[tuple[str, ...], ArrayShape(("n_q",))]
    energy_shares: Annotated[Array, ArrayShape(("n_q", "n_sources"))]
    sources: Annotated[tuple[str, ...], ArrayShape(("n_sources",))]
    moments: Moments
    free_frequencies: Annotated[Array, ArrayShape((None,))]
    nodes: Annotated[Array, ArrayShape(("n_kept", 3))]
    node_ids: Annotated[IntArray, ArrayShape(("n_kept",))]
    Phi: Annotated[Array, ArrayShape(("n_kept", 3, "n_q"))]
    surface: Annotated[IntArray, ArrayShape((None, 3))]
    interfaces: tuple[ReducedInterface, ...]
    provenance: Mapping[str, str] = field(default_factory=dict)
    columns: SourceColumns | None = None
    nodal_sums: NodalSums | None = None
    load_cases: tuple[ReducedLoadCase, ...] = ()
    stress: Annotated[Array | None, ArrayShape(("n_kept", 6, "n_q"))] = None
    point_stress: PointStress | None = None
    geometric: GeometricStiffness | None = None
    quadratic: Annotated[Array | None, ArrayShape(("n_kept", 3, "n_q", "n_q"))] = None
    numbering: Numbering = field(default_factory=Numbering)
    kept: KeptPoints | None = None
    recovery: Mapping[str, RecoveryTable] = field(default_factory=dict)
    errors: ErrorEstimates | None = None

    def __post_init__(self) -> None:
        where = f"reduced body {self.name!r}"
        put = object.__setattr__
        for name in ("interfaces", "load_cases"):
            put(self, name, tuple(getattr(self, name)))
        put(self, "provenance", FrozenMapping(dict(self.provenance)))
        put(self, "recovery", FrozenMapping(dict(self.recovery)))
        n, n_kept = self.n_q, len(self.nodes)
        if self.quadratic is not None and self.geometric is None:
            raise BodyError(f"{where}: quadratic modes need the geometric stiffness, which contains their inertia")
        if self.moments.n_q != n:
            raise BodyError(f"{where}: {n} modes, but moments of {self.moments.n_q}")
        widths = {f"load case {case.name!r}: h": case.h.shape for case in self.load_cases}
        if self.columns is not None:
            widths["columns"] = (np.asarray(self.columns.A).shape[1],)
        if self.kept is not None:
            widths["kept points"] = (np.asarray(self.kept.rotation).shape[2],)
        if self.nodal_sums is not None:
            widths["nodal sums"] = (np.asarray(self.nodal_sums.U1).shape[1],)
        if self.point_stress is not None:
            widths["stress points"] = (np.asarray(self.point_stress.modes).shape[2],)
        if self.errors is not None and len(self.errors.frequency) > len(self.free_frequencies):
            raise BodyError(
                f"{where}: {len(self.free_frequencies)} free frequencies, but errors of {len(self.errors.frequency)}"
            )
        if self.errors is not None and (left_out := self.errors.left_out) is not None:
            widths["left-out shapes"] = (len(left_out.inertia),)
            place, n_left = f"{where}: left-out shapes", left_out.n_left
            require_shape(f"{place}: interfaces", left_out.interfaces, (6, len(self.interfaces), n_left))
            require_shape(f"{place}: load_cases", left_out.load_cases, (len(self.load_cases), n_left))
        if self.geometric is not None:
            widths["geometric stiffness"] = (self.geometric.n_q,)
            if len(self.geometric.is_loaded) != len(self.interfaces):
                raise BodyError(
                    f"{where}: {len(self.interfaces)} interfaces, but geometric stiffness of "
                    f"{len(self.geometric.is_loaded)}"
                )
            if self.geometric.spread is not None and self.nodal_sums is None:
                raise BodyError(f"{where}: loads spread over the nodes need the nodal sums, which are their resultants")
        for name, table in self.recovery.items():
            widths[f"recovery {name!r}"] = (table.n_q,)
            if table.system != self.units or table.name != name:
                raise BodyError(
                    f"{where}: recovery {name!r}: expected a table of this name in {self.units.name}, got "
                    f"{table.name!r} in {table.system.name}"
                )
        for name, width in widths.items():
            if width != (n,):
                raise BodyError(f"{where}: {n} modes, but {name} of {width[0]}")
        if self.surface.size and (self.surface.min() < 0 or self.surface.max() >= n_kept):
            raise BodyError(f"{where}: surface: nodes outside 0..{n_kept - 1}")
        self.numbering.require_fit(where, n_kept, len(self.surface))
        if self.kept is not None and (self.kept.nodes.min(initial=0) < 0 or self.kept.nodes.max(initial=0) >= n_kept):
            raise BodyError(f"{where}: kept points: nodes outside 0..{n_kept - 1}")
        for interface in self.interfaces:
            require_shape(f"{where}: interface {interface.name!r}: Psi", interface.Psi, (6, n))
            if interface.members.size and (interface.members.min() < 0 or interface.members.max() >= n_kept):
                raise BodyError(f"{where}: interface {interface.name!r}: members outside 0..{n_kept - 1}")

    def summary(self) -> Summary:
        """Return what `repr` and notebooks show: units, mass, frame and interfaces, and the modes with their labels."""
        center = number_list(self.moments.center_of_mass, float(np.abs(self.nodes).max(initial=0.0)))
        rows = [
            ("units", self.units.name),
            ("mass", f"{self.moments.m:.6g} {self.units.mass_symbol}"),
            (
                "centre of mass",
                f"({center}) {self.units.length_symbol} in the frame",
            ),
            ("frame", self.frame.kind),
            ("interfaces", listed([each.name for each in self.interfaces])),
        ]
        scale = 1 / self.units.time
        modes = [
            (str(k + 1), f"{f * scale:.6g}", label)
            for k, (f, label) in enumerate(zip(self.frequencies, self.labels, strict=True))
        ]
        return Summary(f"ReducedBody {self.name!r}: {self.n_q} modes", rows, ("mode", "Hz", "energy from"), modes)

    def to_table(self) -> Table:
        """Return number, frequency with a fixed frame, and label of each mode, a row each."""
        frequencies = self.frequencies / self.units.time
        rows = zip(range(1, self.n_q + 1), frequencies.tolist(), self.labels, strict=True)
        return Table.of_rows(("mode", "frequency", "energy from"), rows, {"frequency": "Hz"})

    @property
    def n_q(self) -> int:
        """Number of modes."""
        return np.asarray(self.K).shape[0]

    @property
    def is_held(self) -> bool:
        """Whether the body is intentionally fixed to the ground; a floating frame rejects such a body."""
        return self.frame.kind == "held"

    @property
    def frequencies(self) -> Array:
        """Frequencies of the modes with origin and axes of this frame fixed, (n_q,) [Hz]; inf for massless shapes."""
        mass = np.diag(self.M)
        omega2 = np.divide(np.diag(self.K), mass, out=np.full(self.n_q, np.inf), where=mass > 0)
        return np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi)

    def node_name(self, row: int) -> str:
        """Return the user's name of a kept node: "12", "PART-1-1.12", or "index 7" if it has no number."""
        if self.numbering.nodes.size and self.numbering.nodes[row] != NONE:
            return self.numbering.node_name(row)
        return f"index {self.node_ids[row]}"

    def interface(self, name: str) -> ReducedInterface:
        """Return the interface with this name; raise `BodyError` with the known names if there is none."""
        for interface in self.interfaces:
            if interface.name == name:
                return interface
        choices = [interface.name for interface in self.interfaces]
        raise BodyError(f"reduced body {self.name!r}: no interface {quoted(name)}{nearest(name, choices)}")

    def load_case(self, name: str) -> ReducedLoadCase:
        """Return the load case with this name; raise `BodyError` with the known names if there is none."""
        for case in self.load_cases:
            if case.name == name:
                return case
        choices = [case.name for case in self.load_cases]
        raise BodyError(f"reduced body {self.name!r}: no load case {quoted(name)}{nearest(name, choices)}")


def unit_findings(body: ReducedBody) -> list[tuple[bool, str]]:
    """Return (is an error, text) for each implausible number: size, mass / hull volume, 2 f L of the first mode.

    Size L and hull are computed from the kept nodes; f is the first of `free_frequencies`.
    """
    nodes, free = np.asarray(body.nodes), np.asarray(body.free_frequencies)
    numbers = BodyNumbers(
        size=float(np.linalg.norm(np.ptp(nodes, axis=0))) if len(nodes) else 0.0,
        hull=hull_volume(nodes),
        mass=body.moments.m,
        frequency=float(free[0]) if len(free) else None,
    )
    return implausible_numbers(body.units, numbers)
