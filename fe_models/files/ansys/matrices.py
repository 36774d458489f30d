"""Binary files of ANSYS as parts of a model: assembled matrices (.full) and superelements (.sub)."""

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.files.ansys.full import read_full
from fe_models.files.ansys.sub import SCALAR as MODAL
from fe_models.files.ansys.sub import read_sub
from fe_models.files.matrices.foreign_matrices import SCALAR, ForeignMatrices
from fe_models.files.matrices.request import Request

__all__ = ["read_full_part", "read_sub_part"]


def read_full_part(path: Path, request: Request) -> ForeignMatrices:
    """Read a .full file; positions come from a separate deck.

    Raises
    ------
    MatrixError
        If `read_full` raises it.
    """
    read = read_full(path)
    return ForeignMatrices(
        K=read.K,
        M=read.M,
        D=read.D,
        dofs=read.dofs,
        triangle={role: "upper" for role in "KMD" if getattr(read, role) is not None},
        removed=read.removed,
        program="ANSYS",
    )


def read_sub_part(path: Path, request: Request) -> ForeignMatrices:
    """Read a superelement; its modal coordinates are numbered after its nodes.

    Raises
    ------
    MatrixError
        If `read_sub` raises it.
    """
    read = read_sub(path)
    numbers = np.array(sorted(read.positions), dtype=np.int64)
    dofs = read.dofs.copy()
    is_modal = dofs[:, 1] == MODAL
    dofs[is_modal, 0] += numbers.max(initial=0)
    dofs[is_modal, 1] = SCALAR
    return ForeignMatrices(
        K=sp.csc_array(read.K),
        M=None if read.M is None else sp.csc_array(read.M),
        D=None if read.D is None else sp.csc_array(read.D),
        dofs=dofs,
        node_numbers=numbers,
        nodes=np.array([read.positions[number] for number in numbers.tolist()]).reshape(-1, 3),
        systems=read.systems,
        loads={f"load {k + 1}": load for k, load in enumerate(read.loads.T) if load.any()},
        triangle={role: "both" for role in "KMD" if getattr(read, role) is not None},
        program="ANSYS",
    )
