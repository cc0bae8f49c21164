"""Recordings: arrays in memory give what the same files give by the command."""

import shutil
from pathlib import Path

import asperity
import numpy as np
import pytest
from conftest import ROOT, Command

SLIP = ROOT / "fixtures" / "recordings" / "slip"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The recording without its arrays."""
    for name in ("recording.toml", "forces.csv", "starts.csv"):
        shutil.copy(SLIP / name, tmp_path)
    return tmp_path


def arrays() -> dict[str, np.ndarray]:
    return {path.name: np.load(path) for path in SLIP.glob("event-*.npy")}


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_arrays_in_memory_are_read_as_files_are(command: Command, folder: Path) -> None:
    by_command = folder / "files.mcap"
    command("--quiet", "recording", "read", SLIP / "recording.toml", "--out", by_command)
    theirs = asperity.open(by_command)
    by_columns = {name: np.asfortranarray(array) for name, array in arrays().items()}
    for given, log in ((arrays(), "rows.mcap"), (by_columns, "columns.mcap")):
        run = asperity.recording(folder / "recording.toml", given, log=folder / log)
        assert len(run.ruptures) == 26 and run.ruptures.to_polars().equals(theirs.ruptures.to_polars())
        assert run.table("/events/load-drop").to_polars().equals(theirs.table("/events/load-drop").to_polars())
        assert 'class="data"' in run.draw("lengths").svg
        with pytest.raises(asperity.Error, match="which has no scenario"):
            run.scenario  # noqa: B018
    # Changed in place, since it is not copied before it is read.
    changed = arrays()
    next(iter(changed.values()))[:] = 0
    with pytest.warns(UserWarning, match="no noise"):
        other = asperity.recording(folder / "recording.toml", changed, log=folder / "changed.mcap")
    assert len(other.arrivals) < len(theirs.arrivals)


def test_what_is_not_accepted_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    toml = folder / "recording.toml"
    apart = {name: array[:, ::2] for name, array in arrays().items()}
    with pytest.raises(asperity.Refused, match=r"event-\d+.npy.*numpy.ascontiguousarray"):
        asperity.recording(toml, apart, log=folder / "apart.mcap")
    with pytest.raises(asperity.Refused, match="event-"):
        asperity.recording(toml, {"event-1.npy": np.array(["text"])}, log=folder / "text.mcap")
    # Paths in a text count from the working folder.
    monkeypatch.chdir(folder)
    with pytest.raises(asperity.Refused, match="forces.csv:1: F_X"):
        asperity.recording(toml.read_text().replace('"F_T"', '"F_X"'), log=folder / "column.mcap")
    assert not list(folder.glob("*.mcap"))
