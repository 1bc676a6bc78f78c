"""The target ``fmu``: an FMI 3.0 co-simulation unit per joint, with sources and binary."""

from __future__ import annotations

import hashlib
import io
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from clie_blocks.analysis.export.c_target import notes
from clie_blocks.analysis.export.core import Core, core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.joint_block import INPUTS, OUTPUTS, joint_block
from clie_blocks.errors import ClieError

COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-Wall", "-Wextra")
_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"),
            "win32": ("windows", ".dll")}
_MACHINES = {"AMD64": "x86_64", "arm64": "aarch64"}
_STAMP = (1980, 1, 1, 0, 0, 0)  # same answer, same bytes


def export_fmu(correction: Correction, step: float) -> Exported:
    """Return one FMU per joint.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    step : float
        Internal step [s]; a communication step is a whole number of them.

    Raises
    ------
    ClieError
        If the compiler fails; says what it wrote.

    """
    files: dict[str, str | bytes] = {}
    told = [*notes(correction)]
    compiler = next((found for name in COMPILERS if (found := shutil.which(name))), None)
    for k in range(len(correction.joints)):
        made = core(joint_block(correction, k, step))
        files[f"{made.name}.fmu"] = fmu(made, compiler)
    if compiler is None:
        told.append("No C compiler is here, so the FMUs hold sources alone: compile "
                    "sources/fmu.c, or import them where sources are compiled.")
    return Exported("fmu", files, tuple(told),
                    ran="The block is checked against python-control at random points; FMPy "
                        "validates and runs such units in the tests of this package.")


def fmu(made: Core, compiler: str | None) -> bytes:
    """Return the archive of one FMU."""
    sources = {f"{made.name}.c": made.c_source(), f"{made.name}.h": made.c_header()}
    token = hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:32]
    variables = _variables(made)
    sources["fmu.c"] = fill("fmu.c.j2", core=made, token=token)
    files: dict[str, str | bytes] = {f"sources/{name}": text for name, text in sources.items()}
    files["modelDescription.xml"] = fill(
        "model_description.xml.j2", core=made, token=token, variables=variables)
    files["sources/buildDescription.xml"] = fill("build_description.xml.j2", core=made)
    if compiler is not None:
        files[_binary_name(made.name)] = _compiled(sources, made.name, compiler)
    return _archive(files)


def _variables(made: Core) -> list[dict[str, object]]:
    """Inputs, outputs and parameters, with the value references of the C file."""
    joint = made.block.joint
    units = {"q": joint.unit_q, "dq": f"{joint.unit_q}/s", "tau_other": joint.unit_torque,
             "tau": joint.unit_torque, "tau_smooth": joint.unit_torque,
             "friction_forward": joint.unit_torque, "friction_backward": joint.unit_torque,
             "q_measured": joint.unit_q}
    rows: list[dict[str, object]] = [
        {"name": name, "reference": 1 + k, "causality": "input", "unit": units.get(name, "")}
        for k, name in enumerate(INPUTS)]
    rows += [{"name": name, "reference": 101 + k, "causality": "output",
              "unit": units.get(name, "")} for k, name in enumerate(OUTPUTS)]
    rows += [{"name": key, "reference": 1001 + k, "causality": "parameter", "start": repr(value),
              "unit": ""} for k, (key, value) in enumerate(made.parameters)]
    return rows


def _binary_name(name: str) -> str:
    if sys.platform not in _SYSTEMS:
        raise ClieError(f"no FMI name of the system {sys.platform!r} is known; export where the "
                        "simulator runs")
    system, ending = _SYSTEMS[sys.platform]
    machine = _MACHINES.get(platform.machine(), platform.machine())
    return f"binaries/{machine}-{system}/{name}{ending}"


def _compiled(sources: dict[str, str], name: str, compiler: str) -> bytes:
    with tempfile.TemporaryDirectory() as scratch:
        for file, text in sources.items():
            (Path(scratch) / file).write_text(text)
        run = subprocess.run([compiler, *FLAGS, "-o", "unit", "fmu.c", f"{name}.c", "-lm"],
                             cwd=scratch, capture_output=True, text=True, check=False)
        if run.returncode:
            raise ClieError(f"{compiler} cannot compile the FMU {name}: {run.stderr[-500:]}; "
                            "take it out of PATH for an FMU with sources alone")
        return (Path(scratch) / "unit").read_bytes()


def _archive(files: dict[str, str | bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, _STAMP), files[name],
                             zipfile.ZIP_DEFLATED)
    return buffer.getvalue()
