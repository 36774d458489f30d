"""The notebook spacecraft_tower runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    "by_hand += sum(m for m, _ in masses.values())": [
        "assert abs(tower.moments.m / by_hand - 1) < 1e-9",
    ],
    "full_hertz = np.sort(np.sqrt(omega2)) / (2 * np.pi)": [
        "assert np.allclose(tower.frequencies[:8], full_hertz, rtol=1e-7)",
    ],
    "n_b = carried.n_b": [
        ("assert np.allclose(carried.M_rigid[:3, :3], by_hand * np.eye(3), rtol=0, atol=1e-7 * by_hand)"),
    ],
    "participation = carried.rigid.T @ carried.M[:n_b, n_b:]": [
        ("assert np.allclose((participation**2).T, table.mass, rtol=0, atol=1e-8 * table.total.max())"),
    ],
    "found = table.mass[:, :3].sum(axis=0)": [
        "assert (found < whole * (1 + 1e-9)).all()",
        "assert (found > 0.9 * whole).all()",
    ],
    'print(f"{quantity}: {apart:.0e} from pyYeti")': [
        "assert apart < 1e-6",
    ],
    'fx = labels.index("interface force adapter fx")': [
        'assert np.allclose(here[:, fx], sine.transfer[:, of["adapter force x"]], rtol=1e-6)',
    ],
    "allowed = np.minimum(": [
        ("assert np.allclose(np.interp(sine.frequencies, notched.frequencies, notched.notched), allowed, rtol=1e-3)"),
        'assert notched.sizes[:, of["adapter force x"]].max() < 1500.0 * (1 + 1e-6)',
        'assert notched.sizes[:, of["telescope acceleration x"]].max() < 15.0 * G * (1 + 1e-6)',
    ],
    "here, steady = (": [
        "assert abs(here / peak - 1) < 5e-3",
    ],
    'print(f"{label}: {mine / scale:.2f} {unit} rms, 3 sigma {3 *': [
        "assert abs(mine / other - 1) < 1e-4",
    ],
    "found = random.von_mises[place]": [
        "assert abs(found.rms / mises - 1) < 1e-4",
    ],
    "one = np.sqrt(np.trapezoid(np.abs(1 + single.fsolve(-np.ones": [
        "assert abs(main.grms / one - 1) < 0.1",
    ],
    'print(f"{what}: apart by {np.abs(a - b).max() / np.abs(b).ma': [
        "assert np.abs(a - b).max() < 2e-3 * np.abs(b).max()",
    ],
    'print(f"{name}: {np.abs(own / theirs[name] - 1).max():.1e} f': [
        "assert np.allclose(own, theirs[name], rtol=1e-6)",
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("spacecraft_tower", CLAIMS)
