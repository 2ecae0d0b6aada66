"""All scenarios."""

import shutil
from pathlib import Path

from . import (  # noqa: F401  (importing them registers their scenarios)
    scenarios_loss, scenarios_recording, scenarios_mapping, scenarios_scheduling, scenarios_timing,
    scenarios_formats)
from .register import ALL


def generate(name: str, seed: int, folder: Path) -> None:
    """Writes one scenario to `folder`, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    ALL[name](seed).write(folder)
