"""A failing import names the missing part and the remedy."""

import importlib.machinery
import pathlib
import shutil
import subprocess
import sys

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "apps" / "python" / "counterpoint"


def errors_with(tmp_path, *files):
    """The last line of an import's errors, for the package's Python files plus these empty files beside them."""
    shutil.copytree(PACKAGE, tmp_path / "counterpoint")
    for name in files:
        (tmp_path / "counterpoint" / name).touch()
    done = subprocess.run([sys.executable, "-c", "import counterpoint"], env={"PYTHONPATH": str(tmp_path)},
                          capture_output=True, text=True)
    assert done.returncode == 1
    return done.stderr.strip().split("\n")[-1]


def test_without_the_compiled_part(tmp_path):
    said = errors_with(tmp_path)
    assert "ninja -C build/release counterpoint_python" in said and "python3-dev" in said


def test_built_for_another_python(tmp_path):
    said = errors_with(tmp_path, "_core.cpython-399-x86_64-linux-gnu.so")
    assert "another Python" in said and "-DPython_EXECUTABLE=" in said


def test_a_damaged_compiled_part(tmp_path):
    said = errors_with(tmp_path, "_core" + importlib.machinery.EXTENSION_SUFFIXES[0])
    assert "cannot be loaded" in said or "NumPy is missing" in said
