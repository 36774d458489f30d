import os
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.errors import FeModelsError, MeshError
from fe_models.parts import (
    SHIPPED_MESHES,
    SLENDER_ROD,
    Bracket,
    ConnectingRod,
    MeshingError,
    PartError,
    mesh_bracket,
    mesh_connecting_rod,
    shipped_mesh,
)
from fe_models.parts.connecting_rod import pocket_circles, shank_outline

COARSE = 9.0  #: element size that keeps a test short


@pytest.fixture
def gmsh():
    """The mesher; its absence skips visibly, or fails where everything is required."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        if os.environ.get("FLOATFRAME_REQUIRE_ALL") == "1":
            pytest.fail(f"gmsh is required here, but cannot be imported: {error}")
        pytest.skip(f"gmsh cannot be imported: {error}")
    return gmsh


def read(path):
    """meshio's view of a file: points (n, 3), tet10 (m, 10), and triangles of each group by name."""
    import meshio

    mesh = meshio.read(path)
    tetra = np.concatenate([block.data for block in mesh.cells if block.type == "tetra10"])
    groups = {
        name: np.concatenate(
            [
                block.data[rows]
                for block, rows in zip(mesh.cells, sets, strict=True)
                if block.type == "triangle6" and len(rows)
            ]
            or [np.zeros((0, 6), int)]
        )
        for name, sets in mesh.cell_sets.items()
        if not name.startswith("gmsh:")
    }
    return mesh.points, tetra, groups


def jacobians(points, tetra):
    """det J at the 4-point rule, (n_elements, 4), from the quadratic shape functions written out by hand."""
    a, b = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
    d_bary = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])  # d(barycentric)/d(x, y, z)
    edges = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # VTK order of the mid-side nodes
    det = []
    for k in range(4):
        L = np.full(4, a)
        L[k] = b
        d_corner = (4 * L - 1)[:, None] * d_bary
        d_mid = [4 * (L[i] * d_bary[j] + L[j] * d_bary[i]) for i, j in edges]
        gradient = np.vstack([d_corner, d_mid])  # (10, 3)
        det.append(np.linalg.det(np.einsum("enc,nd->ecd", points[tetra], gradient)))
    return np.stack(det, axis=1)


def volume(points, tetra):
    return jacobians(points, tetra).sum() / 24


@pytest.mark.parametrize("name", SHIPPED_MESHES)
def test_shipped_rods_have_their_groups_and_no_inverted_element(name):
    path = shipped_mesh(name)
    points, tetra, groups = read(path)
    assert set(groups) == {"rod", "big_end", "small_end"}
    assert path.stat().st_size < 1e6
    assert jacobians(points, tetra).min() > 0
    assert_array_equal(np.unique(tetra), np.arange(len(points)))


@pytest.mark.parametrize(("end", "x"), [("big", 0.0), ("small", 140.0)])
def test_shipped_rod_bores_are_round_with_curved_mid_side_nodes(end, x):
    rod = ConnectingRod()
    points, _, groups = read(shipped_mesh("connecting_rod"))
    face = points[np.unique(groups[f"{end}_end"])]
    radius = getattr(rod, f"{end}_bore") / 2
    assert_allclose(np.hypot(face[:, 0] - x, face[:, 1]), radius, rtol=1e-9, atol=0)
    assert_allclose(
        [face[:, 2].min(), face[:, 2].max()], np.array([-0.5, 0.5]) * getattr(rod, f"{end}_width"), rtol=1e-9, atol=0
    )


@pytest.mark.parametrize(
    ("name", "rod", "size"), [("connecting_rod", ConnectingRod(), 5.5), ("slender_rod", SLENDER_ROD, 7.0)]
)
def test_shipped_rods_are_those_of_their_dimensions(gmsh, tmp_path, name, rod, size):
    part = mesh_connecting_rod(rod, size=size, path=tmp_path / "rod.msh")  # another gmsh may mesh it a little otherwise
    points, tetra, groups = read(shipped_mesh(name))
    assert_allclose(volume(points, tetra), part.volume, rtol=2e-4, atol=0)
    own_points, _, own_groups = read(part.path)
    for bound in (np.min, np.max):
        assert_allclose(bound(points, axis=0), bound(own_points, axis=0), rtol=0, atol=1e-9 * np.ptp(points))
    assert set(own_groups) == set(groups)


def test_same_parameters_give_the_same_bytes_of_a_linear_mesh(gmsh, tmp_path):
    first = mesh_connecting_rod(size=COARSE, order=1, path=tmp_path / "a.msh").path.read_bytes()
    assert mesh_connecting_rod(size=COARSE, order=1, path=tmp_path / "b.msh").path.read_bytes() == first


def test_same_parameters_give_the_same_curved_mesh(gmsh, tmp_path):
    points, tetra, groups = read(mesh_connecting_rod(path=tmp_path / "a.msh").path)
    again, tetra_again, groups_again = read(mesh_connecting_rod(path=tmp_path / "b.msh").path)
    assert_allclose(again, points, rtol=0, atol=1e-10 * np.ptp(points))  # gmsh's optimiser varies in the last bits
    assert_array_equal(tetra_again, tetra)
    for name, faces in groups.items():
        assert_array_equal(groups_again[name], faces)


def test_mesh_volume_tends_to_that_of_the_geometry_and_linear_elements_cut_the_corners(gmsh, tmp_path):
    quadratic = mesh_connecting_rod(size=5.0, path=tmp_path / "q.msh")
    points, tetra, _ = read(quadratic.path)
    assert jacobians(points, tetra).min() > 0
    assert_allclose(volume(points, tetra), quadratic.volume, rtol=2e-4, atol=0)
    linear = mesh_connecting_rod(size=5.0, order=1, path=tmp_path / "l.msh")
    assert linear.n_nodes < quadratic.n_nodes / 4
    assert linear.volume == quadratic.volume


def test_dimensions_are_respected(gmsh, tmp_path):
    rod = ConnectingRod(
        centre_distance=200.0, big_bore=52.0, big_outer=76.0, small_bore=26.0, small_outer=42.0, bolt=0.0
    )
    points, _, groups = read(mesh_connecting_rod(rod, size=6.0, path=tmp_path / "rod.msh").path)
    assert_allclose(points.min(axis=0), [-38.0, -38.0, -12.0], rtol=1e-9, atol=0)
    assert_allclose(points.max(axis=0), [221.0, 38.0, 12.0], rtol=1e-9, atol=0)
    small = points[np.unique(groups["small_end"])]
    assert_allclose(np.hypot(small[:, 0] - 200.0, small[:, 1]), 13.0, rtol=1e-9, atol=0)


def test_pockets_make_the_shank_lighter_by_their_own_volume(gmsh, tmp_path):
    rod = ConnectingRod()
    plain = mesh_connecting_rod(replace(rod, web=rod.shank_width), size=COARSE, order=1, path=tmp_path / "plain.msh")
    part = mesh_connecting_rod(rod, size=COARSE, order=1, path=tmp_path / "rod.msh")
    (x_1, r_1), (x_2, r_2) = pocket_circles(rod)
    theta = np.arccos((r_1 - r_2) / (x_2 - x_1))  # half the arc of the small circle; the hull of two circles
    area = (np.pi - theta) * r_1**2 + theta * r_2**2 + (r_1 + r_2) * (x_2 - x_1) * np.sin(theta)
    assert_allclose(plain.volume - part.volume, area * (rod.shank_width - rod.web), rtol=1e-9, atol=0)


def test_fillets_touch_the_shank():
    rod = ConnectingRod()
    _, line_big, line_small, _, c_big, c_small = shank_outline(rod)
    edge = np.subtract(line_small, line_big)
    for line, centre in ((line_big, c_big), (line_small, c_small)):
        assert_allclose(np.dot(np.subtract(centre, line), edge), 0, rtol=0, atol=1e-12 * 140**2)
        assert_allclose(np.hypot(*np.subtract(centre, line)), rod.fillet, rtol=1e-12, atol=0)


def test_bracket_has_the_volume_and_the_groups_of_its_dimensions(gmsh, tmp_path):
    b = Bracket()
    part = mesh_bracket(b, size=COARSE, path=tmp_path / "bracket.msh")
    corner = (1 - np.pi / 4) * b.fillet**2
    ell = b.width * (b.foot_length * b.thickness + (b.height - b.thickness) * b.thickness + corner)
    rib = b.rib_thickness * (b.rib_length * b.rib_height / 2 - corner)
    holes = np.pi / 4 * b.thickness * (4 * b.bolt**2 + b.bore**2)
    assert_allclose(part.volume, ell + rib - holes, rtol=1e-9, atol=0)
    points, tetra, groups = read(part.path)
    assert jacobians(points, tetra).min() > 0
    assert_allclose(volume(points, tetra), part.volume, rtol=1e-3, atol=0)
    assert set(groups) == {"bracket", "bore", "bolts", "bolt_1", "bolt_2", "bolt_3", "bolt_4"}
    assert_allclose(b.bolt_axes, [(24, -21), (24, 21), (76, -21), (76, 21)], rtol=1e-12, atol=0)
    for k, axis in enumerate(b.bolt_axes, start=1):
        hole = points[np.unique(groups[f"bolt_{k}"])]
        assert_allclose(np.hypot(*(hole[:, :2] - axis).T), b.bolt / 2, rtol=1e-9, atol=0)
    together = np.unique(np.concatenate([groups[f"bolt_{k}"] for k in range(1, 5)]))
    assert_array_equal(np.unique(groups["bolts"]), together)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"big_bore": 0.0}, "big_bore: expected a positive length, got 0"),
        ({"web": np.nan}, "web: expected a positive length, got nan"),
        ({"small_bore": 40.0}, "small_bore < small_outer"),
        ({"centre_distance": 45.0}, "centre_distance > 51"),
        ({"web": 20.0}, "web <= shank_width"),
        ({"fillet": 300.0}, "smaller fillet"),
        ({"flange": 13.5}, "room for the pockets"),
        ({"boss": 7.0}, "bolt < boss"),
        ({"shank_height_big": 80.0}, "shank_height_big < big_outer"),
    ],
)
def test_a_rod_that_cannot_be_is_refused_with_words(wrong, words):
    with pytest.raises(PartError, match=words) as caught:
        ConnectingRod(**wrong)
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, FeModelsError)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"thickness": -1.0}, "thickness: expected a positive length"),
        ({"bore": 80.0}, "bore < width"),
        ({"bore_height": 100.0}, "below the upright's top"),
        ({"bore_height": 60.0}, "above the rib"),
        ({"rib_thickness": 40.0}, "clear of the rib"),
        ({"foot_length": 40.0}, "two rows of bolts"),
        ({"fillet": 12.0}, "clear of the fillet"),
        ({"rib_length": 95.0}, "smaller rib"),
    ],
)
def test_a_bracket_that_cannot_be_is_refused_with_words(wrong, words):
    with pytest.raises(PartError, match=words):
        Bracket(**wrong)


@pytest.mark.parametrize("options", [{"size": 0.0}, {"size": np.inf}, {"order": 3}])
def test_bad_meshing_options_are_refused_before_gmsh_is_needed(options, tmp_path):
    with pytest.raises(MeshError, match="expected"):
        mesh_connecting_rod(**options, path=tmp_path / "rod.msh")


def test_another_file_format_is_refused(gmsh, tmp_path):
    with pytest.raises(MeshError, match=r"ends in \.msh"):
        mesh_connecting_rod(size=COARSE, path=tmp_path / "rod.stl")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (
            ModuleNotFoundError("No module named 'gmsh'", name="gmsh"),
            r'not installed; pip install "floatframe\[mesh\]"$',
        ),
        (OSError("libGLU.so.1: cannot open shared object file"), "libGLU.so.1.*apt-get install libglu1-mesa"),
    ],
)
def test_a_missing_mesher_is_told_with_the_way_to_get_it(error, words, monkeypatch, tmp_path):
    def without_gmsh(name):
        raise error

    monkeypatch.setattr("fe_models.foundation.extras.import_module", without_gmsh)
    with pytest.raises(MeshingError, match=words):
        mesh_connecting_rod(path=tmp_path / "rod.msh")
    assert not (tmp_path / "rod.msh").exists()


def test_an_unknown_shipped_mesh_is_refused_with_the_choices():
    with pytest.raises(PartError, match="choices: connecting_rod, slender_rod"):
        shipped_mesh("conrod")
