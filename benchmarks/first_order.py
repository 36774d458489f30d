"""Cells of first order against second: errors of the lowest frequencies of a free bar, and what the mesh report says.

python -m benchmarks.first_order
"""

import time

import numpy as np

from fe_models.checks.first_order import first_order_error
from fe_models.meshes.quadratic_mesh import FIRST_ORDER
from tests.bodies import box_mesh
from tests.fe_models.checks.test_first_order import free_frequencies

SIZE = (1.0, 0.1, 0.05)


def main():
    """Print the largest error in % of the first three frequencies, and the figure with the time it took."""
    exact = free_frequencies(box_mesh(60, 6, 3, *SIZE, "tetra10"))
    print("cells over the thickness        1       2       4   mesh report (time)")
    for name, kind, options in (
        ("tetra", "tetra", {}),
        ("wedge", "wedge", {}),
        ("hexahedron", "hexahedron", {}),
        ("hexahedron, incompatible", "hexahedron", {"incompatible_modes": True}),
        ("tetra10", "tetra10", {}),
    ):
        errors, figures = [], []
        for n in (1, 2, 4):
            mesh = box_mesh(20 * n, 2 * n, n, *SIZE, kind)
            ratio = free_frequencies(mesh, **options) / exact - 1
            errors.append(100 * ratio[np.abs(ratio).argmax()])
            start = time.process_time()
            found = first_order_error(mesh) if kind in FIRST_ORDER and not options else None
            spent = time.process_time() - start
            figures.append(
                "-" if found is None else f"{100 * found.error:.1f}{'' if found.is_whole else ' piece'} ({spent:.1f} s)"
            )
        print(f"{name:26s}" + "".join(f"{error:8.2f}" for error in errors) + "   " + ", ".join(figures))


if __name__ == "__main__":
    main()
