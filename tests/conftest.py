"""Shared fixtures: the data folder beside the checkout, the built package, a fresh environment."""

import contextlib
import os
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers of pytest share the processors
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest  # noqa: E402 (numpy reads the variable when it is imported)
from hypothesis import settings  # noqa: E402
from packaging.requirements import Requirement  # noqa: E402

# Shared machines are slow at random, so no example is timed; CI repeats the same examples, and
# every run by hand looks for new ones.
settings.register_profile("default", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "default")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared():
    """Folder `../shared` with real logs and blind trials; absent on a user's machine."""
    folder = Path(__file__).resolve().parents[2] / "shared"
    if not folder.is_dir():
        pytest.skip(f"needs the data folder {folder}, which is not part of the package")
    return folder


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """Folder with the wheel and the sdist of this checkout."""
    def build(folder):
        subprocess.run([sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder)],
                       cwd=ROOT, check=True, capture_output=True)

    return _made_once(tmp_path_factory, "dist", build)


@pytest.fixture(scope="session")
def fresh_environment(built, tmp_path_factory):
    """Folder of the programs of a new environment: the wheel, and what it says that it needs.

    What it needs is linked from this environment, so that nothing is fetched, and what only the
    tests have is not there.
    """
    def install(folder):
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        python = folder / "bin" / "python"
        subprocess.run([python, "-m", "pip", "install", "--no-deps", "--no-index", "--quiet",
                        next(built.glob("*.whl"))], check=True)
        site = Path(subprocess.check_output(
            [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
            text=True).strip())
        for top in _tops(_needed("clie-blocks", {"mujoco"})):
            with contextlib.suppress(FileExistsError):
                (site / top.name).symlink_to(top)

    return _made_once(tmp_path_factory, "fresh", install) / "bin"


def _made_once(tmp_path_factory, name, make):
    """Folder that the workers of a test run share; the first that asks for it makes it."""
    fcntl = pytest.importorskip("fcntl")
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    with open(folder.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            try:
                make(folder)
            except BaseException:
                shutil.rmtree(folder, ignore_errors=True)
                raise
    return folder


def _needed(name, extras, known=None):
    """Names of the packages that one needs with some extras, and what those need."""
    known = set() if known is None else known
    for line in metadata.requires(name) or []:
        one = Requirement(line)
        holds = one.marker is None or any(
            one.marker.evaluate({"extra": extra}) for extra in {"", *extras})
        if holds and one.name not in known:
            known.add(one.name)
            _needed(one.name, one.extras, known)
    return known


def _tops(names):
    """Files and folders that packages put at the top of the folder of packages."""
    return {Path(str(one.locate_file(file.parts[0])))
            for one in map(metadata.distribution, names) for file in one.files or []
            if file.parts[0] not in ("..", "__pycache__")}
