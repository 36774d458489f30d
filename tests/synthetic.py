"""A reduced body of random point masses: consistent in every moment, made without any finite element code."""

import numpy as np

from cms.body.invariants import NodalSums, moments_from_gram
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.body.source_columns import source_columns
from cms.body.stress import PointStress
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.foundation.units import unit_system


def synthetic_reduced_body(*, n_q: int = 5, n_nodes: int = 40, seed: int = 0, units: str = "mm-t-s") -> ReducedBody:
    """Return a body whose nodes carry the masses, so that all moments are plain sums over nodes."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.5, 2.0, n_nodes)
    nodes = rng.normal(size=(n_nodes, 3))
    raw = rng.normal(size=(n_nodes * 3, n_q)) * np.repeat(np.sqrt(mass), 3)[:, None]
    orthonormal = np.linalg.qr(raw)[0] if n_q else raw
    Phi = (orthonormal / np.repeat(np.sqrt(mass), 3)[:, None]).reshape(n_nodes, 3, n_q)
    a = np.concatenate([np.ones((n_nodes, 1)), nodes, *(Phi[:, c] for c in range(3))], axis=1)
    frequencies = np.sort(rng.uniform(100.0, 1000.0, n_q))
    interfaces = tuple(
        ReducedInterface(
            name, kind, rng.normal(size=3), np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=(6, n_q)), members
        )
        for name, kind, members in [("big_end", "rigid", [0, 3, 5]), ("kleines Auge/2 µ", "distributing", [7])]
    )
    more = np.random.default_rng(seed + 1000)
    volume = more.uniform(0.5, 2.0, n_nodes)
    volume_Phi = volume[:, None, None] * Phi
    return ReducedBody(
        name="synthetic",
        units=unit_system(units),
        frame=BodyFrame("nodal", rng.normal(size=3), np.eye(3), "big_end", [[3, c] for c in range(6)]),
        M=np.eye(n_q),
        K=np.diag((2 * np.pi * frequencies) ** 2),
        D=np.diag(0.02 * 2 * np.pi * frequencies),
        labels=tuple(f"mode {k + 1}: fixed-interface" for k in range(n_q)),
        energy_shares=rng.uniform(size=(n_q, 2)),
        sources=("constraint", "fixed-interface"),
        moments=moments_from_gram(a.T @ (mass[:, None] * a)),
        free_frequencies=np.sort(rng.uniform(100.0, 1000.0, n_q)),
        nodes=nodes,
        node_ids=np.arange(n_nodes) * 7,
        Phi=Phi,
        surface=rng.integers(0, n_nodes, size=(60, 3)),
        interfaces=interfaces,
        provenance={"mesh": "rod.msh", "note": "", "größe/µ": "ü" * 300},
        columns=source_columns(
            ("constraint big_end ux", "fixed-interface 1", "fixed-interface 2"),
            ("constraint", "fixed-interface", "fixed-interface"),
            more.normal(size=(3, n_q)),
            1e5 * more.normal(size=(3, n_q)),
        ),
        nodal_sums=NodalSums(
            w=volume.sum(),
            S=volume @ nodes,
            R=nodes.T @ (volume[:, None] * nodes),
            U1=volume_Phi.sum(axis=0),
            U2=np.cross(nodes[:, :, None], volume_Phi, axisa=1, axisb=1, axisc=1).sum(axis=0),
        ),
        load_cases=(
            ReducedLoadCase("weight", "gravity", more.normal(size=3), more.normal(size=3), more.normal(size=n_q)),
            ReducedLoadCase("Zünden/1", "pressure", more.normal(size=3), more.normal(size=3), more.normal(size=n_q)),
        ),
        stress=more.normal(size=(n_nodes, 6, n_q)),
        point_stress=PointStress(("shaft 1 top", "shaft 1 µ"), more.normal(size=(2, 3)), more.normal(size=(2, 6, n_q))),
    )
