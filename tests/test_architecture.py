"""The direction of imports: fe_models -> cms <- floatframe; only the command lines look outward."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MAY_IMPORT = {"cms": {"cms"}, "fe_models": {"fe_models", "cms"}, "floatframe": {"floatframe", "cms"}}
OURS = set(MAY_IMPORT)


def imported_packages(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("package", sorted(OURS))
def test_imports_point_inward(package):
    outward = {}
    for path in (ROOT / package).rglob("*.py"):
        if path.relative_to(ROOT / package).parts[0] == "cli":
            continue
        wrong = (imported_packages(path) & OURS) - MAY_IMPORT[package]
        if wrong:
            outward[str(path.relative_to(ROOT))] = sorted(wrong)
    assert outward == {}


def test_no_package_imports_the_tests():
    for package in OURS:
        for path in (ROOT / package).rglob("*.py"):
            assert "tests" not in imported_packages(path), path


HEAVY = ["skfem", "meshio", "pyvista", "vtk", "numba", "matplotlib", "gmsh", "typer", "rich"]


@pytest.mark.parametrize("module", HEAVY)
def test_importing_the_packages_leaves_the_heavy_libraries_alone(module):
    code = f"import sys, cms, floatframe, fe_models; sys.exit({module!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_output_of_the_core_goes_through_the_command_line():
    """No print outside the command lines and the rendering worker."""
    talkers = []
    for package in OURS:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).parts
            calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
            if "cli" not in parts and any(isinstance(c.func, ast.Name) and c.func.id == "print" for c in calls):
                talkers.append(str(path.relative_to(ROOT)))
    assert [name for name in talkers if "rendering" not in name] == []


ENTRIES = ("system_file", "study_file", "analyses", "measuring", "integration", "trajectory", "mechanisms")


@pytest.mark.parametrize("module", ENTRIES)
def test_modules_where_users_begin_can_be_imported_first(module):
    code = f"import floatframe.{module}"
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr


@pytest.mark.long
def test_every_module_can_be_imported_first():
    """Each in an interpreter whose modules of ours are forgotten before: no circle of imports."""
    code = """
import importlib, pathlib, sys
failed = []
for package in {packages!r}:
    for path in sorted(pathlib.Path(package).rglob("*.py")):
        name = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        if "kernels" in name or "rendering" in name or name.endswith("__main__"):
            continue  # compiled on import, or the entry of a process
        for known in [m for m in sys.modules if m.split(".")[0] in {packages!r} and "kernels" not in m]:
            del sys.modules[known]
        try:
            importlib.import_module(name)
        except ImportError as error:
            failed.append(f"{{name}}: {{error}}")
print("\\n".join(failed))
sys.exit(bool(failed))
"""
    result = subprocess.run(
        [sys.executable, "-c", code.format(packages=tuple(OURS))], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
