"""Damage of every kind of file, seeded: read as a model of the same size, or one message; never another error."""

import gzip
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import fe_models
from fe_models.errors import FeModelsError

DATA = Path(__file__).parent / "data"
A = sp.csc_array(sp.diags_array([[4.0] * 9, [-1.0] * 8, [-1.0] * 8], offsets=[0, 1, -1]))


def files(folder):
    """Write one small file of every format, and return them."""
    scipy.io.mmwrite(folder / "K.mtx", sp.coo_array(A), symmetry="symmetric")
    scipy.io.savemat(folder / "five.mat", {"K": A, "dofs": np.column_stack([np.arange(1, 10), np.ones(9)])})
    sp.save_npz(folder / "K.npz", A)
    np.savez_compressed(folder / "dense.npz", K=A.toarray())
    (folder / "bar.sti").write_bytes(gzip.decompress((DATA / "calculix" / "bar.sti.gz").read_bytes())[:4000])
    lines = [f"{i + 5},1, {j + 5},1, {v:.15e}\n" for i, j, v in zip(*sp.find(sp.tril(A)), strict=True)]
    (folder / "a_STIF1.mtx").write_text("".join(lines))
    (folder / "bar_sub.mtx").write_bytes((DATA / "calculix" / "bar_sub.mtx").read_bytes())
    (folder / "bar.dof").write_bytes((DATA / "calculix" / "bar.dof").read_bytes())
    return sorted(folder.iterdir())


def damaged(data, rng):
    """Cut, overwrite or double a piece of the bytes."""
    at = int(rng.integers(len(data)))
    kind = rng.integers(3)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + rng.integers(0, 256, 3, dtype=np.uint8).tobytes() + data[at + 3 :]
    return data[: at + 40] + data[at:]


def outcome(path):
    """Read a file: the message, "" if there is none, and the number of rows."""
    try:
        return "", fe_models.files.read_matrices(path).n_dof or 0
    except FeModelsError as error:
        return str(error), 0


@pytest.mark.parametrize("k", range(8))
def test_a_damaged_file_gives_one_message_or_a_model(k, tmp_path):
    path = files(tmp_path)[k]
    data = path.read_bytes()
    rng = np.random.default_rng(k)
    refused = 0
    for _ in range(30):
        path.write_bytes(damaged(data, rng))
        message, n_dof = outcome(path)
        refused += bool(message)
        assert not message or (path.name in message and "\n" not in message)
        assert n_dof <= 1000
    assert refused >= 10
