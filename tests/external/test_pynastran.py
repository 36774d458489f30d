"""OP4 files beside pyNastran, which wants an older numpy: FLOATFRAME_PYNASTRAN names the Python that has it."""

import json
import os
import subprocess

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from cms.exchange.importers.element_rows import FORCE_ITEMS
from fe_models.files.nastran.matrices.op4 import read_op4
from fe_models.files.nastran.matrices.write_op4 import write_op4

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
    subprocess.run([PYTHON, "-c", READ, tmp_path / "a.op4", tmp_path / "a.npz"], check=True)
    with np.load(tmp_path / "a.npz") as theirs:
        for name, matrix in matrices.items():
            assert_array_equal(theirs[name], matrix)
    for matrix in read_op4(tmp_path / "a.op4"):
        assert_array_equal(matrix.matrix.toarray(), matrices[matrix.name])


READ_DMIG = """
import sys
import numpy as np
from pyNastran.bdf.bdf import BDF
model = BDF(debug=None)
model.read_bdf(sys.argv[1], xref=False, punch=True)
found = {}
for name, matrix in model.dmig.items():
    dense, rows, columns = matrix.get_matrix(is_sparse=False)
    found[name] = dense
    found[name + "_rows"] = np.array([rows[k] for k in range(len(rows))])
np.savez(sys.argv[2], **found)
"""


@pytest.mark.skipif(not PYTHON, reason="FLOATFRAME_PYNASTRAN is not set")
def test_pynastran_reads_exported_superelements(tmp_path):
    """OP4 bit for bit, DMIG to the ten digits of its fields, rows sorted by their point and component."""
    import cms
    from cms.reduction.interface_model import interface_model
    from tests.cms.exchange.exporters.examples import reduced_bar

    body = reduced_bar()
    model = interface_model(body)
    cms.exchange.export_body(body, tmp_path / "bar.op4", to="nastran-op4", units="m-kg-s")
    subprocess.run([PYTHON, "-c", READ, tmp_path / "bar.op4", tmp_path / "bar.npz"], check=True)
    with np.load(tmp_path / "bar.npz") as theirs:
        for name, matrix in {"KXX": model.K, "MXX": model.M, "BXX": model.D, "PX": model.loads}.items():
            assert_array_equal(theirs[name], matrix)
    cms.exchange.export_body(body, tmp_path / "dmig.bdf", to="nastran-dmig", units="m-kg-s")
    subprocess.run([PYTHON, "-c", READ_DMIG, tmp_path / "dmig.bdf", tmp_path / "dmig.npz"], check=True)
    with np.load(tmp_path / "dmig.npz") as theirs:
        rows = [(k + 1, c + 1) for k in range(2) for c in range(6)] + [(1000001 + k, 0) for k in range(3)]
        for name, matrix in {"KAAX": model.K, "MAAX": model.M, "BAAX": model.D}.items():
            at = [rows.index(tuple(row)) for row in theirs[f"{name}_rows"].tolist()]
            assert_allclose(theirs[name], matrix[np.ix_(at, at)], rtol=1e-9, atol=1e-30)


READ_HEADERS = """
import json
from pyNastran.op2.tables.oef_forces import oef_force_objects as objects
names = {1: "Rod", 3: "Rod", 4: "CShear", 10: "Rod", 24: "Visc", 33: "Plate", 34: "CBar", 38: "CGap", 69: "Bend",
         74: "Plate", 102: "CBush"}
found = {}
for code, name in names.items():
    kind = getattr(objects, f"Real{name}ForceArray")
    found[code] = kind.get_headers(kind.__new__(kind))
print(json.dumps(found))
"""
#: pyNastran's word for an item -> ours
WORDS = {
    "axial": "N", "torsion": "T", "torque": "T", "shear1": "V1", "shear2": "V2",
    **{f"bending_moment_{end}{plane}": f"end {end.upper()} M{plane}" for end in "ab" for plane in (1, 2)},
    "mx": "Nx", "my": "Ny", "mxy": "Nxy", "bmx": "Mx", "bmy": "My", "bmxy": "Mxy", "tx": "Qx", "ty": "Qy",
    **{f"force{a}{b}": f"F{a}{b}" for a in range(1, 5) for b in range(1, 5)},
    **{f"kick_force{k}": f"kick {k}" for k in range(1, 5)},
    **{f"shear{a}{b}": f"q{a}{b}" for a, b in ((1, 2), (2, 3), (3, 4), (4, 1))},
    "sfy": "fy", "sfz": "fz",
    **{f"{theirs}_{plane}{end}": f"end {end.upper()} {ours}{plane}"
       for end in "ab" for theirs, ours in (("bending_moment", "M"), ("shear", "V")) for plane in (1, 2)},
    **{f"{theirs}_{end}": f"end {end.upper()} {ours}"
       for end in "ab" for theirs, ours in (("axial", "N"), ("torque", "T"))},
}  # fmt: skip


@pytest.mark.skipif(not PYTHON, reason="FLOATFRAME_PYNASTRAN is not set")
def test_items_of_element_forces_stand_in_the_order_of_pynastran():
    """Every type whose MEF1 rows come in; words that both have (fx, mx of a bushing) mean the same there."""
    said = subprocess.run([PYTHON, "-c", READ_HEADERS], check=True, capture_output=True, text=True).stdout
    theirs = {int(code): words for code, words in json.loads(said.splitlines()[-1]).items()}
    assert set(theirs) == set(FORCE_ITEMS)
    for code, items in FORCE_ITEMS.items():
        same = code == 102  # a bushing: mx is a moment, of a plate it is a membrane force
        assert [name for name, _ in items] == [w if same else WORDS.get(w, w) for w in theirs[code]], code
