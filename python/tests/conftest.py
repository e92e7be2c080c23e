"""What the tests share: the command line beside the package, and bags made once."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


def _executable() -> Path:
    folder = os.environ.get("ROTARY_SINS_BIN_DIR")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return Path(folder or target / "release") / "rotary-sins"


class CommandLine:
    """The executable `rotary-sins`."""

    def __call__(self, *arguments: str | Path, status: int | None = 0) -> str:
        command = [str(_executable()), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert status is None or done.returncode == status, done.stderr
        return done.stdout

    def json(self, *arguments: str | Path, status: int | None = 0) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self(*arguments, "--json", status=status))
        return found


@pytest.fixture(scope="session")
def rotary_sins() -> CommandLine:
    if not _executable().exists():
        if "CI" in os.environ:
            pytest.fail(f"CI is set, but there is no {_executable()}")
        pytest.skip(f"there is no {_executable()}: cargo build --release")
    return CommandLine()


@pytest.fixture(scope="session")
def bag(tmp_path_factory: pytest.TempPathFactory, rotary_sins: CommandLine) -> Path:
    """An hour and a half of the eight positions, 10 Hz, which converges after about an hour."""
    path = tmp_path_factory.mktemp("bag") / "run.mcap"
    rotary_sins(
        "simulate", "--hours", "1.5", "--rate", "10", "--seed", "3", "--output", path
    )
    return path


@pytest.fixture(scope="session")
def rest(tmp_path_factory: pytest.TempPathFactory, rotary_sins: CommandLine) -> Path:
    """Half an hour at rest, 20 Hz."""
    path = tmp_path_factory.mktemp("rest") / "rest.mcap"
    rotary_sins(
        *["simulate", "--scheme", "static", "--hours", "0.5", "--rate", "20"],
        *["--seed", "5", "--output", path],
    )
    return path
