"""How large a page is, and how thin it may get: ten seconds of a vehicle whose body has 50 000 nodes."""

import numpy as np
from numpy.testing import assert_allclose

from floatframe import view
from floatframe.results.recovery import nodal_positions
from tests.floatframe.pictures.viewer.pages import ReadPage
from tests.floatframe.pictures.viewer.vehicle import T_END, car_body, vehicle

LENGTH = 4.2  #: of the car [m]


def test_ten_seconds_of_a_vehicle_with_a_body_of_many_nodes_have_ten_megabytes_at_most(tmp_path):
    """Frames interpolated from 60 rows a second, shapes and stress of a thousand nodes and more, exact at each."""
    system, motion = vehicle(n=50_000, rows_a_second=60)
    body = system.body("car").reduced
    assert len(body.nodes) > 49_000
    page = view(motion, tmp_path / "car.html", system=system, color="von-mises")
    assert page.size < 10e6
    read = ReadPage(page.path)
    times = read.array(read.record["time"])
    assert_allclose((times[0], times[-1]), (0.0, T_END), atol=1e-6)
    assert len(times) == 60 * T_END + 1
    assert read.record["view"]["follows"] == 0  # it travels: the camera goes with the body
    shown = read.array(read.record["surfaces"][0]["nodes"])
    assert len(shown) > 4000
    rows = [int(np.linalg.norm(body.nodes - node, axis=1).argmin()) for node in shown[::400]]
    for row in (0, 120, 600):
        expected = nodal_positions(motion, "car", body, row)[rows]
        assert_allclose(read.places(0, row)[::400], expected, rtol=0, atol=1e-4 * LENGTH)


def test_what_a_page_may_have_decides_how_many_nodes_are_shown(tmp_path):
    system, motion = vehicle(n=12_000, rows_a_second=20)
    counts = []
    for largest in (1.2, 2.0, 10.0):
        page = view(motion, tmp_path / "car.html", system=system, largest=largest)
        assert page.size < 1e6 * largest
        counts.append(ReadPage(page.path).record["surfaces"][0]["nodes"]["shape"][0])
    assert counts[0] < counts[1] < counts[2] == len(car_body(12_000).nodes)
