"""What the tests of the package share: the command of the same wheel, and a run of both."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import asperity
import pytest

ROOT = Path(__file__).parent.parent.parent
COMMAND = Path(sys.executable).with_name("asperity")
TESTS = Path(__file__).parent

# Twenty blocks for a second: runs in tens of milliseconds and has precursors.
SMALL = {"slider.blocks": 20, "time.step_s": 1e-7, "time.duration_s": 1.0}

Command = Callable[..., str]


@pytest.fixture(scope="session")
def command() -> Command:
    """Calls the `asperity` command that the wheel has brought."""

    def call(*arguments: str | Path) -> str:
        called = subprocess.run([COMMAND, *arguments], capture_output=True, text=True, check=False)
        assert called.returncode == 0, called.stderr
        return called.stdout

    return call


def overrides(values: dict[str, object]) -> list[str]:
    """Values as the command takes them."""
    return [word for key, value in values.items() for word in ("--set", f"{key}={value}")]


@pytest.fixture(scope="session")
def default_log(command: Command, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of the default run, made by the command."""
    log = tmp_path_factory.mktemp("default") / "default.mcap"
    command("--quiet", "run", "default", "--out", log)
    return log


@pytest.fixture(scope="session")
def default_run() -> asperity.Run:
    """The default run, made here, without a log."""
    return asperity.run("default")
