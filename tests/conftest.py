"""Shared fixtures: the optional folder of paper, reference values and logs beside the checkout."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared():
    """Folder `../shared` with real logs and blind trials; absent on a user's machine."""
    folder = Path(__file__).resolve().parents[2] / "shared"
    if not folder.is_dir():
        pytest.skip(f"needs the data folder {folder}, which is not part of the package")
    return folder
