"""The PEP 517 back end: maturin, for a wheel that has the `asperity` command beside the module."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import get_requires_for_build_editable, get_requires_for_build_wheel

__all__ = [
    "build_editable",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

_PACKAGE = Path(__file__).resolve().parent.parent
_SCRIPTS = _PACKAGE / "asperity.data" / "scripts"


def prepare_metadata_for_build_wheel(folder: str, config_settings: Any = None) -> str:
    """As maturin does, which asks for the folder of the command."""
    _SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(folder, config_settings)


prepare_metadata_for_build_editable = prepare_metadata_for_build_wheel


def build_wheel(folder: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """Builds the command, which maturin then packs with the module. Returns the wheel's name."""
    _build_command()
    return maturin.build_wheel(folder, config_settings, metadata_directory)


def build_editable(folder: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """As `build_wheel`, for `pip install --editable`."""
    _build_command()
    return maturin.build_editable(folder, config_settings, metadata_directory)


def _build_command() -> None:
    build = [os.environ.get("CARGO", "cargo"), "build", "--locked", "--package", "asperity-cli"]
    build.append("--message-format=json-render-diagnostics")
    messages = subprocess.run(build, cwd=_PACKAGE, check=True, stdout=subprocess.PIPE, text=True).stdout
    executables = (json.loads(message).get("executable") for message in messages.splitlines())
    command = next(path for path in executables if path)
    _SCRIPTS.mkdir(parents=True, exist_ok=True)
    packed = _SCRIPTS / Path(command).name
    shutil.copy2(command, packed)
    if strip := shutil.which("strip"):
        subprocess.run([strip, packed], check=True)
