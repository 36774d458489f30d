"""`cms split`: write jobs for the parts of one body, and a system that joins the parts."""

import json
import logging
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import Job, read_job
from cms.jobs.reduction_table import FRAMES, named_interfaces
from fe_models.foundation.paths import replace_file
from fe_models.foundation.units import UNIT_SYSTEMS

if TYPE_CHECKING:
    from cms.jobs.part_damping import PartsDamping
    from fe_models.meshes.split import Cut

__all__ = ["SplitRequest", "direction_of", "places_of", "split_job"]

log = logging.getLogger(__name__)

CUT_KINDS = ("rigid", "distributing")
COORDINATE = 1e-9  #: largest difference between coordinates of one node, divided by the mesh size


@dataclass(frozen=True)
class SplitRequest:
    """Arguments of `cms split`."""

    job: Path
    n: int | None = None
    at: tuple[float, ...] | None = None  #: positions of the cuts along the axis; None: equal parts
    axis: tuple[float, float, float] | None = None
    kind: str = "rigid"  #: kind of the interfaces at the cuts
    folder: Path | None = None  #: folder of the jobs; None: NAME_parts next to the job


def direction_of(text: str | None) -> tuple[float, float, float] | None:
    """Return the direction for x, y, z or three numbers."""
    from cms.cli.frame import numbers

    if text is None:
        return None
    if text in ("x", "y", "z"):
        x, y, z = np.eye(3)["xyz".index(text)]
        return float(x), float(y), float(z)
    return numbers("--axis", text)


def places_of(text: str | None) -> tuple[float, ...] | None:
    """Return the positions of the cuts, given as numbers separated by commas."""
    if text is None:
        return None
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise JobError(f"--at {text}: expected numbers with commas between them, as 40,80") from None


def split_job(request: SplitRequest) -> list[Path]:
    """Write a job for every part, and a system file that joins them with fixed joints; return the files.

    Raises
    ------
    JobError
        If the body cannot be cut there, because an interface, a load or an attachment lies on two parts.
    MeshError
        If the mesh cannot be cut into this number of parts.
    """
    import tomlkit

    from cms.reduction.basis.strain_damping import strain_damping_bytes
    from fe_models.meshes.split import longest_direction, split_mesh

    job = read_job(request.job)
    if request.kind not in CUT_KINDS:
        raise JobError(f"--cut {request.kind}: expected one of {', '.join(CUT_KINDS)}")
    if job.body.part is not None:
        raise JobError(f"{request.job}: body.part: this is a part already; split the whole body")
    folder = request.folder or request.job.with_name(f"{request.job.stem}_parts")
    if folder.exists() and not folder.is_dir():
        raise JobError(f"--output {folder}: this is a file; expected a folder")
    mesh = mesh_of(job)
    # The jobs of the parts get the same axis to the last digit: a cell centred at a cut must go to the same part.
    axis = longest_direction(mesh.nodes) if request.axis is None else np.array(request.axis)
    split = split_mesh(mesh, request.n, at=request.at, axis=axis)
    names_of_cuts = [cut.name for cut in split.cuts]
    homes = homes_of(job, mesh, split.parts, names_of_cuts)
    documents = []
    for k, part in enumerate(split.parts):
        document = tomlkit.parse(request.job.read_text(encoding="utf-8-sig"))
        edit_job(
            document, job, part,
            number=k + 1, request=request, folder=folder, axis=axis,
            cuts=[split.cuts[j] for j in (k - 1, k) if 0 <= j < len(split.cuts)],
            inside=[name for name, home in homes.items() if home == k],
        )  # fmt: skip
        documents.append(document)
    damping = parts_damping(job, [text_without_damping(document, job) for document in documents], split.parts)
    files: dict[Path, bytes] = {}
    dampings: dict[Path, bytes] = {}
    for k, document in enumerate(documents, 1):
        if damping is not None:
            path = folder / f"part_{k}_damping.npz"
            table = tomlkit.table()
            table.add(tomlkit.comment(description_of(damping, job)))
            table["file"] = path.name
            document["damping"] = table
            dampings[path] = strain_damping_bytes(damping.parts[k - 1])
        files[folder / f"part_{k}.toml"] = tomlkit.dumps(document).encode()
    files[folder / "system.toml"] = system_text(job, len(split.parts)).encode()
    if damping is not None:
        log.warning("damping: %s", description_of(damping, job))
    folder.mkdir(parents=True, exist_ok=True)
    for path, content in {**dampings, **files}.items():
        replace_file(path, content)
    return list(files)


def text_without_damping(document: Any, job: Job) -> str:
    """Return the job text of a part with absolute paths and without damping."""
    import tomlkit

    copy = tomlkit.parse(tomlkit.dumps(document))
    copy.pop("damping", None)
    for key in ("mesh", "nodes", "lines"):
        if key in copy["body"]:
            copy["body"][key] = os.path.abspath(getattr(job.body, key))
    return tomlkit.dumps(copy)


def parts_damping(job: Job, texts: list[str], parts: "tuple[Any, ...]") -> "PartsDamping | None":
    """Return the damping with which the body in parts keeps the damping ratios of a job; None if the job has none.

    Parameters
    ----------
    texts
        Jobs of the parts without damping, with absolute paths.
    parts
        Meshes of the parts.
    """
    from cms.jobs.body_of_job import is_of_mesh, job_body
    from cms.jobs.part_damping import damping_of_parts
    from cms.reduction.basis.damping import PerModeDamping, RayleighDamping, damping_ratios
    from cms.reduction.basis.strain_damping import StrainDamping

    damping = None if job.damping is None else job.damping.damping
    if damping is None or isinstance(damping, RayleighDamping | StrainDamping):
        return None
    bodies = []
    with TemporaryDirectory() as folder:
        for text, mesh in zip(texts, parts, strict=True):
            path = Path(folder) / "part.toml"
            path.write_text(text, encoding="utf-8")
            part = read_job(path)
            bodies.append(job_body(part, source=mesh if is_of_mesh(part) else None))

    def ratios(omega2: np.ndarray) -> np.ndarray:
        if isinstance(damping, PerModeDamping):
            return np.array([damping.ratios[min(k, len(damping.ratios) - 1)] for k in range(len(omega2))])
        return damping_ratios(damping, np.ones(len(omega2)), omega2, bodies[0].units.time)

    held = job.reduction.at if job.reduction.frame == "nodal" else None
    return damping_of_parts(bodies, ratios, held=held, solver=job.reduction.solver)


def description_of(found: "PartsDamping", job: Job) -> str:
    """Return a text with the damping ratios of the joined parts."""
    second = UNIT_SYSTEMS[job.body.units].time
    listed = "; ".join(
        f"{k}: {mode.frequency / second:.4g} Hz, {mode.ratio:.3g} for {mode.wanted:.3g}"
        for k, mode in enumerate(found.modes, 1)
    )
    is_all = found.n_exact == len(found.modes)
    kept = "all these modes" if is_all else f"the first {found.n_exact} modes"
    support = "free" if found.held is None else f"clamped at {found.held!r}"
    others = "" if is_all else "; others are too alike in the parts, and fewer parts keep more"
    return (
        f"ratios belong to modes of one body: the parts have dampings of their own, with which {kept} of "
        f"{job.body.name!r}, {support}, keep theirs{others} (mode: frequency, ratio in parts for ratio of the job): "
        f"{listed}"
    )


def mesh_of(job: Job) -> Any:
    """Read the mesh of a job that can be cut: solid cells, shells or lines."""
    from cms.jobs.body_of_job import mesh_of_job
    from fe_models.meshes.mesh import Mesh, drop_unused_nodes

    if job.body.matrices is not None:
        raise JobError("body.matrices: bare matrices cannot be cut; give the mesh they were made of")
    if job.ties:
        raise JobError("ties: beams tied to a solid cannot be cut; cut one without the other")
    mesh = mesh_of_job(job)
    return drop_unused_nodes(mesh) if isinstance(mesh, Mesh) else mesh


def homes_of(job: Job, mesh: Any, parts: tuple[Any, ...], cuts: list[str]) -> dict[str, int]:
    """Return the part index of each interface; raise `JobError` if an interface is on two parts or on a cut."""
    from fe_models.assembly.tables.places import interfaces_of
    from fe_models.errors import InterfaceError

    tolerance = COORDINATE * float(np.ptp(mesh.nodes, axis=0).max())
    homes: dict[str, int] = {}
    for name, section in job.interfaces.items():
        whole = mesh.nodes[interfaces_of({name: section}, mesh)[0].nodes]
        for k, part in enumerate(parts):
            try:
                there = part.nodes[interfaces_of({name: section}, part)[0].nodes]
            except InterfaceError:
                continue
            if len(there) == len(whole) and np.abs(there - whole).max() <= tolerance:
                homes[name] = k
                on_cut = [
                    cut
                    for cut in cuts
                    if cut in part.node_sets and shares(part.nodes[part.node_sets[cut]], there, tolerance)
                ]
                if on_cut:
                    raise JobError(
                        f"interfaces.{name}: it has nodes on {on_cut[0]}; a node can follow one interface only: take "
                        "another number of parts or another axis"
                    )
        if name not in homes:
            raise JobError(
                f"interfaces.{name}: its {len(whole)} nodes do not lie on one part alone; take fewer parts, or another "
                "axis"
            )
    return homes


def shares(A: np.ndarray, B: np.ndarray, tolerance: float) -> bool:
    """Return whether two sets of points have a common point."""
    from scipy.spatial import cKDTree

    return bool(np.isfinite(cKDTree(A).query(B, distance_upper_bound=tolerance)[0]).any())


def edit_job(
    document: Any,
    job: Job,
    part: Any,
    *,
    number: int,
    request: SplitRequest,
    folder: Path,
    axis: np.ndarray,
    cuts: "list[Cut]",
    inside: list[str],
) -> None:
    """Convert the job of the whole body to the job of a part; comments and order remain."""
    import tomlkit

    body = document["body"]
    body["name"] = f"{job.body.name}_{number}"
    for key in ("mesh", "nodes", "lines"):
        if key in body:
            body[key] = os.path.relpath(getattr(job.body, key), folder).replace(os.sep, "/")
    table = tomlkit.inline_table()
    where = {"of": request.n} if request.at is None else {"at": list(request.at)}
    table.update({"number": number, **where, "axis": [float(x) for x in axis]})
    body["part"] = table
    keep_groups(document, "materials", "cells", getattr(part, "cell_sets", {}))
    keep_groups(document, "sections", "lines", getattr(part, "line_sets", {}))
    keep_groups(document, "shells", "cells", getattr(part, "cell_sets", {}))
    used = {section.material for name, section in job.sections.items() if name in document.get("sections", {})}
    shells = [shell for name, shell in job.shells.items() if name in document.get("shells", {})]
    used |= {item.material for shell in shells for item in shell.layers or (shell,)}
    if (job.sections or job.shells) and None not in used:
        keep(document, "materials", [name for name in job.materials if name in used])
    keep(document, "interfaces", inside)
    interfaces = document.setdefault("interfaces", tomlkit.table(is_super_table=True))
    for cut in cuts:
        interface = tomlkit.table()
        interface.update({"kind": request.kind, "nodes": cut.name, "reference": [float(x) for x in cut.point]})
        interfaces[cut.name] = interface
    for key in ("masses", "springs", "links"):
        keep(document, key, attached(getattr(job, key), key, part, cuts))
    keep(document, "load_cases", loads_on(job, part, inside, request))
    edit_reduction(document["reduction"], job, [*inside, *(cut.name for cut in cuts)])


def edit_reduction(reduction: Any, job: Job, interfaces: list[str]) -> None:
    """Remove entries about interfaces of other parts; replace a nodal frame by mean axes.

    Neighbours hold the parts at both ends. With geometric stiffness, a frame attached at only one end would be
    inaccurate.
    """
    for key in ("free", "loads"):
        if key in reduction:
            for name in [name for name in reduction[key] if name not in interfaces]:
                del reduction[key][name]
            if not len(reduction[key]):
                del reduction[key]
    if "neighbours" in reduction and any(
        name not in interfaces for where, name in named_interfaces(job.reduction).items() if "neighbours" in where
    ):
        raise JobError("reduction.neighbours: they name interfaces of several parts; remove the table")
    if reduction.get("frame", FRAMES[0]) == "nodal":
        reduction["frame"] = "tisserand"
        for key in ("at", "dofs"):
            if key in reduction:
                del reduction[key]


def keep(document: Any, key: str, names: list[str]) -> None:
    """Keep only the named tables in a table of tables; remove it if it becomes empty."""
    if key not in document:
        return
    for name in [name for name in document[key] if name not in names]:
        del document[key][name]
    if not len(document[key]):
        del document[key]


def keep_groups(document: Any, key: str, groups_key: str, groups: Mapping[str, Any]) -> None:
    """Keep the tables that name groups of this part, with only these groups."""
    for name in list(document.get(key, {})):
        given = document[key][name].get(groups_key, "all")
        names = [given] if isinstance(given, str) else list(given)
        there = [group for group in names if group == "all" or group in groups]
        if not there:
            del document[key][name]
        elif there != names:
            document[key][name][groups_key] = there


def attached(tables: Mapping[str, Any], key: str, part: Any, cuts: "list[Cut]") -> list[str]:
    """Return the attachments on this part; raise `JobError` for one on a cut, because both parts would have it."""
    on_cut = [set(part.node_sets[cut.name].tolist()) for cut in cuts]
    names = []
    for name, table in tables.items():
        groups = [*getattr(table, "nodes", ()), *getattr(table, "followers", ())]
        groups += [table.node] if getattr(table, "node", None) else []
        if any(isinstance(group, int) for group in groups):
            raise JobError(f"{key}.{name}.node: a number belongs to the whole mesh; name a group of that node instead")
        there = [group for group in groups if group in part.node_sets]
        if any(set(part.node_sets[group].tolist()) & cut for group in there for cut in on_cut) and key != "links":
            raise JobError(
                f"{key}.{name}: it is on a node of a cut, which two parts have; take another number of parts"
            )
        if there and len(there) < len(groups):
            raise JobError(f"{key}.{name}: its nodes are on two parts; take another number of parts, or another axis")
        if there:
            names.append(name)
    return names


def loads_on(job: Job, part: Any, inside: list[str], request: SplitRequest) -> list[str]:
    """Return the load cases of this part: gravity, pressure on its faces, and forces at its interfaces."""
    names = []
    groups = part.cell_sets if job.shells else getattr(part, "face_sets", {})
    for name, case in job.load_cases.items():
        if case.kind == "gravity" or (case.at is not None and case.at in inside):
            names.append(name)
        elif case.kind == "pressure" and case.faces is not None:
            if all(face in groups for face in case.faces):
                names.append(name)
        elif case.at is None:
            raise JobError(
                f"load_cases.{name}: whose part it is cannot be told from {case.selection}; remove it from "
                f"{request.job.name}, split, and add it to the jobs of the parts"
            )
    return names


def key(name: str) -> str:
    """Return a name as a TOML key, in quotes if necessary."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name)


def system_text(job: Job, n: int) -> str:
    """Return the text of a system file with the parts in their original positions, joined at the cuts."""
    name = str(job.body.name)
    lines = [
        f"# {name!r} in {n} parts, each with a frame of its own. Reduce them first: cms reduce part_1.toml, ...",
        "[system]",
        f'units = "{job.body.units}"',
        "gravity = [0, 0, 0]",
        "",
    ]
    for k in range(1, n + 1):
        lines += [f"[bodies.{key(f'{name}_{k}')}]", f'file = "part_{k}.h5"', ""]
    for k in range(1, n):
        lines += [
            f"[joints.cut_{k}]",
            'type = "fixed"',
            f"body_a = {json.dumps(f'{name}_{k}')}",
            f'marker_a = "cut_{k}"',
            f"body_b = {json.dumps(f'{name}_{k + 1}')}",
            f'marker_b = "cut_{k}"',
            "",
        ]
    return "\n".join([*lines, "[run]", "t_end = 1.0", "h = 1e-3", ""])
