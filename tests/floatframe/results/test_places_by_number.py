"""Sensors at nodes, elements and sets by the user's numbers, against the same places by coordinates; and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from fe_models.body.fe_body import Interface
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Rectangle
from fe_models.elements.interfaces import NodeIndices, line_interface
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from fe_models.meshes.line_mesh import straight_line
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.numbering import Numbering
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    System,
    integrate,
    read_results,
)
from floatframe.errors import ModelError
from floatframe.pictures.animation import motion_scene
from floatframe.pictures.body_colors import VON_MISES
from floatframe.pictures.film_times import film_times
from floatframe.results.export import sensors_record
from floatframe.results.place_motion import interface_motion, point_motion
from floatframe.results.sensor_plots import plot_measurement
from floatframe.results.sensors import (
    DisplacementSensor,
    ElongationSensor,
    PlaceSensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
    measured,
    sensor_points,
)
from tests.bodies import STEEL, box_mesh
from tests.floatframe.command import run_floatframe

UNITS = unit_system("m-kg-s")
SOFT = replace(STEEL, E=2.1e9)


def renumbered(mesh, seed):
    """Return the mesh with its nodes and cells in another order, under numbers with gaps that go with the places."""
    (kind, cells), random = *mesh.cells.items(), np.random.default_rng(seed)
    order, rows = random.permutation(len(mesh.nodes)), random.permutation(len(cells))
    place = np.argsort(order)
    own, of_cells = np.random.default_rng(99), np.random.default_rng(98)
    numbers = own.permutation(7 * len(order))[: len(order)] + 5_000_000
    cell_numbers = of_cells.permutation(5 * len(rows))[: len(rows)] + 300
    return Mesh(mesh.nodes[order], {kind: place[cells[rows]]},
                node_sets={name: place[nodes] for name, nodes in mesh.node_sets.items()},
                node_numbers=numbers[order], cell_numbers={kind: cell_numbers[rows]})  # fmt: skip


def bar(mesh, keep=()):
    ends = [Interface("left", "rigid", mesh.node_sets["left"], np.array([0.0, 0.02, 0.02]))]
    body = cms.couple(solid_body(mesh, SOFT, name="bar", units=UNITS, interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=4), keep=keep)


PLAIN = box_mesh(6, 1, 1, 1.0, 0.04, 0.04, "hexahedron20")


@pytest.fixture(scope="module")
def bars():
    """Two numberings of one mesh: the same number stands at the same place, in another row."""
    return [bar(renumbered(PLAIN, seed), keep=["right"]) for seed in (1, 2)]


def swinging(reduced, *sensors, stiffening="auto"):
    body = FlexibleBody("bar", reduced, stiffening=stiffening)
    pin = RevoluteJoint("pin", Marker(GROUND), Marker("bar", "left"), axis=(0, 1, 0))
    return System([body], [pin], [Gravity((0.0, 0.0, -9.81))], sensors=sensors)


def ran(system):
    return integrate(system, GeneralizedAlpha(), 0.05, 1e-3)


@pytest.fixture(scope="module")
def motions(bars):
    systems = [swinging(each) for each in bars]
    return [(system, ran(system)) for system in systems]


def at(position, mesh):
    return int(np.flatnonzero(np.abs(mesh.nodes - position).max(axis=1) < 1e-9)[0])


def test_a_sensor_by_number_is_the_one_by_coordinates_in_another_numbering(motions):
    mesh = renumbered(PLAIN, 1)
    place = (1.0, 0.04, 0.04)
    number = int(mesh.node_numbers[at(place, mesh)])
    for make in (
        lambda **where: PlaceSensor("s", Marker("bar", **where), "acceleration"),
        lambda **where: PlaceSensor("s", Marker("bar", **where), "angular-velocity"),
        lambda **where: DisplacementSensor("s", Marker("bar", **where)),
        lambda **where: StressSensor("s", "bar", **where),
        lambda **where: StrainGauge("s", "bar", (1, 0, 0), 2.1e9, 0.3, **where),
    ):
        by_number = make(node=number).measure(*motions[0]).columns
        by_place = make(position=place).measure(*motions[1]).columns
        for name, values in by_number.items():
            assert np.abs(values).max() > 0 or name == "y"
            assert_allclose(values, by_place[name], rtol=0, atol=1e-6 * max(np.abs(v).max() for v in by_place.values()))


def test_an_element_and_a_set_are_the_mean_of_their_kept_nodes(bars, motions):
    mesh, (system, motion) = renumbered(PLAIN, 1), motions[0]
    right = DisplacementSensor("s", Marker("bar", set="right")).measure(system, motion).columns
    markers = [Marker("bar", node=int(mesh.node_numbers[node])) for node in mesh.node_sets["right"]]
    single = [DisplacementSensor("s", marker).measure(system, motion).columns["z"] for marker in markers]
    assert_allclose(right["z"], np.mean(single, axis=0), rtol=0, atol=1e-14)
    row = int(np.argmax(mesh.nodes[mesh.cells["hexahedron20"]][:, :, 0].mean(axis=1)))  # the cell at the end
    element = int(mesh.cell_numbers["hexahedron20"][row])
    found = cms.body.Address(element=element).find(bars[0], "test")
    assert set(found.names) == {str(mesh.node_numbers[node]) for node in mesh.cells["hexahedron20"][row]}


def test_the_hot_spot_has_the_number_of_its_node_in_the_mesh(bars):
    mesh = renumbered(PLAIN, 1)
    hot = at((0.5, 0.04, 0.0), mesh)
    row = int(np.flatnonzero(bars[0].numbering.nodes == mesh.node_numbers[hot])[0])
    stress = np.zeros((len(bars[0].nodes), 6, bars[0].n_q))
    stress[:, 0] = 1.0
    stress[row, 0] = 5.0
    system = swinging(replace(bars[0], stress=stress))
    motion = ran(system)
    found = VonMisesSensor("vm", "bar").measure(system, motion)
    assert found.units["node"] == "number in the mesh"
    assert set(found.columns["node"][1:]) == {float(mesh.node_numbers[hot])}
    assert found.places == (f"largest at node {mesh.node_numbers[hot]} at [0.5, 0.04, 0]",)
    at_element = StressSensor("s", "bar", set="right").measure(system, motion).columns["von Mises"]
    assert_allclose(5 * at_element, found.columns["largest"], rtol=1e-9)
    assert list(found.quantities) == ["largest"]
    row = sensors_record(replace(system, sensors=(VonMisesSensor("vm", "bar"),)), motion)["vm largest"]
    at_peak = int(np.argmax(found.columns["largest"]))
    assert row["peak"] == {"t": float(motion.t[at_peak]), "node": int(mesh.node_numbers[hot])}
    without = swinging(replace(bars[0], stress=stress, numbering=Numbering()))
    assert list(VonMisesSensor("vm", "bar").measure(without, motion).quantities) == ["largest"]
    assert VonMisesSensor("vm", "bar").measure(without, motion).units["node"] == "index in the model, from 0"


def test_a_sensor_at_a_node_of_a_line_is_an_interface_there():
    """Before, it took a point of the skin, half the height of the section away."""
    mesh = replace(straight_line((0, 0, 0), (1, 0, 0), 8), node_numbers=10 * np.arange(1, 10))
    ends = [line_interface(mesh, name, NodeIndices((k,))) for name, k in (("left", 0), ("middle", 5))]
    body = cms.couple(
        beam_body(mesh, BeamProperty(Rectangle(0.04, 0.04), SOFT), name="bar", units=UNITS, interfaces=ends)
    )
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=4))
    place = tuple(reduced.frame.origin + reduced.frame.axes @ reduced.interface("middle").position)
    system = swinging(reduced, PlaceSensor("a", Marker("bar", node=60), "acceleration"),
                      PlaceSensor("w", Marker("bar", position=place), "angular-velocity"),
                      StressSensor("s", "bar", node=60), stiffening=False)  # fmt: skip
    motion = ran(system)
    exact = interface_motion(motion, "bar", reduced, "middle")
    found = measured(system, motion)
    for name, values in (("a", exact.acceleration), ("w", exact.omega)):
        ours = np.stack([found[name].columns[axis] for axis in "xyz"], axis=1)
        assert_allclose(ours, values, rtol=0, atol=1e-9 * np.abs(values).max())
    assert found["s"].columns["von Mises"].max() > 0  # of the skin: a line itself has no stress
    assert sensor_points(system)["a"] == ("node 60 at [0.625, 0, 0]",)
    local = reduced.interface("middle").position
    assert_allclose(point_motion(motion, "bar", local, reduced=reduced).omega, exact.omega, rtol=0, atol=1e-9)


def test_elongation_between_numbers_is_that_between_places(motions):
    mesh = renumbered(PLAIN, 1)
    ends = [(0.5, 0.0, 0.04), (1.0, 0.0, 0.04)]
    numbers = [cms.body.Address(node=int(mesh.node_numbers[at(place, mesh)])) for place in ends]
    found = ElongationSensor("e", "bar", *numbers).measure(*motions[0]).columns["strain"]
    assert_allclose(
        found, ElongationSensor("e", "bar", *ends).measure(*motions[1]).columns["strain"], rtol=0, atol=1e-10
    )


@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (PlaceSensor("s", Marker("bar", node=3)), "sensor 's': marker: body 'bar': no node 3 among the"),
        (PlaceSensor("s", Marker("bar", set="rigth")), "no set 'rigth'; did you mean 'right'"),
        (StressSensor("s", "bar", element=2), "no element 2 behind the surface"),
        (PlaceSensor("s", Marker("bar", position=(0.5, 0.0, 0.0)), "rotation-vector"), "keeps no rotation; keep it"),
        (
            PlaceSensor("s", Marker("bar", position=(0.52, 0.0, 0.0))),
            r"within 0.001 of the body size .* nearest: node \d+ at",
        ),
        (
            StrainGauge("s", "bar", (1, 0, 0), 1.0, 0.3, position=(0.52, 0, 0)),
            "or allow a greater distance by tolerance",
        ),
    ],
)
def test_what_is_not_there_is_refused(motions, sensor, words):
    with pytest.raises(ModelError, match=words):
        sensor.measure(*motions[0])


def test_a_joint_at_a_kept_node_is_refused(bars):
    joint = FixedJoint("weld", Marker(GROUND), Marker("bar", set="right"))
    with pytest.raises(ModelError, match="needs an interface and no set"):
        ran(System([FlexibleBody("bar", bars[0])], [joint]))
    with pytest.raises(ModelError, match="expected one place, got interface and node"):
        Marker("bar", "left", node=3)


FILE = """
[bodies.bar]
file = "bar.h5"

[joints.pin]
type = "revolute"
body_a = "ground"
marker_a = [0.0, 0.0, 0.0]
body_b = "bar"
marker_b = "left"
axis = [0.0, 1.0, 0.0]

[sensors.tip]
type = "position"
body = "bar"
node = {number}

[sensors.near]
type = "acceleration"
body = "bar"
marker = [1.0, 0.0, 0.01]
tolerance = 0.05

[sensors.hot]
type = "von-mises"
body = "bar"
set = "right"

[sensors.gauge]
type = "elongation"
body = "bar"
position_a = {{node = {number}}}
position_b = [0.5, 0.0, 0.04]

[sensors.turn]
type = "angle"
body_a = "ground"
body_b = "bar"
marker_b = {{set = "right"}}
axis = [0.0, 1.0, 0.0]

[system]
name = "swing"
units = "m-kg-s"
gravity = [0.0, 0.0, -9.81]

[run]
t_end = 0.01
h = 1e-3
"""


def test_the_file_of_a_system_names_nodes_sets_and_elements_and_its_run_says_which_it_took(bars, tmp_path):
    mesh = renumbered(PLAIN, 1)
    number = int(mesh.node_numbers[at((1.0, 0.0, 0.04), mesh)])
    cms.write(bars[0], tmp_path / "bar.h5")
    (tmp_path / "bar.toml").write_text(FILE.format(number=number))
    done = run_floatframe("run", tmp_path / "bar.toml", "-o", tmp_path / "out.h5", code=0)
    places = read_results(tmp_path / "out.h5").head.places
    assert places["tip"] == (f"node {number} at [1, 0, 0.04]",)
    assert places["near"][0].startswith("[1, 0, 0.01]: node")
    assert places["near"][0].endswith("0.01 away")
    assert places["hot"] == ("set 'right': 8 nodes about [1, 0.02, 0.02]",)
    assert len(places["gauge"]) == 2
    assert "Places of sensors" in done.output
    assert str(number) in done.output
    (tmp_path / "bar.toml").write_text(FILE.format(number=number).replace("tolerance = 0.05", ""))
    refused = run_floatframe("run", tmp_path / "bar.toml", "-o", tmp_path / "out.h5")
    assert refused.exit_code != 0
    assert "keep" in refused.output


def test_pictures_name_the_node_with_the_largest_stress(motions):
    """In the caption of a film, over the panel of the sensor: the number that the sensor itself tells."""
    system, run = motions[0]
    reduced = system.body("bar").reduced
    told = VonMisesSensor("vm", "bar").measure(system, run)
    hot = int(told.columns["node"][told.columns["largest"].argmax()])
    times = film_times(run.t, fps=20.0, speed=0.05)
    scene = motion_scene(run, {"bar": reduced}, times, color=VON_MISES, system=system)
    q = run.body("bar").q[times.rows]
    largest = VON_MISES.values(reduced, q).max(axis=0)
    assert f"largest stress at node {reduced.node_name(int(largest.argmax()))}" in scene.captions[0]
    assert "largest stress" not in motion_scene(run, {"bar": reduced}, times, system=system).captions[0]
    assert f"largest at node {hot}" in plot_measurement(told).get_title()
