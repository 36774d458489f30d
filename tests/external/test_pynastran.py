"""OP4 files beside pyNastran, which wants an older numpy: FLOATFRAME_PYNASTRAN names the Python that has it."""

import os
import subprocess

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_array_equal

from fe_models.importers.nastran_matrices.op4 import read_op4
from fe_models.importers.nastran_matrices.write_op4 import write_op4

pytestmark = pytest.mark.external

PYTHON = os.environ.get("FLOATFRAME_PYNASTRAN", "")
READ = """
import sys
import numpy as np
from pyNastran.op4.op4 import read_op4
found = {}
for name, matrix in read_op4(sys.argv[1], debug=False).items():
    data = matrix.data
    found[name] = data.toarray() if hasattr(data, "toarray") else data
np.savez(sys.argv[2], **found)
"""


@pytest.mark.skipif(not PYTHON, reason="FLOATFRAME_PYNASTRAN is not set")
@pytest.mark.parametrize("text", [False, True])
def test_pynastran_reads_what_is_written_bit_for_bit(tmp_path, text):
    rng = np.random.default_rng(3)
    A = sp.random_array((60, 60), density=0.1, rng=rng, format="csc")
    A.data *= 10.0 ** rng.integers(-150, 150, A.nnz)
    matrices = {"KAA": (A + A.T).toarray(), "B": rng.standard_normal((5, 9))}
    write_op4(tmp_path / "a.op4", {"KAA": A + A.T, "B": matrices["B"]}, text=text)
    subprocess.run([PYTHON, "-c", READ, tmp_path / "a.op4", tmp_path / "a.npz"], check=True, timeout=100)
    with np.load(tmp_path / "a.npz") as theirs:
        for name, matrix in matrices.items():
            assert_array_equal(theirs[name], matrix)
    for matrix in read_op4(tmp_path / "a.op4"):
        assert_array_equal(matrix.matrix.toarray(), matrices[matrix.name])
