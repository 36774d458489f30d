"""Matrix Market: stiffness, mass and damping of a body over its interfaces, one text file for each matrix."""

import io
from pathlib import Path

import scipy.sparse as sp

from cms.exchange.exporters.writer import Made, Request, in_ascii
from cms.reduction.interface_model import interface_model
from fe_models.foundation.arrays import Array
from fe_models.foundation.components import MOTION_COMPONENTS

__all__ = ["make_matrix_market"]


def make_matrix_market(request: Request) -> Made:
    """Return FILE_K.mtx, FILE_M.mtx, FILE_C.mtx and, if there are load cases, FILE_F.mtx; comments name the rows."""
    model = interface_model(request.body)
    names = [f"{node.interface} {MOTION_COMPONENTS[c]}" for node in model.nodes for c in node.components]
    names += [f"fixed-interface mode {k + 1}" for k in range(model.n_modes)]
    comment = "\n".join([*request.header(), *(f"row {row + 1}: {in_ascii(name)}" for row, name in enumerate(names))])
    files: dict[Path, bytes] = {}
    for letter, matrix in {"K": model.K, "M": model.M, "C": model.D, "F": model.loads}.items():
        if matrix.shape[1]:
            path = request.path.with_name(f"{request.path.stem}_{letter}.mtx")
            files[path] = text_of(matrix, comment, "general" if letter == "F" else "symmetric")
    cases = enumerate(model.body.load_cases)
    return Made(files, tuple(f"load case {case.name}: column {k + 1} of F" for k, case in cases))


def text_of(matrix: Array, comment: str, symmetry: str) -> bytes:
    """Return a file in coordinate format, in full precision."""
    from scipy.io import mmwrite

    image = io.BytesIO()
    mmwrite(image, sp.coo_array(matrix), comment=comment, field="real", precision=17, symmetry=symmetry)
    return image.getvalue()
