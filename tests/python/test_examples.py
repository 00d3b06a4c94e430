"""Every example runs; examples that need a missing package beyond NumPy are reported as skipped."""

import pathlib
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "apps" / "python" / "examples"
NOT_THERE = 77


@pytest.mark.parametrize("example", sorted(p.name for p in EXAMPLES.glob("*.py")))
def test_an_example_runs(example, tmp_path):
    done = subprocess.run([sys.executable, EXAMPLES / example], cwd=tmp_path, capture_output=True, text=True)
    if done.returncode == NOT_THERE:
        pytest.skip(done.stdout.strip())
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


@pytest.mark.parametrize("page", ["python", "control"])
def test_a_pages_first_lines_run(page):
    """Runs the first Python block of a page of the guide and compares the output with the text block after it."""
    root = EXAMPLES.parents[2]
    text = (root / f"docs/guide/{page}.md").read_text()
    code = text.split("```python\n", 1)[1].split("```", 1)[0]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = text.split("```python\n", 1)[1].split("```text\n", 1)[1].split("```", 1)[0]
    assert done.stdout == said
