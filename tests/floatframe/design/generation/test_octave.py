"""Generated MATLAB functions in GNU Octave, beside the recursive model."""

import shutil
import subprocess

import numpy as np
import pytest

from floatframe.design.generation.generate import generate
from floatframe.design.generation.routines import ROUTINES
from tests.floatframe.design.generation.calls import SYSTEMS, Case, agree, arguments, few, near, python_function

pytestmark = pytest.mark.external
OCTAVE = shutil.which("octave-cli") or shutil.which("octave")
needs_octave = pytest.mark.skipif(OCTAVE is None, reason="GNU Octave is not installed (Debian: octave)")


def written(values):
    return f"[{' '.join(repr(float(each)) for each in values)}]"


def in_octave(calls, folder):
    """Call generated functions, each with its arrays, in one process; return the outputs of every call."""
    lines, shapes = [], []
    for code, arrays in calls:
        code.write(folder)
        names = [f"out{k}" for k in range(len(code.outputs))]
        lines.append(f"[{', '.join(names)}] = {code.name}({', '.join(written(each) for each in arrays)});")
        for name, shape in zip(names, code.outputs.values(), strict=True):  # row by row, as all other languages
            lines.append(f"printf('%.17g ', {name}.'); printf('\\n');")
            lines.append(f"printf('%d ', size({name})); printf('\\n');")
            shapes.append(shape)
    (folder / "call_all.m").write_text("\n".join(lines) + "\n")
    done = subprocess.run(
        [OCTAVE, "--norc", "--no-gui", "--quiet", "call_all.m"], cwd=folder, text=True, capture_output=True, check=True
    )
    assert not [line for line in done.stderr.splitlines() if "while preparing to exit" not in line]  # one of its own
    printed = done.stdout.splitlines()
    assert len(printed) == 2 * len(shapes)
    results = []
    for k, shape in enumerate(shapes):
        rows = int(np.prod(shape[:-1])) if len(shape) > 1 else shape[0]
        assert printed[2 * k + 1].split() == [str(rows), str(shape[-1] if len(shape) > 1 else 1)]
        results.append(np.array(printed[2 * k].split(), dtype=float).reshape(shape))
    outputs, first = [], 0
    for code, _ in calls:
        outputs.append(results[first : first + len(code.outputs)])
        first += len(code.outputs)
    return outputs


@needs_octave
@pytest.mark.parametrize("system", SYSTEMS)
def test_octave_has_the_numbers_of_the_model(system, tmp_path):
    """All routines but sensitivities, in several motions."""
    case, calls, asked = Case(SYSTEMS[system]()), [], []
    for what in ROUTINES:
        if what != "sensitivity":
            code = generate(case.system, what=what, language="matlab")
            for motion in case.motions:
                calls.append((code, arguments(what, motion)))
                asked.append((what, motion))
    for got, (what, motion) in zip(in_octave(calls, tmp_path), asked, strict=True):
        agree(got, case, what, motion)


@needs_octave
def test_octave_has_the_sensitivities_of_python(tmp_path):
    case = Case(few())
    code = generate(case.system, what="sensitivity", language="matlab")
    run = python_function(case.system, "sensitivity")
    calls = [(code, [*arguments("sensitivity", motion), code.parameter_values]) for motion in case.motions]
    for got, (_, arrays) in zip(in_octave(calls, tmp_path), calls, strict=True):
        near(got[0], run(*arrays))
