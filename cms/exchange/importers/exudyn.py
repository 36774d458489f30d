"""Bodies of Exudyn: the archive of its ObjectFFRFreducedOrderInterface."""

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cms.errors import ForeignBodyError
from cms.exchange.importers.integrals import moments_of_invariants
from cms.exchange.importers.modal_body import ForeignInterface, ModalBody
from fe_models.foundation.arrays import Array

__all__ = ["is_exudyn", "read_exudyn"]

NEEDED = (
    "modeBasis", "massMatrixReduced", "stiffnessMatrixReduced", "xRef", "inertiaLocal", "totalMass", "chiU",
    "mPhitTPsi", "mXRefTildePsi", "mXRefTildePsiTilde", "mPsiTildePsi", "mPsiTildePsiTilde",
)  # fmt: skip
LARGEST = 1_000_000_000  #: bytes of an array that are taken


def is_exudyn(path: Path, head: bytes) -> bool:
    """Whether a file is an archive with the arrays of a reduced body of Exudyn."""
    if path.suffix.lower() != ".npz" or not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return {"modeBasis.npy", "mPsiTildePsi.npy"} <= set(archive.namelist())


def read_exudyn(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> ModalBody:
    """Read a reduced body of Exudyn; nodes are numbered from 0, as there. Pickled objects are never opened.

    mPhitTPsi = 1C, mXRefTildePsi = -2C, mXRefTildePsiTilde = [3C_k], mPsiTildePsi = 4C, mPsiTildePsiTilde = 5C

    Raises
    ------
    ForeignBodyError
        If an array is missing or of another shape, or the archive is damaged.
    """
    path = files[0]
    if len(files) > 1:
        raise ForeignBodyError(f"{path}: expected one archive of Exudyn, got {len(files)} files")
    with zipfile.ZipFile(path) as archive:
        too_large = [entry.filename for entry in archive.infolist() if entry.file_size > LARGEST]
        if too_large:
            raise ForeignBodyError(f"{path}: {too_large[0]} says it holds more than {LARGEST} bytes; is it damaged?")
    with np.load(path, allow_pickle=False) as archive:

        def read(key: str, *shape: int) -> Array:
            if key not in archive:
                raise ForeignBodyError(f"{path}: array {key!r} is missing")
            values = archive[key]
            if values.dtype.kind not in "fiu" or values.size != int(np.prod(shape)):
                raise ForeignBodyError(
                    f"{path}: array {key!r}: expected numbers of shape {shape}, got {values.dtype} {values.shape}"
                )
            return np.asarray(values, dtype=float).reshape(shape)

        for key in NEEDED:
            if key not in archive:
                raise ForeignBodyError(f"{path}: array {key!r} is missing; save it with exudyn 1.9 or newer")
        n = archive["stiffnessMatrixReduced"].shape[-1]
        n_nodes = archive["xRef"].size // 3
        if not n or not n_nodes:
            raise ForeignBodyError(f"{path}: expected modes and nodes, got {n} and {n_nodes}")
        m, M = float(read("totalMass")), read("massMatrixReduced", n, n)
        moments, notes = moments_of_invariants(
            str(path),
            m,
            m * read("chiU", 3),
            read("inertiaLocal", 3, 3),
            read("mPhitTPsi", 3, n),
            -read("mXRefTildePsi", 3, n),
            M,
            C3=read("mXRefTildePsiTilde", 3, n, 3).transpose(1, 0, 2),
            C4=read("mPsiTildePsi", n, 3, n).transpose(0, 2, 1),
            C5=read("mPsiTildePsiTilde", n, 3, n, 3).transpose(0, 2, 1, 3),
        )
        interfaces: list[ForeignInterface] = []
        if "floatframe_names" in archive:
            names = archive["floatframe_names"].tolist()
            positions, Psi = read("floatframe_positions", len(names), 3), read("floatframe_Psi", len(names), 6, n)
            triads = read("floatframe_triads", len(names), 3, 3)
            interfaces = [
                ForeignInterface(str(each), archive[f"floatframe_members_{k}"], positions[k], triads[k], Psi[k])
                for k, each in enumerate(names)
            ]
        surface = np.asarray(archive["trigList"], dtype=np.int64) if "trigList" in archive else np.zeros((0, 3))
        return ModalBody(
            name=name,
            M=M,
            K=read("stiffnessMatrixReduced", n, n),
            D=read("floatframe_damping", n, n) if "floatframe_damping" in archive else None,
            moments=moments,
            node_numbers=np.arange(n_nodes),
            nodes=read("xRef", n_nodes, 3),
            Phi=read("modeBasis", n_nodes, 3, n),
            surface=surface.reshape(-1, 3).astype(np.int64),
            interfaces=tuple(interfaces),
            program="Exudyn",
            provenance={
                "source": "Exudyn, ObjectFFRFreducedOrderInterface",
                **{f"note {k + 1}": note for k, note in enumerate(notes)},
            },
        )
