"""The example of scikit-fem in docs/formats.md runs as it stands."""

import re
from pathlib import Path

import numpy as np

import fe_models

PAGE = Path(__file__).resolve().parents[2] / "docs/formats.md"


def test_the_example_with_forms_of_scikit_fem_makes_a_body_of_the_density_it_says():
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (code,) = [block for block in blocks if "import skfem" in block]
    names = {"fe_models": fe_models}
    exec(code, names)
    body = names["body"]
    gram = body.element_model.mass_gram(np.zeros((body.n_dof, 0)))
    np.testing.assert_allclose(gram[0, 0], 7850 * 1.25, rtol=1e-10)
    np.testing.assert_allclose(gram[0, 3], 7850 * (1 / 2 + 1 / 6), rtol=1e-10)
    assert len(body.interfaces[0].nodes) == 81
