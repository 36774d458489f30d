"""User basis: given columns as a mode set."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile

import numpy as np

from cms.errors import ModeSetError
from cms.modes.families.sharing import body_of
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.given_columns import coupled_columns, log_frequencies
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array

if TYPE_CHECKING:
    from cms.modes.families.families import Families

__all__ = ["user_basis"]


def user_basis(
    body: "FEBody | Families",
    *,
    columns: Array | str | os.PathLike[str] | None = None,
    columns_over: str | None = None,
    labels: Sequence[str] | None = None,
    frequencies: Array | None = None,
) -> ModeSet:
    """Make a mode set from given columns.

    Parameters
    ----------
    body
        A coupled body, or its `Families`, which several sets can share.
    columns
        Displacement columns over the dofs of the coupled body, (n_dof, k), or of its mesh, (n_mesh_dof, k). Columns
        over the mesh are converted by `cms.coupled_field`: rigid interfaces take the best-fitting rigid motion, and the
        options of the set give the remainder. Alternatively a file: .npy with the array, or .npz with `columns` and
        optionally `labels` and `frequencies`.
    columns_over
        "coupled" or "mesh": the dofs of the rows. Needed if both have the same number, because their order differs;
        otherwise the number of rows decides.
    labels
        Label of each column; default: those of the file, or "user 1", "user 2", …
    frequencies
        Frequencies of vibration columns, NaN for static columns, (k,) [Hz]; default: those of the file, or all NaN.

    Raises
    ------
    ModeSetError
        If the file cannot be read; if shape, labels or numbers do not fit the body; if the rows may be those of the
        coupled body or of its mesh and `columns_over` is not given; or if the columns contradict `columns_over`.
    """
    body = body_of(body)
    body.require_coupled()
    if columns is None:
        raise ModeSetError(f"user_basis: body {body.name!r}: columns: missing; give an array, or a .npy or .npz file")
    options = {"columns": "given as an array"}
    if isinstance(columns, str | os.PathLike):
        path = Path(columns)
        columns, labels, frequencies = _read(path, labels, frequencies)
        options["columns"] = f"file {path.name}"
    V = np.asarray(columns)
    where = f"user_basis: body {body.name!r}"
    if V.dtype.kind not in "fiu":
        raise ModeSetError(f"{where}: columns: expected real numbers, got {V.dtype}")
    V = V.astype(np.float64)
    if not np.isfinite(V).all():
        raise ModeSetError(f"{where}: columns: expected finite numbers, got NaN or infinite ones")
    V, told = coupled_columns(where, body, V, columns_over)
    options |= told
    k = V.shape[1]
    labels = tuple(f"user {j + 1}" for j in range(k)) if labels is None else tuple(str(label) for label in labels)
    frequencies = np.full(k, np.nan) if frequencies is None else np.asarray(frequencies, dtype=float)
    if len(labels) != k or frequencies.shape != (k,):
        raise ModeSetError(
            f"{where}: {k} columns need as many labels and frequencies, got {len(labels)} and {frequencies.shape}"
        )
    log_frequencies(where, body, V, frequencies)
    return ModeSet("user-basis", V, labels, frequencies, options, ("user",) * k)


def _read(
    path: Path, labels: Sequence[str] | None, frequencies: Array | None
) -> tuple[Array, Sequence[str] | None, Array | None]:
    """Read an array from .npy, or columns, labels and frequencies from .npz; never a pickle."""
    where = f"user_basis: {path}"
    try:
        with open(path, "rb") as file:
            content = np.load(file, allow_pickle=False)
            if isinstance(content, np.ndarray):
                return content, labels, frequencies
            if "columns" not in content:
                raise ModeSetError(
                    f"{where}: expected an array named 'columns', got {', '.join(content.files) or 'nothing'}"
                )
            labels = content["labels"].tolist() if labels is None and "labels" in content else labels
            frequencies = content["frequencies"] if frequencies is None and "frequencies" in content else frequencies
            return content["columns"], labels, frequencies
    except FileNotFoundError:
        raise ModeSetError(f"{where}: no such file") from None
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        if isinstance(error, ModeSetError):
            raise
        raise ModeSetError(f"{where}: not a readable .npy or .npz file of numbers: {error}") from error
