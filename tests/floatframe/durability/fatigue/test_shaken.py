"""A shaken body: stresses of `floatframe shake` by another road, and the damage of its random test."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from cms.body.modal_file.file import write
from floatframe.durability.fatigue.assessment import shaken_damage, shaken_spectra
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.spectral.spectral_damage import stress_moments
from floatframe.errors import FatigueError
from tests.bodies import bar

NODE = 5
LEVEL = ff.durability.shaking.Level.of([(20, 1e-3), (100, 1e-2), (2000, 1e-2)], "g2/Hz")


@pytest.fixture(scope="module")
def body():
    part = cms.couple(bar(nx=3))
    return cms.reduce(part, cms.craig_bampton(part, n_modes=3))


@pytest.fixture(scope="module")
def shaken(body):
    place = body.frame.origin + body.frame.axes @ body.nodes[NODE]
    test = ff.durability.shaking.RandomTest("noise", LEVEL, ("x", "z"), duration=60.0)
    wanted = [ff.durability.shaking.Observed("a", position=place, quantities=("stress",))]
    return ff.durability.shaking.shake(
        ff.durability.shaking.ShakeJob(
            body, "left", damping=ff.durability.shaking.Damping(Q=20), outputs=wanted, random=[test]
        )
    ), test


def test_moments_are_those_of_the_shaken_stress(body, shaken):
    """rms of von Mises' stress at every node, rms and crossings of a component: from the densities of the outputs."""
    result, test = shaken
    for run in result.random:
        spectra, stress = shaken_spectra(result.model, test, run, 60.0)
        assert_allclose(
            np.sqrt(stress_moments(stress, spectra, Criterion())[0, :, 0]),
            run.field,
            rtol=1e-7,
            atol=1e-7 * run.field.max(),
        )
        turned = np.tile(body.frame.axes.T, (len(stress), 1, 1))  # the components of outputs are along axes of the mesh
        moments = stress_moments(stress, spectra, Criterion("normal", n_planes=4), turned)[:, NODE, 0]
        k = result.model.output_index("a stress xx")
        assert_allclose(np.sqrt(moments[0]), run.rms[k], rtol=1e-7)
        assert_allclose(np.sqrt(moments[2] / moments[0]), run.crossings[k], rtol=1e-7)


def test_damage_of_a_random_test_grows_with_its_duration_and_adds_its_directions(body, shaken):
    result, test = shaken
    curve = ff.durability.fatigue.basquin_curve(1e6, 1e6, 5.0, least_cycles=1e-12)
    both = shaken_damage(body, result.model, test, result.random, curve)
    each = [shaken_damage(body, result.model, test, [run], curve, duration=120.0) for run in result.random]
    assert both.block_names == ("noise left:x", "noise left:z")
    assert_allclose(both.damage, 0.5 * (each[0].damage + each[1].damage), rtol=1e-12)
    assert both.damage.max() > 0
    with pytest.raises(FatigueError, match="its duration is not known"):
        shaken_damage(body, result.model, replace(test, duration=None), result.random, curve)
    with pytest.raises(FatigueError, match="expected one of its runs"):
        shaken_damage(body, result.model, replace(test, name="other"), result.random, curve)


def test_a_fatigue_file_names_a_shake_file(body, shaken, tmp_path):
    result, test = shaken
    write(body, tmp_path / "bar.h5")
    (tmp_path / "bar_shake.toml").write_text(SHAKE)
    (tmp_path / "job.toml").write_text(FATIGUE)
    made = ff.durability.fatigue.assess(ff.durability.fatigue.read_fatigue(tmp_path / "job.toml"))
    curve = ff.durability.fatigue.basquin_curve(1e6, 1e6, 5.0, least_cycles=1e-12)
    assert_allclose(made.result.damage, shaken_damage(body, result.model, test, result.random, curve).damage, rtol=1e-6)
    (tmp_path / "job.toml").write_text(FATIGUE.replace('"noise"', '"noisy"'))
    with pytest.raises(FatigueError, match="no random test 'noisy'; did you mean 'noise'"):
        ff.durability.fatigue.assess(ff.durability.fatigue.read_fatigue(tmp_path / "job.toml"))


FATIGUE = """
body = "bar.h5"
[material]
stress_unit = "MPa"
[material.sn]
amplitude = 1.0
cycles = 1e6
slope = 5.0
least_cycles = 1e-12
[[spectra]]
shake = "bar_shake.toml"
test = "noise"
"""
SHAKE = """
body = "bar.h5"
base = "left"
[damping]
Q = 20
[random.noise]
level = [[20, 1e-3], [100, 1e-2], [2000, 1e-2]]
unit = "g2/Hz"
directions = ["x", "z"]
duration = 60.0
"""
