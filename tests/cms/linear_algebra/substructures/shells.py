"""Bodies for the tests of substructures."""

import numpy as np

import cms
import fe_models as fm
from fe_models.elements.solids.body import solid_body
from tests.bodies import STEEL, box_mesh
from tests.fe_models.small_shells import SI
from tests.fe_models.small_shells import STEEL as SHEET


def panel(n=14):
    """A curved panel of n x n quads with a rigid interface along one edge and one at the other, coupled."""

    def place(u, v):
        return np.stack([0.7 * np.sin(1.5 * (u - 0.5)), 0.8 * v, 0.7 * np.cos(1.5 * u) + 0.1 * np.sin(3 * v)], axis=1)

    mesh = fm.shells.mapped_shell(place, n, n)
    edges = [fm.shells.shell_interface(mesh, name, fm.selections.NodeSet(name)) for name in ("u0", "u1")]
    return cms.couple(
        fm.shell_body(mesh, fm.shells.ShellProperty(0.005, SHEET), name="panel", units=SI, interfaces=edges)
    )


def between(kind, nx=9):
    """A bar of hexahedra between interfaces of a kind, coupled."""
    mesh = box_mesh(nx, 3, 3, 1.0, 0.2, 0.2, "hexahedron")
    weights = {"weights": np.ones(16)} if kind == "distributing" else {}
    ends = [
        fm.Interface(name, kind, mesh.node_sets[name], np.array([x, 0.1, 0.1]), **weights)
        for name, x in (("left", 0.0), ("right", 1.0))
    ]
    return cms.couple(solid_body(mesh, STEEL, name="bar", units=SI, interfaces=ends))
