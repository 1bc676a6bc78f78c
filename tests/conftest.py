"""Shared fixtures: the optional folder of paper, reference values and logs beside the checkout."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Shared machines are slow at random, so no example is timed; CI repeats the same examples, and
# every run by hand looks for new ones.
settings.register_profile("default", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "default")


@pytest.fixture(scope="session")
def shared():
    """Folder `../shared` with real logs and blind trials; absent on a user's machine."""
    folder = Path(__file__).resolve().parents[2] / "shared"
    if not folder.is_dir():
        pytest.skip(f"needs the data folder {folder}, which is not part of the package")
    return folder
