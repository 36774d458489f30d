"""Reduction jobs and meshes: what `cms reduce` accepts is compared with matrices assembled here.

The oracle reads the job with `tomllib`, the mesh with `plain_mesh`, and the modal file with h5py; nothing of it goes
through the code under test. Of every accepted job it asks: is the mass that of the cells and the density; are the
shapes orthonormal in the consistent mass matrix, and is K theirs; does a rigid interface move its members as a rigid
body; are interfaces, units, number of modes and damping those of the text.
"""

import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tests.campaign.mutation import damaged_text, damaged_toml
from tests.campaign.plain_mesh import FORMATS, SIZE, bar, read_plain
from tests.campaign.verdict import ACCEPTED, WRONG, Verdict, ask, judged

__all__ = ["JOB", "job_case", "mesh_case", "wrong_body"]

JOB = """\
# a bar
[body]
mesh = "bar.msh"
units = "mm-t-s"

[materials.steel]
young = 210000.0
poisson = 0.3
density = 7.85e-9

[interfaces.left]
kind = "rigid"
plane = {point = [0.0, 0.0, 0.0], normal = [1.0, 0.0, 0.0]}

[interfaces.right]
kind = "rigid"
box = {lo = [29.9, -1.0, -1.0], hi = [30.1, 20.0, 20.0]}
reference = [30.0, 5.0, 4.0]

[load_cases.pull]
kind = "force"
at = "right"
force = [1.0, 0.0, 0.0]

[reduction]
set = "craig-bampton"
n_modes = 4
geometric_stiffness = false

[damping]
ratio = 0.01
"""
ROUNDOFF = 1e-7  #: of orthonormal shapes and of their stiffness, over the largest; the solver's residual is in it


def job_case(seed: int, folder: Path) -> Verdict:
    """Run a damaged job on the whole mesh."""
    rng = np.random.default_rng([1, seed])
    text = damaged_toml(JOB, rng) if seed else JOB.encode()
    (folder / "bar.msh").write_text(FORMATS["msh"](*bar()))
    return reduced_case(folder, text)


def mesh_case(seed: int, folder: Path) -> Verdict:
    """Run the whole job on a damaged mesh."""
    rng = np.random.default_rng([2, seed])
    suffix = ("msh", "inp", "bdf")[seed % 3]
    whole = FORMATS[suffix](*bar())
    (folder / f"bar.{suffix}").write_bytes(damaged_text(whole, rng) if seed > 2 else whole.encode())
    return reduced_case(folder, JOB.replace("bar.msh", f"bar.{suffix}").encode())


def reduced_case(folder: Path, text: bytes) -> Verdict:
    """Run a job and let the oracle look at what it accepts."""
    (folder / "job.toml").write_bytes(text)
    verdict = judged(ask("cms", "reduce", folder / "job.toml", "-o", folder / "out.h5"), folder=folder)
    if verdict.kind != ACCEPTED:
        return verdict
    reason = wrong_body(folder, text)
    return Verdict(WRONG, reason) if reason else verdict


def wrong_body(folder: Path, text: bytes) -> str:
    """Return what is wrong with the modal file of a job, "" if nothing is."""
    job = tomllib.loads(text.decode("utf-8-sig"))
    mesh_file = folder / job["body"]["mesh"]
    try:
        nodes, tets = read_plain(mesh_file.read_text(errors="replace"), mesh_file.suffix[1:])
    except (ValueError, KeyError, IndexError) as error:
        return f"a mesh was read that the plain reading refuses: {error!r}"
    with h5py.File(folder / "out.h5", "r") as file:
        return compared(job, nodes, tets, file)


def compared(job: dict[str, Any], nodes: dict[int, Any], tets: list[Any], file: Any) -> str:
    """Compare a modal file with the matrices of the mesh; return the first difference in words."""
    used = sorted({n for tet in tets for n in tet})
    place = {number: k for k, number in enumerate(used)}
    X = np.array([nodes[number] for number in used])
    cells = np.array([[place[n] for n in tet] for tet in tets])
    materials = list(job["materials"].values())
    if len(materials) != 1:
        return "the campaign knows one material"
    steel = materials[0]
    M, K, mass = matrices(X, cells, steel["young"], steel["poisson"], steel["density"])
    if not np.isclose(file["/moments/m"][()], mass, rtol=1e-9, atol=0):
        return f"mass {file['/moments/m'][()]}, of the cells {mass}"
    if text_of(file["/units"].attrs["name"]) != job["body"]["units"]:
        return "units"
    axes, origin = file["/frame/axes"][...], file["/frame/origin"][...]
    kept = file["/nodes/position"][...] @ axes.T + origin
    size = np.ptp(X, axis=0).max()
    near = np.linalg.norm(kept[:, None] - X[None], axis=2)
    rows = near.argmin(axis=0)
    if near.min(axis=0).max() > 1e-9 * size:
        return "nodes of the mesh are not among those kept"  # every node of the bar lies on its surface
    n_q = file["/modes/K"].shape[0]
    U = np.einsum("ab,nbk->nak", axes, file["/nodes/Phi"][...])[rows].reshape(3 * len(X), n_q)
    modal_M, modal_K = file["/modes/M"][...], file["/modes/K"][...]
    rank_one = np.abs(U.T @ M @ U - modal_M).max()
    if rank_one > ROUNDOFF * max(1.0, np.abs(modal_M).max()):
        return f"shapes are not orthonormal in the mass of the mesh: {rank_one:.1e}"
    defect = np.abs(U.T @ K @ U - modal_K).max()
    if defect > ROUNDOFF * np.abs(modal_K).max():
        return f"K is not that of the mesh: {defect / np.abs(modal_K).max():.1e}"
    names = [text_of(file[f"/interfaces/{k}"].attrs["name"]) for k in range(file["/interfaces"].attrs["count"])]
    if sorted(names) != sorted(job.get("interfaces", {})):
        return f"interfaces {names}"
    for k, name in enumerate(names):
        reason = wrong_interface(job["interfaces"][name], file[f"/interfaces/{k}"], X, U, size, axes, origin)
        if reason:
            return f"interface {name}: {reason}"
    reduction = job["reduction"]
    if reduction.get("set") == "craig-bampton" and "n_modes" in reduction and "extra" not in reduction:
        kinds = [table["kind"] for table in job["interfaces"].values()]
        if set(kinds) <= {"rigid", "distributing"} and n_q != reduction["n_modes"] + 6 * len(kinds) - 6:
            return f"{n_q} modes, asked for {reduction['n_modes']} and {len(kinds)} interfaces"
    damping = job.get("damping", {})
    omega = np.sqrt(np.maximum(np.diag(modal_K), 0))
    if set(damping) == {"ratio"} and not np.allclose(
        np.diag(file["/modes/D"][...]), 2 * damping["ratio"] * omega, rtol=1e-9, atol=0
    ):
        return "damping"
    return ""


def wrong_interface(
    table: dict[str, Any], group: Any, X: np.ndarray, U: np.ndarray, size: float, axes: np.ndarray, origin: np.ndarray
) -> str:
    """Return what is wrong with an interface: its members, its reference point, its motion."""
    inside = selected(table, X, size)
    point = group["position"][...] @ axes.T + origin
    if "reference" in table and np.abs(point - table["reference"]).max() > 1e-9 * max(size, np.abs(point).max()):
        return "reference point"
    if inside is None or table["kind"] != "rigid":
        return ""
    Psi = np.kron(np.eye(2), axes) @ group["Psi"][...]
    arms = X[inside] - point
    moved = Psi[None, :3] + np.cross(Psi[3:].T[None], arms[:, None], axis=2).transpose(0, 2, 1)
    found = U.reshape(len(X), 3, -1)[inside]
    if np.abs(moved - found).max() > ROUNDOFF * np.abs(U).max():
        return "members do not follow it as a rigid body"
    return ""


def selected(table: dict[str, Any], X: np.ndarray, size: float) -> np.ndarray | None:
    """Return the nodes that a plane or a box selects beyond doubt, None if that depends on a tolerance."""
    if "box" in table and set(table["box"]) == {"lo", "hi"}:
        lo, hi = np.array(table["box"]["lo"]), np.array(table["box"]["hi"])
        found = [((lo - e <= X) & (hi + e >= X)).all(axis=1) for e in (-1e-6 * size, 1e-6 * size)]
    elif "plane" in table:
        normal = np.array(table["plane"]["normal"], dtype=float)
        distance = np.abs((X - table["plane"]["point"]) @ normal) / np.linalg.norm(normal)
        limits = [table["plane"]["tolerance"] * (1 + e) for e in (-1e-9, 1e-9)] if "tolerance" in table["plane"] else \
            [1e-9 * size, 1e-3 * size]  # fmt: skip
        found = [distance <= limit for limit in limits]
    else:
        return None
    return np.flatnonzero(found[0]) if (found[0] == found[1]).all() else None


def matrices(X: np.ndarray, cells: np.ndarray, E: float, nu: float, rho: float) -> tuple[Any, Any, float]:
    """Return M, K and mass of linear tetrahedra, dense: constant strain, consistent mass rho V / 20 (1 + delta_ij)."""
    D = np.zeros((6, 6))
    D[:3, :3] = E / ((1 + nu) * (1 - 2 * nu)) * ((1 - 2 * nu) * np.eye(3) + nu)
    D[3:, 3:] = E / (2 * (1 + nu)) * np.eye(3)
    M, K, mass = np.zeros((3 * len(X), 3 * len(X))), np.zeros((3 * len(X), 3 * len(X))), 0.0
    for cell in cells:
        T = np.column_stack([np.ones(4), X[cell]])
        volume = abs(np.linalg.det(T)) / 6
        gradient = np.linalg.inv(T)[1:]  # (3, 4): of the four shape functions
        B = np.zeros((6, 12))
        for a in range(4):
            gx, gy, gz = gradient[:, a]
            B[:, 3 * a : 3 * a + 3] = [[gx, 0, 0], [0, gy, 0], [0, 0, gz], [0, gz, gy], [gz, 0, gx], [gy, gx, 0]]
        dofs = (3 * cell[:, None] + np.arange(3)).ravel()
        K[np.ix_(dofs, dofs)] += volume * B.T @ D @ B
        M[np.ix_(dofs, dofs)] += rho * volume / 20 * np.kron(np.ones((4, 4)) + np.eye(4), np.eye(3))
        mass += rho * volume
    return M, K, mass


def text_of(value: Any) -> str:
    """Return an attribute as text."""
    return value.decode() if isinstance(value, bytes) else str(value)


assert SIZE[0] == 30.0  # the job speaks of it
