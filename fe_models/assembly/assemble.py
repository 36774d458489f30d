"""Assembly of a model: a body of each kind of elements, joined at shared nodes, with constraints and loads."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from fe_models.assembly.constraints import Constraint, MeanMotion, NodeEquation, RigidNodes
from fe_models.assembly.join import Joined, Part, join
from fe_models.assembly.lumped import lumped_beams, lumped_shells
from fe_models.assembly.model import LUMPED, FEModel, GivenElements, ModelTables
from fe_models.assembly.rods import rod_body
from fe_models.assembly.tables.attachments import (
    followers_of,
    nodes_at,
    one_node,
    point_masses,
    rigid_links,
    springs_between,
)
from fe_models.assembly.tables.beams import PLANES, beam_properties, rod_properties
from fe_models.assembly.tables.materials import solid_properties
from fe_models.assembly.tables.places import (
    InterfaceSection,
    interfaces_of,
    load_case_of,
    load_cases_of,
)
from fe_models.assembly.tables.shells import shell_properties
from fe_models.body.fe_body import FEBody, Interface, dofs_of
from fe_models.body.load_cases import LoadCase
from fe_models.body.loads import nodal_load, pressure_load
from fe_models.checks.mesh_report import report_mesh
from fe_models.checks.thin_reports import report_frame, report_shell
from fe_models.elements.beams.body import beam_body
from fe_models.elements.shells.body import shell_body
from fe_models.elements.shells.quality import WARP_LIMIT
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.paths import file_digest
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.stages import Stages
from fe_models.foundation.words import nearest
from fe_models.meshes.cells.line_cells import line_mesh_from_raw
from fe_models.meshes.cells.raw_mesh import LINES, RawMesh, chosen_cells, groups_apart, mesh_from_raw
from fe_models.meshes.cells.shell_cells import SHELL_TYPES, shell_mesh_from_raw, with_centres
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import FACE_TYPES, SOLID_TYPES, Mesh, drop_unused_nodes
from fe_models.meshes.numbering import Numbering
from fe_models.meshes.selections import FaceGroup
from fe_models.meshes.shell_mesh import ShellMesh

if TYPE_CHECKING:
    from fe_models.elements.beams.attachments import PointMass, RigidLink, Spring
    from fe_models.elements.beams.beam_property import BeamProperty

__all__ = ["assemble"]

NO_NODES = np.zeros(0, dtype=np.int64)
OnReport = Callable[[Any], None] | None
BEAM_TYPES = ("line", "line3")
ATTACHED = ("masses", "springs", "links")
#: tables of elements and attachments that a mesh of one kind of elements takes
TABLES_OF_MESH: dict[type, tuple[str, ...]] = {
    Mesh: ("materials", "solids"),
    ShellMesh: ("materials", "shells", "sections", *ATTACHED),
    LineMesh: ("materials", "sections", *ATTACHED),
    GivenElements: (),
}
PLACES = ("interfaces", "load_cases")  #: tables that every model takes


def assemble(
    model: FEModel,
    *,
    stages: Stages | None = None,
    on_report: OnReport = None,
    is_checked: bool = False,
    ranks: Ranks | None = None,
) -> FEBody:
    """Check and assemble a model.

    (1) a body for each kind and formulation of elements, after the checks of its mesh
    (2) join these at their shared nodes, and eliminate the constraints
    (3) add load cases and interfaces, which are not coupled yet

    A mesh of one kind of elements is one body, to which attachments, interfaces and load cases are added directly.

    Parameters
    ----------
    model
        The model.
    stages
        Receives durations and progress of the stages; None: neither is reported.
    on_report
        Receives the report of each kind of elements before it is checked.
    is_checked
        Whether a mesh of solids was checked before, and has no unused nodes.
    ranks
        Processes that assemble a mesh of solids in parts (`fe_models.solid_body`).

    Raises
    ------
    FeModelsError
        If the mesh, a table or a constraint is invalid.
    """
    stages = stages or Stages()
    if isinstance(model.mesh, RawMesh):
        return _joined_body(model, stages, on_report)
    _require_one_kind(model)
    if isinstance(model.mesh, GivenElements):
        return model.mesh.assembled(model, stages, on_report)
    tables, mesh = model.tables, model.mesh
    if isinstance(mesh, Mesh):
        rules = solid_properties(tables.solids, tables.materials, model.mass)
        if len(rules) != 1:
            raise BodyError(f"model {model.name!r}: solids: a Mesh takes one integration and mass, got {len(rules)}")
        ((rule, of_group),) = rules.items()
        body, mesh = _solid_body(
            model, mesh, of_group.get("all", of_group), model.name, stages, on_report, rule, places=tables.interfaces,
            is_checked=is_checked, ranks=ranks,
        )  # fmt: skip
    else:
        beams = beam_properties(tables.sections, tables.materials)
        others: dict[str, Any] = {
            "masses": point_masses(mesh, tables.masses), "springs": springs_between(mesh, tables.springs),
            "links": rigid_links(mesh, tables.links), "places": tables.interfaces,
        }  # fmt: skip
        if isinstance(mesh, ShellMesh):
            shells = shell_properties(tables.shells, tables.materials)
            given = shells.get("all", shells)
            body = _thin_body(model, mesh, given, model.name, stages, on_report, stiffeners=beams or None, **others)
        else:
            body = _thin_body(model, mesh, beams.get("all", beams), model.name, stages, on_report, **others)
    if not tables.load_cases:
        return body
    with stages("assemble"):
        return body.with_load_cases(*load_cases_of(tables.load_cases, body, mesh))


def _require_one_kind(model: FEModel) -> None:
    """Raise `BodyError` if a table or field has no effect on the mesh, which has one kind of elements."""
    where = f"model {model.name!r}"
    kind = next((each for each in TABLES_OF_MESH if isinstance(model.mesh, each)), None)
    if kind is None:
        expected = ", ".join(("RawMesh", *(each.__name__ for each in TABLES_OF_MESH if each is not GivenElements)))
        raise BodyError(f"{where}: mesh: expected one of {expected}, or matrices, got {type(model.mesh).__name__}")
    name = type(model.mesh).__name__
    for key in ModelTables.model_fields:
        if key not in (*PLACES, *TABLES_OF_MESH[kind]) and getattr(model.tables, key):
            takes = ", ".join(each for each in (TABLES_OF_MESH[kind] or PLACES) if each != "materials")
            raise BodyError(f"{where}: {key}: a {name} takes {takes} only; remove the tables, or give a RawMesh")
    if model.plane is not None:
        raise BodyError(f"{where}: plane: belongs to a RawMesh; remove it, and call fe_models.planar(couple(body))")
    if model.mass not in (None, "consistent") and kind is not Mesh:
        advice = "remove it" if kind is GivenElements else "give a RawMesh"
        given = "its own" if kind is GivenElements else "consistent"
        raise BodyError(f"{where}: mass: a {name} has {given} mass, got {model.mass!r}; {advice}")


def _joined_body(model: FEModel, stages: Stages, on_report: OnReport) -> FEBody:
    """Return the body of several kinds of elements on shared nodes."""
    raw = with_centres(model.mesh)
    model = replace(model, mesh=raw)
    parts, meshes = _parts(model, stages, on_report)  # (1)
    means = _mean_interfaces(model)
    with stages("assemble"):
        joined = join(  # (2)
            model.name, parts, raw.nodes, _constraints(model, besides=set(means.values())), numbers=raw.node_numbers,
            node_sets=raw.node_sets, normal=None if model.plane is None else PLANES[model.plane],
        )  # fmt: skip
        record = joined.body.provenance
        if model.source is not None:
            record = {**record, "deck": str(model.source), "deck sha256": file_digest(model.source)}
        record = {**record, **{f"file {name}": digest for name, digest in raw.included.items()}}
        numbering = joined.body.numbering.with_instances(raw.instances, raw.instance_step)
        body = replace(joined.body, provenance=record, numbering=numbering)
        _require_used_groups(model, joined)
        body = body.with_load_cases(*_load_cases(model, joined, meshes))  # (3)
        return body.with_interfaces(
            *[
                _mean_interface(name, each, means[name], model, joined)
                if name in means
                else _interface(name, each, raw, joined)
                for name, each in model.tables.interfaces.items()
            ]
        )


def _thin_body(
    model: FEModel,
    mesh: ShellMesh | LineMesh,
    given: Any,
    name: str,
    stages: Stages,
    on_report: OnReport,
    *,
    stiffeners: Mapping[str, "BeamProperty"] | None = None,
    is_lumped: bool = False,
    masses: Sequence["PointMass"] = (),
    springs: Sequence["Spring"] = (),
    links: Sequence["RigidLink"] = (),
    places: Mapping[str, InterfaceSection] = MappingProxyType({}),
) -> FEBody:
    """Check a mesh of shells or lines, and return its body."""
    used = given.values() if isinstance(given, Mapping) else [given]
    functions: tuple[Any, Any, Any] = report_frame, lumped_beams, beam_body
    own: dict[str, Any] = {}
    if isinstance(mesh, ShellMesh):
        functions = report_shell, lumped_shells, shell_body
        own = {"stiffeners": stiffeners, "warp_limit": 180.0 if "warped" in model.accept else WARP_LIMIT}
        materials = {made: None for item in used for made in item.materials}
        materials |= {item.material: None for item in (stiffeners or {}).values()}
    else:
        materials = {each.material: None for each in used}
    check, lump, make = functions
    with stages("check mesh"):
        report = check(mesh, materials, units=model.units, springs=springs, links=links)
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=model.accept)
        interfaces = interfaces_of(places, mesh)
    with stages("assemble"):
        if is_lumped:
            given, masses = lump(mesh, given)
        return make(
            mesh, given, name=name, units=model.units, interfaces=interfaces, point_masses=masses, springs=springs,
            links=links, **own,
        )  # fmt: skip


# (1) a body for each kind of elements ---------------------------------------------------------------------------------


def _parts(model: FEModel, stages: Stages, on_report: OnReport) -> tuple[list[Part], list[Mesh]]:
    """Return bodies of solids, shells, lines, rods and attachments, and the meshes of the solids."""
    tables, lumped = model.tables, model.lumped
    if model.mass != "as the deck":
        lumped = frozenset(LUMPED if model.mass == "lumped" else ())
    # row indices of the mesh serve as node numbers of the parts
    raw = replace(model.mesh, node_numbers=np.arange(len(model.mesh.nodes)))
    path = model.source or Path(model.name)
    for name, table in tables.solids.items():
        _require_groups(raw, f"solids.{name}.cells", [group for group in table.cells if group != "all"])
    solids = solid_properties(tables.solids, tables.materials, model.mass)
    shells = _layers(raw, "shells.cells", SHELL_TYPES, shell_properties(tables.shells, tables.materials))
    beams = _layers(raw, "sections.lines", BEAM_TYPES, beam_properties(tables.sections, tables.materials))
    rods = _layers(raw, "rods.lines", ("line",), rod_properties(tables.rods, tables.materials))
    is_linked = bool(tables.links or tables.couplings or tables.equations or tables.springs)
    is_alone = len(solids) + len(shells) + len(beams) + len(rods) == 1 and not is_linked

    if not is_alone:  # other parts and constraints may join what a part leaves apart
        model = replace(model, accept=(*model.accept, "parts", "transition"))
    parts: list[Part] = []
    meshes: list[Mesh] = []

    def add(body: FEBody, mesh: Mesh | ShellMesh | LineMesh) -> None:
        parts.append(Part(body, np.asarray(mesh.node_numbers)))
        if isinstance(mesh, Mesh):
            meshes.append(mesh)

    for rule, of_group in solids.items():
        groups = None if "all" in of_group else tuple(of_group)
        solid_mesh = mesh_from_raw(chosen_cells(raw, SOLID_TYPES, groups), path, "")
        name = " ".join((f"{model.name} solids", *(rule if len(solids) > 1 else ())))
        add(*_solid_body(model, solid_mesh, of_group.get("all", of_group), name, stages, on_report, rule))
    for name, (groups, given) in _named(f"{model.name} shells", shells):
        shell_mesh = shell_mesh_from_raw(chosen_cells(raw, SHELL_TYPES, groups), path, "", groups, ())
        add(_thin_body(model, shell_mesh, given, name, stages, on_report, is_lumped="shells" in lumped), shell_mesh)
    for name, (groups, given) in _named(f"{model.name} beams", beams):
        mesh = line_mesh_from_raw(chosen_cells(raw, BEAM_TYPES, groups), path, "", groups)
        add(_thin_body(model, mesh, given, name, stages, on_report, is_lumped="lines" in lumped), mesh)
    for name, (groups, given) in _named(f"{model.name} rods", rods):
        mesh = line_mesh_from_raw(chosen_cells(raw, ("line",), groups), path, "", groups)
        add(rod_body(mesh, given, name=name, units=model.units, is_lumped="rods" in lumped), mesh)
    return [*parts, *_attached(model)], meshes


def _solid_body(
    model: FEModel,
    mesh: Mesh,
    given: Any,
    name: str,
    stages: Stages,
    on_report: OnReport,
    rule: tuple[str, str],
    *,
    places: Mapping[str, InterfaceSection] = MappingProxyType({}),
    ranks: Ranks | None = None,
    is_checked: bool = False,
) -> tuple[FEBody, Mesh]:
    """Check a mesh of solids, and return its body, and the mesh without unused nodes.

    Parameters
    ----------
    rule
        Integration and kind of mass.
    is_checked
        Whether the mesh was checked before, and has no unused nodes.
    """
    integration, mass = rule
    bends = integration == "incompatible" and bool(len(mesh.cells.get("hexahedron", ())))
    first_order = None
    if not is_checked:
        with stages("check mesh"):
            report = report_mesh(mesh, given, units=model.units, incompatible_modes=bends)
            if on_report is not None:
                on_report(report)
            report.raise_for_errors(accept=model.accept)
            mesh, first_order = drop_unused_nodes(mesh), report.first_order
    interfaces = interfaces_of(places, mesh)
    with stages("assemble") as advance:
        body = solid_body(
            mesh,
            given,
            name=name,
            units=model.units,
            interfaces=interfaces,
            incompatible_modes=bends,
            integration="full" if integration == "incompatible" else integration,
            mass=mass,
            progress=advance,
            ranks=ranks,
        )
    if first_order is not None and isinstance(model.mesh, Mesh):
        body = replace(body, provenance={**body.provenance, **first_order.provenance()})
    return body, mesh


def _layers(
    raw: RawMesh, where: str, kinds: tuple[str, ...], properties: Mapping[str, Any]
) -> list[tuple[tuple[str, ...] | None, Any]]:
    """Return groups of cells and their properties, in layers without two cells on the same nodes.

    The groups are None if all cells have one property.
    """
    if "all" in properties:
        return [(None, properties["all"])]
    _require_groups(raw, where, properties)
    apart = groups_apart(raw, kinds, properties)
    return [(groups, {group: properties[group] for group in groups}) for groups in apart]


def _named(name: str, layers: list[Any]) -> list[tuple[str, Any]]:
    """Return the layers with a name each."""
    return [(name if len(layers) == 1 else f"{name} {k}", each) for k, each in enumerate(layers, start=1)]


def _attached(model: FEModel) -> list[Part]:
    """Return point masses and springs as a body with only their nodes; an empty list if there are none."""
    raw = model.mesh
    masses = point_masses(raw, model.tables.masses, at_each=True)
    springs = springs_between(raw, model.tables.springs)
    if not masses and not springs:
        return []
    at = [node for spring in springs for node in spring.nodes] + [mass.node for mass in masses]
    nodes = np.unique(np.array(at, dtype=np.int64))
    place = {int(node): k for k, node in enumerate(nodes)}
    body = beam_body(
        LineMesh(raw.nodes[nodes], np.zeros((0, 2), np.int64)),
        {},
        name=f"{model.name} attached",
        units=model.units,
        point_masses=[replace(mass, node=place[mass.node]) for mass in masses],
        springs=[replace(each, nodes=(place[each.nodes[0]], place[each.nodes[1]])) for each in springs],
    )
    return [Part(body, nodes)]


# (2) constraints ------------------------------------------------------------------------------------------------------


def _mean_interfaces(model: FEModel) -> dict[str, str]:
    """Return the coupling for each interface whose node is the reference node of this coupling (a mean motion).

    Such a node has no dofs of its own; an interface of kind "distributing" gives it dofs. The coupling must have all
    components and one weight per member, and nothing else may be attached to its node.
    """
    raw, tables = model.mesh, model.tables
    couplings = {one_node(raw, f"couplings.{k}.node", each.node): k for k, each in tables.couplings.items()}
    found: dict[str, str] = {}
    for name, table in tables.interfaces.items():
        group = raw.node_sets.get(table.nodes, NO_NODES) if isinstance(table.nodes, str) else NO_NODES
        node = int(group[0]) if len(group) == 1 else -1
        if node not in couplings:
            continue
        coupling = tables.couplings[couplings[node]]
        where = f"interfaces.{name}: its node is the reference of coupling {couplings[node]!r}"
        if len(coupling.components) < 6 or not all(isinstance(w, float) for w in coupling.members.values()):
            raise BodyError(
                f"{where}, which takes some components only, or a weight for each: it has no dofs of its own; put the "
                'interface on its members (kind = "distributing")'
            )
        taken = [
            words
            for words, each in _used_groups(model)
            if words != f"couplings.{couplings[node]}" and node in nodes_at(raw, words, each)
        ]
        if taken:
            raise BodyError(f"{where}, and {taken[0]} sits on it too: as an interface it has the motion of its members "
                            "alone; put that on another node, or the interface on the members")  # fmt: skip
        found[name] = couplings[node]
    return found


def _used_groups(model: FEModel) -> list[tuple[str, str | int]]:
    """Return (table, node group) for each attachment and constraint."""
    tables = model.tables
    found: list[tuple[str, str | int]] = [(f"masses.{k}", each.node) for k, each in tables.masses.items()]
    found += [(f"springs.{k}", group) for k, each in tables.springs.items() for group in each.nodes]
    found += [(f"links.{k}", group) for k, each in tables.links.items() for group in (each.node, *each.followers)]
    found += [(f"couplings.{k}", group) for k, each in tables.couplings.items() for group in (each.node, *each.members)]
    return found + [(f"equations.{k}", node) for k, each in tables.equations.items() for node, _, _ in each.terms]


def _constraints(model: FEModel, *, besides: set[str]) -> list[Constraint]:
    raw, tables = model.mesh, model.tables
    made: list[Constraint] = []
    for name, link in tables.links.items():
        node, followers = one_node(raw, f"links.{name}.node", link.node), followers_of(raw, name, link)
        made.append(RigidNodes(f"links.{name}", node, followers, link.components))
    for name, coupling in tables.couplings.items():
        if name in besides:
            continue
        where = f"couplings.{name}"
        members = [(nodes_at(raw, f"{where}.members", group), weight) for group, weight in coupling.members.items()]
        nodes = np.concatenate([group for group, _ in members])
        each = [(weight,) * 3 + (0.0,) * 3 if isinstance(weight, float) else weight for _, weight in members]
        weights = np.concatenate([np.tile(six, (len(group), 1)) for (group, _), six in zip(members, each, strict=True)])
        node = one_node(raw, f"{where}.node", coupling.node)
        made.append(MeanMotion(where, node, nodes, weights, coupling.components))
    for name, equation in tables.equations.items():
        where = f"equations.{name}"
        terms = tuple((one_node(raw, f"{where}.terms", node), c, a) for node, c, a in equation.terms)
        made.append(NodeEquation(where, terms))
    return made


# (3) load cases and interfaces ----------------------------------------------------------------------------------------


def _load_cases(model: FEModel, joined: Joined, meshes: list[Mesh]) -> list[LoadCase]:
    body, made = joined.body, []
    for name, table in model.tables.load_cases.items():
        where = f"load_cases.{name}"
        if table.each is not None:
            forces: dict[int, Any] = {}
            for group, force in table.each.items():
                nodes = nodes_at(model.mesh, f"{where}.each", group)
                for node in _placed(joined, nodes, f"{where}.each = {group}").tolist():
                    forces[node] = forces.get(node, np.zeros(6)) + np.array(force)
            made.append(nodal_load(body, name, forces))
        elif table.kind == "pressure" and table.faces is not None:
            mesh = next((each for each in meshes if set(table.faces) <= set(each.face_sets)), None)
            if mesh is None:
                raise BodyError(f'{where}.faces = "{", ".join(table.faces)}": no solid has such faces')
            made.append(_pressure(joined, mesh, name, table))
        elif table.kind == "gravity":
            made.append(load_case_of(name, table, body, None))
        else:
            raise BodyError(f"{where}: with a deck, expected kind gravity, pressure on faces, or force with each")
    return made


def _pressure(joined: Joined, mesh: Mesh, name: str, table: Any) -> LoadCase:
    """Return the load case of a pressure on faces of one of the solid meshes."""
    body = joined.body
    dofs = dofs_of(np.arange(len(mesh.nodes)), 3)
    nothing = sp.csc_array((len(dofs), len(dofs)))
    alone = replace(
        body, M=nothing, K=nothing, D=None, nodes=mesh.nodes, dofs=dofs,
        surface=np.zeros((0, 3), np.int64), element_model=None, recovery=None, load_cases=(), stress_points=None,
        node_volumes=None, interfaces=(), numbering=Numbering(), kept=np.zeros(0, np.int64),
    )  # fmt: skip
    f = pressure_load(alone, mesh, name, FaceGroup(table.faces[0], tuple(table.faces[1:])), table.pressure).f
    rows = zip(joined.place[np.asarray(mesh.node_numbers)], f.reshape(-1, 3), strict=True)
    return replace(nodal_load(body, name, {int(n): row for n, row in rows if row.any()}), kind="pressure")


def _mean_interface(name: str, table: InterfaceSection, coupling: str, model: FEModel, joined: Joined) -> Interface:
    """Return the interface at the reference node of a coupling, which follows the mean motion of the members."""
    raw, given, where = model.mesh, model.tables.couplings[coupling], f"couplings.{coupling}"
    groups = [(nodes_at(raw, f"{where}.members", group), weight) for group, weight in given.members.items()]
    members = _placed(joined, np.concatenate([rows for rows, _ in groups]), f"{where}.members")
    weights = np.concatenate([np.full(len(rows), float(weight)) for rows, weight in groups])  # type: ignore[arg-type]
    reference = raw.nodes[one_node(raw, f"{where}.node", given.node)]
    return Interface(name, "distributing", members, np.asarray(reference), _triad(table), weights)


def _interface(name: str, table: InterfaceSection, raw: RawMesh, joined: Joined) -> Interface:
    """Return an interface on a group of nodes of the mesh."""
    if not isinstance(table.nodes, str):
        raise BodyError(f"interfaces.{name}: with a deck, expected nodes = a group of nodes, got {table.selection}")
    nodes = _placed(joined, nodes_at(raw, f"interfaces.{name}.nodes", table.nodes), f"interfaces.{name}")
    points = joined.body.nodes[nodes]
    reference = points.mean(axis=0) if table.reference is None else np.array(table.reference)
    return Interface(name, table.kind, nodes, reference, _triad(table))


def _triad(table: InterfaceSection) -> Array:
    """Return the axes of an interface as columns, (3, 3)."""
    return np.eye(3) if table.triad is None else np.array(table.triad).T


def _placed(joined: Joined, nodes: IntArray, where: str) -> IntArray:
    """Return the nodes of the body for rows of the mesh; raise `BodyError` for nodes without elements."""
    place = joined.place[nodes]
    if (place < 0).any():
        raise BodyError(f"{where}: {int((place < 0).sum())} of its nodes belong to no element of the body")
    return np.asarray(place)


def _require_groups(raw: RawMesh, where: str, wanted: Iterable[str]) -> None:
    groups = {name for block in raw.blocks for name in block.groups}
    for group in wanted:
        if group not in groups:
            raise BodyError(f'{where} = "{group}": the mesh has no such group of cells{nearest(group, groups)}')


def _require_used_groups(model: FEModel, joined: Joined) -> None:
    """Raise `BodyError` if cells of the mesh are in no table, because their mass would silently be lost."""
    naming = FACE_TYPES + LINES if model.are_faces_names else ()
    tables = model.tables
    cells = [table.cells for table in tables.solids.values()] + [table.cells for table in tables.shells.values()]
    lines = [table.lines for table in tables.sections.values()] + [table.lines for table in tables.rods.values()]
    groups = {group for names in (*cells, *lines) for group in names}
    if "all" in groups or "left-out" in model.accept:
        return
    faces = {group for table in tables.load_cases.values() for group in table.faces or ()}
    for block in model.mesh.blocks:
        if set(block.groups) & faces or (block.kind in naming and (joined.place[block.nodes] >= 0).all()):
            continue
        inside = np.zeros(len(block.nodes), dtype=bool)
        for group in groups & set(block.groups):
            inside[block.groups[group]] = True
        if not inside.all():
            raise BodyError(
                f"model {model.name!r}: {int((~inside).sum())} {block.kind} cells are in no table [solids], [shells] "
                'or [sections]; add one, or accept = ["left-out"]'
            )
