"""External superelements of Nastran: the record of their files as a superelement of ours."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from cms.exchange.importers.element_rows import ForeignRows, force_rows, motion_rows, stress_rows
from cms.exchange.importers.superelement import RecoveryRows, Superelement
from fe_models.files.nastran_matrices.superelement import SCALAR, NastranSuperelement, read_superelement
from fe_models.foundation.arrays import Array

__all__ = ["is_nastran", "nastran_superelement", "read_nastran"]

COMPANIONS = (".pch", ".asm")  #: text files of an external superelement beside its .op4


def is_nastran(path: Path, head: bytes) -> bool:
    """Whether a file is one of an external superelement: cards of one, or matrices with such cards beside them."""
    suffix = path.suffix.lower()
    if suffix in COMPANIONS:
        return any(word in head.upper() for word in (b"EXT. SUPERELEMENT", b"EXTRN", b"SEBULK", b"BEGIN SUPER"))
    if suffix != ".op4":
        return False
    beside = [path.with_suffix(other) for other in (*COMPANIONS, *(text.upper() for text in COMPANIONS))]
    return any(other.is_file() for other in beside)


def read_nastran(files: Iterable[Path], name: str, places: Mapping[int, Array] | None = None) -> Superelement:
    """Read an external superelement of Nastran (.op4 with .pch or .asm, and bulk data for nodes of the recovery)."""
    return nastran_superelement(read_superelement(list(files)), name, places)


def nastran_superelement(
    raw: NastranSuperelement, name: str, places: Mapping[int, Array] | None = None
) -> Superelement:
    """Return a superelement of what the files say; grid points without place are left out of the recovery, and told."""
    positions = {**{int(k): np.asarray(x, dtype=float) for k, x in (places or {}).items()}, **raw.positions}
    notes = list(raw.notes)
    recovery = None
    numbers = set(raw.grid_ids)
    if raw.displacement is not None:
        rows = raw.displacement.rows
        usable = (rows[:, 1] != SCALAR) & ~np.isin(rows[:, 0], raw.displacement.unplaced)
        recovery = RecoveryRows(rows[usable], raw.displacement.matrix[usable])
        numbers |= {int(number) for number in rows[usable, 0]}
    tables: dict[str, ForeignRows] = {}
    if recovery is not None:
        tables["displacements"] = motion_rows(recovery.dofs, recovery.matrix)
    if raw.forces is not None:
        of_elements, lost = force_rows(raw.forces.elements, raw.forces.matrix)
        notes += lost
        if of_elements.names:
            tables["element forces"] = of_elements
    if raw.stresses is not None:
        tables["element stresses"] = stress_rows(raw.stresses.elements, raw.stresses.matrix)
    kept = np.array(sorted(numbers), dtype=np.int64)
    n_loads = raw.loads.shape[1]
    return Superelement(
        name=name,
        K=raw.K.toarray(),
        M=raw.M.toarray(),
        D=None if raw.D is None else raw.D.toarray(),
        dofs=raw.dofs,
        node_numbers=kept,
        nodes=np.array([positions[int(number)] for number in kept]).reshape(-1, 3),
        recovery=recovery,
        tables=tables,
        loads={f"load {k + 1}": raw.loads[:, k] for k in range(n_loads) if raw.loads[:, k].any()},
        program="Nastran",
        provenance={
            "source": "Nastran external superelement",
            **{f"file {path}": digest for path, digest in raw.files.items()},
            **{f"note {k + 1}": note for k, note in enumerate(notes)},
        },
    )
