import json

import numpy as np
import pytest

from cms.assessment.report.face_view import visible_points
from tests.cms.command import run_cms
from tests.fe_models.small_solids import in_unit, painted, plate_file


@pytest.fixture
def plate(tmp_path):
    return painted(plate_file(tmp_path / "plate.step"), 6, (1, 0, 0))


def run(*words):
    return run_cms("faces", *words)


def test_faces_are_listed_with_what_selects_them(plate):
    result = run(plate)
    assert result.exit_code == 0
    assert "STEP in mm, taken to mm; 1 solid, 7 faces, volume 38869 mm³" in result.stdout
    assert "size (100, 40, 10) mm" in result.stdout
    (line,) = [line for line in result.stdout.splitlines() if "cylinder" in line]
    assert " ".join(line.split()) == "7 cylinder r=6 hole 376.991 (20, 20, 5) (0, 0, 1) #ff0000"


def test_json_has_the_faces_in_the_unit_that_is_asked_for_and_nothing_else_on_the_output(plate):
    result = run(in_unit(plate, "inch"), "--units", "m-kg-s", "--select", "cylinder hole", "--json")
    record = json.loads(result.stdout)
    assert (record["unit of the file"], record["units"]) == ("inch", "m-kg-s")
    (face,) = record["faces"]
    assert face["radius"] == pytest.approx(6 * 0.0254, rel=1e-9)
    assert face["select"] == f"cylinder r={6 * 0.0254:.6g} hole"
    assert face["area"] == pytest.approx(2 * np.pi * 60 * 0.0254**2, rel=1e-9)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--select", "cylinder r=7"], "no face of the body is such; it has cylinder r=6 hole"),
        (["--units", "furlong"], "unknown unit system"),
        (["-o", "faces.stl"], "expected a file name that ends in .png"),
    ],
)
def test_what_cannot_be_is_refused_in_one_message(plate, words, said):
    result = run(plate, *words)
    assert result.exit_code == 2
    assert said in result.stderr
    assert result.stderr.count("error") == 1


def test_a_picture_of_all_faces_is_drawn(plate, tmp_path):
    from PIL import Image

    assert run(plate, "-o", tmp_path / "faces.png").exit_code == 0
    with Image.open(tmp_path / "faces.png") as image:
        assert image.size == (2000, 800)
        assert len(np.unique(np.array(image.resize((250, 100))).reshape(-1, 3), axis=0)) > 50
    assert sorted(path.name for path in tmp_path.iterdir()) == ["faces.png", "plate.step"]


def test_a_face_behind_another_has_no_number():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    nodes = np.concatenate([square, square - np.array([0, 0, 1]), square + np.array([2, 0, -1])])
    two = np.array([[0, 1, 2], [0, 2, 3]])
    faces = {1: two, 2: two + 4, 3: two + 8}
    assert set(visible_points(nodes, faces, np.array([0.5, 0.5, 50.0]))) == {1, 3}
    assert set(visible_points(nodes, faces, np.array([0.5, 0.5, -50.0]))) == {2, 3}
