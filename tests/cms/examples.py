"""Systems, bodies and helpers that several tests share: frame conversion, reduction."""

import numpy as np

from cms.reduction.basis.frames import BuckensFrame, NodalFrame, TisserandFrame
from fe_models.body.fe_body import Interface
from fe_models.body.loads import gravity_load, interface_load
from tests.bodies import STEEL, box_mesh, distorted


def hinged_bricks():
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.units import unit_system
    from fe_models.meshes.mesh import Mesh

    one = box_mesh(2, 1, 1, kind="hexahedron")
    other = one.nodes + np.array([1.0, 1.0, 0.0])
    nodes = np.vstack([one.nodes, other])
    unique, index = np.unique(np.round(nodes, 9), axis=0, return_inverse=True)
    cells = np.vstack([one.cells["hexahedron"], one.cells["hexahedron"] + len(one.nodes)])
    mesh = Mesh(unique, {"hexahedron": index[cells]})
    ends = [
        Interface("left", "rigid", np.flatnonzero(unique[:, 0] == 0), np.array([0.0, 0.5, 0.5])),
        Interface("right", "rigid", np.flatnonzero(unique[:, 0] == 2), np.array([2.0, 1.5, 0.5])),
    ]
    return solid_body(mesh, STEEL, name="hinged", units=unit_system("m-kg-s"), interfaces=ends)


TURNED = ((0.0, 1.0, 0.0), (-0.6, 0.0, 0.8), (0.8, 0.0, 0.6))
FRAMES = {
    "tisserand": TisserandFrame(),
    "tisserand turned": TisserandFrame(origin=(0.2, -0.1, 0.3), axes=TURNED),
    "buckens": BuckensFrame(),
    "buckens turned": BuckensFrame(origin=(0.2, -0.1, 0.3), axes=TURNED),
    "nodal left": NodalFrame("left"),
    "nodal right": NodalFrame("right"),
    "nodal right turned": NodalFrame("right", origin=(0.2, -0.1, 0.3), axes=TURNED),
    "nodal": NodalFrame(),
}


def uneven_bar(kinds=("rigid", "distributing")):
    """A bar of two densities with distorted cells and an interface of each kind, so that no two frames coincide."""
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.units import unit_system
    from tests.bodies import ALUMINIUM, STEEL

    mesh = distorted(box_mesh(6, 1, 1, 1.0, 0.08, 0.05, "hexahedron"), amount=0.3)
    ends = [
        Interface(name, kind, mesh.node_sets[name], np.array([x, 0.03, 0.02]))
        for name, kind, x in (("left", kinds[0], 0.0), ("right", kinds[1], 1.02))
    ]
    materials = {"left half": STEEL, "right half": ALUMINIUM}
    body = solid_body(mesh, materials, name="bar", units=unit_system("m-kg-s"), interfaces=ends)
    return body.with_load_cases(
        gravity_load(body, "weight", (1.0, 2.0, -9.81)),
        interface_load(body, "pull", "right", force=(5.0, 1.0, 2.0), torque=(0.3, 0.2, 0.1)),
    )
