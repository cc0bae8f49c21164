"""The notebooks of docs/notebooks: executed again they say and show what is committed, and their code is typed."""

import base64
import io
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib.image
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))
PICTURES = ("image/png", "image/svg+xml")
each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def code_cells(notebook: Any) -> list[Any]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def shown(cell: Any) -> list[tuple[str, dict[str, str]]]:
    """What a cell prints and shows: the kind of each output, and its data by MIME type, of a PNG the kind alone."""
    found: list[tuple[str, dict[str, str]]] = []
    for output in cell.outputs:
        assert output.output_type in ("stream", "display_data", "execute_result"), output
        if output.output_type == "stream":
            assert output.name == "stdout", output.text
            if found and found[-1][0] == "stdout":  # a busy kernel sends a line in two parts
                found[-1][1]["text"] += output.text
            else:
                found.append(("stdout", {"text": output.text}))
            continue
        data = dict(output.data)
        if "image/png" in data:  # matplotlib describes its figure by size and version
            data = {"image/png": ""}
        found.append((output.output_type, data))
    return found


def pictures(cell: Any) -> list[tuple[str, str]]:
    return [(kind, output.data[kind]) for output in cell.outputs for kind in PICTURES if kind in output.get("data", {})]


def require_not_blank(kind: str, data: str) -> None:
    """A PNG of which at least one pixel in a hundred differs from the corner, or an SVG with data in it."""
    if kind == "image/svg+xml":
        assert re.search(r'<(path|image)[^>]*class="data"', data), "no data in the figure"
        return
    pixels = matplotlib.image.imread(io.BytesIO(base64.b64decode(data)))
    share = np.mean(np.any(pixels != pixels[0, 0], axis=-1))
    assert share >= 0.01, f"{share:.2%} of the pixels differ from the background"


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) == 6


@each_notebook
def test_executed_again_a_notebook_shows_what_is_committed(path: Path, tmp_path: Path) -> None:
    committed = nbformat.read(path, as_version=4)
    executed = nbformat.read(path, as_version=4)
    client = NotebookClient(executed, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    assert not list(tmp_path.iterdir()), "files are left in the working folder"
    old, new = code_cells(committed), code_cells(executed)
    for number, (before, after) in enumerate(zip(old, new, strict=True), 1):
        assert before.execution_count == number, f"code cell {number} was committed out of order"
        assert shown(after) == shown(before), f"code cell {number}:\n{before.source}"
    drawn = [[picture for cell in cells for picture in pictures(cell)] for cells in (old, new)]
    assert drawn[0], "a notebook without a picture"
    for kind, data in drawn[0] + drawn[1]:
        require_not_blank(kind, data)


@each_notebook
def test_the_code_of_a_notebook_is_typed(
    path: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    source = "\n\n".join(cell.source for cell in code_cells(nbformat.read(path, as_version=4)))
    assert "type: ignore" not in source
    module = tmp_path / "notebook.py"
    module.write_text(source + "\n", encoding="utf-8")
    cache = tmp_path_factory.getbasetemp() / "mypy"
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(cache), str(module)]
    checked = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout + checked.stderr
