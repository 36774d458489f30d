"""Modes for ParaView, read by pyvista: shapes, stress and frequencies of the body."""

import xml.etree.ElementTree as ET

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

import cms
from tests.cms.exchange.exporters.small_bodies import cloud_body


def test_each_mode_is_a_grid_of_the_collection(tmp_path):
    import pyvista

    body, cloud = cloud_body(n_q=2)
    exported = cms.exchange.export_body(body, tmp_path / "b.pvd", to="vtk", units=body.units)
    assert [path.name for path in exported.files] == ["b.pvd", "b_1.vtu", "b_2.vtu"]
    entries = ET.parse(tmp_path / "b.pvd").getroot().iter("DataSet")
    assert [entry.get("file") for entry in entries] == ["b_1.vtu", "b_2.vtu"]
    grid = pyvista.read(tmp_path / "b_2.vtu")
    mesh = body.frame.origin + cloud.c @ body.frame.axes.T
    assert_allclose(grid.points, mesh, rtol=1e-15, atol=1e-15)
    q = grid.field_data["q"][0]
    shape = cloud.phi[:, :, 1] @ body.frame.axes.T
    assert_allclose(grid["displacement"], q * shape, rtol=1e-12, atol=1e-15)
    size = np.linalg.norm(np.ptp(mesh, axis=0))
    assert_allclose(np.linalg.norm(grid["displacement"], axis=1).max(), 0.05 * size, rtol=1e-12)
    assert_allclose(grid.field_data["frequency"][0], body.frequencies[1], rtol=1e-15)
    assert_array_equal(grid.cells_dict[5], body.surface)
    tensor = grid["stress"]  # xx yy zz xy yz xz
    xx, yy, zz, xy, yz, xz = tensor.T
    mises = np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + xz**2))
    assert_allclose(grid["von Mises stress"], mises, rtol=1e-12)
    assert_allclose(tensor[:, 0], q * np.asarray(body.stress)[:, 0, 1], rtol=1e-12)  # axes of B are those of the mesh
    assert_allclose(tensor[:, 4], q * np.asarray(body.stress)[:, 3, 1], rtol=1e-12)


def test_turned_frames_give_fields_in_mesh_axes(tmp_path):
    """A turn of the body frame changes nothing in the files but rounding."""
    import pyvista

    body, _ = cloud_body(n_q=2)
    turned = cms.reduction.convert_frame(body, cms.TisserandFrame(axes=([0, 1, 0], [0, 0, 1], [1, 0, 0])))
    plain = cms.reduction.convert_frame(body, cms.TisserandFrame())
    for name, each in {"a": turned, "b": plain}.items():
        cms.exchange.export_body(each, tmp_path / f"{name}.pvd", to="vtk", units=body.units)
    a, b = (pyvista.read(tmp_path / f"{name}_1.vtu") for name in "ab")
    assert_allclose(a.points, b.points, rtol=0, atol=1e-12)
    sign = np.sign(np.sum(a["displacement"] * b["displacement"]))
    assert_allclose(sign * a["displacement"], b["displacement"], rtol=0, atol=1e-10)
    assert_allclose(sign * a["stress"], b["stress"], rtol=0, atol=1e-8 * np.abs(b["stress"]).max())
