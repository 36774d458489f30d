"""The conda recipe says what pyproject.toml says."""

import re
import tomllib

import yaml

from tests.root import ROOT

RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text())
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CONDA_NAMES = {"matplotlib": "matplotlib-base"}  #: where conda-forge has another name
CONDITIONS = {"platform_machine in 'x86_64 AMD64' and sys_platform != 'darwin'": "x86_64 and not osx"}


def as_conda(requirement):
    """Return name and least version of a requirement, as conda writes them, without its condition."""
    name, version = re.fullmatch(r"([\w-]+)(>=[\d.]+)", requirement.split(";")[0].strip()).groups()
    return f"{CONDA_NAMES.get(name, name)} {version}"


def test_the_recipe_requires_what_the_project_requires():
    run = RECIPE["requirements"]["run"]
    always = [each for each in run if isinstance(each, str)]
    conditional = [each for each in run if not isinstance(each, str)]
    needed = PROJECT["dependencies"]
    assert always == [
        f"python {PROJECT['requires-python']}", *(as_conda(each) for each in needed if ";" not in each)
    ]  # fmt: skip
    assert {each["then"]: each["if"] for each in conditional} == {
        as_conda(each): CONDITIONS[each.split(";")[1].strip()] for each in needed if ";" in each
    }


def test_the_recipe_has_the_version_and_the_commands_of_the_project():
    assert RECIPE["context"]["version"] == PROJECT["version"]
    assert RECIPE["about"]["summary"] == PROJECT["description"]
    assert RECIPE["tests"][1]["script"] == [f"{name} --version" for name in PROJECT["scripts"]]
