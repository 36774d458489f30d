"""Several materials and stress points of elements in one assessment."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from fe_models.foundation.documents.html import html_page
from floatframe.durability.fatigue import (
    FatigueMaterial,
    MeanStress,
    assess,
    basquin_curve,
    history_damage,
    read_fatigue,
)
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.fatigue_file import FatigueFile
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.outputs import fatigue_record, nodes_of_places, vtu_of, worst_table
from floatframe.durability.fatigue.report import fatigue_document, head
from floatframe.durability.fatigue.surface_damage import spectral_damage
from floatframe.errors import FatigueError
from tests.bodies import box_mesh
from tests.floatframe.durability.fatigue.examples import FILE, LENGTH, UNITS, B, H, block, noise

CURVE = basquin_curve(1e6, 1e6, 5.0, least_cycles=1.0)
WEAK = basquin_curve(5e5, 2e6, 3.0, least_cycles=1.0)


def test_points_see_the_section_forces_of_a_tip_load(mast):
    """A force pulsing at the tip: sigma = F (L - x) z / I at the ends of every element, N = (sigma_a / S_1)^-5 N_1."""
    force, z = 100.0, H / 2
    tip = mast.interface("end").Psi[2]
    q = np.linalg.solve(mast.K, tip * force)  # the frame is clamped at the start; the static set holds the tip load
    found = history_damage(mast, [LoadBlock("pulse", np.stack([0 * q, q, 0 * q]))], CURVE, negligible=0,
                           extrapolate=True, nodes=np.zeros(0, np.int64),
                           points=np.arange(len(mast.point_stress.names)))  # fmt: skip
    x, height = found.positions(np.arange(len(found.points)))[:, [0, 2]].T
    amplitude = 0.5 * force * (LENGTH - x) * z / (B * H**3 / 12)
    outer = np.abs(np.abs(height) - z) < 1e-9
    corners = outer & (np.abs(np.abs(mast.point_stress.positions[:, 1]) - B / 2) < 1e-9)  # no shear stress there
    assert corners.sum() == 4 * 2 * 4
    assert_allclose(found.largest[corners], amplitude[corners], rtol=1e-6, atol=1e-6 * amplitude.max())
    expected = (amplitude[corners] / 1e6) ** 5 / 1e6
    assert_allclose(found.damage[corners], expected, rtol=1e-5, atol=1e-9 * expected.max())
    assert found.description(int(found.worst()[0])).startswith("beam 11 end A point")


@pytest.mark.parametrize("negligible", [0.0, 1e-3])
def test_each_place_has_the_damage_of_its_own_material(mast, negligible):
    blocks = [block(mast)]
    points = np.flatnonzero([name.startswith("beam 11 ") for name in mast.point_stress.names])
    nodes = np.unique(mast.surface[mast.numbering.named_set("", "ROOT").members])
    weak = FatigueMaterial(WEAK, MeanStress("goodman", 1e10), "weld", nodes, points)
    options = {"negligible": negligible, "extrapolate": True}
    found = history_damage(mast, blocks, CURVE, others=[weak], **options)
    strong, soft = (history_damage(mast, blocks, c, negligible=0, extrapolate=True, mean_stress=m)
                    for c, m in ((CURVE, MeanStress()), (WEAK, weak.mean_stress)))  # fmt: skip
    assert len(found.nodes) == len(strong.nodes)
    for one in range(2):
        alone = (strong, soft)[one]
        at = {(n, p): k for k, (n, p) in enumerate(zip(alone.nodes, alone.points, strict=True))}
        mine = np.flatnonzero((found.material == one) & found.is_counted)
        same = [at[found.nodes[k], found.points[k]] for k in mine]
        assert len(mine) > 3 or (negligible and one == 1)  # the beam itself is far worse than its weld
        assert_allclose(found.damage[mine], alone.damage[same], rtol=1e-12)
    is_weak = np.isin(found.points, points) | np.isin(found.nodes, nodes)
    assert (is_weak == (found.material == 1)).all()
    left_out = ~found.is_counted
    assert (found.bound[left_out] < max(negligible, 1e-300) * found.damage[found.worst()[0]]).all()


def test_a_node_of_two_materials_is_a_place_of_each_and_places_of_none_are_told(mast):
    nodes = np.unique(mast.surface)[:6]
    materials = [FatigueMaterial(CURVE, name="a", nodes=nodes[:4]), FatigueMaterial(WEAK, name="b", nodes=nodes[2:])]
    found = history_damage(mast, [block(mast)], None, others=materials, negligible=0, extrapolate=True)
    assert found.nodes.tolist() == [*nodes[:4], *nodes[2:]]
    n_others = len(np.unique(mast.surface)) + len(mast.point_stress.names) - 6
    assert any(f"{n_others} nodes were not assessed" in note for note in found.notes)
    with pytest.raises(FatigueError, match="material 'none': none of its places is assessed"):
        history_damage(mast, [block(mast)], CURVE, others=[FatigueMaterial(WEAK, name="none", nodes=nodes[:0])])
    with pytest.raises(FatigueError, match="expected an S-N curve, or others"):
        history_damage(mast, [block(mast)], None)
    with pytest.raises(FatigueError, match="two materials name no places"):
        history_damage(mast, [block(mast)], CURVE, others=[FatigueMaterial(WEAK)])


def test_spectra_know_points_and_materials(mast):
    spectra = [noise(mast)]
    points = np.arange(5)
    weak = FatigueMaterial(WEAK, name="weld", points=points)
    found = spectral_damage(mast, spectra, CURVE, others=[weak], extrapolate=True)
    alone = spectral_damage(mast, spectra, WEAK, extrapolate=True, nodes=np.zeros(0, np.int64), points=points)
    assert_allclose(found.damage[found.material == 1], alone.damage, rtol=1e-12)


def test_critical_planes_need_a_surface(mast):
    with pytest.raises(FatigueError, match="stress points of elements have none"):
        history_damage(mast, [block(mast)], CURVE, criterion=Criterion("normal"))
    found = history_damage(mast, [block(mast)], CURVE, criterion=Criterion("normal"), extrapolate=True,
                           nodes=np.unique(mast.surface))  # fmt: skip
    assert (found.nodes >= 0).all()


WELD = """
[materials.weld]
stress_unit = "N/mm^2"
tensile_strength = 500
{where}
factors = {{ weld = 0.5 }}
sn = {{ amplitude = 0.5, cycles = 2e6, slope = 3, least_cycles = 1, log_deviation = 0.2 }}
"""


def read(folder, where='sets = ["ROOT"]', places="all") -> FatigueFile:
    (folder / "mast.toml").write_text(FILE.format(weld=WELD.format(where=where), places=places))
    return read_fatigue(folder / "mast.toml")


@pytest.mark.parametrize("where", ['sets = ["ROOT"]', "elements = [11]", 'points = ["beam 11"]'])
def test_a_file_names_the_places_of_a_material(folder, mast, where):
    made = assess(read(folder, where))
    result = made.result
    weld = [result.description(int(k)) for k in np.flatnonzero(result.material == 1)]
    assert sum(name.startswith("beam 11 ") for name in weld) == 2 * 8
    assert not any(name.startswith("beam") and not name.startswith("beam 11 ") for name in weld)
    assert any(name.startswith("node") for name in weld) == ("points" not in where)
    quantile = -1.2815515655446004  # of 90 %
    assert_allclose(result.materials[1].curve.amplitude[0], 0.5e6 * 0.9 * 0.5, rtol=1e-12)
    assert_allclose(result.materials[1].curve.cycles[0], 2e6 * 10 ** (0.2 * quantile), rtol=1e-9)
    assert (result.materials[0].name, result.materials[1].name) == ("tube", "weld")
    assert result.materials[1].mean_stress.value == 500e6
    record = fatigue_record(made)
    assert [each["name"] for each in record["materials"]] == ["tube", "weld"]
    if "sets" in where:  # drawing takes seconds
        html = html_page(fatigue_document(made))
        assert "S-N curve weld" in html
        for target, verdict in ((None, "info"), (0.5 * record["life"], "pass"), (2 * record["life"], "fail")):
            asked = {**record, "programme": {**record["programme"], "target": target}}
            assert head(asked)[1].verdict == verdict
        assert "stress points of elements" in html
    assert worst_table(made).names[:3] == ("rank", "node", "material")
    assert b"log10 damage" in vtu_of(made)


def test_places_are_nodes_or_points_as_asked(folder, mast):
    assert (assess(read(folder, places="nodes")).result.points == -1).all()
    made = assess(read(folder, places="points"))
    assert (made.result.nodes == -1).all()
    places, nodes = nodes_of_places(made.result)  # ends of elements lie on the rings of the skin
    assert len(places) == len(mast.point_stress.names)
    assert_allclose(mast.nodes[nodes], mast.point_stress.positions[made.result.points[places]], atol=1e-12)


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("", "expected the places of the material: sets, elements, nodes or points"),
        ('sets = ["TOP"]', "no set 'TOP'"),
        ("elements = [99]", "no element 99 behind the surface"),
        ('points = ["beam 99"]', "no stress point 'beam 99'"),
    ],
)
def test_places_that_are_not_there_are_refused(folder, where, message):
    with pytest.raises(Exception, match=message):
        assess(read(folder, where))


def test_points_of_a_material_stand_for_the_nodes_of_its_border(tmp_path):
    """In a bar of two materials the soft one is judged with its own stress where they meet."""
    from floatframe.durability.fatigue.assessment import places_named
    from floatframe.durability.fatigue.fatigue_file import PlacesSection

    stiff, soft = (fm.Material(n, E=E, nu=0.3, rho=1000.0) for n, E in (("stiff", 2e11), ("soft", 5e8)))
    mesh = box_mesh(4, 2, 2, 1.0, 0.3, 0.2)
    mesh = replace(mesh, node_sets={**mesh.node_sets, "soft part": np.flatnonzero(mesh.nodes[:, 0] <= 0.5)})
    block = fm.solid_body(mesh, {"left half": soft, "right half": stiff}, name="b", units=UNITS)
    ends = [
        fm.Interface(n, "rigid", mesh.node_sets[n], mesh.nodes[mesh.node_sets[n]].mean(0)) for n in ("left", "right")
    ]
    coupled = cms.couple(fm.body.element_points(block.with_interfaces(*ends), "borders"))
    body = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=2))
    given = {"sn_exponent": 5.0, "fatigue_strength": 1e8, "stress_unit": "Pa"}
    keys = {key: value for key, value in given.items() if key in PlacesSection.model_fields}
    everywhere = PlacesSection.model_construct(sets=("soft part",), elements=(), nodes=(), points=(), **keys)
    nodes, points = places_named("materials.soft", everywhere, body)
    x = body.nodes @ np.asarray(body.frame.axes).T + body.frame.origin
    assert not len(points)
    assert np.isclose(x[nodes, 0], 0.5).sum() >= 8
    own = PlacesSection.model_construct(sets=("soft part",), elements=(), nodes=(), points=("soft",), **keys)
    nodes, points = places_named("materials.soft", own, body)
    assert x[nodes, 0].max() < 0.5 - 1e-9
    assert len(points) == 9
    assert all(body.point_stress.names[k].startswith("soft node ") for k in points)
