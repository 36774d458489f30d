"""The HDF5 file of ExternalFlexibleFfrBody of MBSim (mass integrals, nodal shapes), read and written."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.invariants import Moments
from cms.body.reduced_body import ReducedBody
from cms.errors import ForeignBodyError
from cms.exchange.exporters.nodes import all_nodes
from cms.exchange.exporters.writer import Request, WrittenFiles
from cms.exchange.importers.modal_body import ForeignInterface, ModalBody
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["STRESS_ORDER", "is_mbsim", "make_mbsim", "read_mbsim"]


# the input of MBSim's ExternalFlexibleFfrBody: one HDF5 file of mass integrals and nodal shapes -----------------------


#: stress components xx yy zz xy yz zx as indices into xx yy zz yz xz xy of this project
STRESS_ORDER = [0, 1, 2, 5, 3, 4]
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  #: index pairs (a, b) of the blocks ∫ phi_a phi_b


def make_mbsim(request: Request) -> WrittenFiles:
    """Return the file; docs/formats.md lists the datasets and their index orders."""
    import h5py

    body = request.body
    image = io.BytesIO()
    with h5py.File(image, "w", libver=("v108", "v108")) as file:
        for name, values in datasets(body).items():
            file.create_dataset(name, data=values, track_times=False)
        for k, line in enumerate(request.header()):
            file.attrs.create(f"header {k + 1}", line.encode("ascii"))
        nodes = all_nodes(body)
        for name, row in nodes.of_interface.items():
            file.attrs.create(f"interface {name}", int(nodes.numbers[row]))
    return WrittenFiles({request.path: image.getvalue()}, nodes.notes())


def datasets(body: ReducedBody) -> dict[str, Array]:
    """Return all datasets by name, in the order in which they are written."""
    moments, n = body.moments, body.n_q
    nodes = all_nodes(body)
    n_nodes = len(nodes.numbers)
    values = {
        "mass": np.array(moments.m),
        "position integral": moments.S,
        "position position integral": moments.R,
        "shape function integral": moments.C1,
        "stiffness matrix": body.K,
        "position shape function integral": moments.P.reshape(9, n),
        "shape function shape function integral": np.concatenate([moments.S_kl[a, b] for a, b in UPPER]),
        "nodal relative position": nodes.positions.reshape(-1),
        "nodal shape matrix of translation": nodes.Phi.reshape(3 * n_nodes, n),
        "nodal shape matrix of rotation": nodes.Psi.reshape(3 * n_nodes, n),
        "node numbers": nodes.numbers.astype(np.int32),
    }
    if np.any(body.D):
        values["damping matrix"] = body.D
    if body.stress is not None:
        stress = np.zeros((n_nodes, 6, n))
        stress[: len(body.nodes)] = np.asarray(body.stress)[:, STRESS_ORDER]
        values["nodal stress matrix"] = stress.reshape(6 * n_nodes, n)
    if len(body.surface):
        ends = np.full((len(body.surface), 1), -1)
        values["openmbv indices"] = np.hstack([body.surface, ends]).astype(np.int32).reshape(-1)
    return values


# bodies of MBSim: the HDF5 input of its ExternalFlexibleFfrBody -------------------------------------------------------


SIGNATURE = b"\x89HDF\r\n\x1a\n"
#: stress components xx yy zz yz xz xy as indices into xx yy zz xy yz zx of the file
READ_STRESS_ORDER = [0, 1, 2, 4, 5, 3]
DENSEST = 1100  #: largest compression ratio of a file
NEEDED = ("mass", "position integral", "position position integral", "shape function integral", "stiffness matrix")


def is_mbsim(path: Path, head: bytes) -> bool:
    """Return whether a file is HDF5 with the datasets of MBSim."""
    if not head.startswith(SIGNATURE):
        return False
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return all(name in file for name in NEEDED[1:4])
    except (OSError, RuntimeError):  # RuntimeError comes from damaged internal tables
        return False


def read_mbsim(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> ModalBody:
    """Read a body of MBSim; docs/formats.md lists names and shapes of the datasets.

    Raises
    ------
    ForeignBodyError
        If a dataset is missing, of another shape, or the file is damaged.
    """
    import h5py

    path = files[0]
    if len(files) > 1:
        raise ForeignBodyError(f"{path}: expected one file of MBSim, got {len(files)}")
    try:
        with h5py.File(path, "r") as file:
            return body_of_file(file, path, name)
    except (OSError, RuntimeError) as error:
        raise ForeignBodyError(f"{path}: cannot be read as HDF5: {error}; it is truncated or damaged") from error


def body_of_file(file: Any, path: Path, name: str) -> ModalBody:
    """Return the body in an open file."""
    if "stiffness matrix" not in file:
        raise ForeignBodyError(f"{path}: dataset 'stiffness matrix' is missing")
    shape = file["stiffness matrix"].shape
    if len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
        raise ForeignBodyError(f"{path}: dataset 'stiffness matrix': expected a square matrix, got shape {shape}")
    n = shape[0]

    def read(key: str, *shape: int) -> Array:
        if key not in file:
            raise ForeignBodyError(f"{path}: dataset {key!r} is missing")
        dataset = file[key]
        stored = dataset.id.get_storage_size()
        if dataset.nbytes > 4096 + DENSEST * stored:
            raise ForeignBodyError(f"{path}: dataset {key!r}: declares {dataset.nbytes} bytes but contains {stored}")
        if dataset.size != int(np.prod(shape)):
            raise ForeignBodyError(f"{path}: dataset {key!r}: expected shape {shape}, got {dataset.shape}")
        return np.asarray(dataset[()], dtype=float).reshape(shape)

    m = float(read("mass"))
    S_kl = np.zeros((3, 3, n, n))
    blocks = read("shape function shape function integral", 6, n, n)
    for (a, b), block in zip(UPPER, blocks, strict=True):
        S_kl[a, b], S_kl[b, a] = block, block.T
    moments = Moments(
        m=m,
        S=read("position integral", 3),
        R=read("position position integral", 3, 3),
        C1=read("shape function integral", 3, n),
        P=read("position shape function integral", 3, 3, n),
        S_kl=S_kl,
    )
    n_nodes = file["nodal relative position"].size // 3 if "nodal relative position" in file else 0
    numbers = read("node numbers", n_nodes).astype(np.int64) if "node numbers" in file else 1 + np.arange(n_nodes)
    rotation, stress = "nodal shape matrix of rotation", "nodal stress matrix"
    surface: IntArray = np.zeros((0, 3), np.int64)
    if "openmbv indices" in file:
        surface = triangles_of(np.asarray(file["openmbv indices"][()]), n_nodes)
    return ModalBody(
        name=name,
        M=moments.M,
        K=read("stiffness matrix", n, n),
        D=read("damping matrix", n, n) if "damping matrix" in file else None,
        moments=moments,
        node_numbers=numbers,
        nodes=read("nodal relative position", n_nodes, 3) if n_nodes else np.zeros((0, 3)),
        Phi=read("nodal shape matrix of translation", n_nodes, 3, n) if n_nodes else np.zeros((0, 3, n)),
        rotations=read(rotation, n_nodes, 3, n) if rotation in file else None,
        stress=read(stress, n_nodes, 6, n)[:, READ_STRESS_ORDER] if stress in file else None,
        surface=surface,
        interfaces=tuple(
            ForeignInterface(key.removeprefix("interface "), np.array([int(file.attrs[key])]))
            for key in file.attrs
            if key.startswith("interface ")
        ),
        program="MBSim",
        provenance={"source": "MBSim, ExternalFlexibleFfrBody"},
    )


def triangles_of(indices: IntArray, n_nodes: int) -> IntArray:
    """Return triangles of node indices from faces that each end with -1; larger faces are divided into triangles."""
    triangles, face = [], []
    for index in indices.tolist():
        if index >= 0:
            face.append(int(index))
            continue
        triangles += [[face[0], face[k], face[k + 1]] for k in range(1, len(face) - 1)]
        face = []
    found = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    return found if found.size and found.max() < n_nodes else np.zeros((0, 3), np.int64)
