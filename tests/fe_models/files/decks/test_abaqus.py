"""Decks of Abaqus and CalculiX: what is in the record, what is in the ledger, what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.elements.beams.sections import Circle
from fe_models.errors import MeshError
from fe_models.files.decks.deck import DeckMaterial, LineSection, ShellSection, SolidSection
from fe_models.files.read_deck import parse_deck
from tests.bodies import box_mesh
from tests.decks import write_deck

DECK = """*HEADING
*NODE, NSET=NALL
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
20, 3, 0, 0
21, 4, 0, 0
22, 5, 0, 0
30, 0, 0, 5
*ELEMENT, TYPE=C3D8I, ELSET=block
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=S4R, ELSET=skin
2, 5, 6, 7, 8
*ELEMENT, TYPE=B32R, ELSET=arm
3, 20, 21, 22
*ELEMENT, TYPE=MASS, ELSET=lead
4, 30
*ELEMENT, TYPE=SPRINGA, ELSET=coil
5, 7, 20
*MASS, ELSET=lead
2.5
*SPRING, ELSET=coil

1000.
*NSET, NSET=foot
1, 2, 3, 4
*NSET, NSET=top
5, 6, 7, 8
*RIGID BODY, NSET=top, REF NODE=30
*EQUATION
2
20, 2, 1., 7, 2, -1.
*SOLID SECTION, ELSET=block, MATERIAL=Steel
*SHELL SECTION, ELSET=skin, MATERIAL=STEEL, OFFSET=0.5
0.1
*BEAM SECTION, ELSET=arm, MATERIAL=STEEL, SECTION=RECT
0.2, 0.3
0., 1., 0.
*MATERIAL, NAME=STEEL
*ELASTIC
210., .25
*DENSITY
7.8
*EXPANSION
1e-5
*BOUNDARY
foot, 1, 3
22, 2
*STEP
*STATIC
*CLOAD
20, 3, -4.
top, 1, 1.
*DLOAD
block, P1, 9.
block, GRAV, 9.81, 0., 0., -2.
*END STEP
"""


def deck_of(tmp_path, text=DECK, **options):
    path = tmp_path / "model.inp"
    path.write_text(text)
    return parse_deck(path, **options)


def numbers(deck, group):
    return sorted(deck.mesh.node_numbers[deck.mesh.node_sets[group]].tolist())


def test_a_deck_is_read_whole(tmp_path):
    deck = deck_of(tmp_path)
    assert deck.materials == {"STEEL": DeckMaterial("STEEL", 210.0, 0.25, 7.8)}
    assert deck.solids == (SolidSection("block", "STEEL", "incompatible", "consistent"),)
    assert deck.shells == (ShellSection("skin", "STEEL", 0.1, -0.05),)
    shape = {"shape": "rectangle", "width": 0.2, "height": 0.3}
    assert deck.lines == (LineSection("arm", "STEEL", shape, (0.0, 1.0, 0.0)),)
    assert [(numbers(deck, mass.nodes), mass.mass) for mass in deck.masses] == [([30], 2.5)]
    spring = deck.springs[0]
    assert [numbers(deck, group) for group in spring.nodes] == [[7], [20]]
    assert spring.stiffness == (1000.0, 0, 0, 0, 0, 0)
    assert_allclose(spring.triad[0], np.array([2, -1, -1]) / np.sqrt(6), rtol=1e-14)
    link = deck.rigid[0]
    assert (numbers(deck, link.node), numbers(deck, link.followers)) == ([30], [5, 6, 7, 8])
    terms = [(numbers(deck, group), component, a) for group, component, a in deck.equations[0].terms]
    assert terms == [([20], 1, 1.0), ([7], 1, -1.0)]
    supports = {support.name: (numbers(deck, support.nodes), support.components) for support in deck.supports}
    assert supports == {"foot": ([1, 2, 3, 4], (0, 1, 2)), "node_22": ([22], (1,))}


def test_loads_of_a_step_are_forces_pressures_and_gravity(tmp_path):
    forces, pressure, gravity = deck_of(tmp_path).loads
    assert forces.forces == {"node_20": (0, 0, -4.0, 0, 0, 0), "top": (1.0, 0, 0, 0, 0, 0)}
    deck = deck_of(tmp_path)
    faces = next(block for block in deck.mesh.blocks if pressure.faces in block.groups)
    assert (pressure.pressure, faces.kind) == (9.0, "quad")
    assert_array_equal(deck.mesh.node_numbers[faces.nodes], [[1, 2, 3, 4]])
    assert_allclose(gravity.acceleration, [0, 0, -9.81], rtol=1e-15)


def test_the_ledger_counts_what_is_not_taken_over_and_why(tmp_path):
    rows = deck_of(tmp_path).ledger.rows()
    assert ("*STATIC", "1", "belongs to the analysis, not to the body") in rows
    assert ("*EXPANSION", "1", "heat is not part of the body") in rows
    assert ("*DLOAD, GRAV", "1", "acts on the whole body, not on a set of elements") in rows


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*STEP", "*CONTACT PAIR, INTERACTION=I\na, b\n*STEP", r"1 \*CONTACT PAIR \(first: line"),
        ("*EXPANSION", "*PLASTIC", r"1 \*PLASTIC \(first: line 4\d\): the material is plastic"),
        ("*SHELL SECTION, ELSET=skin, MATERIAL=STEEL, OFFSET=0.5\n0.1\n", "", "1 S4R: elements without a section"),
        ("TYPE=S4R", "TYPE=CPS4R", "1 CPS4R: not an element of"),
        ("TYPE=C3D8I", "TYPE=C3D8X", "1 C3D8X .*: this element is not known here"),
        ("*STEP", "*ELEMENT, TYPE=D, ELSET=gas\n91, 0, 1, 2\n*STEP", "1 D: this element is not known here"),
        ("*ELASTIC\n", "*ELASTIC, TYPE=COUPLED\n", r"1 \*ELASTIC, TYPE=COUPLED"),
        ("*ELASTIC\n210., .25", f"*ELASTIC, TYPE=ENG\n{'1., ' * 3}{'0., ' * 3}1., 1.\n1.", "no ORIENTATION says"),
        ("*ELASTIC\n210., .25", f"*ELASTIC, TYPE=ORTHO\n{'0., ' * 6}1., 1.\n1.", "not positive definite"),
        ("SPRING, ELSET=coil", "SPRING, NONLINEAR, ELSET=coil", r"1 \*SPRING, NONLINEAR"),
        ("*RIGID BODY, NSET=top, REF NODE=30", "*TIE, NAME=t\nfoot, top", r"1 \*TIE .*not made of faces of solids"),
        ("SECTION=RECT", "SECTION=TRAPEZOID", "SECTION=TRAPEZOID: this shape is not known here"),
    ],
)
def test_mass_and_stiffness_are_never_left_out_unasked(tmp_path, old, new, words):
    assert old in DECK
    deck = deck_of(tmp_path, DECK.replace(old, new, 1))
    with pytest.raises(MeshError, match=words) as caught:
        deck.ledger.require_whole()
    assert "--leave-out" in str(caught.value)
    entry = next(each for each in deck.ledger.entries.values() if each.is_body)
    deck.ledger.require_whole([entry.name])
    with pytest.raises(MeshError, match="the deck has no such thing to be left out"):
        deck.ledger.require_whole([entry.name, "NOTHING"])


def test_elements_of_one_type_without_a_section_are_counted_together(tmp_path):
    more = "*ELEMENT, TYPE=S4R, ELSET=more\n91, 1, 2, 3, 4\n92, 1, 2, 6, 5\n"
    text = DECK.replace("*NSET, NSET=foot", more + "*NSET, NSET=foot")
    text = text.replace("*SHELL SECTION, ELSET=skin, MATERIAL=STEEL, OFFSET=0.5\n0.1\n", "")
    assert ("S4R", "3") in [row[:2] for row in deck_of(tmp_path, text).ledger.rows()]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("foot, 1, 3", "feet, 1, 3", r"\*BOUNDARY: unknown node set 'feet'; choices: FOOT, NALL, TOP"),
        ("ELSET=block, MAT", "ELSET=blok, MAT", r"\*SOLID SECTION: unknown element set 'blok'"),
        ("210., .25", "soft", r"\*ELASTIC: cannot be understood .*first line below: \['soft'\]"),
        ("20, 2, 1., 7, 2, -1.", "20, 2, 1., 99, 2, -1.", "names node 99, which is not in the deck"),
    ],
)
def test_damaged_decks_are_refused_with_place_and_reason(tmp_path, old, new, words):
    assert old in DECK
    with pytest.raises(MeshError, match=words):
        deck_of(tmp_path, DECK.replace(old, new, 1))


def test_the_same_deck_of_abaqus_has_other_masses(tmp_path):
    assert deck_of(tmp_path, program="abaqus").solids[0].mass == "lumped"
    with pytest.raises(MeshError, match="unknown program 'ansys'; expected one of calculix, abaqus"):
        deck_of(tmp_path, program="ansys")


def test_suffixes_that_are_no_deck_and_missing_files_are_refused(tmp_path):
    with pytest.raises(MeshError, match=r"unknown suffix '\.xyz'"):
        parse_deck(tmp_path / "a.xyz")
    with pytest.raises(MeshError, match="there is no such file"):
        parse_deck(tmp_path / "a.inp")


PART = """*PART, NAME=Bar
*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4, ELSET=body
1, 1, 2, 3, 4
*NSET, NSET=tip
4
*NSET, NSET=both, GENERATE
1, 2
*SOLID SECTION, ELSET=body, MATERIAL=STEEL
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=Bar-1, PART=bar
*END INSTANCE
*INSTANCE, NAME=Bar-2, PART=BAR
10., 0., 0.
10., 0., 0., 10., 0., 1., 90.
*END INSTANCE
*NODE
1, 5, 5, 5
*NSET, NSET=point
1
*NSET, NSET=feet, INSTANCE=Bar-1
1, 2
*NSET, NSET=feet, INSTANCE=Bar-2
tip
*RIGID BODY, NSET=Bar-2.both, REF NODE=point
*END ASSEMBLY
*MATERIAL, NAME=STEEL
*ELASTIC
210., .3
*BOUNDARY
feet, 1, 3
Bar-1.tip, 2
Bar-2.3, 1
"""


def test_instances_of_an_assembly_are_placed_and_keep_their_names(tmp_path):
    """Two instances of one part, the second moved by 10 along x, then turned by 90 degrees about z there."""
    deck = deck_of(tmp_path, PART)
    assert_allclose(deck.mesh.nodes[4:8], [[10, 0, 0], [10, 1, 0], [9, 0, 0], [10, 0, 1]], atol=1e-14)
    assert [(s.group, s.material) for s in deck.solids] == [("Bar-1.body", "STEEL"), ("Bar-2.body", "STEEL")]
    assert numbers(deck, "Bar-2.tip") == [14]
    link = deck.rigid[0]
    assert (numbers(deck, link.node), numbers(deck, link.followers)) == ([21], [11, 12])
    held = {s.name: (numbers(deck, s.nodes), s.components) for s in deck.supports}
    assert held == {"feet": ([1, 2, 14], (0, 1, 2)), "node_4": ([4], (1,)), "node_13": ([13], (0,))}
    assert any("BAR-2: numbers of the deck + 10" in words for _, _, words in deck.ledger.rows())
    with pytest.raises(MeshError, match=r"\*INSTANCE of an unknown part 'BAZ'; did you mean 'BAR'"):
        deck_of(tmp_path, PART.replace("PART=BAR", "PART=BAZ"))


def test_tied_nodes_follow_the_face_they_stand_on(tmp_path):
    """Rigid motions and a linear field of the master are met exactly at slaves anywhere on its faces."""
    mesh = box_mesh(2, 2, 1, kind="hexahedron20")
    path = write_deck(tmp_path / "tie.inp", mesh)
    rng = np.random.default_rng(4)
    spots = np.column_stack([rng.uniform(0, 1, (3, 2)), np.ones(3)])
    extra = "*NODE\n" + "".join(f"{900 + k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(spots.tolist()))
    extra += "903, .5, .5, 1.3\n904, .5, .9, 1.3\n905, .9, .9, 1.3\n906, .3, .3, 1.8\n"
    extra += "*ELEMENT, TYPE=C3D4, ELSET=upper\n500, 900, 901, 902, 903\n*NSET, NSET=slaves\n900, 901, 902, 903\n"
    extra += "*SURFACE, NAME=below, TYPE=NODE\nslaves\n*SURFACE, NAME=above\nall, S2\n*TIE, NAME=t\nbelow, above\n"
    path.write_text(path.read_text() + extra)
    deck = parse_deck(path)
    assert (
        "*TIE",
        "1",
        "slave nodes farther from the master surface than the tolerance: not tied",
    ) in deck.ledger.rows()
    assert len(deck.equations) == 9
    H, t = rng.normal(size=(3, 3)), rng.normal(size=3)
    u = deck.mesh.nodes @ H.T + t
    for equation in deck.equations:
        total = sum(a * u[deck.mesh.node_sets[group][0], c] for group, c, a in equation.terms)
        assert abs(total) < 1e-12


def test_parts_that_are_turned_turn_their_beams_and_keep_their_reference_nodes(tmp_path):
    """The local 1-direction of a beam belongs to its part; so does a reference node that is named by its number."""
    part = PART.replace("*END PART", "*NODE\n5, 2, 0, 0\n*ELEMENT, TYPE=B31, ELSET=arm\n2, 2, 5\n"
        "*BEAM SECTION, ELSET=arm, MATERIAL=STEEL, SECTION=RECT\n0.1, 0.2\n0., 1., 0.\n"
        "*RIGID BODY, NSET=both, REF NODE=3\n*END PART", 1)  # fmt: skip
    deck = deck_of(tmp_path, part.replace("*RIGID BODY, NSET=Bar-2.both, REF NODE=point\n", ""))
    first, second = deck.lines
    assert_allclose(first.orientation, [0, 1, 0])
    assert_allclose(second.orientation, [-1, 0, 0], atol=1e-15)
    assert [numbers(deck, link.node) for link in deck.rigid] == [[3], [13]]


def test_nodes_of_a_beam_with_an_offset_lie_off_its_centroid(tmp_path):
    """OFFSET1 = 0.5: the nodes are on the surface towards 1. CalculiX 2.20 writes the section from -0.2 to 0 there."""
    deck = deck_of(tmp_path, DECK.replace("SECTION=RECT", "SECTION=RECT, OFFSET1=0.5, OFFSET2=0.25"))
    assert_allclose(deck.lines[0].offset, [-0.1, -0.075])


def test_offsets_of_a_pipe_are_in_parts_of_its_diameter(tmp_path):
    """OFFSET1 = 0.5 of a pipe of radius 0.2 has the nodes on its surface, 0.2 from the centroid."""
    rectangle = DECK[DECK.index("SECTION=RECT") :].splitlines()[1]
    pipe = DECK.replace(f"SECTION=RECT\n{rectangle}", "SECTION=PIPE, OFFSET1=0.5, OFFSET2=-0.25\n0.2, 0.05")
    deck = deck_of(tmp_path, pipe)
    assert deck.lines[0].shape["shape"] == "tube"
    assert_allclose(deck.lines[0].offset, [-0.2, 0.1], rtol=1e-14)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("MASS, ELSET=lead\n4, 30", "MASS\n4, 30\n*ELSET, ELSET=lead\n4"),
        ("*ELEMENT, TYPE=MASS, ELSET=lead\n4, 30", "*ELEMENT, TYPE=MASS, ELSET=x\n4, 30\n*ELSET, ELSET=lead\n4"),
        ("*HEADING\n", "*HEADING\n*MASS, ELSET=lead\n2.5\n"),
    ],
)
def test_a_mass_is_found_by_any_set_and_in_any_order(tmp_path, old, new):
    text = DECK if "HEADING" not in old else DECK.replace("*MASS, ELSET=lead\n2.5\n", "")
    deck = deck_of(tmp_path, text.replace(old, new))
    assert [(numbers(deck, mass.nodes), mass.mass) for mass in deck.masses] == [([30], 2.5)]
    deck.ledger.require_whole()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*MASS, ELSET=lead\n2.5\n", "", "1 MASS: elements without a section"),
        ("*SPRING, ELSET=coil\n\n1000.\n", "", "1 SPRINGA: elements without a section"),
        ("*MASS, ELSET=lead\n", "*MASS, ELSET=lead, TYPE=ANISOTROPIC\n", r"1 \*MASS.*: a mass of its own"),
        ("*RIGID BODY, NSET=top, REF NODE=30",
         "*COUPLING, REF NODE=30, SURFACE=top, ORIENTATION=o, CONSTRAINT NAME=c\n*KINEMATIC\n1, 1",
         r"1 \*KINEMATIC.*: single components along axes of their own"),
        ("*RIGID BODY, NSET=top, REF NODE=30",
         "*COUPLING, REF NODE=30, SURFACE=top, CONSTRAINT NAME=c\n*DISTRIBUTING\n1, 3",
         r"1 \*DISTRIBUTING.*: of some components"),
    ],
)  # fmt: skip
def test_what_was_left_out_in_silence_is_refused(tmp_path, old, new, words):
    assert old in DECK
    with pytest.raises(MeshError, match=words):
        deck_of(tmp_path, DECK.replace(old, new)).ledger.require_whole()


def test_equations_and_forces_in_axes_of_their_nodes_are_turned_to_basic_axes(tmp_path):
    """A hinge pin in cylindrical axes about z through (0.5, 0): components of nodes 3 and 6 there, formed by hand."""
    extra = "*NSET, NSET=pin\n3, 6\n*TRANSFORM, NSET=pin, TYPE=C\n.5, 0., 0., .5, 0., 1.\n"
    extra += "*EQUATION\n2\n3, 1, 1., 6, 1, -2.\n2\n3, 2, 1., 6, 2, -3.\n"
    text = DECK.replace("20, 2, 1., 7, 2, -1.\n", "20, 2, 1., 7, 2, -1.\n" + extra)
    text = text.replace("*CLOAD\n20, 3, -4.\n", "*CLOAD\n3, 2, -4.\n")
    deck = deck_of(tmp_path, text)
    at = {name: int(deck.mesh.node_numbers[rows[0]]) for name, rows in deck.mesh.node_sets.items() if len(rows) == 1}
    u = {(6, c): value for c, value in enumerate((0.3, -0.7, 0.2))} | {(3, c): 0.0 for c in range(3)}
    u[3, 2] = 0.9
    turned = deck.equations[1:]
    assert len(turned) == 2
    for equation in turned:  # masters given, slaves follow
        (slave, c, a), *others = [(at[name], c, a) for name, c, a in equation.terms]
        assert slave == 3
        u[slave, c] = -sum(b * u[node, k] for node, k, b in others) / a
    radial = {3: np.array([0.5, 1.0]) / np.sqrt(1.25), 6: np.array([1.0, 0.0])}
    local = {}
    for node, e in radial.items():
        v = np.array([u[node, 0], u[node, 1]])
        local[node] = (e @ v, np.array([-e[1], e[0]]) @ v)
    assert_allclose(local[3], [2 * local[6][0], 3 * local[6][1]], rtol=1e-13)
    assert u[3, 2] == 0.9  # the axial motion stays free
    forces = deck.loads[0].forces
    assert_allclose(forces["node_3"][:3], -4 * np.array([-1.0, 0.5, 0.0]) / np.sqrt(1.25), rtol=1e-13)
    assert forces["node_6"] == (1.0, 0, 0, 0, 0, 0)  # of the set top: radial there
    with pytest.raises(MeshError, match="points a and b lie on one line"):
        deck_of(tmp_path, text.replace("TYPE=C\n.5, 0., 0., .5, 0., 1.", "TYPE=R\n1., 0., 0., 2., 0., 0."))
    deck = deck_of(tmp_path, text.replace("*EQUATION\n2\n3, 1, 1.", "*EQUATION\n2\n3, 2, 4., 6, 1, 1.\n2\n3, 1, 1."))
    assert any(name == "*EQUATION" and "the same twice" in why for name, _, why in deck.ledger.rows())


@pytest.mark.parametrize(("end", "radial"), [
    ("0., 0., 2.", (1, 0, 0)), ("0., 2., 0.", (0, 0, 1)), ("2., 0., 0.", (0, 1, 0)),
    ("3., 4., 0.", (-0.8, 0.6, 0)), ("0., 3., 4.", (0, -0.8, 0.6)),
])  # fmt: skip
def test_a_node_on_the_axis_has_the_radial_direction_that_calculix_takes(tmp_path, end, radial):
    """Node 1 is the first point of the axis; the expected directions are those of ccx 2.20 (`CLOAD` in a run of it)."""
    extra = f"*NSET, NSET=pin\n1\n*TRANSFORM, NSET=pin, TYPE=C\n0., 0., 0., {end}\n"
    text = DECK.replace("20, 2, 1., 7, 2, -1.\n", "20, 2, 1., 7, 2, -1.\n" + extra)
    text = text.replace("*CLOAD\n20, 3, -4.\n", "*CLOAD\n1, 1, -4.\n")
    assert_allclose(deck_of(tmp_path, text).loads[0].forces["node_1"][:3], -4 * np.array(radial), rtol=0, atol=1e-14)


def test_axes_turn_with_their_instance(tmp_path):
    """Bar-2 stands turned by 90 degrees about z at x = 10: axes of its material and of its nodes are those of Bar-1."""
    axes = "*ORIENTATION, NAME=grain\n1., 1., 0., 0., 1., 0.\n*SOLID SECTION, ORIENTATION=grain, ELSET"
    pin = "*TRANSFORM, NSET=tip, TYPE=C\n1., 0., 0., 1., 0., 1.\n*END PART"
    text = PART.replace("*SOLID SECTION, ELSET", axes).replace("*END PART", pin)
    text = text.replace("210., .3\n", "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n3., 2., 1., 0., 0., 0., 1., 1.\n1.\n")
    text = (
        text.replace("*ELASTIC\n*EL", "*EL") + "*STEP\n*STATIC\n*CLOAD\nBar-1.tip, 1, 2.\nBar-2.tip, 1, 2.\n*END STEP\n"
    )
    deck = deck_of(tmp_path, text)
    first, second = (deck.materials[solid.material].axes for solid in deck.solids)
    R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert_allclose(first, np.array([[1, 1, 0], [-1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2), atol=1e-14)
    assert_allclose(second, np.array(first) @ R.T, atol=1e-14)
    forces = deck.loads[0].forces
    assert_allclose(forces["node_4"][:3], [-2, 0, 0], atol=1e-14)
    assert_allclose(forces["node_14"][:3], [0, -2, 0], atol=1e-14)


def test_an_ellipse_is_between_the_circle_and_the_thin_strip(tmp_path):
    """Nearly a circle it has the numbers of our circle; a thin one along y has 9/10 of its area in shear, J = 4 Iy."""
    section = "SECTION=RECT\n0.2, 0.3\n"
    nearly = deck_of(tmp_path, DECK.replace(section, "SECTION=CIRC\n0.2, 0.2000001\n")).lines[0].shape
    circle = Circle(0.1).properties(0.25)
    numbers_ = [nearly[key] for key in ("area", "iy", "iz", "torsion", "shear_area_y", "shear_area_z")]
    expected = [circle.A, circle.Iy, circle.Iz, circle.J, circle.A_sy, circle.A_sz]
    assert_allclose(numbers_, expected, rtol=3e-6)
    thin = deck_of(tmp_path, DECK.replace(section, "SECTION=CIRC\n0.2, 0.0002\n").replace("210., .25", "210., 0."))
    shape = thin.lines[0].shape
    assert_allclose(shape["shear_area_y"], 0.9 * shape["area"], rtol=1e-4)
    assert_allclose([shape["iz"], shape["torsion"]], [shape["area"] * 0.01 / 4, 4 * shape["iy"]], rtol=1e-5)
    assert len(shape["outline"]) == 16


RIGID = "*RIGID BODY, NSET=top, REF NODE=30\n"


@pytest.mark.parametrize("program", ["calculix", "abaqus"])
def test_pinned_and_tied_nodes_apart_have_equal_displacements_without_a_lever(tmp_path, program):
    """Abaqus: PIN makes global displacements equal, TIE all six; a rotation of one moves the other not at all."""
    deck = deck_of(tmp_path, DECK.replace(RIGID, "*MPC\nPIN, 5, 30\nTIE, 6, 30\n"), program=program)
    terms = {tuple((*numbers(deck, group), c, a) for group, c, a in each.terms) for each in deck.equations[:-1]}
    assert terms == {((node, c, 1.0), (30, c, -1.0)) for node in (5, 6) for c in range(3)}
    assert [(numbers(deck, x.node), numbers(deck, x.followers), x.components) for x in deck.rigid] == [
        ([30], [6], (3, 4, 5))
    ]
    deck.ledger.require_whole()


def test_a_beam_between_nodes_is_rigid_in_abaqus_and_keeps_a_distance_in_calculix(tmp_path):
    text = DECK.replace(RIGID, "*MPC\nBEAM, top, 30\n")
    deck = deck_of(tmp_path, text, program="abaqus")
    assert [(numbers(deck, x.followers), x.components) for x in deck.rigid] == [([5, 6, 7, 8], (0, 1, 2, 3, 4, 5))]
    with pytest.raises(MeshError, match=r"1 \*MPC, BEAM .*CalculiX keeps the distance of the nodes alone"):
        deck_of(tmp_path, text).ledger.require_whole()
    with pytest.raises(MeshError, match=r"1 \*MPC, PIN .*: of nodes in pairs"):
        deck_of(tmp_path, DECK.replace(RIGID, "*MPC\nPIN, foot, top\n")).ledger.require_whole()


def test_a_set_of_an_instance_is_not_one_of_the_same_name_elsewhere(tmp_path):
    """Bar-1.feet is not the set `feet` of the assembly, of nodes or of elements."""
    for old, new in (("Bar-1.tip, 2", "Bar-1.feet, 2"), ("\ntip\n", "\npoint\n")):
        with pytest.raises(MeshError, match=r"unknown (node )?set 'B[Aa][Rr]-[12]\.(feet|POINT)'"):
            deck_of(tmp_path, PART.replace(old, new))
    surface = "*ELSET, ELSET=skin, INSTANCE=Bar-1\n1\n*SURFACE, NAME=s\nBar-2.skin, S1\n*END ASSEMBLY"
    tie = "*COUPLING, REF NODE=point, SURFACE=s, CONSTRAINT NAME=c\n*KINEMATIC\n1, 6\n*END ASSEMBLY"
    with pytest.raises(MeshError, match=r"unknown element set 'Bar-2\.skin'"):
        deck_of(tmp_path, PART.replace("*END ASSEMBLY", surface).replace("*END ASSEMBLY", tie))


def test_equations_and_couplings_of_parts_are_those_of_their_instances(tmp_path):
    """Bar-2 is turned by 90 degrees about z: what is x in the part is y there, and y is -x."""
    lines = "*EQUATION\n2\n1, 1, 1., tip,\n1, -2.\n3\n1, 2, 1., 2, 3, 4., 3, 1, 5.\n*MPC\nPIN, 2, 3\n"
    deck = deck_of(tmp_path, PART.replace("*END PART", lines + "*END PART"))
    terms = [equation.terms for equation in deck.equations]
    pins = [each for each in terms if each[0][0] in ("node_3", "node_13", "node_2", "node_12")]
    assert sorted({name for each in pins for name, _, _ in each}) == ["node_12", "node_13", "node_2", "node_3"]
    assert len(pins) == 6
    first, second, *turned = [each for each in terms if each not in pins]
    assert first == (("node_1", 0, 1.0), ("node_4", 0, -2.0))
    assert second == (("node_1", 1, 1.0), ("node_2", 2, 4.0), ("node_3", 0, 5.0))
    rows = [{term[:2]: term[2] / each[0][2] for term in each} for each in turned]
    expected = [
        {("node_11", 1): 1.0, ("node_14", 1): -2.0},
        {("node_11", 0): 1.0, ("node_12", 2): -4.0, ("node_13", 1): -5.0},
    ]
    for row, known in zip(sorted(rows, key=len), expected, strict=True):
        assert row == pytest.approx(known, abs=1e-12)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("*EQUATION\n3\n1, 1, 1., 2, 1, -1.\n", "expected a number of terms"),
        ("*EQUATION\ntip, 1, 1.\n", "expected a number of terms"),
        ("*MPC\nMEANROT, 1, 1, 1, 2, 2, 2, 3\n", "instance 'Bar-2' is moved"),
    ],
)
def test_constraints_of_parts_that_cannot_be_placed_are_refused(tmp_path, lines, words):
    with pytest.raises(MeshError, match=words):
        deck_of(tmp_path, PART.replace("*END PART", lines + "*END PART"))


@pytest.mark.parametrize("word", ["nan", "-inf", "1e999"])
def test_coordinates_that_are_no_numbers_are_refused(tmp_path, word):
    with pytest.raises(MeshError, match="expected finite coordinates"):
        deck_of(tmp_path, DECK.replace("4, 0, 1, 0", f"4, {word}, 1, 0"))


SPRING2 = "*ELEMENT, TYPE=SPRING2, ELSET=coil\n5, 7, 40\n"


@pytest.mark.parametrize(
    ("place", "components", "words"),
    [
        ("1, 1, 1", "5, 5", ""),
        ("1, 1, 1", "2", ""),
        ("1, 1, 1.5", "3, 3", ""),
        ("1, 1, 1.5", "2, 2", "1 SPRING2 .*nodes apart across the direction"),
        ("1, 1, 1", "2, 3", "1 SPRING2 .*: between different components"),
    ],
)
def test_springs_between_components_join_nodes_at_one_place(tmp_path, place, components, words):
    text = DECK.replace("30, 0, 0, 5\n", f"30, 0, 0, 5\n40, {place}\n")
    text = text.replace("*ELEMENT, TYPE=SPRINGA, ELSET=coil\n5, 7, 20\n", SPRING2)
    deck = deck_of(tmp_path, text.replace("*SPRING, ELSET=coil\n\n1000.", f"*SPRING, ELSET=coil\n{components}\n1000."))
    if words:
        with pytest.raises(MeshError, match=words):
            deck.ledger.require_whole()
        return
    deck.ledger.require_whole()
    (spring,) = deck.springs
    assert spring.nodes == ("node_7", "node_40")
    assert spring.stiffness == tuple(1000.0 * (k == int(components[0]) - 1) for k in range(6))
