"""The reference node of a distributing coupling of a deck as an interface: that of its members' mean motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.errors import BodyError
from cms.jobs.decks.job_text import job_text
from fe_models.body.fe_body import Interface
from fe_models.elements.solids.body import solid_body
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from tests.bodies import STEEL, box_mesh

BOX = box_mesh(3, 1, 1, 1.0, 0.1, 0.1)
REFERENCE = np.array([1.2, 0.05, 0.05])


def deck(*more):
    """A bar; the nodes at its right end carry node 901 in the mean, which is held, as the left end is."""
    text = ["*NODE", *(f"{n + 1}, {x!r}, {y!r}, {z!r}" for n, (x, y, z) in enumerate(BOX.nodes.tolist()))]
    text += ["901, 1.2, 0.05, 0.05", "*ELEMENT, TYPE=C3D8, ELSET=all"]
    text += [f"{e + 1}, {', '.join(str(n + 1) for n in row)}" for e, row in enumerate(BOX.cells["hexahedron"])]
    for name, rows in (("TIP", BOX.node_sets["right"]), ("ROOT", BOX.node_sets["left"]), ("REF", [900])):
        text += [f"*NSET, NSET={name}", ", ".join(str(n + 1) for n in rows)]
    text += ["*SURFACE, NAME=FACE, TYPE=NODE", "TIP, 1.", "*COUPLING, CONSTRAINT NAME=C1, REF NODE=901, SURFACE=FACE"]
    text += ["*DISTRIBUTING", "*SOLID SECTION, ELSET=all, MATERIAL=STEEL", "*MATERIAL, NAME=STEEL", "*ELASTIC"]
    text += [f"{STEEL.E!r}, {STEEL.nu!r}", "*DENSITY", f"{STEEL.rho!r}", *more]
    return "\n".join([*text, "*BOUNDARY", "REF, 1, 6", "ROOT, 1, 3", ""])


def job_of(folder, text):
    path = folder / "bar.inp"
    path.write_text(text)
    path.with_suffix(".toml").write_text(job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name))
    return path.with_suffix(".toml")


def test_the_reference_node_is_the_distributing_interface_of_the_members(tmp_path):
    job = job_of(tmp_path, deck())
    job.write_text(job.read_text().replace("n_modes = 10", "n_modes = 4"))
    found = cms.reduce_job(job)
    ends = [
        Interface("REF", "distributing", BOX.node_sets["right"], REFERENCE),
        Interface("ROOT", "rigid", BOX.node_sets["left"], BOX.nodes[BOX.node_sets["left"]].mean(axis=0)),
    ]
    units = cms.unit_system("m-kg-s")
    body = cms.couple(solid_body(BOX, STEEL, name="bar", units=units, interfaces=ends))
    expected = cms.reduce(body, cms.craig_bampton(body, n_modes=4))
    interface = found.interface("REF")
    assert interface.kind == "distributing"
    assert_allclose(found.frame.origin + found.frame.axes @ interface.position, REFERENCE, atol=1e-12)
    assert_allclose(np.diag(found.K), np.diag(expected.K), rtol=1e-7)
    assert_allclose(np.abs(interface.Psi), np.abs(expected.interface("REF").Psi), rtol=0, atol=1e-6)


def test_what_sits_on_the_node_too_is_refused(tmp_path):
    job = job_of(tmp_path, deck("*ELEMENT, TYPE=MASS, ELSET=lump", "99, 901", "*MASS, ELSET=lump", "2.0"))
    with pytest.raises(BodyError, match=r"interfaces.REF: its node is the reference of coupling 'C1', and masses\."):
        cms.reduce_job(job)


def test_a_coupling_of_some_components_is_refused(tmp_path):
    job = job_of(tmp_path, deck())
    job.write_text(job.read_text().replace("members =", 'components = ["ux", "uy", "uz"]\nmembers ='))
    with pytest.raises(BodyError, match="takes some components only"):
        cms.reduce_job(job)
