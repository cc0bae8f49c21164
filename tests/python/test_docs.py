"""The examples of the manual run, block after block, in a folder of their own."""

import re
from pathlib import Path

import pytest
from conftest import ROOT, Command

PAGES = ["README.md", "docs/python.md"]


@pytest.mark.parametrize("page", PAGES)
def test_the_examples_run(page: str, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE)
    assert blocks
    monkeypatch.chdir(tmp_path)
    for name in ("old.mcap", "new.mcap"):
        command("--quiet", "run", "ten-blocks", "--out", name)
    slab = "asperity.run('slab', {'time.duration_s': 0.3})"
    sheet = "asperity.run('sheet-coarse', {'time.duration_s': 0.21})"
    names: dict[str, object] = {}
    for block in blocks:
        # The field of nodes is one of a slab, that across one of a sheet, and a run that was broken off is whole by then.
        block = block.replace("nodes = run", f"nodes = {slab}").replace("across = run", f"across = {sheet}")
        exec(compile(block, page, "exec"), names)
