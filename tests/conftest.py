"""Shared fixtures: the optional folder of paper, reference values and logs beside the checkout."""

import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers of pytest share the processors

import pytest  # noqa: E402 (numpy reads the variable when it is imported)
from hypothesis import settings  # noqa: E402

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
