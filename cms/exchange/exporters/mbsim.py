"""The input of MBSim's ExternalFlexibleFfrBody: one HDF5 file of mass integrals and nodal shapes."""

import io

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.exchange.exporters.nodes import all_nodes
from cms.exchange.exporters.writer import Made, Request
from fe_models.foundation.arrays import Array

__all__ = ["STRESS_ORDER", "make_mbsim"]

STRESS_ORDER = [0, 1, 2, 5, 3, 4]  #: xx yy zz xy yz zx as indices into our xx yy zz yz xz xy
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  #: (a, b) of the blocks of int phi_a phi_b


def make_mbsim(request: Request) -> Made:
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
    return Made({request.path: image.getvalue()}, nodes.notes())


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
