"""Results as tables, for pandas and xarray, and as pictures: motions, equilibria, modes, responses, comparisons."""

import ast
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from fe_models.foundation.documents.table import Table, Tabular
from floatframe.errors import ModelError
from floatframe.results.sensors import PlaceSensor
from tests.bodies import bar
from tests.import_graph import PACKAGES, files_of, statements, tree_of

FORCE = 30.0  #: vertical load on the arm [N]
STIFFNESS = 2000.0  #: of its hinge [N m/rad]
ARM = ff.System(
    [ff.RigidBody("arm", 1.5, np.diag([0.01, 0.2, 0.2]), center_of_mass=np.array([1.0, 0, 0]))],
    [ff.RevoluteJoint("pin", ff.Marker("ground"), ff.Marker("arm"), axis=np.array([0, 1.0, 0]))],
    [
        ff.PointForce("push", ff.Marker("arm", position=np.array([1.0, 0, 0])), np.array([0, 0, -FORCE])),
        ff.JointForce("spring", "pin", "angle", stiffness=STIFFNESS, damping=1.0),
    ],
    sensors=[PlaceSensor("tip", ff.Marker("arm", position=np.array([2.0, 0, 0])))],
    name="arm",
)


@pytest.fixture(scope="module")
def rest():
    return ff.static_equilibrium(ARM)


@pytest.fixture(scope="module")
def linear(rest):
    return ff.linearize(ARM, rest, inputs=["pin.angle"], outputs=["pin.angle", "tip z"])


@pytest.fixture(scope="module")
def reduced():
    body = cms.couple(bar())
    return cms.reduce(body, cms.craig_bampton(body, 4))


def test_every_result_with_a_table_has_the_same_for_pandas_and_xarray():
    found = {
        f"{path.name}: {node.name}": {ast.unparse(base) for base in node.bases}
        for package in PACKAGES
        for path in files_of(package)
        for node in statements(tree_of(path))
        if isinstance(node, ast.ClassDef) and node.name != "Tabular"
        and any(isinstance(part, ast.FunctionDef) and part.name == "to_table" for part in node.body)
    }  # fmt: skip
    assert len(found) > 9
    assert {name for name, bases in found.items() if "Tabular" not in bases} == set()


def assert_same(table, frame, dataset):
    """Compare the values and units of a table, a DataFrame and a Dataset."""
    frame = frame if frame.index.name is None else frame.reset_index()
    assert list(frame.columns) == list(table.names)
    assert frame.attrs["units"] == dict(table.units)
    for name in table.names:
        np.testing.assert_array_equal(frame[name].to_numpy(), table[name])
        np.testing.assert_array_equal(dataset[name].to_numpy(), table[name])
    assert {name: dataset[name].attrs["units"] for name in dataset.data_vars}.items() <= table.units.items()


def test_an_equilibrium_is_a_table_of_its_sensors_and_joints(rest):
    """Moment about the pin: the spring balances the load, k phi = F x, with x = cos(phi) at the point of the load."""
    table = rest.to_table("tip", "pin.angle", "pin")
    assert_same(table, rest.to_dataframe("tip", "pin.angle", "pin"), rest.to_xarray("tip", "pin.angle", "pin"))
    phi = table["pin.angle value"][0]
    assert_allclose(STIFFNESS * phi, FORCE * np.cos(phi), rtol=1e-8, atol=0)
    assert_allclose(table["tip z"], [-2 * np.sin(phi)], rtol=0, atol=1e-9)
    assert table.units["tip z"] == "m"
    assert_allclose(rest.motion.joint("pin").reaction.force[0], [0, 0, -FORCE], rtol=0, atol=1e-6)
    with pytest.raises(ModelError, match="its system is not known here"):
        replace(rest, system=None).to_table()


def test_an_equilibrium_draws_reactions_or_what_is_named_as_bars(rest):
    force, moment = rest.plot().axes
    assert (force.get_xlabel(), moment.get_xlabel()) == ("[N]", "[N m]")
    assert [label.get_text() for label in force.get_yticklabels()] == ["pin force"]
    assert_allclose(force.patches[0].get_width(), FORCE, rtol=1e-8)
    (ax,) = rest.plot("tip").axes
    assert [label.get_text() for label in ax.get_yticklabels()] == ["tip x", "tip z", "tip size"]


def test_modes_are_a_table_and_a_picture_of_eigenvalues(linear):
    modes = ff.system_modes(linear)
    assert_same(modes.to_table(), modes.to_dataframe(), modes.to_xarray())
    assert_allclose(modes.to_dataframe()["frequency"].to_numpy(), modes.frequencies)
    ax = modes.plot().axes[0]
    assert_allclose(ax.collections[0].get_offsets(), np.stack([modes.eigenvalues.real, modes.frequencies], axis=1))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("growth [1/s]", "frequency [Hz]")
    assert_allclose(modes.to_dataframe(time_unit=1e-3)["frequency"].to_numpy(), 1e3 * modes.frequencies)


def test_a_frequency_response_is_a_table_over_frequency(linear):
    found = ff.frequency_response(linear, np.array([1.0, 2.0, 5.0]))
    assert_same(found.to_table(), found.to_dataframe(), found.to_xarray())
    column = found.to_xarray()["tip z / pin.angle amplitude"]
    assert_allclose(column.to_numpy(), found.amplitudes[:, 1, 0])
    assert column.attrs["units"] == "m/(N m)"
    assert_allclose(found.to_dataframe().index.to_numpy(), found.frequencies)


def test_a_reduced_body_is_a_table_of_its_modes(reduced):
    assert_same(reduced.to_table(), reduced.to_dataframe(), reduced.to_xarray())
    assert reduced.to_dataframe()["energy from"].tolist() == list(reduced.labels)
    assert_allclose(reduced.to_table()["frequency"] * reduced.units.time, reduced.frequencies)


@pytest.mark.parametrize("damping", [None, 0.01])
def test_the_response_of_a_reduced_body_is_a_table_with_units(reduced, damping):
    found = cms.frf(reduced, [10.0, 20.0], damping=damping).between("left", "right")
    assert_same(found.to_table(), found.to_dataframe(), found.to_xarray())
    assert_allclose(found.to_dataframe()["right uy / left rz"].to_numpy(), found.H[:, 1, 5])
    force, length = reduced.units.force_symbol, reduced.units.length_symbol
    units = found.to_table().units
    assert units["right ux / left ux"] == f"{length}/{force}"
    assert units["right rz / left rz"] == f"rad/({force} {length})"


def test_a_table_without_index_has_the_numbers_of_its_rows():
    class Plain(Tabular):
        is_indexed = False

        def to_table(self):
            return Table({"set": ["a", "a"], "error": [1.0, 2.0]})

    assert Plain().to_dataframe().index.tolist() == [0, 1]
    assert list(Plain().to_xarray().dims) == ["row"]
