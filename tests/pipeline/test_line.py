"""The whole line: mesh, reduction, modal file, flexible body, motion."""

import re
import subprocess
import sys
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import ellipk

import cms
import fe_models
import floatframe as ff
from fe_models.parts import shipped_mesh
from floatframe.results.trajectory import BodyMotion
from tests.cms.command import run_cms
from tests.docs.tutorials import PAGES, blocks
from tests.root import ROOT

README = ROOT / "README.md"
GRAVITY = 9810.0


@pytest.fixture(scope="module")
def body():
    mesh = fe_models.read_mesh(shipped_mesh("connecting_rod"))
    steel = fe_models.Material("steel", E=210e3, nu=0.3, rho=7.85e-9)
    ends = [
        fe_models.rigid_interface(mesh, name, fe_models.selections.FaceGroup(name)) for name in ("big_end", "small_end")
    ]
    units = cms.unit_system("mm-t-s")
    return cms.couple(fe_models.solid_body(mesh, steel, name="rod", units=units, interfaces=ends))


@pytest.fixture(scope="module")
def reduced(body):
    return cms.reduce(body, cms.modes.craig_bampton_ir(body, n_modes=4), frame=cms.NodalFrame("big_end"))


def swing(reduced, t_end=0.05, h=1e-4):
    rod = ff.FlexibleBody("rod", reduced)
    pin = ff.RevoluteJoint("pin", ff.GROUND, ff.Marker("rod", "big_end"), axis=(0, 1, 0))
    system = ff.System([rod], [pin], [ff.Gravity((0, 0, -GRAVITY))], units=reduced.units)
    return ff.integrate(system, ff.GeneralizedAlpha(rho_inf=0.8), t_end=t_end, h=h)


def assert_same(a, b, where="body"):
    """Every field equal bit for bit, down to the last array."""
    if is_dataclass(a) and not isinstance(a, type):
        for field in fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name), f"{where}.{field.name}")
    elif isinstance(a, np.ndarray):
        assert_array_equal(a, b, err_msg=where, strict=True)
    elif isinstance(a, tuple):
        assert len(a) == len(b), where
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{where}[{k}]")
    elif hasattr(a, "items"):
        assert dict(a) == dict(b), where
    else:
        assert a == b, where


def test_the_file_holds_the_reduced_body_bit_for_bit(reduced, tmp_path):
    cms.write(reduced, tmp_path / "rod.h5")
    assert_same(reduced, cms.read(tmp_path / "rod.h5"))


def test_memory_line_and_file_line_move_alike_bit_for_bit(reduced, tmp_path):
    cms.write(reduced, tmp_path / "rod.h5")
    from_memory, from_file = (swing(r).body("rod") for r in (reduced, cms.read(tmp_path / "rod.h5")))
    for field in fields(BodyMotion):
        assert_same(getattr(from_memory, field.name), getattr(from_file, field.name), field.name)


@pytest.mark.long  # of a job and of its Python example, below
def test_the_reduction_repeats_itself(body, reduced):
    again = cms.reduce(body, cms.modes.craig_bampton_ir(body, n_modes=4), frame=cms.NodalFrame("big_end"))
    assert_allclose(again.K, reduced.K, rtol=0, atol=1e-10 * reduced.K.max())
    assert_allclose(again.Phi, reduced.Phi, rtol=0, atol=1e-10 * np.abs(reduced.Phi).max())


def test_a_stiff_rod_swings_with_the_period_of_the_compound_pendulum(reduced):
    """Released horizontally: a quarter period is K(sin(pi/4)) / sqrt(m g s / J)."""
    moments = reduced.moments
    s, J = np.hypot(moments.S[0], moments.S[2]) / moments.m, moments.J0[1, 1]
    quarter = ellipk(np.sin(np.pi / 4) ** 2) / np.sqrt(moments.m * GRAVITY * s / J)
    motion = swing(reduced, t_end=1.2 * quarter, h=2e-4)
    rod = motion.body("rod")
    # lowest point: the centre of mass under the pin; elastic ringing moves the peak of the rate, hardly the angle
    w, x, y, z = rod.p.T
    along = np.stack([1 - 2 * (y**2 + z**2), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1) @ moments.S / moments.m
    k = int(np.argmax(along < 0))
    lowest = rod.t[k - 1] + (rod.t[k] - rod.t[k - 1]) * along[k - 1] / (along[k - 1] - along[k])
    assert_allclose(lowest, quarter, rtol=2e-5)
    assert_allclose(np.abs(rod.omega_B[k, 1]), np.sqrt(2 * moments.m * GRAVITY * s / J), rtol=1e-4)


def test_type_checkers_accept_the_python_of_readme_and_tutorials(tmp_path):
    """Tuples and lists where a field holds an array; a wrong kind is still seen."""
    block = re.search(r"<!-- python -->\n```python\n(.*?)```", README.read_text(), re.DOTALL)
    (tmp_path / "example.py").write_text(block[1] + "ff.Gravity(acceleration=pin)\n")
    for page in PAGES:
        for name, language, content in blocks(page):
            if language == "python":
                (tmp_path / page / name).parent.mkdir(parents=True, exist_ok=True)
                (tmp_path / page / name).write_text(content)
    files = [str(path) for path in tmp_path.rglob("*.py")]
    assert len(files) > 5
    # in a process of its own, since mypy changes the recursion limit of the one that it runs in
    command = [sys.executable, "-m", "mypy", *files, "--config-file", str(ROOT / "pyproject.toml")]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout.splitlines()
    assert len(told) == 2, told
    assert 'Argument "acceleration" to "Gravity" has incompatible type "RevoluteJoint"' in told[0]


def test_python_example_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    block = re.search(r"<!-- python -->\n```python\n(.*?)```", README.read_text(), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rod.msh").write_bytes(shipped_mesh("connecting_rod").read_bytes())
    exec(compile(block.group(1), "README.md", "exec"), {})  # the example itself is what is tested
    assert (tmp_path / "rod.h5").is_file()
    assert "[" in capsys.readouterr().out


def test_job_of_the_readme_gives_the_body_of_its_python_example(tmp_path, reduced):
    """A reduction repeats itself, too."""
    block = re.search(r"```toml\n(\[body\].*?)```", README.read_text(), re.DOTALL).group(1)
    (tmp_path / "rod.msh").write_bytes(shipped_mesh("connecting_rod").read_bytes())
    (tmp_path / "rod.toml").write_text(block.replace("n_modes = 12", "n_modes = 4"))
    run_cms("reduce", tmp_path / "rod.toml", "-o", tmp_path / "rod.h5", code=0)
    from_job = cms.read(tmp_path / "rod.h5")
    assert_allclose(from_job.frequencies, reduced.frequencies, rtol=1e-10)
    assert_allclose(from_job.K, reduced.K, rtol=0, atol=1e-10 * reduced.K.max())
    assert_allclose(from_job.Phi, reduced.Phi, rtol=0, atol=1e-10 * np.abs(reduced.Phi).max())
    assert_allclose(from_job.moments.J0, reduced.moments.J0, rtol=0, atol=1e-12 * reduced.moments.J0.max())


def test_the_system_of_the_readme_moves_its_body(tmp_path, reduced):
    cms.write(reduced, tmp_path / "rod.h5")
    (tmp_path / "swing.toml").write_text(re.search(r"```toml\n(\[system\].*?)```", README.read_text(), re.DOTALL)[1])
    system, run = ff.read_system(tmp_path / "swing.toml")
    motion = ff.integrate(system, run.integrator, 0.25, run.h, output_every=run.output_every)
    assert np.ptp(motion.energies.balance) < 1e-6 * np.ptp(motion.energies.kinetic)
    tips = [each.body("rod").interface("small_end").position[-1] for each in (motion, swing(reduced, 0.25))]
    assert_allclose(*tips, rtol=0, atol=1e-3)
    assert tips[0][2] < -100.0
