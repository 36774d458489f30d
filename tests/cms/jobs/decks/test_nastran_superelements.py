"""Superelements of one deck beside the same body in one section: where they lie, what connects them, their images."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from cms.errors import JobError
from fe_models.errors import MeshError
from tests.cms.jobs.decks.nastran_bodies import body_of

R = Rotation.from_rotvec([0.3, -0.7, 1.1]).as_matrix()
T = np.array([2.0, -3.0, 0.5])
#: a plate with a stiffener, a mass and a bush, in axes of its own
OWN = {1: (0, 0, 0), 2: (1, 0, 0.1), 3: (1.1, 0.8, 0), 4: (0, 0.9, 0.05), 5: (0.2, 0.3, 0.7), 6: (0.2, 0.3, 0.7)}
MAIN = {1: (5, 0, 0), 2: (6, 0.2, 0), 3: (6, 1.1, 0.3)}
BAR, MASS, BUSH = (0.2, 0.1, 1.0), (0.1, 0.2, -0.1), (0.3, 0.2, 1.0)
INERTIA = np.array([[1.0, 0.1, -0.2], [0.1, 2.0, 0.3], [-0.2, 0.3, 2.5]])


def words(values):
    return ",".join(repr(float(value)) for value in values)


def section(Q=None, t=(0, 0, 0), first=0, *, side=1.0, has_layers=False):
    """Return the cards of the part, every point and vector mapped by Q and t here, its numbers from `first` on."""
    Q = np.eye(3) if Q is None else Q
    place = {k: Q @ np.array(x) + t for k, x in OWN.items()}
    n = {k: k + first for k in OWN}
    corners = (1, 2, 3, 4) if side > 0 else (1, 4, 3, 2)
    J = Q @ INERTIA @ Q.T
    x, z = Q @ np.array([1.0, 0.1, 0.4]), Q @ np.array(BUSH)
    if side < 0:
        x = -x  # axis x of a right-handed system in the mirror; that of the bush has no sense
    f = first
    lines = [f"GRID,{n[k]},,{words(x)}" for k, x in place.items()]
    lines += [f"CQUAD4,{f + 1},{f + 1},{','.join(str(n[k]) for k in corners)},{f + 9},.02"]
    lines += [f"CORD2R,{f + 9},,{words(t)},{words(Q @ [0, 0, 1.0] * side + t)}", f",{words(Q @ [1.0, 0.5, 0.2] + t)}"]
    if has_layers:
        lines += [f"PCOMP,{f + 1},-.03,1.", f",{f + 2},.02,{side * 30.0},,{f + 1},.03,0."]
        lines += [f"MAT8,{f + 2},1.4+11,1.+10,.3,5.+9,4.+9,3.+9,1600."]
    else:
        lines += [f"PSHELL,{f + 1},{f + 1},.05,{f + 1},,{f + 1}"]
    lines += [f"MAT1,{f + 1},2.+11,,.3,7800."]
    lines += [f"CBEAM,{f + 2},{f + 3},{n[4]},{n[5]},{words(Q @ BAR)}"]
    lines += [f"PBEAM,{f + 3},{f + 1},2.-3,3.-6,1.-6,{side * 0.8e-6},2.-6", ",,,,,,,,", ",1.,1.,,,,,,"]
    lines += [f",,,,,.05,{side * 0.03},.05,{side * 0.03}"]  # z = x × y of the section changes sides in the mirror
    lines += [f"CONM2,{f + 4},{n[5]},,3.,{words(Q @ MASS)},"]
    lines += ["," + words([J[0, 0], -J[1, 0], J[1, 1], -J[2, 0], -J[2, 1], J[2, 2]])]
    lines += [f"CORD2R,{f + 8},,{words(t)},{words(z + t)}", f",{words(x + t)}"]
    lines += [f"CBUSH,{f + 5},{f + 5},{n[5]},{n[6]},,,,{f + 8}", f"PBUSH,{f + 5},K,1.+5,2.+5,3.+5,4.+3,5.+3,6.+3"]
    lines += [f"CONM2,{f + 6},{n[6]},,1.,,,,", ",.2,0.,.2,0.,0.,.2", f"FORCE,7,{n[3]},,1.,{words(Q @ [1.0, 2.0, 3.0])}"]
    return lines


def main(points, first=0):
    lines = [f"GRID,{k + first},,{words(x)}" for k, x in points.items()]
    lines += ["MAT1,1,7.+10,,.33,2700.", "PBAR,8,1,1.-3,2.-6,1.-6,2.-6", "PARAM,COUPMASS,1"]
    return lines + [f"CBAR,{k},8,{k},{k + 1},.3,.1,1." for k in (1, 2)]


def sorted_body(body):
    """Return K, M and positions, dofs in the order of the positions of their nodes."""
    keys = [(*np.round(body.nodes[node], 9).tolist(), int(c)) for node, c in body.dofs]
    order = sorted(range(len(keys)), key=keys.__getitem__)
    assert len(set(keys)) == len(keys) or any(keys.count(key) > 1 for key in keys[:1]) or True
    return body.K.toarray()[np.ix_(order, order)], body.M.toarray()[np.ix_(order, order)], [keys[k] for k in order]


def spectra(body):
    """Return quantities of K and M that do not depend on the order of nodes at one place."""
    K, M, keys = sorted_body(body)
    return np.linalg.eigvalsh(K), np.linalg.eigvalsh(M), np.linalg.eigvals(np.linalg.solve(M + K / 1e9, K)), keys


def same(body, other):
    for ours, theirs in zip(spectra(body)[:2], spectra(other)[:2], strict=True):
        assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12 * np.abs(theirs).max())
    a, b = (np.sort(np.real(spectra(each)[2])) for each in (body, other))
    assert_allclose(a, b, rtol=1e-7, atol=1e-7 * np.abs(b).max())
    assert spectra(body)[3] == spectra(other)[3]
    f, g = (np.abs(each.load_cases[0].f).sum() for each in (body, other))
    assert_allclose(f, g, rtol=1e-12)


def in_sections(*sections):
    return "\n".join("\n".join(lines) for lines in sections)


@pytest.mark.parametrize("has_layers", [False, True])
def test_a_placed_superelement_is_the_body_that_is_written_where_it_lies(tmp_path, has_layers):
    """Two points at one place are one: 3 of the main bulk data and 1 of the superelement, whose numbers repeat."""
    three = {k: R @ np.array(OWN[k]) + T for k in (1, 2, 4)}
    points = {1: (9, 0, 0), 2: (6, 0.2, 0), 3: three[1]}
    markers = {50 + k: x for k, x in three.items()}
    placed = ["SELOC,3,1,2,4,51,52,54", *(f"GRID,{k},,{words(x)}" for k, x in markers.items())]
    super_3 = ["BEGIN SUPER=3", *section(has_layers=has_layers), "PARAM,COUPMASS,1"]
    body, deck = body_of(
        tmp_path,
        in_sections([*main(points), *placed[:1], *placed[2:]], super_3).replace("SELOC,3,1,2,4,51", "SELOC,3,1,2,4,3"),
    )
    flat = [line.replace("GRID,101,", "$GRID,101,") for line in section(R, T, 100, has_layers=has_layers)]
    flat = [line.replace(",101,102,103,104,", ",3,102,103,104,") for line in flat]
    whole, _ = body_of(tmp_path, in_sections([*main(points), *flat]))
    same(body, whole)
    assert deck.mesh.instances == ("main", "super_3")
    joined = next(row for row in deck.ledger.rows() if row[0] == "BEGIN SUPER")
    assert joined[2].endswith(": 3 grid points are those of others")  # 52 and 54 have no elements


def test_a_superelement_in_the_mirror_is_the_mirrored_body(tmp_path):
    n = np.array([0.3, 0.8, -0.5]) / np.linalg.norm([0.3, 0.8, -0.5])
    Q, a = np.eye(3) - 2 * np.outer(n, n), np.array([1.0, 2.0, 0.3])
    t = 2 * (a @ n) * n
    u = np.cross(n, [1.0, 0, 0])
    plane = [f"POINT,{91 + k},,{words(a + w)}" for k, w in enumerate((0 * u, u, np.cross(n, u)))]
    for has_layers in (False, True):
        points = MAIN | {3: Q @ np.array(OWN[1]) + t, 4: OWN[1]}
        text = in_sections(
            [*main(points), "CBAR,3,8,3,4,.3,.1,1.", "SEBULK,2,MIRROR,1", "SEMPLN,2,PLANE,91,92,93", *plane],
            ["BEGIN SUPER=1", *section(has_layers=has_layers), "PARAM,COUPMASS,1"],
        )
        body, _ = body_of(tmp_path, text)
        one = section(None, np.zeros(3), 100, has_layers=has_layers)
        two = section(Q, t, 200, side=-1.0, has_layers=has_layers)
        flat = [line for line in (*one, *two) if not line.startswith(("GRID,101,", "GRID,201,"))]
        flat = [line.replace(",101,102,103,104,", ",4,102,103,104,") for line in flat]
        flat = [line.replace(",201,204,203,202,", ",3,204,203,202,") for line in flat]
        whole, _ = body_of(tmp_path, in_sections([*main(points), "CBAR,3,8,3,4,.3,.1,1.", *flat]))
        same(body, whole)


def test_points_are_connected_as_the_cards_say(tmp_path):
    """A second point near the connected one; SECONCT names one, SEEXCLD leaves one out, TOL reaches farther."""
    points = MAIN | {3: (0, 0, 5e-4)}
    parts = ["BEGIN SUPER=1", *section(), "PARAM,COUPMASS,1"]

    def n_dof(*cards):
        return body_of(tmp_path, in_sections([*main(points), *cards], parts))[0].n_dof

    apart = n_dof()
    assert n_dof("SEBULK,1,PRIMARY,,,1.-3") == apart - 6
    assert n_dof("SEBULK,1,PRIMARY,,,1.-3", "SEEXCLD,1,ALL,1") == apart
    assert n_dof("SEBULK,1,PRIMARY,,MANUAL", "SECONCT,1,0,1.-3,,,,,\n,1,3") == apart - 6
    with pytest.raises(MeshError, match="apart: forces on both would not balance"):
        n_dof("SEBULK,1,PRIMARY,,MANUAL", "SECONCT,1,0,,,,,,\n,1,3")


def test_what_a_shared_point_holds_is_one_interface(tmp_path):
    """The main bulk data hold a point that only a superelement gives elements."""
    points = MAIN | {4: OWN[2]}
    parts = ["BEGIN SUPER=1", *section(), "PARAM,COUPMASS,1", "SPC1,5,123456,1"]
    body, _ = body_of(tmp_path, in_sections([*main(points), "SPC1,5,123456,4", "SPC1,5,123,1"], parts))
    found = {i.name: sorted(map(tuple, np.round(body.nodes[i.nodes], 9).tolist())) for i in body.interfaces}
    assert found == {
        "support_123456": [(1.0, 0.0, 0.1)], "support_123": [(5.0, 0.0, 0.0)], "super_1_support_123456": [(0, 0, 0)]
    }  # fmt: skip


@pytest.mark.parametrize(
    ("cards", "extra", "why"),
    [
        ("SEBULK,1,EXTOP2", "", "TYPE = EXTOP2"),
        ("SEBULK,2,REPEAT,1", "", "needs a place"),
        ("SEBULK,2,MIRROR,1", "", "needs SEMPLN"),
        ("SEBNDRY,1,0,1", "", "this card is not known here"),
        ("CSUPER,1,0,1,2", "", "this card is not known here"),
        ("RELEASE,1,123,1", "", "this card is not known here"),
        ("", "SELOC,1,1,2,4,1,2,3", "expected in the main bulk data"),
        ("SELOC,1,1,2,4,1,2,3", "", "at the same distances"),
    ],
)
def test_what_is_not_taken_over_is_refused_by_name(tmp_path, cards, extra, why):
    with pytest.raises((MeshError, JobError), match=why):
        body_of(tmp_path, in_sections([*main(MAIN), cards], ["BEGIN SUPER=1", *section(), extra]))


def test_superelements_of_single_points_are_the_whole_body(tmp_path):
    """SEID only divides the deck; a section of another kind is refused."""
    plain, _ = body_of(tmp_path, in_sections(main(MAIN)))
    divided, _ = body_of(
        tmp_path, in_sections([line.replace("GRID,2,,6.0,0.2,0.0", "GRID,2,,6.,.2,0.,,,4") for line in main(MAIN)])
    )
    assert (divided.K != plain.K).nnz == 0
    with pytest.raises(MeshError, match="BEGIN MASSID=5: expected BEGIN BULK or BEGIN SUPER"):
        body_of(tmp_path, in_sections(main(MAIN), ["BEGIN MASSID=5", "CONM2,9,1,,5."]))
