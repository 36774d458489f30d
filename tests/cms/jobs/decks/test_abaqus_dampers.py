"""Springs and dashpots of Abaqus between nodes, and to the ground, beside energies by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

DECK = """*NODE
1, 0., 0., 0.
2, 1., 0., .1
3, 1., .4, .1
4, 2., .5, .3
*ELEMENT, TYPE=B31, ELSET=bars
1, 1, 2
2, 3, 4
*ELEMENT, TYPE={kind}, ELSET=pot
5, {nodes}
*MATERIAL, NAME=steel
*ELASTIC
2.0E11, .3
*DENSITY
7800.
*BEAM SECTION, ELSET=bars, MATERIAL=steel, SECTION=RECT
.1, .05
0., 0., 1.
*{keyword}, ELSET=pot
{components}
{value}
"""


def body_of(folder, **words):
    path = folder / "model.inp"
    path.write_text(DECK.format(**words))
    deck = parse_deck(path)
    job = job_text(deck, DeckOptions("m-kg-s", {}), path.name).replace("[body]", '[body]\naccept = ["parts"]')
    path.with_suffix(".toml").write_text(job)
    return uncoupled_body(read_job(path.with_suffix(".toml")), Stages()), deck


@pytest.mark.parametrize("keyword", ["SPRING", "DASHPOT"])
@pytest.mark.parametrize(
    ("letter", "nodes", "components", "direction"),
    [
        ("A", "2, 4", "", np.array([1.0, 0.5, 0.2, 0, 0, 0]) / np.linalg.norm([1.0, 0.5, 0.2])),
        ("2", "2, 3", "2, 2", np.eye(6)[1]),
        ("2", "2, 3", "6, 6", np.eye(6)[5]),
    ],
)
def test_a_spring_or_dashpot_between_two_nodes(tmp_path, keyword, letter, nodes, components, direction):
    words = {"kind": f"{keyword}{letter}", "keyword": keyword, "nodes": nodes, "components": components}
    none, _ = body_of(tmp_path, **words, value="1.E-30")
    body, _ = body_of(tmp_path, **words, value="7.E4")
    a, b = (int(word) - 1 for word in nodes.split(", "))
    u = np.random.default_rng(1).normal(size=body.n_dof)
    of = {n: np.array([u[(body.dofs == (n, c)).all(axis=1)][0] for c in range(6)]) for n in (a, b)}
    energy = 7e4 * (direction @ (of[b] - of[a])) ** 2
    if keyword == "SPRING":
        assert_allclose(u @ (body.K - none.K) @ u, energy, rtol=1e-6)
        assert body.D is None
    else:
        assert_allclose(u @ body.D @ u, energy, rtol=1e-9)
        assert_allclose(body.K.toarray(), none.K.toarray(), rtol=0, atol=1e-9 * abs(none.K).max())


@pytest.mark.parametrize("keyword", ["SPRING", "DASHPOT"])
def test_a_spring_or_dashpot_to_the_ground_makes_an_interface(tmp_path, keyword):
    body, deck = body_of(tmp_path, kind=f"{keyword}1", keyword=keyword, nodes="4", components="3", value="7.E4")
    assert any("ties uz of node 4 to the ground with 70000" in row[2] for row in deck.ledger.rows())
    assert [(support.name, support.components) for support in deck.supports] == [("node_4", (2,))]
    assert [interface.nodes.tolist() for interface in body.interfaces] == [[3]]
    assert body.D is None


@pytest.mark.parametrize(("nodes", "components"), [("2, 3", "1, 1"), ("2, 3", "2, 3")])
def test_dashpots_whose_forces_do_not_balance_are_refused(tmp_path, nodes, components):
    with pytest.raises(ValueError, match=r"1 DASHPOT2 .*the forces do not balance"):
        body_of(tmp_path, kind="DASHPOT2", keyword="DASHPOT", nodes=nodes, components=components, value="1.")


@pytest.mark.parametrize("keyword", ["SPRING", "DASHPOT"])
def test_a_spring_or_dashpot_along_no_line_is_refused(tmp_path, keyword):
    with pytest.raises(ValueError, match=rf"1 {keyword}A \(first: line 19\): has no length between its nodes"):
        body_of(tmp_path, kind=f"{keyword}A", keyword=keyword, nodes="2, 2", components="", value="1.")


def test_a_spring_to_the_ground_of_a_turned_instance_holds_along_its_axis(tmp_path):
    """Turned by 30 degrees about z, its axis 1 has two components in basic axes."""
    text = DECK.format(kind="SPRING1", keyword="SPRING", nodes="4", components="1", value="7.E4")
    turned = f"*PART, NAME=P\n{text}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n"
    turned += "0., 0., 0.\n0., 0., 0., 0., 0., 1., 30.\n*END INSTANCE\n*END ASSEMBLY\n"
    path = tmp_path / "model.inp"
    path.write_text(turned)
    deck = parse_deck(path)
    assert [support.components for support in deck.supports] == [(0, 1, 2)]
    assert any("ties ux along axes of its instance of node" in row[2] for row in deck.ledger.rows())
