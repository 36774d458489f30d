"""Free rectangular Reissner-Mindlin plates by the Ritz method; the polynomials resolve the layers at the edges."""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.polynomial import legendre

DEGREE = 6


def free_plate_eigenvalues(lengths, t, material, n):
    """Return the lowest n elastic eigenvalues omega² of a free plate of two lengths and the thickness t, (n,)."""
    E, nu, rho = material.E, material.nu, material.rho
    H, D = 5 / 6 * E / (2 + 2 * nu) * t, E * t**3 / (12 - 12 * nu**2)
    (M_x, G_x, S_x), (M_y, G_y, S_y) = (line_integrals(strips(length, t / np.sqrt(10)), DEGREE) for length in lengths)
    mass, bend_x, bend_y = sp.kron(M_x, M_y), sp.kron(S_x, M_y), sp.kron(M_x, S_y)
    to_x, to_y = H * sp.kron(G_x, M_y), H * sp.kron(M_x, G_y)
    twist = D * (1 - nu) / 2
    coupled = nu * D * sp.kron(G_x, G_y.T) + twist * sp.kron(G_x.T, G_y)
    of_x, of_y = D * bend_x + twist * bend_y + H * mass, D * bend_y + twist * bend_x + H * mass
    K = sp.block_array([[H * (bend_x + bend_y), to_x, to_y], [to_x.T, of_x, coupled], [to_y.T, coupled.T, of_y]])
    M = sp.block_diag([rho * t * mass, rho * t**3 / 12 * mass, rho * t**3 / 12 * mass])
    size = D / (rho * t * max(lengths) ** 4)
    found = sla.eigsh(K.tocsc(), n + 3, M.tocsc(), sigma=-size, v0=np.ones(K.shape[0]), return_eigenvectors=False)
    return np.sort(found)[3:]


def strips(length, layer):
    """Return borders of intervals: four equal ones, and layers of the given length at both ends."""
    inner = np.linspace(0, length, 5)
    near = np.array([1.5, 6]) * layer
    near = near[near < inner[1] / 2]
    return np.concatenate([[0], near, inner[1:-1], (length - near)[::-1], [length]])


def line_integrals(borders, p):
    """Return the integrals of N N, N' N and N' N' of continuous polynomials of degree p on intervals."""
    q, w = legendre.leggauss(p + 2)
    ends = np.concatenate([[-1], np.sort(legendre.legroots(legendre.legder(np.eye(p + 1)[p])).real), [1]])
    to_nodes = np.linalg.inv(legendre.legvander(ends, p))
    N = legendre.legvander(q, p) @ to_nodes
    dN = np.stack([legendre.legval(q, legendre.legder(row)) for row in np.eye(p + 1)], axis=1) @ to_nodes
    n = p * (len(borders) - 1) + 1
    found = [np.zeros((n, n)) for _ in range(3)]
    for k, h in enumerate(np.diff(borders) / 2):
        rows = slice(k * p, (k + 1) * p + 1)
        for total, a, b, factor in zip(found, (N, dN, dN), (N, N, dN), (h, 1, 1 / h), strict=True):
            total[rows, rows] += factor * a.T @ (w[:, None] * b)
    return [sp.csr_array(each) for each in found]
