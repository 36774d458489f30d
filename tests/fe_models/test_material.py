"""Materials: impossible ones are refused, and every cell has exactly one."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.material import Material, assign_materials
from fe_models.errors import MaterialError
from fe_models.meshes.mesh import Mesh
from tests.bodies import ALUMINIUM, STEEL, box_mesh


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"E": 0.0}, "E: expected a modulus above zero, got 0"),
        ({"E": -2e11}, "E: expected a modulus above zero"),
        ({"rho": -1.0}, "rho: expected a density of zero or more, got -1"),
        ({"nu": 0.5}, r"nu: expected -1 < nu < 0.5, got 0.5"),
        ({"nu": -1.0}, r"nu: expected -1 < nu < 0.5, got -1"),
        ({"nu": float("nan")}, "nu: expected a finite number, got nan"),
        ({"rho": float("inf")}, "rho: expected a finite number"),
        ({"E": "2e11"}, "E: expected a number, got '2e11'"),
    ],
)
def test_impossible_material_is_refused_by_name(values, message):
    with pytest.raises(MaterialError, match=message) as caught:
        Material("steel", **({"E": 2e11, "nu": 0.3, "rho": 7850.0} | values))
    assert "material 'steel'" in str(caught.value)


def test_lame_constants_give_back_modulus_and_ratio():
    lam, mu = STEEL.lam, STEEL.mu
    assert_allclose(mu * (3 * lam + 2 * mu) / (lam + mu), STEEL.E, rtol=1e-14)
    assert_allclose(lam / (2 * (lam + mu)), STEEL.nu, rtol=1e-14)


def test_each_cell_gets_the_material_of_its_group():
    mesh = box_mesh(4, 1, 1)
    materials, of_cell = assign_materials(mesh, {"left half": STEEL, "right half": ALUMINIUM})
    assert materials == (STEEL, ALUMINIUM)
    assert_array_equal(of_cell["hexahedron"], [0, 0, 1, 1])


def test_overlapping_groups_that_agree_are_one_material():
    mesh = box_mesh(4, 1, 1)
    materials, of_cell = assign_materials(mesh, {"all": STEEL, "left half": Material("steel", STEEL.E, 0.3, 7850.0)})
    assert materials == (STEEL,)
    assert_array_equal(of_cell["hexahedron"], 0)


def test_unknown_group_names_the_nearest():
    with pytest.raises(MaterialError, match=r"no group of cells 'left haf'; did you mean 'left half'\?"):
        assign_materials(box_mesh(), {"left haf": STEEL})


def test_cells_without_material_are_counted_and_their_group_named():
    with pytest.raises(MaterialError, match=r"material: 8 hexahedron; they are in the groups right half, all"):
        assign_materials(box_mesh(4, 2, 2), {"left half": STEEL})


def test_cells_in_no_group_are_counted():
    mesh = box_mesh(2, 1, 1)
    mesh = Mesh(mesh.nodes, mesh.cells, {"one": {"hexahedron": np.array([0])}})
    with pytest.raises(MaterialError, match="1 hexahedron; they are in no group"):
        assign_materials(mesh, {"one": STEEL})


def test_cells_with_two_materials_are_counted_and_named():
    with pytest.raises(MaterialError, match=r"4 hexahedron cells of group 'all' have two materials, 'aluminium' and"):
        assign_materials(box_mesh(4, 2, 1), {"left half": ALUMINIUM, "all": STEEL})


def test_no_material_at_all_is_refused():
    with pytest.raises(MaterialError, match="expected one material"):
        assign_materials(box_mesh(), {})
