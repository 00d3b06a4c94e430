"""Fixtures shared by the tests of the Python module. COUNTERPOINT_COMMAND: the C++ command to compare with."""

import os
import pathlib
import subprocess

import pytest

import counterpoint as cp

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "data" / "scenes"


@pytest.fixture
def scenes():
    return SCENES


@pytest.fixture
def load():
    return lambda name: cp.load_scene(SCENES / f"{name}.yaml")


@pytest.fixture
def command():
    path = os.environ.get("COUNTERPOINT_COMMAND")
    if not path:
        pytest.skip("COUNTERPOINT_COMMAND is not set: no command to compare with")

    def run(*arguments, exit_code=0):
        words = [path, *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
        assert done.returncode == exit_code, done.stderr
        return done.stdout

    return run
