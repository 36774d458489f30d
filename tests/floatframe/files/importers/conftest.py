"""Fixtures of this room."""

import numpy as np
import pytest

from floatframe.files.importers.mesh_files import stl_bytes
from tests.floatframe.files.importers.examples import GRIPPER


@pytest.fixture
def gripper(tmp_path):
    path = tmp_path / "hand" / "urdf" / "gripper.urdf"
    path.parent.mkdir(parents=True)
    path.write_text(GRIPPER)
    (tmp_path / "hand" / "meshes").mkdir()
    nodes = np.array([[0, 0, 0], [10.0, 0, 0], [0, 20.0, 0], [0, 0, 30.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    (tmp_path / "hand" / "meshes" / "tip.stl").write_bytes(stl_bytes(nodes, faces))
    return path
