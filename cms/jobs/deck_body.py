"""Body of a complete deck: solids, shells and lines on shared nodes, with attachments and links."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import SELECTIONS, InterfaceSection, Job
from cms.jobs.tables.material_table import isotropic_of, material_of
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.digest import file_digest
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system
from fe_models.foundation.words import nearest
from fe_models.meshes.numbering import Numbering

if TYPE_CHECKING:
    from fe_models.assembly.constraints import Constraint
    from fe_models.assembly.join import Joined, Part
    from fe_models.body.material import AnyMaterial
    from fe_models.elements.beams.attachments import PointMass
    from fe_models.meshes.cells.raw_mesh import RawMesh
    from fe_models.meshes.mesh import Mesh

__all__ = ["body_of_deck"]

NO_NODES = np.zeros(0, dtype=np.int64)


def body_of_deck(job: Job, path: Path, stages: Stages, on_report: Callable[[Any], None] | None) -> FEBody:
    """Read the deck, build a body for each kind of elements, join these, and add loads and interfaces."""
    from cms.jobs.beam_tables import PLANES
    from fe_models.assembly.join import join
    from fe_models.files.decks.read_deck import read_deck
    from fe_models.meshes.cells.raw_mesh import LINES
    from fe_models.meshes.cells.shell_cells import with_centres
    from fe_models.meshes.mesh import FACE_TYPES

    with stages("read deck"):
        deck = read_deck(path, program=job.body.program)
        raw = with_centres(deck.mesh)
    with stages("assemble"):
        parts, meshes = _parts(job, path, raw, deck.lumped, on_report)
        means = _mean_interfaces(job, raw)
        constraints = _constraints(job, raw, besides=set(means.values()))
        joined = join(
            str(job.body.name), parts, raw.nodes, constraints, numbers=raw.node_numbers, node_sets=raw.node_sets,
            normal=None if job.body.plane is None else PLANES[job.body.plane],
        )  # fmt: skip
        record = {**joined.body.provenance, "deck": str(path), "deck sha256": file_digest(path)}
        record |= {f"file {name}": digest for name, digest in raw.included.items()}
        numbering = joined.body.numbering.with_instances(raw.instances, raw.instance_step)
        body = replace(joined.body, provenance=record, numbering=numbering)
        _require_used_groups(job, raw, joined, naming=FACE_TYPES + LINES if deck.is_plain_mesh else ())
        body = body.with_load_cases(*_load_cases(job, raw, joined, meshes))
        return body.with_interfaces(
            *[
                _mean_interface(name, each, means[name], job, raw, joined)
                if name in means
                else _interface(name, each, raw, joined)
                for name, each in job.interfaces.items()
            ]
        )


def _parts(
    job: Job, path: Path, raw: "RawMesh", lumped: frozenset[str], on_report: Callable[[Any], None] | None
) -> "tuple[list[Part], list[Mesh]]":
    """Return bodies of solids, shells, lines and single-node attachments, and the meshes of the solids."""
    from fe_models.assembly.join import Part

    # row indices of the deck serve as node numbers of the parts
    by_row = replace(raw, node_numbers=np.arange(len(raw.nodes)))
    parts: list[Part] = []
    meshes = []
    for body, mesh in _solids(job, path, by_row, on_report):
        parts.append(Part(body, np.asarray(mesh.node_numbers)))
        meshes.append(mesh)
    if job.body.mass != "as the deck":
        lumped = frozenset(("lines", "shells", "rods") if job.body.mass == "lumped" else ())
    parts += _shells(job, path, by_row, "shells" in lumped, on_report)
    parts += _lines(job, path, by_row, "lines" in lumped, on_report)
    parts += _rods(job, path, by_row, "rods" in lumped)
    attached = _attached(job, raw)
    return [*parts, *([] if attached is None else [attached])], meshes


def _materials(job: Job) -> "dict[str, AnyMaterial]":
    return {name: material_of(name, each) for name, each in job.materials.items()}


def _solids(
    job: Job, path: Path, raw: "RawMesh", on_report: Callable[[Any], None] | None
) -> "Iterable[tuple[FEBody, Mesh]]":
    """Yield a body and its mesh for each element formulation of the solids."""
    from fe_models.checks.mesh_report import report_mesh
    from fe_models.elements.solids.body import solid_body
    from fe_models.meshes.cells.raw_mesh import chosen_cells, mesh_from_raw
    from fe_models.meshes.mesh import SOLID_TYPES, drop_unused_nodes

    materials = _materials(job)
    rules: dict[tuple[str, str], dict[str, AnyMaterial]] = {}
    for name, table in job.solids.items():
        material = materials[table.material or next(iter(materials))]
        for group in table.cells:
            if group != "all":
                _require_group(raw, f"solids.{name}.cells", group)
            rules.setdefault((table.integration, _solid_mass(job, table.mass)), {})[group] = material
    units = unit_system(job.body.units)
    is_alone = len(rules) == 1 and not job.shells and not job.sections and not job.rods
    for (integration, mass), of_group in rules.items():
        groups = None if "all" in of_group else tuple(of_group)
        piece = chosen_cells(raw, SOLID_TYPES, groups)
        mesh = mesh_from_raw(piece, path, "")
        has_bricks = bool(len(mesh.cells.get("hexahedron", ())))
        incompatible = integration == "incompatible" and has_bricks
        given: Any = of_group["all"] if groups is None else of_group
        report = report_mesh(mesh, given, units=units, incompatible_modes=incompatible)
        if on_report is not None:
            on_report(report)
        joined_elsewhere = () if is_alone and not _is_linked(job) else ("parts", "transition")
        report.raise_for_errors(accept=(*job.body.accept, *joined_elsewhere))
        mesh = drop_unused_nodes(mesh)
        body = solid_body(
            mesh,
            given,
            name=f"{job.body.name} solids" if len(rules) == 1 else f"{job.body.name} solids {integration} {mass}",
            units=units,
            incompatible_modes=incompatible,
            integration="full" if integration == "incompatible" else integration,
            mass=mass,
        )
        yield body, mesh


def _solid_mass(job: Job, of_table: str) -> str:
    """Return the mass option of a table [solids.NAME]; [body] mass may request lumped mass or none."""
    if job.body.mass == "lumped":
        return "lumped"
    return "consistent" if job.body.mass == "consistent" and of_table == "lumped" else of_table


def _is_linked(job: Job) -> bool:
    return bool(job.links or job.couplings or job.equations or job.springs)


def _shells(
    job: Job, path: Path, raw: "RawMesh", is_lumped: bool, on_report: Callable[[Any], None] | None
) -> "Iterable[Part]":
    """Yield a body of the shells, or several bodies if shells overlap on the same nodes."""
    from cms.jobs.shell_body import shell_properties_of
    from fe_models.assembly.join import Part
    from fe_models.assembly.lumped import lumped_shells
    from fe_models.checks.shell_report import report_shell
    from fe_models.elements.shells.body import shell_body
    from fe_models.elements.shells.quality import WARP_LIMIT
    from fe_models.meshes.cells.raw_mesh import chosen_cells
    from fe_models.meshes.cells.shell_cells import SHELL_TYPES, shell_mesh_from_raw

    properties = shell_properties_of(job) if job.shells else {}
    layers = _layers(raw, "shells.cells", SHELL_TYPES, properties)
    is_alone = not job.solids and not job.sections and not _is_linked(job) and len(layers) == 1
    for name, groups in zip(_names(f"{job.body.name} shells", layers), layers, strict=True):
        mesh = shell_mesh_from_raw(chosen_cells(raw, SHELL_TYPES, groups), path, "", groups, ())
        mine = properties if groups is None else {group: properties[group] for group in groups}
        materials = {made: None for item in mine.values() for made in item.materials}
        report = report_shell(mesh, materials, units=unit_system(job.body.units))
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept if is_alone else (*job.body.accept, "parts", "transition"))
        given: Any = mine["all"] if groups is None else mine
        masses: list[PointMass] = []
        if is_lumped:
            given, masses = lumped_shells(mesh, given)
        body = shell_body(
            mesh,
            given,
            name=name,
            point_masses=masses,
            units=unit_system(job.body.units),
            warp_limit=180.0 if "warped" in job.body.accept else WARP_LIMIT,
        )
        yield Part(body, np.asarray(mesh.node_numbers))


def _layers(
    raw: "RawMesh", where: str, kinds: tuple[str, ...], properties: Mapping[str, Any]
) -> list[tuple[str, ...] | None]:
    """Split the groups into layers without two cells on the same nodes; None stands for all cells."""
    from fe_models.meshes.cells.raw_mesh import groups_apart

    if "all" in properties:
        return [None]
    for group in properties:
        _require_group(raw, where, group)
    return [*groups_apart(raw, kinds, properties)]


def _names(name: str, layers: list[Any]) -> list[str]:
    """Return a name for each layer."""
    return [name] if len(layers) == 1 else [f"{name} {k}" for k in range(1, len(layers) + 1)]


def _lines(
    job: Job, path: Path, raw: "RawMesh", is_lumped: bool, on_report: Callable[[Any], None] | None
) -> "Iterable[Part]":
    """Yield a body of the beams, or several bodies if beams overlap on the same nodes."""
    from cms.jobs.attachments_of_job import properties_of
    from fe_models.assembly.join import Part
    from fe_models.assembly.lumped import lumped_beams
    from fe_models.checks.frame_report import report_frame
    from fe_models.elements.beams.body import beam_body
    from fe_models.meshes.cells.line_cells import line_mesh_from_raw
    from fe_models.meshes.cells.raw_mesh import chosen_cells

    properties = properties_of(job) if job.sections else {}
    layers = _layers(raw, "sections.lines", ("line", "line3"), properties)
    is_alone = not job.solids and not job.shells and not _is_linked(job) and len(layers) == 1
    for name, groups in zip(_names(f"{job.body.name} beams", layers), layers, strict=True):
        mesh = line_mesh_from_raw(chosen_cells(raw, ("line", "line3"), groups), path, "", groups)
        mine = properties if groups is None else {group: properties[group] for group in groups}
        materials = {item.material: None for item in mine.values()}
        report = report_frame(mesh, materials, units=unit_system(job.body.units))
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept if is_alone else (*job.body.accept, "parts"))
        given: Any = mine["all"] if groups is None else mine
        masses: list[PointMass] = []
        if is_lumped:
            given, masses = lumped_beams(mesh, given)
        body = beam_body(mesh, given, name=name, units=unit_system(job.body.units), point_masses=masses)
        yield Part(body, np.asarray(mesh.node_numbers))


def _rods(job: Job, path: Path, raw: "RawMesh", is_lumped: bool) -> "Iterable[Part]":
    """Yield a body of the rods, or several bodies if rods overlap on the same nodes."""
    from fe_models.assembly.join import Part
    from fe_models.assembly.rods import Rod, rod_body
    from fe_models.meshes.cells.line_cells import line_mesh_from_raw
    from fe_models.meshes.cells.raw_mesh import chosen_cells

    rods: dict[str, Rod] = {}
    for table in job.rods.values():
        name = table.material or next(iter(job.materials))
        rod = Rod(isotropic_of(name, job.materials[name], "rods"), table.area)
        rods |= dict.fromkeys(table.lines, rod)
    layers = _layers(raw, "rods.lines", ("line",), rods)
    for name, groups in zip(_names(f"{job.body.name} rods", layers), layers, strict=True):
        assert groups is not None  # rods must name their lines
        mesh = line_mesh_from_raw(chosen_cells(raw, ("line",), groups), path, "", groups)
        mine = {group: rods[group] for group in groups}
        body = rod_body(mesh, mine, name=name, units=unit_system(job.body.units), is_lumped=is_lumped)
        yield Part(body, np.asarray(mesh.node_numbers))


def _attached(job: Job, raw: "RawMesh") -> "Part | None":
    """Return point masses and springs as a body with only their nodes."""
    from fe_models.assembly.join import Part
    from fe_models.elements.beams.attachments import PointMass, Spring
    from fe_models.elements.beams.body import beam_body
    from fe_models.meshes.line_mesh import LineMesh

    if not job.masses and not job.springs:
        return None
    at_masses = [(name, _group(raw, f"masses.{name}.node", table.node)) for name, table in job.masses.items()]
    at_springs = [
        (name, [_one(raw, f"springs.{name}.nodes", group) for group in table.nodes])
        for name, table in job.springs.items()
    ]
    ends = np.array([node for _, pair in at_springs for node in pair], dtype=np.int64)
    nodes = np.unique(np.concatenate([ends, *(members for _, members in at_masses)]))
    place = {int(node): k for k, node in enumerate(nodes)}
    masses = [
        PointMass(place[node], job.masses[name].mass, job.masses[name].inertia, job.masses[name].offset or (0, 0, 0))
        for name, members in at_masses
        for node in members.tolist()
    ]
    springs = []
    for name, pair in at_springs:
        table = job.springs[name]
        triad = np.eye(3) if table.triad is None else np.array(table.triad).T
        springs.append(
            Spring(
                (place[pair[0]], place[pair[1]]), table.stiffness, damping=table.damping, point=table.point, triad=triad
            )
        )
    body = beam_body(
        LineMesh(raw.nodes[nodes], np.zeros((0, 2), np.int64)),
        {},
        name=f"{job.body.name} attached",
        units=unit_system(job.body.units),
        point_masses=masses,
        springs=springs,
    )
    return Part(body, nodes)


def _mean_interfaces(job: Job, raw: "RawMesh") -> dict[str, str]:
    """Return the coupling for each interface whose node is the reference node of this coupling (a mean motion).

    Such a node has no dofs of its own; an interface of kind "distributing" gives it dofs. The coupling must have all
    components and one weight per member, and nothing else may be attached to its node.
    """
    couplings = {_one(raw, f"couplings.{k}.node", each.node): k for k, each in job.couplings.items()}
    found: dict[str, str] = {}
    for name, table in job.interfaces.items():
        group = raw.node_sets.get(table.nodes, NO_NODES) if isinstance(table.nodes, str) else NO_NODES
        node = int(group[0]) if len(group) == 1 else -1
        if node not in couplings:
            continue
        coupling = job.couplings[couplings[node]]
        where = f"interfaces.{name}: its node is the reference of coupling {couplings[node]!r}"
        if len(coupling.components) < 6 or not all(isinstance(w, float) for w in coupling.members.values()):
            raise JobError(
                f"{where}, which takes some components only, or a weight for each: it has no dofs of its own; put the "
                'interface on its members (kind = "distributing")'
            )
        others = _used_groups(job)
        taken = [
            words
            for words, each in others
            if words != f"couplings.{couplings[node]}" and node in _group(raw, words, each)
        ]
        if taken:
            raise JobError(f"{where}, and {taken[0]} sits on it too: as an interface it has the motion of its members "
                           "alone; put that on another node, or the interface on the members")  # fmt: skip
        found[name] = couplings[node]
    return found


def _used_groups(job: Job) -> "list[tuple[str, str | int]]":
    """Return (table, node group) for each attachment and tie."""
    found: list[tuple[str, str | int]] = [(f"masses.{k}", each.node) for k, each in job.masses.items()]
    found += [(f"springs.{k}", group) for k, each in job.springs.items() for group in each.nodes]
    found += [(f"links.{k}", group) for k, each in job.links.items() for group in (each.node, *each.followers)]
    found += [(f"couplings.{k}", group) for k, each in job.couplings.items() for group in (each.node, *each.members)]
    return found + [(f"equations.{k}", node) for k, each in job.equations.items() for node, _, _ in each.terms]


def _mean_interface(
    name: str, table: InterfaceSection, coupling: str, job: Job, raw: "RawMesh", joined: "Joined"
) -> Interface:
    """Return the interface at the reference node of a coupling, which follows the mean motion of the members."""
    given = job.couplings[coupling]
    groups = [(_group(raw, f"couplings.{coupling}.members", group), weight) for group, weight in given.members.items()]
    members = _placed(joined, np.concatenate([rows for rows, _ in groups]), f"couplings.{coupling}.members")
    weights = np.concatenate([np.full(len(rows), float(weight)) for rows, weight in groups])  # type: ignore[arg-type]
    triad = np.eye(3) if table.triad is None else np.array(table.triad).T
    reference = raw.nodes[_one(raw, f"couplings.{coupling}.node", given.node)]
    return Interface(name, "distributing", members, np.asarray(reference), triad, weights)


def _constraints(job: Job, raw: "RawMesh", *, besides: set[str]) -> "list[Constraint]":
    from fe_models.assembly.constraints import MeanMotion, NodeEquation, RigidNodes

    made: list[Constraint] = []
    for name, link in job.links.items():
        where = f"links.{name}"
        followers = np.unique(np.concatenate([_group(raw, f"{where}.followers", group) for group in link.followers]))
        made.append(RigidNodes(where, _one(raw, f"{where}.node", link.node), followers, link.components))
    for name, coupling in job.couplings.items():
        if name in besides:
            continue
        where = f"couplings.{name}"
        members = [(_group(raw, f"{where}.members", group), weight) for group, weight in coupling.members.items()]
        nodes = np.concatenate([group for group, _ in members])
        each = [(weight,) * 3 + (0.0,) * 3 if isinstance(weight, float) else weight for _, weight in members]
        weights = np.concatenate([np.tile(six, (len(group), 1)) for (group, _), six in zip(members, each, strict=True)])
        node = _one(raw, f"{where}.node", coupling.node)
        made.append(MeanMotion(where, node, nodes, weights, coupling.components))
    for name, equation in job.equations.items():
        where = f"equations.{name}"
        terms = tuple((_one(raw, f"{where}.terms", node), c, a) for node, c, a in equation.terms)
        made.append(NodeEquation(where, terms))
    return made


def _load_cases(job: Job, raw: "RawMesh", joined: "Joined", meshes: "list[Mesh]") -> "list[Any]":
    from cms.jobs.parts_of_job import load_case_of
    from fe_models.body import loads

    body, made = joined.body, []
    for name, table in job.load_cases.items():
        where = f"load_cases.{name}"
        if table.each is not None:
            forces: dict[int, Any] = {}
            for group, force in table.each.items():
                for node in _placed(joined, _group(raw, f"{where}.each", group), f"{where}.each = {group}").tolist():
                    forces[node] = forces.get(node, np.zeros(6)) + np.array(force)
            made.append(loads.nodal_load(body, name, forces))
        elif table.kind == "pressure" and table.faces is not None:
            mesh = next((each for each in meshes if set(table.faces) <= set(each.face_sets)), None)
            if mesh is None:
                raise JobError(f'{where}.faces = "{", ".join(table.faces)}": no solid of the deck has such faces')
            made.append(_pressure(body, joined, mesh, name, table))
        elif table.kind == "gravity":
            made.append(load_case_of(name, table, body, None))
        else:
            raise JobError(f"{where}: with a deck, expected kind gravity, pressure on faces, or force with each")
    return made


def _pressure(body: FEBody, joined: "Joined", mesh: "Mesh", name: str, table: Any) -> Any:
    """Return the load case of a pressure on faces of one of the solid meshes."""
    from fe_models.body.loads import nodal_load, pressure_load
    from fe_models.meshes.selections import FaceGroup

    dofs = np.stack([np.repeat(np.arange(len(mesh.nodes)), 3), np.tile(np.arange(3), len(mesh.nodes))], axis=1)
    alone = replace(
        body, M=_empty(len(dofs)), K=_empty(len(dofs)), D=None, nodes=mesh.nodes, dofs=dofs,
        surface=np.zeros((0, 3), np.int64), element_model=None, recovery=None, load_cases=(), stress_points=None,
        node_volumes=None, interfaces=(), numbering=Numbering(), kept=np.zeros(0, np.int64),
    )  # fmt: skip
    f = pressure_load(alone, mesh, name, FaceGroup(table.faces[0], tuple(table.faces[1:])), table.pressure).f.reshape(
        -1, 3
    )
    place = joined.place[np.asarray(mesh.node_numbers)]
    case = nodal_load(body, name, {int(n): row for n, row in zip(place, f, strict=True) if row.any()})
    return replace(case, kind="pressure")


def _empty(n: int) -> Any:
    import scipy.sparse as sp

    return sp.csc_array((n, n))


def _interface(name: str, table: InterfaceSection, raw: "RawMesh", joined: "Joined") -> Interface:
    """Return an interface on a group of nodes of the deck."""
    if not isinstance(table.nodes, str):
        (given,) = (key for key in SELECTIONS if getattr(table, key) is not None)
        raise JobError(f"interfaces.{name}: with a deck, expected nodes = a group of nodes, got {given}")
    nodes = _placed(joined, _group(raw, f"interfaces.{name}.nodes", table.nodes), f"interfaces.{name}")
    points = joined.body.nodes[nodes]
    # axes are rows in the job, but columns here
    triad = np.eye(3) if table.triad is None else np.array(table.triad).T
    reference = points.mean(axis=0) if table.reference is None else np.array(table.reference)
    return Interface(name, table.kind, nodes, reference, triad)


def _placed(joined: "Joined", nodes: IntArray, where: str) -> IntArray:
    """Return the nodes of the body for rows of the deck; raise `JobError` for nodes without elements."""
    place = joined.place[nodes]
    if (place < 0).any():
        raise JobError(f"{where}: {int((place < 0).sum())} of its nodes belong to no element of the body")
    return np.asarray(place)


def _group(raw: "RawMesh", where: str, group: str | int) -> IntArray:
    """Return the rows of a node group, or the row of the node with this number."""
    if isinstance(group, int):
        numbers = np.zeros(0, np.int64) if raw.node_numbers is None else np.asarray(raw.node_numbers)
        found: IntArray = np.flatnonzero(numbers == group).astype(np.int64)
        if len(found) != 1:
            raise JobError(f"{where} = {group}: the deck has {len(found)} nodes with this number; expected one")
        return found
    if group not in raw.node_sets:
        raise JobError(f'{where} = "{group}": the deck has no such group of nodes{nearest(group, raw.node_sets)}')
    return np.asarray(raw.node_sets[group])


def _one(raw: "RawMesh", where: str, group: str) -> int:
    nodes = _group(raw, where, group)
    if len(nodes) != 1:
        raise JobError(f'{where} = "{group}": expected a group of one node, got {len(nodes)} nodes')
    return int(nodes[0])


def _require_group(raw: "RawMesh", where: str, group: str) -> None:
    groups = {name for block in raw.blocks for name in block.groups}
    if group not in groups:
        raise JobError(f'{where} = "{group}": the deck has no such group of cells{nearest(group, groups)}')


def _require_used_groups(job: Job, raw: "RawMesh", joined: "Joined", *, naming: tuple[str, ...]) -> None:
    """Raise `JobError` if cells of the deck are in no table, because their mass would silently be lost.

    naming: kinds of cells that are only names of edges and faces if all their nodes are on the body.
    """
    tables = [*(t.cells for t in job.solids.values()), *(t.cells for t in job.shells.values())]
    groups = {
        group
        for names in (*tables, *(t.lines for t in job.sections.values()), *(t.lines for t in job.rods.values()))
        for group in names
    }
    if "all" in groups or "left-out" in job.body.accept:
        return
    faces = {group for table in job.load_cases.values() for group in table.faces or ()}
    for block in raw.blocks:
        if set(block.groups) & faces or (block.kind in naming and (joined.place[block.nodes] >= 0).all()):
            continue
        inside = np.zeros(len(block.nodes), dtype=bool)
        for group in groups & set(block.groups):
            inside[block.groups[group]] = True
        if not inside.all():
            raise JobError(
                f"body.deck: {int((~inside).sum())} {block.kind} cells are in no table [solids], [shells] or "
                '[sections]; add one, or accept = ["left-out"]'
            )
