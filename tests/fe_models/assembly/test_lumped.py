"""Lumped mass of beams, shells and rods: chains of equal elements have natural frequencies in closed form.

Free rod of n elements of length h: lumped 2 c/h sin(k pi / 2n), consistent sqrt(6 (1 - cos)/(2 + cos)) c/h of k pi / n.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from cms.jobs.body_of_job import coupled_body, uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.stages import Stages

E, RHO, N, H = 2e11, 7800.0, 5, 0.4
C = np.sqrt(E / RHO)
R = Rotation.from_rotvec([0.3, -0.7, 1.1])
T = np.array([5.0, -2.0, 1.0])
LUMPED = 2 * C / H * np.sin(np.arange(1, N + 1) * np.pi / (2 * N))
COS = np.cos(np.arange(1, N + 1) * np.pi / N)
CONSISTENT = np.sqrt(6 * (1 - COS) / (2 + COS)) * C / H


def grid(points):
    return "".join(
        f"GRID,{k},,{','.join(map(repr, (R.apply(p) + T).tolist()))}\n" for k, p in enumerate(points, start=1)
    )


def bars(offset=""):
    text = grid([(k * H, 0, 0) for k in range(N + 1)]) + f"MAT1,1,{E!r},,0.,{RHO!r}\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6\n"
    v = ",".join(map(repr, R.apply([0.1, 0.2, 1.0]).tolist()))
    return text + "".join(f"CBAR,{k},1,{k},{k + 1},{v}{offset}\n" for k in range(1, N + 1))


def strip():
    """A strip of quads without Poisson's ratio: N along, one across."""
    points = [(k * H, y, 0) for y in (0, 0.3) for k in range(N + 1)]
    text = grid(points) + f"MAT1,1,{E!r},,0.,{RHO!r}\nPSHELL,1,1,.02,1,,1\n"
    n = N + 1
    return text + "".join(f"CQUAD4,{k},1,{k},{k + 1},{n + k + 1},{n + k}\n" for k in range(1, N + 1))


def body_of(tmp_path, text, mass, suffix=".bdf"):
    path = tmp_path / f"model{suffix}"
    path.write_text(text if suffix == ".inp" else f"BEGIN BULK\n{text}ENDDATA\n")
    deck = parse_deck(path, program="abaqus") if suffix == ".inp" else parse_deck(path)
    job = path.with_suffix(".toml")
    job.write_text(job_text(deck, DeckOptions("m-kg-s", {}, mass=mass), path.name))
    made = read_job(job)
    return coupled_body(made, uncoupled_body(made, Stages())), deck


def axial_frequencies(body):
    """Return the frequencies of motions along the chain that are the same across it, without the rigid one."""
    axis = R.apply([1.0, 0, 0])
    stations = np.round((body.nodes - T) @ axis / H).astype(int)
    columns = np.zeros((body.n_dof, N + 1))
    for k, (node, c) in enumerate(body.dofs):
        if c < 3:
            columns[k, stations[node]] = axis[c]
    K, M = columns.T @ body.K @ columns, columns.T @ body.M @ columns
    return np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0))[1:]


@pytest.mark.parametrize("deck", [bars, strip])
@pytest.mark.parametrize(
    ("coupmass", "mass", "expected"),
    [
        (False, None, CONSISTENT), (False, "consistent", CONSISTENT), (False, "lumped", LUMPED),
        (False, "as the deck", LUMPED), (True, "as the deck", CONSISTENT), (True, "lumped", LUMPED),
    ],
)  # fmt: skip
def test_frequencies_of_a_chain_are_those_of_the_mass_that_is_asked_for(tmp_path, deck, coupmass, mass, expected):
    body, read = body_of(tmp_path, deck() + ("PARAM,COUPMASS,1\n" if coupmass else ""), mass)
    assert_allclose(axial_frequencies(body), expected, rtol=1e-9)
    notes = [row for row in read.ledger.rows() if row[0].startswith("mass of")]
    is_other = (expected is LUMPED) == coupmass
    assert len(notes) == is_other
    assert not is_other or '--mass "as the deck"' in notes[0][2]


def test_rods_of_abaqus_are_lumped_as_the_deck(tmp_path):
    rows = "\n".join(f"{k}, " + ", ".join(map(repr, (R.apply([k * H, 0, 0]) + T).tolist())) for k in range(N + 1))
    lines = "\n".join(f"{k + 1}, {k}, {k + 1}" for k in range(N))
    text = f"*NODE\n{rows}\n*ELEMENT, TYPE=T3D2, ELSET=ALL\n{lines}\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n2e-3\n"
    text += f"*MATERIAL, NAME=M\n*ELASTIC\n{E!r}, 0.\n*DENSITY\n{RHO!r}\n"
    for mass, expected in ((None, CONSISTENT), ("as the deck", LUMPED), ("lumped", LUMPED)):
        path = tmp_path / "model.inp"
        path.write_text(text)
        deck = parse_deck(path, program="abaqus")
        path.with_suffix(".toml").write_text(job_text(deck, DeckOptions("m-kg-s", {}, mass=mass), path.name))
        body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
        assert_allclose(axial_frequencies(body), expected, rtol=1e-9)


def test_lumped_masses_sit_on_the_centroid_line_and_on_the_surface_of_the_centre_of_mass(tmp_path):
    """Mass and centre of mass of an offset bar and of a shell of two layers, off the grid points, are the same."""
    w = R.apply([0.02, 0.05, 0.03])
    offset = ",\n,,," + ",".join(map(repr, [*w.tolist(), *w.tolist()]))
    layers = strip().replace("PSHELL,1,1,.02,1,,1", "PCOMP,1,.01,3.\n,1,.02,0.,,2,.03,0.") + "MAT1,2,1.+11,,0.,2000.\n"
    for text in (bars(offset), layers):
        sums = []
        for mass in ("consistent", "lumped"):
            body, _ = body_of(tmp_path, text, mass)
            rigid = np.zeros((body.n_dof, 6))
            for k, (node, c) in enumerate(body.dofs):
                x, y, z = body.nodes[node] - T
                rigid[k] = [*np.eye(3)[c], *[[0, z, -y], [-z, 0, x], [y, -x, 0]][c]] if c < 3 else np.eye(6)[c]
            sums.append(rigid.T @ body.M @ rigid)
        scale = np.abs(sums[0]).max()
        assert_allclose(sums[1][:3], sums[0][:3], atol=1e-11 * scale)
        assert np.abs(sums[1][3:, 3:] - sums[0][3:, 3:]).max() > 1e-6 * scale  # moments of inertia are not the same


def test_the_mass_of_a_job_belongs_to_a_deck_and_is_a_known_word(tmp_path):
    body_of(tmp_path, bars(), "lumped")
    job = tmp_path / "model.toml"
    text = job.read_text()
    job.write_text(text.replace('mass = "lumped"', 'mass = "lump"'))
    with pytest.raises(ReportedError, match=r"body\.mass"):
        read_job(job)
    job.write_text(text.replace('deck = "model.bdf"', 'mesh = "model.bdf"'))
    with pytest.raises(ReportedError, match=r"body\.mass: belongs to a whole deck"):
        read_job(job)
