"""Targets that are source text around the core of a joint, in the words of a simulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

from clie_blocks.analysis.export.c_target import notes
from clie_blocks.analysis.export.core import Core, core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.errors import ClieError


@dataclasses.dataclass(frozen=True)
class SourceTarget:
    """One such target.

    Parameters
    ----------
    of_joint : dict of str to str
        Template of each file of a joint, by the name of the file, with ``{name}`` or
        ``{class_name}`` for the joint.
    ran : str
        What was checked, and where.
    in_c : bool
        Whether it calls the C file, which is then written beside it.
    of_robot : dict of str to str
        Template of each file that holds all joints, by its name.
    at_controller : bool
        Whether its blocks step at the period of the controller where no step is given.
    in_hertz : bool
        Whether it runs at a whole number of Hz.
    commanded : str
        What says how much logged command a unit of torque is, where it commands a torque.

    """

    of_joint: Mapping[str, str]
    ran: str
    in_c: bool = True
    of_robot: Mapping[str, str] = dataclasses.field(default_factory=dict)
    at_controller: bool = False
    in_hertz: bool = False
    commanded: str = ""

    def files(self, cores: Sequence[Core]) -> dict[str, str | bytes]:
        """Return the files of some joints.

        Raises
        ------
        ClieError
            If two joints have the same name in code.

        """
        files: dict[str, str | bytes] = {}
        names: dict[str, str] = {}
        for made in cores:
            name = made.block.joint.name
            if (other := names.setdefault(made.class_name, name)) != name:
                raise ClieError(f"the joints {other!r} and {name!r} have the same name in code, "
                                f"{made.class_name}; give one another with --joint {name}=NAME")
            files |= {
                name.format(name=made.name, class_name=made.class_name): fill(template, core=made)
                for name, template in self.of_joint.items()}
            if self.in_c:
                files |= {f"{made.name}.c": made.c_source(), f"{made.name}.h": made.c_header()}
        return files | {name: fill(template, cores=cores)
                        for name, template in self.of_robot.items()}

    def notes(self, cores: Sequence[Core]) -> Iterator[str]:
        """Yield what the user must know of the commands of some joints."""
        for made in cores:
            if self.commanded and abs(made.command_per_force - 1.0) >= 1e-9:
                joint = made.block.joint
                quantity = "force" if joint.slides else "torque"
                yield (f"{joint.name}: your controller commands the {quantity} of the joint in "
                       f"{joint.unit_torque}, which by gear and gain is "
                       f"{1.0 / made.command_per_force:.6g} times the logged command "
                       f"[{joint.unit_u}]; where it commands what was logged, set "
                       f"{self.commanded} to 1.")


SOURCE_TARGETS = {
    "python-control": SourceTarget(
        {"{name}_control.py": "python_control.py.j2"},
        "The tests of this package run such blocks in python-control.", in_c=False),
    "drake": SourceTarget(
        {"{name}_drake.py": "drake.py.j2"},
        "The tests of this package run such systems in Drake where pydrake is installed.",
        in_c=False),
    "simulink": SourceTarget(
        {"{name}_sfun.c": "s_function.c.j2"},
        "The tests of this package compile and run such S-functions against a stand-in for "
        "simstruc.h; they were never run in Simulink."),
    "ros2-control": SourceTarget(
        {"{name}_controller.cpp": "ros2_controller.cpp.j2"},
        "The tests of this package compile and run such controllers against a stand-in for the "
        "headers of ros2_control; they were never run in ROS 2.",
        of_robot={"CMakeLists.txt": "ros2_cmake.txt.j2", "package.xml": "ros2_package.xml.j2",
                  "corrected_joints.xml": "ros2_plugins.xml.j2",
                  "controllers.yaml": "ros2_controllers.yaml.j2"},
        at_controller=True, in_hertz=True, commanded="command_per_effort"),
    "modelica": SourceTarget(
        {"CorrectedJoints/{class_name}.mo": "modelica_joint.mo.j2",
         "CorrectedJoints/Resources/Include/{name}_modelica.h": "modelica.h.j2"},
        "The tests of this package compile and run the C that such models call; the models were "
        "never run in a Modelica tool.",
        in_c=False, of_robot={"CorrectedJoints/package.mo": "modelica_package.mo.j2",
                              "CorrectedJoints/Internal.mo": "modelica_internal.mo.j2"}),
    "isaac": SourceTarget(
        {},
        "The tests of this package run such actuators against a stand-in for isaaclab, and in "
        "PyTorch where it is installed; they were never run in Isaac Lab.",
        in_c=False, of_robot={"corrected_actuators.py": "isaac.py.j2"}, at_controller=True,
        commanded="command_per_effort in JOINTS"),
    "newton": SourceTarget(
        {},
        "The tests of this package compile and run the native functions, and run the kernels in "
        "Warp where it is installed; they were never run in Newton.",
        in_c=False, of_robot={"corrected_joints_newton.py": "newton.py.j2"}, at_controller=True,
        commanded="per_effort"),
}


def export_source(correction: Correction, step: float, target: str) -> Exported:
    """Return the source of every joint.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    step : float
        Sample time of the blocks [s].
    target : str
        One of `SOURCE_TARGETS`.

    Raises
    ------
    ClieError
        If the target cannot take the step.

    """
    how = SOURCE_TARGETS[target]
    if how.in_hertz and abs(1.0 / step - round(1.0 / step)) > 1e-6 / step:
        raise ClieError(f"the target {target!r} runs at a whole number of Hz, and a step of "
                        f"{step:g} s is {1.0 / step:g} Hz; give the step of your simulated "
                        "controllers with --step")
    cores = [core(joint_block(correction, k, step)) for k in range(len(correction.joints))]
    told = (*notes(correction), *how.notes(cores))
    return Exported(target, how.files(cores), told, ran=how.ran)
