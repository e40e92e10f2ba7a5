"""The type checkers mypy and pyright on the package, its tests and the examples of documents and notebooks."""

import ast
import json
import os
import pathlib
import subprocess
import sys

import pytest

import rodfit

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = pathlib.Path(rodfit.__file__).parent

# Variables that a page uses and does not define.
READER = """\
from typing import Any
import lmfit
import numpy as np
import pandas
import scipy.optimize
import rodfit
scene = rodfit.Scene.load("data/cantilever.toml")
t, xyz = np.zeros(3), np.zeros((3, 3))
frame = pandas.DataFrame({"t": t})
x = np.zeros(1)
"""
PAGES = ["docs/reference/python.md", "docs/tutorials/python.md", "docs/how-to/campaign.md", "python/README.md"]


def is_python(code: str) -> bool:
    """Whether a text is Python; rules of Snakemake are not."""
    try:
        ast.parse(code)
    except SyntaxError:
        return False
    return True


def page_code(page: str) -> str:
    """The code blocks of a page, in order."""
    blocks = [block.split("```")[0] for block in (ROOT / page).read_text().split("```python\n")[1:]]
    return READER * (page == "docs/reference/python.md") + "\n".join(filter(is_python, blocks))


def notebook_code(notebook: pathlib.Path) -> str:
    """The code cells of a notebook without commands of the shell."""
    cells = [cell["source"] for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    return "".join(line for cell in cells for line in [*cell, "\n"] if not line.startswith("!"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder of the examples and the tests, away from the source of the package."""
    folder = tmp_path_factory.mktemp("types")
    examples = {page.replace("/", "_").removesuffix(".md"): page_code(page) for page in PAGES}
    for notebook in sorted((ROOT / "python/notebooks").glob("*.ipynb")):
        examples[f"notebook_{notebook.stem.replace('-', '_')}"] = notebook_code(notebook)
    for name, code in examples.items():
        assert "import" in code
        # The last line of a cell is displayed.
        (folder / f"{name}.py").write_text(f"# pyright: reportUnusedExpression=false\n{code}")
    for test in sorted(pathlib.Path(__file__).parent.glob("test_*.py")):
        (folder / test.name).write_text(test.read_text())
    return folder


def pyright(*words: str, folder: pathlib.Path) -> "subprocess.CompletedProcess[str]":
    """Runs pyright on the environment of this interpreter."""
    pytest.importorskip("pyright", reason="pyright is not installed")
    path = os.pathsep.join([str(pathlib.Path(sys.executable).parent), os.environ.get("PATH", "")])
    environment = os.environ | {"PATH": path, "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}

    def run(*words: str) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "pyright", *words]
        return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600)

    if run("--version").returncode != 0:
        pytest.skip("pyright found no Node.js and could not fetch it")
    return run(*words)


def test_mypy_reports_no_errors(folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    api = pytest.importorskip("mypy.api")
    monkeypatch.chdir(folder)
    config = ["--config-file", str(ROOT / "python/pyproject.toml")]
    for files in ([str(ROOT / "python/rodfit")], sorted(file.name for file in folder.glob("*.py"))):
        said, _, code = api.run([*config, *files])
        assert code == 0, said


def test_pyright_reports_no_errors(folder: pathlib.Path) -> None:
    # Packages of the extras may be missing or have no types, and the native part has no source.
    source = folder / "rodfit_source"
    source.mkdir()
    for file in PACKAGE.glob("*.py*"):
        (source / file.name).write_text(file.read_text())
    settings = {"reportMissingImports": False, "reportMissingModuleSource": False, "useLibraryCodeForTypes": False}
    (folder / "pyrightconfig.json").write_text(json.dumps(settings))
    done = pyright("--outputjson", ".", folder=folder)
    found = json.loads(done.stdout)
    said = [f"{d['file']}:{d['range']['start']['line'] + 1}: {d['message']}" for d in found["generalDiagnostics"]]
    assert said == [] and found["summary"]["filesAnalyzed"] > 20


def test_all_public_symbols_have_types(folder: pathlib.Path) -> None:
    done = pyright("--verifytypes", "rodfit", "--ignoreexternal", "--outputjson", folder=folder)
    complete = json.loads(done.stdout)["typeCompleteness"]
    assert complete["completenessScore"] == 1.0, done.stdout
