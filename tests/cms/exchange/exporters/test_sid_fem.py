"""SID_FEM: a reader of its own, and the forces of a moving body from the accelerations of its points."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.exchange.programs.sid_fem import DIALECTS
from tests.cms.exchange.exporters.examples import stiffened
from tests.cms.exchange.exporters.small_bodies import cloud_body


def read_sid(text: str, *, column_last: bool) -> dict:
    """Terms by name, those of nodes by (number, name): (m0, m1 as row, column, q)."""
    found, node, name, term = {}, None, "", {}
    for line in text.splitlines()[1:]:
        words = line.split("=", 1)
        key = words[0].strip()
        if key == "new node":
            node = int(words[1])
        elif key == "end node":
            node = None
        elif len(words) == 1 and not key.startswith("end") and key not in ("part", "refmod", "frame"):
            name, term = key, {}
        elif key.startswith("end ") and key[4:].strip() == name:
            found[name if node is None else (node, name)] = term["m0"], term.get("m1")
            name = ""
        elif name and key in ("order", "nrow", "ncol", "nq", "nqn", "structure"):
            term[key] = int(words[1])
            if key == "structure":
                n, m, q = term["nrow"], term["ncol"], term["nq"]
                term["m0"] = np.eye(n) if term["structure"] == 4 else np.zeros((n, m))
                if term["order"]:
                    term["m1"] = np.zeros((n, m, q))
        elif name and (entry := re.match(r"m([01])\(([\d, ]+)\)", key)):
            at = tuple(int(i) - 1 for i in entry[2].split(","))
            at = (at[0], at[2], at[1]) if column_last and len(at) == 3 else at
            term[f"m{entry[1]}"][at] = float(words[1].replace("D", "E"))
        elif key == "mass":
            found["mass"] = float(words[1].replace("D", "E"))
    return found


def value(term, q):
    """m0 + sum q_l m1_l."""
    m0, m1 = term
    return m0 if m1 is None else m0 + m1 @ q


def written_terms(dialect, tmp_path, *, geometric=False, n_q=4):
    body, cloud = cloud_body(n_q=n_q)
    body = stiffened(body) if geometric else body
    cms.exchange.export_body(body, tmp_path / "b.SID_FEM", to=dialect, units=body.units)
    text = (tmp_path / "b.SID_FEM").read_text()
    return body, cloud, read_sid(text, column_last=DIALECTS[dialect].column_last), text


def inertia_of(terms, q):
    J = value(terms["J"], q)
    if J.shape == (3, 3):
        return J
    xx, yy, zz, xy, xz, yz = J[:, 0]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@pytest.mark.parametrize("dialect", DIALECTS)
def test_forces_of_a_motion_are_those_of_its_points(dialect, tmp_path):
    """d'Alembert, point by point: (force, torque, modal forces) = sum (1, rho ×, phiᵀ) m acceleration.

    Deformed body for the modal forces, whose terms are exact; the undeformed one for the torque, of which the
    standard holds the first order.
    """
    body, cloud, terms, _ = written_terms(dialect, tmp_path)
    rng = np.random.default_rng(11)
    n = body.n_q
    a, alpha, omega = rng.normal(size=(3, 3))
    q_dot, q_ddot = rng.normal(size=(2, n))
    Omega = np.array([omega[i] * omega[j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))])
    for q in (np.zeros(n), rng.normal(size=n)):
        rho = cloud.c + cloud.phi @ q
        u_dot, u_ddot = cloud.phi @ q_dot, cloud.phi @ q_ddot
        acceleration = (
            a + np.cross(alpha, rho) + np.cross(omega, np.cross(omega, rho)) + 2 * np.cross(omega, u_dot) + u_ddot
        )
        inertial = cloud.mass[:, None] * acceleration
        mdCM, Ct, Cr = value(terms["mdCM"], q)[:, 0], value(terms["Ct"], q), value(terms["Cr"], q)
        Ge = terms["Ge"][0].reshape(n, n, 3)  # column 3 l + axis
        modal = Ct @ a + Cr @ alpha + value(terms["Me"], q) @ q_ddot + value(terms["Oe"], q) @ Omega
        modal += np.einsum("kla,a,l->k", Ge, omega, q_dot)
        assert_allclose(modal, np.einsum("ick,ic->k", cloud.phi, inertial), rtol=0, atol=1e-10)
        force = terms["mass"] * a + np.cross(alpha, mdCM) + Ct.T @ q_ddot
        force += np.cross(omega, np.cross(omega, mdCM)) + 2 * np.cross(omega, Ct.T @ q_dot)
        assert_allclose(force, inertial.sum(axis=0), rtol=0, atol=1e-10)
        if not q.any():
            Gr = value(terms["Gr"], q).reshape(3, n, 3)  # three columns a mode
            J = inertia_of(terms, q)
            torque = np.cross(mdCM, a) + J @ alpha + Cr.T @ q_ddot + np.cross(omega, J @ omega)
            torque += np.einsum("akb,k,b->a", Gr, q_dot, omega)
            assert_allclose(torque, np.cross(rho, inertial).sum(axis=0), rtol=0, atol=1e-10)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_gr_is_exact_for_deformed_bodies_too(dialect, tmp_path):
    """The Coriolis torque 2 sum m rho × (omega × u_dot)."""
    body, cloud, terms, _ = written_terms(dialect, tmp_path)
    rng = np.random.default_rng(12)
    omega, q, q_dot = rng.normal(size=3), rng.normal(size=body.n_q), rng.normal(size=body.n_q)
    rho = cloud.c + cloud.phi @ q
    expected = 2 * (cloud.mass[:, None] * np.cross(rho, np.cross(omega, cloud.phi @ q_dot))).sum(axis=0)
    Gr = value(terms["Gr"], q).reshape(3, body.n_q, 3)
    assert_allclose(np.einsum("akb,k,b->a", Gr, q_dot, omega), expected, rtol=0, atol=1e-11)


def test_the_dialects_say_the_same_in_their_orders(tmp_path):
    *_, first, text_1 = written_terms("sid_fem", tmp_path)
    *_, second, text_2 = written_terms("sid_fem-fembeam", tmp_path)
    assert "m1=row,q,col" in text_1.splitlines()[0]
    assert "m1=row,col,q" in text_2.splitlines()[0]
    for name in ("Ct", "Cr", "Gr", "Ge", "Oe", (1, "AP"), (2, "origin")):
        for a, b in zip(first[name], second[name], strict=True):
            assert_array_equal(a, b) if a is not None else None
    assert first["J"][0].shape == (6, 1)
    assert second["J"][0].shape == (3, 3)
    q = np.arange(4.0)
    assert_allclose(inertia_of(first, q), inertia_of(second, q), rtol=1e-15)


def test_nodes_turn_with_psi_and_stiffening_enters_as_the_standard_has_it(tmp_path):
    body, _, terms, _ = written_terms("sid_fem", tmp_path, geometric=True)
    rng = np.random.default_rng(4)
    q, n, K = rng.normal(size=body.n_q), body.n_q, body.geometric
    interface = body.interfaces[1]
    assert_array_equal(terms[2, "psi"][0], interface.Psi[3:])
    small = value(terms[2, "AP"], q) - np.eye(3)
    assert_allclose(small @ [1.0, 2, 3], np.cross(interface.Psi[3:] @ q, [1.0, 2, 3]), rtol=0, atol=1e-13)
    # modal force -K_geo q of a motion, split over Ct, Cr, Oe and phi, psi of the interface
    plain = written_terms("sid_fem", tmp_path)[2]
    a, alpha, omega, wrench = (rng.normal(size=size) for size in (3, 3, 3, 6))
    Omega = np.array([omega[i] * omega[j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))])
    found = (value(terms["Ct"], q) - value(plain["Ct"], q)) @ a + (
        value(terms["Cr"], q) - value(plain["Cr"], q)
    ) @ alpha
    found += (value(terms["Oe"], q) - value(plain["Oe"], q)) @ Omega
    found -= (value(terms[2, "phi"], q) - terms[2, "phi"][0]).T @ wrench[:3]
    found -= (value(terms[2, "psi"], q) - terms[2, "psi"][0]).T @ wrench[3:]
    full = np.zeros((3, 3, n, n))
    for (i, j), matrix in zip(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)), K.spin, strict=True):
        full[i, j] = full[j, i] = matrix
    K_geo = np.einsum("a,akl->kl", a, K.translation) + np.einsum("a,akl->kl", alpha, K.rotation)
    K_geo += np.einsum("a,b,abkl->kl", omega, omega, full) + np.einsum("c,ckl->kl", wrench, K.interfaces[1])
    assert_allclose(found, K_geo @ q, rtol=0, atol=1e-11)
