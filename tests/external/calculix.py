"""CalculiX and its own test decks, as they are installed: the decks of linear bodies, and their frequencies by ccx.

`python -m tests.external.calculix` gives the figures of docs/measured.md: decks read, refused, and the difference of
their frequencies. Every deck is given to ccx as the model it describes: its steps are cut off, what they hold is held,
a material without density gets 1, and one frequency step is added.
"""

import gzip
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh, spsolve

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.stages import Stages

FOLDER = Path("/usr/share/doc/calculix-ccx-test/examples/test")
LIST = Path(__file__).parent / "data" / "calculix_linear_decks.txt"
#: what a deck of the list does not have, and the elements it has (docs/measured.md)
FOREIGN = {
    "PLASTIC", "CREEP", "HYPERELASTIC", "HYPERFOAM", "USER MATERIAL", "CYCLIC HARDENING", "DEFORMATION PLASTICITY",
    "CONTACT PAIR", "GAP", "FLUID SECTION", "MODEL CHANGE", "CHANGE MATERIAL", "CHANGE SOLID SECTION",
    "CHANGE PLASTIC", "PRE-TENSION SECTION", "SUBMODEL", "CYCLIC SYMMETRY MODEL", "VISCO",
}  # fmt: skip
BODY = re.compile(r"(C3D|S\d|B3[123]|T3D)")
ATTACHED = re.compile(r"(MASS|SPRING|DASHPOT|DCOUP3D)")
ACCEPTED = '["units", "parts", "overlap", "transition", "warped"]'
WITHOUT_MEANING = (
    "HEADING", "INITIAL CONDITIONS", "AMPLITUDE", "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION", "TIME POINTS",
    "DESIGNVARIABLES", "DAMPING", "RESTART", "PHYSICAL CONSTANTS", "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT",
    "OBJECTIVE",
)  # fmt: skip
N_FREQUENCIES = 8


def text_of(name):
    """The text of a deck of the suite, packed or not."""
    path = FOLDER / name
    return (path.read_bytes() if path.exists() else gzip.open(f"{path}.gz").read()).decode("utf-8", "replace")


def names():
    """All decks of the suite."""
    return sorted({path.name.removesuffix(".gz") for path in FOLDER.iterdir() if ".inp" in path.name})


def blocks(text) -> Iterator[list[str]]:
    """Keyword lines with the lines below them."""
    found: list[list[str]] = []
    for line in text.splitlines():
        if not line.strip() or line.strip().startswith("**"):
            continue
        goes_on = found and len(found[-1]) == 1 and found[-1][0].endswith(",")
        if line.lstrip().startswith("*") and not goes_on:
            found.append([line.strip()])
        elif found:
            found[-1].append(line.strip())
    yield from found


def keyword(block):
    return " ".join(block[0].split(",")[0][1:].upper().split())


def is_linear_body(text):
    """The rule of the list: solids, shells, beams or trusses of elastic materials, and nothing of `FOREIGN`."""
    keywords = {keyword(block) for block in blocks(text)}
    heads = [block[0].upper() for block in blocks(text) if keyword(block) == "ELEMENT"]
    types = [re.search(r"TYPE\s*=\s*(\w+)", head)[1] for head in heads]
    if "ELASTIC" not in keywords or keywords & FOREIGN or not any(BODY.match(name) for name in types):
        return False
    return all(BODY.match(name) or ATTACHED.match(name) for name in types)


def frequency_deck(text):
    """The model of a deck with one frequency step."""
    model, held, inside = [], [], False
    for block in blocks(text):
        inside = inside or keyword(block) == "STEP"
        if keyword(block) == "BOUNDARY":
            lines = [[word.strip() for word in line.rstrip(", ").split(",")][:3] for line in block[1:]]
            held += [",".join(words) for words in lines if not (words[1].isdigit() and int(words[1]) > 6)]
        elif not inside and keyword(block) not in WITHOUT_MEANING:
            model.append(block)
    material, dense = "", set()
    for block in model:
        material = block[0] if keyword(block) == "MATERIAL" else material
        dense |= {material} if keyword(block) == "DENSITY" else set()
    out: list[str] = []
    for block in model:
        material = block[0] if keyword(block) == "MATERIAL" else material
        out += block
        if keyword(block) == "ELASTIC" and material not in dense:
            out += ["*DENSITY", "1."]
    out += ["*BOUNDARY", *held] if held else []
    return "\n".join([*out, "*STEP", "*FREQUENCY", "8", "*END STEP", ""])


def body_of(path):
    """The deck, and its body by way of its job."""
    deck = parse_deck(path)
    text = job_text(deck, DeckOptions("m-kg-s", {"": 1.0}), path.name)
    job = path.with_suffix(".toml")
    job.write_text(text.replace("[body]\n", f"[body]\naccept = {ACCEPTED}\n"))
    return deck, uncoupled_body(read_job(job), Stages())


def frequencies(deck, body):
    """The lowest frequencies of the body with the supports of its deck [Hz]."""
    is_held = np.zeros(body.n_dof, dtype=bool)
    R = sp.lil_array(sp.eye_array(body.n_dof))  # rows of nodes that are held along axes of their own: these
    for support in deck.supports:
        at = np.isin(body.dofs[:, 0], body.interface(support.name).nodes)
        is_held |= at & np.isin(body.dofs[:, 1], support.components)
        if support.axes is not None:
            for node in body.interface(support.name).nodes:
                rows = np.flatnonzero((body.dofs[:, 0] == node) & (body.dofs[:, 1] < 3))
                assert len(rows) == 3
                R[np.ix_(rows, rows)] = np.array(support.axes)
    free = np.flatnonzero(~is_held)
    turned = sp.csr_array(R)[free]
    K, M = sp.csc_array(turned @ body.K @ turned.T), sp.csc_array(turned @ body.M @ turned.T)
    if len(free) < 400:
        try:
            values = eigh(M.toarray(), K.toarray(), eigvals_only=True)[::-1][:N_FREQUENCIES]
            return 1 / np.sqrt(values) / 2 / np.pi
        except np.linalg.LinAlgError:  # a free body
            if len(free) <= N_FREQUENCIES:
                values = eigh(K.toarray(), M.toarray(), eigvals_only=True)
                return np.sqrt(np.maximum(values, 0)) / 2 / np.pi
    shift = -1e-9 * K.diagonal().max() / M.diagonal().max()
    values = np.sort(eigsh(K, min(N_FREQUENCIES, len(free) - 2), M, sigma=shift, return_eigenvectors=False))
    return np.sqrt(np.maximum(values, 0)) / 2 / np.pi


def frequencies_of_ccx(path):
    """What ccx prints for the deck [Hz]; none where it finds none."""
    subprocess.run(["ccx", "-i", path.stem], cwd=path.parent, capture_output=True, check=False)
    result = path.with_suffix(".dat")
    text = result.read_text() if result.exists() else ""
    table = text.partition("E I G E N V A L U E   O U T P U T")[2].partition("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", table, re.MULTILINE)
    return np.array([float(row) for row in rows])


def difference(name, folder):
    """Kinds of sections of a deck, and the largest relative difference of its frequencies, None where ccx has none.

    Frequencies below a thousandth of the greatest of them are rigid motions.
    """
    path = Path(folder) / name
    path.write_text(frequency_deck(text_of(name)))
    deck, body = body_of(path)
    theirs = frequencies_of_ccx(path)[:N_FREQUENCIES]
    kinds = [kind for kind in ("solids", "shells", "lines", "rods") if getattr(deck, kind)]
    if not len(theirs) or not theirs.any():
        return kinds, None
    ours = frequencies(deck, body)[: len(theirs)]
    theirs = theirs[: len(ours)]
    elastic = theirs > 1e-3 * theirs.max()
    return kinds, float(np.abs(ours[elastic] / theirs[elastic] - 1).max())


def static_difference(name, folder):
    """The largest difference of displacements under three small forces, relative to the largest displacement."""
    step = "*STATIC\n*CLOAD\n22,2,1e-4\n22,1,2e-4\n5,3,3e-4\n*NODE PRINT,NSET=EVERY\nU\n"
    text = frequency_deck(text_of(name)).replace("*FREQUENCY\n8\n", step)
    numbers = re.findall(r"^ *(\d+),", text.split("*ELEMENT")[0], re.MULTILINE)
    path = Path(folder) / name
    path.write_text(text.replace("*STEP", "*NSET,NSET=EVERY\n" + ",\n".join(numbers) + "\n*STEP", 1))
    subprocess.run(["ccx", "-i", path.stem], cwd=path.parent, capture_output=True, check=False)
    rows = [line.split() for line in path.with_suffix(".dat").read_text().splitlines()]
    theirs = {int(row[0]): np.array(row[1:], dtype=float) for row in rows if len(row) == 4}
    deck, body = body_of(path)
    is_held = np.zeros(body.n_dof, dtype=bool)
    for support in deck.supports:
        at = np.isin(body.dofs[:, 0], body.interface(support.name).nodes)
        is_held |= at & np.isin(body.dofs[:, 1], support.components)
    free = np.flatnonzero(~is_held)
    u = np.zeros(body.n_dof)
    u[free] = spsolve(sp.csc_array(body.K[free][:, free]), sum(case.f for case in body.load_cases)[free])
    ours = np.zeros((len(body.nodes), 6))
    ours[tuple(body.recovery.dofs.T)] = body.recovery.matrix @ u
    place = {tuple(np.round(x, 9)): k for k, x in enumerate(body.nodes)}
    pairs = zip(deck.mesh.node_numbers.tolist(), deck.mesh.nodes, strict=True)
    errors = [theirs[n] - ours[place[tuple(np.round(x, 9))], :3] for n, x in pairs if n in theirs]
    assert len(errors) > 200
    return float(np.abs(errors).max() / np.abs(ours).max())


def main(folder):
    """Print a line for each deck of the list, and the sums."""
    counts: dict[str, int] = {}
    for name in LIST.read_text().split():
        try:
            kinds, error = difference(name, folder)
        except ReportedError as refusal:
            print(f"{name}: refused: {str(refusal)[:200]}")
            counts["refused"] = counts.get("refused", 0) + 1
            continue
        grade = "no frequencies by ccx" if error is None else next(
            (word for limit, word in ((1e-6, "1e-6"), (1e-3, "1e-3"), (0.02, "0.02")) if error < limit), "above 0.02"
        )  # fmt: skip
        key = f"{'+'.join(kinds)}: {grade}"
        counts[key] = counts.get(key, 0) + 1
        print(f"{name}: {'+'.join(kinds)} {'-' if error is None else f'{error:.1e}'}")
    for key in sorted(counts):
        print(f"{counts[key]:4d} {key}")


if __name__ == "__main__":
    import tempfile
    import warnings

    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        main(folder)
