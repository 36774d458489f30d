"""Identify the dofs of given columns: those of the coupled body or those of its mesh, which may be equally many."""

import logging
import os
from collections.abc import Sequence
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from cms.errors import ModeSetError
from cms.modes.families.families import Families, body_of
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.mesh_field import coupled_field
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["OVER", "coupled_columns", "log_frequencies", "user_basis"]

log = logging.getLogger(__name__)


OVER = ("coupled", "mesh")  #: kinds of dofs over which columns can be given
WORDS = {"coupled": "coupled dofs", "mesh": "dofs of the mesh"}
#: ratio of the median omega² of the columns to its value in the other interpretation, above which the other is correct
DEARER = 10.0
#: share of the motion of a rigid interface that its members cannot follow, above which a warning is given
NOT_RIGID = 0.1
APART = 3.0  #: ratio between a stated frequency and the Rayleigh quotient frequency above which a warning is given


def coupled_columns(where: str, body: FEBody, V: Array, over: str | None) -> tuple[Array, dict[str, str]]:
    """Convert given columns to the dofs of the coupled body.

    (1) identify the dofs of the rows, from the argument or from their number; if both have the same number, the
        argument is needed
    (2) convert columns over the mesh with `coupled_field`
    (3) if both interpretations are possible, check that the chosen one does not have a far higher energy than the other

    Parameters
    ----------
    where
        Start of messages.
    V
        Finite columns, (n_dof, k) or (n_mesh_dof, k).
    over
        One of `OVER`; None: identify the dofs from the number of rows.

    Returns
    -------
    columns
        Columns over the coupled dofs, (n_dof, k).
    options
        Description of the conversion, for the record of the mode set.

    Raises
    ------
    ModeSetError
        If the number of rows fits neither, if it fits both and `over` is None, or if the columns contradict `over`.
    """
    over = stated_or_counted(where, body, V, over)  # (1)
    options = {"columns over": f"the {WORDS[over]}"}
    columns = V
    if over == "mesh":  # (2)
        field = coupled_field(body, V)
        columns = field.columns
        for name, part in field.departure.items():
            options[f"motion of interface {name} that is not rigid"] = f"{part:.3g}"
            if part > NOT_RIGID:
                log.warning("%s: %.0f %% of the motion of rigid interface %r in some column is not rigid and is left "
                            "out", where, 100 * part, name)  # fmt: skip
    if is_ambiguous(body):  # (3)
        other = OVER[1 - OVER.index(over)]
        read = {"coupled": V, "mesh": columns if over == "mesh" else coupled_field(body, V).columns}
        own, else_ = (float(np.sqrt(np.median(rayleigh(body, read[name])))) for name in (over, other))
        if own**2 > DEARER * else_**2:
            raise ModeSetError(
                f'{where}: columns_over = "{over}": with these dofs, columns vibrate at {own / (2 * np.pi):.4g} per '
                f"time unit (median of sqrt(uᵀKu / uᵀMu) / 2 pi), with {WORDS[other]} {else_ / (2 * np.pi):.4g}; give "
                f'columns_over = "{other}", or correct the order of the rows'
            )
    return columns, options


def stated_or_counted(where: str, body: FEBody, V: Array, over: str | None) -> str:
    """Return the dofs over which the columns are given: as stated, or from the number of rows."""
    if over is not None and over not in OVER:
        raise ModeSetError(f"{where}: columns_over = {quoted(over)}: unknown{nearest(str(over), OVER)}")
    rows = {"coupled": body.n_dof, "mesh": n_mesh(body)}
    if not has_own_mesh(body):
        rows = {"coupled": body.n_dof} if over is None else {over: body.n_dof}
    asked = rows if over is None else {over: rows[over]}
    fitting = [name for name, n in asked.items() if V.ndim == 2 and V.shape[1] and len(V) == n]
    if not fitting:
        expected = " or ".join(f"({n}, k) over the {WORDS[name]}" for name, n in asked.items())
        raise ModeSetError(f"{where}: columns: expected {expected}, got {V.shape}")
    if len(fitting) > 1:
        raise ModeSetError(
            f"{where}: columns: {len(V)} rows may be the dofs of the coupled body or those of its mesh, which have "
            'another order; give columns_over = "coupled" or columns_over = "mesh"'
        )
    return fitting[0]


def n_mesh(body: FEBody) -> int:
    """Return the number of dofs of the mesh."""
    return body.n_dof if body.recovery is None else int(body.recovery.matrix.shape[0])


def has_own_mesh(body: FEBody) -> bool:
    """Return whether mesh dofs and coupled dofs differ in number or order."""
    return body.recovery is not None and not np.array_equal(body.recovery.dofs, body.dofs)


def is_ambiguous(body: FEBody) -> bool:
    """Return whether mesh dofs and coupled dofs differ although they are equally many."""
    return has_own_mesh(body) and n_mesh(body) == body.n_dof


def rayleigh(body: FEBody, X: Array) -> Array:
    """Return the Rayleigh quotient of each column, (k,) [1/s²]; 0 for columns without mass."""
    mass = np.einsum("nk,nk->k", X, body.M @ X)
    energy = np.maximum(np.einsum("nk,nk->k", X, body.K @ X), 0.0)
    return np.divide(energy, mass, out=np.zeros_like(energy), where=mass > 0)


def log_frequencies(where: str, body: FEBody, X: Array, frequencies: Array) -> None:
    """Warn if stated frequencies differ greatly from Rayleigh quotients: order, unit or body may be wrong.

    Parameters
    ----------
    X
        Columns over the coupled dofs, (n_dof, k).
    frequencies
        Stated frequencies, NaN for static columns, (k,) [Hz].
    """
    is_stated = np.isfinite(frequencies) & (frequencies > 0)
    own = np.sqrt(rayleigh(body, X[:, is_stated])) / (2 * np.pi)
    stated = frequencies[is_stated]
    is_known = own > 0
    if not is_known.any():
        return
    apart = np.abs(np.log(own[is_known] / stated[is_known]))
    if np.median(apart) > np.log(APART):
        k = np.flatnonzero(is_known)[int(np.argmax(apart))]
        log.warning(
            "%s: column %d has the stated frequency %.5g, but its energy gives %.5g (per time unit); check that "
            "rows, units and frequencies belong to this body",
            where, np.flatnonzero(is_stated)[k] + 1, stated[k], own[k],
        )  # fmt: skip


# user basis: given columns as a mode set ------------------------------------------------------------------------------


def user_basis(
    body: FEBody | Families,
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
        over the mesh are converted by `cms.modes.coupled_field`: rigid interfaces take the best-fitting rigid motion,
        and the options of the set give the remainder. Alternatively a file: .npy with the array, or .npz with `columns`
        and optionally `labels` and `frequencies`.
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
