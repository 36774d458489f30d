"""Files of other programs, damaged: whole decks, matrices, reduced bodies.

What is accepted must be a body that holds together: matrices that are finite and symmetric, a deck whose job reads and
reduces or is refused in words, a reduced body that `cms info` shows.
"""

import gzip
import io
import shutil
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from tests.campaign.files import prepared
from tests.campaign.mutation import damaged_bytes, damaged_text
from tests.campaign.verdict import ACCEPTED, REFUSED, TRACEBACK, UNCLEAR, WRONG, Verdict, ask, judged
from tests.root import ROOT

__all__ = ["body_case", "deck_case", "matrix_case"]

DATA = ROOT / "tests" / "fe_models" / "files"
INP = """\
*HEADING
*NODE, NSET=NALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
20, 3., 0., 0.
21, 4., 0., 0.
22, 5., 0., 0.
30, 0., 0., 5.
31, 2., 0., 5.
*ELEMENT, TYPE=C3D8I, ELSET=block
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=S4R, ELSET=skin
2, 5, 6, 7, 8
*ELEMENT, TYPE=B32R, ELSET=arm
3, 20, 21, 22
*ELEMENT, TYPE=MASS, ELSET=lead
4, 30
*ELEMENT, TYPE=SPRINGA, ELSET=coil
5, 7, 22
*MASS, ELSET=lead
2.5
*SPRING, ELSET=coil

1000.
*NSET, NSET=foot, GENERATE
1, 4, 1
*NSET, NSET=top
5, 6, 7, 8, 20
*RIGID BODY, NSET=top, REF NODE=30
*TRANSFORM, NSET=foot, TYPE=C
.5, .5, 0., .5, .5, 1.
*EQUATION
2
22, 1, 1., 20, 1, -1.
*MPC
STRAIGHT, 20, 22, 21
*MATERIAL, NAME=STEEL
*ELASTIC
210., .25
*DENSITY
7.8
*MATERIAL, NAME=PLY
*ELASTIC, TYPE=ENGINEERING CONSTANTS
14., 1., 1., .3, .3, .4, .5, .5,
.3
*DENSITY
1.6
*ORIENTATION, NAME=grain
1., 1., 0., -1., 1., 0.
3, 30.
*SOLID SECTION, ELSET=block, MATERIAL=STEEL
*SHELL SECTION, ELSET=skin, COMPOSITE, ORIENTATION=grain
0.01, 3, PLY
0.02, 3, PLY, 45.
*BEAM SECTION, ELSET=arm, MATERIAL=STEEL, SECTION=BOX
0.2, 0.3, .01, .02, .03, .02
0., 1., 0.
*BOUNDARY
foot, 1, 2
22, 2
*STEP
*STATIC
*CLOAD
20, 3, -4.
*DLOAD
block, P2, 2.
block, GRAV, 9.81, 0., 0., -1.
*END STEP
"""
BDF = """\
SOL 103
CEND
SPC = 1
BEGIN BULK
PARAM,COUPMASS,1
PARAM,WTMASS,1.
CORD2C,5,,0.,0.,0.,0.,0.,1.
,1.,0.,0.
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
GRID,5,,0.,0.,1.
GRID,6,,1.,0.,1.
GRID,7,,1.,1.,1.
GRID,8,,0.,1.,1.
GRID,9,5,3.,30.,0.,5
GRID,10,,5.,2.,0.
CHEXA,1,1,1,2,3,4,5,6
,7,8
CQUAD4,2,2,5,6,7,8
CBAR,3,3,9,10,0.,0.,1.
PSOLID,1,1
PSHELL,2,1,.1,1,,1
PBARL,3,1,,BAR
,.1,.2
MAT1,1,200.,,.3,7.8
CONM2,4,10,,3.
CBUSH,6,6,3,9,,,,0
PBUSH,6,K,1.,2.,3.,4.,5.,6.
RBE2,7,9,123456,2,3
RBE3,8,,10,123456,1.,123,5,6
,7
SPC1,1,123,1,4
FORCE,1,9,,2.,0.,0.,1.
PLOAD4,2,1,3.,,,,1,3
GRAV,3,,9.81,0.,0.,-1.
ENDDATA
"""


def deck_case(seed: int, folder: Path) -> Verdict:
    """Write the job of a damaged deck, and run it where one is written."""
    rng = np.random.default_rng([8, seed])
    suffix = (".inp", ".bdf", ".cdb")[seed % 3]
    text = {".inp": INP, ".bdf": BDF, ".cdb": ""}[suffix] or (DATA / "data" / "ansys" / "HexBeam.cdb").read_text()
    path = folder / f"model{suffix}"
    path.write_bytes(text.encode() if seed < 3 else damaged_text(text, rng))
    words = ["--units", "m-kg-s", "-o", folder / "job.toml"]
    words += ["--density", "1"] if suffix == ".cdb" else []
    words += ["--program", "abaqus"] if suffix == ".inp" and rng.random() < 0.5 else []
    verdict = judged(ask("cms", "job", path, *words), folder=folder)
    if verdict.kind != ACCEPTED:
        return Verdict(WRONG, verdict.words) if verdict.kind == REFUSED and seed < 3 else verdict
    job = folder / "job.toml"
    job.write_text(
        job.read_text().replace("[body]\n", '[body]\naccept = ["units", "parts", "warped", "transition"]\n', 1)
    )
    verdict = judged(ask("cms", "reduce", job, "-o", folder / "out.h5"), folder=folder)
    return Verdict(WRONG, verdict.words) if verdict.kind == REFUSED and seed < 3 else verdict


@cache
def matrix_files() -> tuple[tuple[tuple[str, bytes], ...], ...]:
    """Sets of files (name, content) that are read together."""
    nastran, ansys = DATA / "data" / "nastran", DATA / "data" / "ansys"
    calculix = DATA / "matrices" / "data" / "calculix"
    sets = [((each.name, each.read_bytes()),) for each in sorted(nastran.glob("*.op4")) if each.name != "outboard.op4"]
    sets += [((each.name, each.read_bytes()),) for each in (*nastran.glob("*.op2"), *ansys.glob("*.sub"))]
    sets += [tuple((name, (nastran / name).read_bytes()) for name in ("outboard.op4", "outboard.pch", "outboard.asm"))]
    sets += [((name, (nastran / name).read_bytes()),) for name in ("matrix_factory.pch",)]
    sets += [((each.name, each.read_bytes()),) for each in ansys.glob("*.full")]
    bar = [(f"bar{s}", gzip.decompress((calculix / f"bar{s}.gz").read_bytes())) for s in (".sti", ".mas")]
    sets += [
        (*bar, ("bar.dof", (calculix / "bar.dof").read_bytes())),
        (("sub.mtx", (calculix / "bar_sub.mtx").read_bytes()),),
    ]
    rng = np.random.default_rng(0)
    A = sp.random_array((12, 12), density=0.4, rng=rng)
    K, M = sp.csc_array(A @ A.T), sp.csc_array(sp.eye_array(12) * 2.0)
    market = []
    for name, matrix in (("K.mtx", K), ("M.mtx", M)):
        stream = io.BytesIO()
        scipy.io.mmwrite(stream, sp.coo_matrix(matrix), symmetry="symmetric")
        market.append((name, stream.getvalue()))
    sets.append(tuple(market))
    rows = np.column_stack([np.repeat(np.arange(1, 5), 3), np.tile([1, 2, 3], 4)]).astype(float)
    nodes = np.column_stack([np.arange(1.0, 5.0), rng.random((4, 3))])
    for name in ("all.mat", "all.npz"):
        stream = io.BytesIO()
        if name == "all.mat":
            scipy.io.savemat(stream, {"K": K, "M": M, "dofs": rows, "nodes": nodes})
        else:
            np.savez(stream, K=K.toarray(), M=M.toarray(), dofs=rows, nodes=nodes)
        sets.append(((name, stream.getvalue()),))
    return tuple(sets)


def written(files: tuple[tuple[str, bytes], ...], rng: np.random.Generator, folder: Path) -> list[Path]:
    """Write the files of a set, one of them damaged."""
    victim = int(rng.integers(len(files)))
    paths = []
    for k, (name, content) in enumerate(files):
        is_text = name.endswith((".pch", ".asm", ".sti", ".mas", ".dof", ".mtx", ".fem", ".SID_FEM", ".dat"))
        if k == victim:
            small = is_text and len(content) < 300_000 and rng.random() < 0.6
            content = damaged_text(content.decode("latin-1"), rng) if small else damaged_bytes(content, rng)
        (folder / name).write_bytes(content)
        paths.append(folder / name)
    return paths


def matrix_case(seed: int, folder: Path) -> Verdict:
    """Read a set of matrix files of which one is damaged."""
    from fe_models.files import read_matrices
    from fe_models.foundation.errors import ReportedError

    rng = np.random.default_rng([9, seed])
    sets = matrix_files()
    paths = written(sets[seed % len(sets)], rng, folder)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            read = read_matrices(paths if len(paths) > 1 else paths[0])
        except ReportedError as error:
            return Verdict(UNCLEAR if caught else REFUSED, f"{paths[0].name}: {caught[0].message if caught else error}")
        except Exception as error:  # that is what the campaign is for
            return Verdict(TRACEBACK, f"{paths[0].name}: {type(error).__name__}: {error}"[:600])
    for role in ("K", "M", "D"):
        matrix = getattr(read, role)
        if matrix is None:
            continue
        matrix = sp.csc_array(matrix)
        if not np.isfinite(matrix.data).all():
            return Verdict(WRONG, f"{paths[0].name}: {role} is not finite")
        if abs(matrix - matrix.T).max() > 1e-6 * abs(matrix).max():
            return Verdict(WRONG, f"{paths[0].name}: {role} is not symmetric")
    return Verdict(ACCEPTED)


FORMATS = {
    "exudyn": "npz",
    "sid_fem": "SID_FEM",
    "sid_fem-fembeam": "SID_FEM",
    "mbdyn": "fem",
    "mbsim": "h5",
    "abaqus": "inp",
}


def exported(folder: Path) -> dict[str, tuple[tuple[str, bytes], ...]]:
    """Return the bar of the campaign in formats that are read back; made once a process."""
    home = prepared(folder) / "bodies"
    if not home.exists():
        home.mkdir()
        for name, suffix in FORMATS.items():
            reply = ask(
                "cms", "export", folder / "modal.h5", "--to", name, "--units", "mm-t-s", "-o", home / f"{name}.{suffix}"
            )
            if reply.code:
                shutil.rmtree(home)
                raise AssertionError(reply.stderr)
    found = {name: ((f"body.{suffix}", (home / f"{name}.{suffix}").read_bytes()),) for name, suffix in FORMATS.items()}
    nastran = DATA / "data" / "nastran"
    names = ("outboard.op4", "outboard.pch", "outboard.asm", "outboard.blk")
    found["nastran"] = tuple((name, (nastran / name).read_bytes()) for name in names)
    found["ansys"] = (("cp56.sub", (DATA / "data" / "ansys" / "cp56.sub").read_bytes()),)
    return found


def body_case(seed: int, folder: Path) -> Verdict:
    """Import a reduced body of another program from a damaged file."""
    rng = np.random.default_rng([10, seed])
    sets = exported(folder.parent / "prepared")
    name = [*sets][seed % len(sets)]
    paths = written(sets[name], rng, folder)
    units = "mm-kg-s" if name == "nastran" else "mm-t-s"
    words = ["--units", units, "--accept", "units", "-o", folder / "out.h5"]
    verdict = judged(ask("cms", "import", paths[0], *words), folder=folder)
    if verdict.kind != ACCEPTED:
        return Verdict(verdict.kind, f"{name}: {verdict.words}")
    return judged(ask("cms", "info", folder / "out.h5"))
