"""First-order shear laminate theory: stiffness and mass per area of a layered shell (docs/theory.md §5).

Layers lie from the bottom to the top of the shell, z from -t/2 to t/2 about the middle surface. The layup axes are the
direction projected onto the surface, the axis to its left in the surface, and the normal. With Q the plane-stress
elasticity of a layer, rotated by its angle,

    N = A eps + B kappa,  M = B eps + D kappa,  (A, B, D) = ∫ Q (1, z, z²) dz.

Transverse shear follows from equilibrium (Rohwer 1988). Without membrane force, eps = -A⁻¹ B kappa and kappa = D*⁻¹ M
with D* = D - B A⁻¹ B. Two cylindrical bendings M_x,x = Q_x, M_y,y = Q_y give the shear stress

    tau(z) = -∫ div sigma dz = F(z) (Q_x, Q_y),

which is continuous and vanishes at both faces. Its energy gives the shear stiffness H = (∫ Fᵀ G⁻¹ F dz)⁻¹, which is 5/6
G t for one isotropic layer. No shear correction factor is needed. For angle plies H depends slightly on the layup axes,
because the two cylindrical bendings are about these axes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.body.material import AnyMaterial, Material, OrthotropicMaterial
from fe_models.elements.shells.shell_property import AnyShellProperty, LaminateProperty, Layer, StiffnessProperty
from fe_models.elements.shells.strains import plane_elasticity
from fe_models.foundation.arrays import Array, frozen

__all__ = ["ShellLaw", "layer_axes_stress", "shell_law"]


@dataclass(frozen=True, eq=False)
class ShellLaw:
    """Stiffness and mass per area of a shell in layup axes."""

    layers: tuple[Layer, ...]  #: layers; empty if only the stiffness is known
    z: Array  #: faces of the layers, bottom to top, (n_layers + 1,) [m]
    A: Array  #: membrane stiffness, (3, 3) [N/m]
    B: Array  #: coupling of membrane and bending, (3, 3) [N]
    D: Array  #: bending stiffness, (3, 3) [N m]
    third: Array  #: third moment ∫ Q z³ dz, (3, 3) [N m²]
    H: Array  #: transverse shear stiffness, (2, 2) [N/m]
    mass: float  #: mass per area [kg/m²]
    centre: float  #: height of the centre of mass above the middle surface [m]
    spread: float  #: second moment of the mass about its centre along the normal, divided by the mass [m²]

    @property
    def thickness(self) -> float:
        """Thickness of the shell [m]."""
        return float(self.z[-1] - self.z[0])

    @property
    def bending(self) -> Array:
        """Matrix from curvatures to moments without membrane forces, D* = D - B A⁻¹ B, (3, 3) [N m]."""
        return np.asarray(self.D - self.B @ np.linalg.solve(self.A, self.B))

    @property
    def shear_modulus(self) -> float:
        """In-plane shear stiffness, averaged over all directions: (A_11 + A_22 - 2 A_12 + 4 A_66)/8 [N/m]."""
        A = self.A
        return float((A[0, 0] + A[1, 1] - 2 * A[0, 1] + 4 * A[2, 2]) / 8)

    @property
    def nu(self) -> float:
        """Poisson's ratio of the elasticity averaged over all in-plane directions [-]."""
        A = self.A
        across = A[0, 0] + A[1, 1] + 6 * A[0, 1] - 4 * A[2, 2]
        return float(across / (3 * A[0, 0] + 3 * A[1, 1] + 2 * A[0, 1] + 4 * A[2, 2]))

    @property
    def stiffness(self) -> Array:
        """Matrix from eps, kappa, gamma to N, M, Q, (8, 8)."""
        C = np.zeros((8, 8))
        C[:3, :3], C[:3, 3:6], C[3:6, :3], C[3:6, 3:6], C[6:, 6:] = self.A, self.B, self.B, self.D, self.H
        return C

    def layer_at(self, z: float) -> int:
        """Return the index of the layer at a height [m]; at a border, of the lower layer."""
        return int(np.clip(np.searchsorted(self.z, z - 1e-9 * self.thickness, side="right") - 1, 0, len(self.z) - 2))

    def stress(self, z: float, layer: int) -> Array:
        """Return the matrix S from N, M, Q to sigma_x sigma_y tau_xy tau_xz tau_yz in layup axes, (5, 8) [1/m, 1/m²].

        Parameters
        ----------
        z
            Height above the middle surface [m].
        layer
            Index of the layer, from the bottom.
        """
        S = np.zeros((5, 8))
        if not self.layers:
            t = self.thickness
            S[:3, :3], S[:3, 3:6] = np.eye(3) / t, 12 * z / t**3 * np.eye(3)
            S[3:, 6:] = 1.5 / t * (1 - 4 * z**2 / t**2) * np.eye(2)
            return S
        item = self.layers[layer]
        at_height = rotated_elasticity(item.material, item.angle) @ np.hstack([np.eye(3), z * np.eye(3)])
        S[:3, :6] = at_height @ np.linalg.inv(self.stiffness[:6, :6])
        S[3:, 6:] = shear_flow(self.layers, self.z, self.A, self.B, self.D)(z, layer)
        return S


def _given_law(item: StiffnessProperty) -> ShellLaw:
    """Return the law of given matrices; the unknown ∫ Q z³ dz is set to zero, as for symmetric layups."""
    C, half = np.array(item.stiffness), item.thickness / 2
    return ShellLaw(
        layers=(),
        z=frozen(np.array([-half, half])),
        A=frozen(C[:3, :3]),
        B=frozen(C[:3, 3:]),
        D=frozen(C[3:, 3:]),
        third=frozen(np.zeros((3, 3))),
        H=frozen(np.array(item.shear_stiffness)),
        mass=item.added_mass,
        centre=0.0,
        spread=0.0,
    )


def shell_law(item: AnyShellProperty) -> ShellLaw:
    """Return stiffness and mass per area of a shell with one material, with layers, or with given matrices."""
    if isinstance(item, StiffnessProperty):
        return _given_law(item)
    layers = item.layers if isinstance(item, LaminateProperty) else (Layer(item.material, item.thickness),)
    t = np.array([layer.thickness for layer in layers])
    z = np.concatenate([[0.0], np.cumsum(t)])
    z = z - z[-1] / 2
    middle = (z[1:] + z[:-1]) / 2
    A, B, D, third = np.zeros((4, 3, 3))
    for layer, h, c in zip(layers, t, middle, strict=True):
        Q = rotated_elasticity(layer.material, layer.angle)
        A += h * Q
        B += h * c * Q
        D += (h**3 / 12 + h * c**2) * Q
        third += (h**3 * c / 4 + h * c**3) * Q
    flow = shear_flow(layers, z, A, B, D)
    points, weights = np.polynomial.legendre.leggauss(3)  # exact: Fᵀ G⁻¹ F has degree four in each layer
    flexibility = np.zeros((2, 2))
    for k, (layer, h, c) in enumerate(zip(layers, t, middle, strict=True)):
        G_inv = np.linalg.inv(turned_shear(layer.material, layer.angle))
        for x, w in zip(points, weights, strict=True):
            F = flow(c + h / 2 * x, k)
            flexibility += w * h / 2 * F.T @ G_inv @ F
    H = item.shear_ratio * np.linalg.inv(flexibility)
    D, third = item.bending_ratio * D, item.bending_ratio * third
    rho_t = np.array([layer.material.rho for layer in layers]) * t
    mass = float(rho_t.sum()) + item.added_mass
    centre = float(rho_t @ middle) / mass if mass else 0.0
    second = float(rho_t @ (t**2 / 12 + middle**2)) + item.added_mass * item.thickness**2 / 12
    return ShellLaw(
        layers,
        frozen(z),
        frozen(A),
        frozen(B),
        frozen(D),
        frozen(third),
        frozen((H + H.T) / 2),
        mass=mass,
        centre=centre,
        spread=second / mass - centre**2 if mass else item.thickness**2 / 12,
    )


def shear_flow(layers: tuple[Layer, ...], z: Array, A: Array, B: Array, D: Array) -> Callable[[float, int], Array]:
    """Return a function of height and layer: the matrix F from Q_x, Q_y to tau_xz, tau_yz, (2, 2) [1/m].

    It follows from sigma = Q (z - A⁻¹ B) D*⁻¹ M, so that -∫ sigma,a dz = f M,a;
    tau_xz = f_11 Q_x + f_32 Q_y, tau_yz = f_31 Q_x + f_22 Q_y.
    """
    strain = np.linalg.solve(A, B)
    curvature = np.linalg.inv(D - B @ strain)
    Q = [rotated_elasticity(layer.material, layer.angle) for layer in layers]

    def between(k: int, low: float, high: float) -> Array:
        return np.asarray(Q[k] @ ((high**2 - low**2) / 2 * np.eye(3) - (high - low) * strain) @ curvature)

    below = [np.zeros((3, 3))]
    for k in range(len(layers)):
        below.append(below[-1] - between(k, z[k], z[k + 1]))

    def flow(height: float, layer: int) -> Array:
        f = below[layer] - between(layer, z[layer], height)
        return np.array([[f[0, 0], f[2, 1]], [f[2, 0], f[1, 1]]])

    return flow


def rotated_elasticity(material: AnyMaterial, angle: float) -> Array:
    """Return the plane stress elasticity in layup axes, (3, 3) [Pa], rows xx yy xy, engineering shear strain.

    Parameters
    ----------
    material
        Material whose axes 1 and 2 lie in the layer; axis 1 is at the angle.
    angle
        Angle from the first layup axis, right-handed about the normal [degree].
    """
    if isinstance(material, Material):
        return np.asarray(plane_elasticity(np.array([material.E]), np.array([material.nu]))[0])
    assert isinstance(material, OrthotropicMaterial)  # layers accept no other materials
    (E_1, E_2, _), nu_12 = material.young, material.poisson[0]
    share = 1 - nu_12**2 * E_2 / E_1
    Q = np.array([[E_1, nu_12 * E_2, 0.0], [nu_12 * E_2, E_2, 0.0], [0.0, 0.0, material.shear[0] * share]]) / share
    T = strain_turn(angle)
    return np.asarray(T.T @ Q @ T)


def turned_shear(material: AnyMaterial, angle: float) -> Array:
    """Return the transverse shear moduli in layup axes, (2, 2) [Pa], rows xz yz."""
    if isinstance(material, Material):
        return material.mu * np.eye(2)
    assert isinstance(material, OrthotropicMaterial)  # layers accept no other materials
    _, G_13, G_23 = material.shear
    c, s = cosine_sine(angle)
    R = np.array([[c, s], [-s, c]])
    return np.asarray(R.T @ np.diag([G_13, G_23]) @ R)


def strain_turn(angle: float) -> Array:
    """Return the matrix from eps_x eps_y gamma_xy to eps_1 eps_2 gamma_12 of a layer at an angle [degree], (3, 3)."""
    c, s = cosine_sine(angle)
    return np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])


def cosine_sine(angle: float) -> tuple[float, float]:
    """Return cosine and sine of an angle [degree]; they are exact at multiples of 90."""
    quarter = round(angle / 90)
    rest = np.deg2rad(angle - 90 * quarter)
    c, s = float(np.cos(rest)), float(np.sin(rest))
    return ((c, s), (-s, c), (-c, -s), (s, -c))[quarter % 4]


def layer_axes_stress(angle: float) -> Array:
    """Return T, (5, 5), from stress in layup axes to sigma_1 sigma_2 tau_12 tau_13 tau_23 of a layer."""
    c, s = cosine_sine(angle)
    T = np.zeros((5, 5))
    T[:3, :3] = [[c * c, s * s, 2 * c * s], [s * s, c * c, -2 * c * s], [-c * s, c * s, c * c - s * s]]
    T[3:, 3:] = [[c, s], [-s, c]]
    return T
