"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from . import effects as effects
from . import excitation as excitation
from . import paper as paper
from .analysis import gap as gap
from .analysis.gap import Problem as Problem
from .analysis.gap import diagnose as diagnose
from .analysis.records import Record as Record
from .analysis.records import Robot as Robot
from .analysis.records import read_records as read_records
from .analysis.records import read_robot as read_robot
from .compiled import compile_diagram as compile_diagram
from .compiled import held_normal as held_normal
from .controllers import linearizing_controller as linearizing_controller
from .controllers import pd_controller as pd_controller
from .controllers import sampled_cascade as sampled_cascade
from .controllers import sampled_pid as sampled_pid
from .diagrams.clie_composite import clie_composite as clie_composite
from .diagrams.clie_loop import clie_loop as clie_loop
from .diagrams.feedback_linearization import feedback_linearization as feedback_linearization
from .diagrams.joint_loop import joint_loop as joint_loop
from .diagrams.picture import draw as draw
from .effects import with_effects as with_effects
from .excitation import source as source
from .filters import lowpass as lowpass
from .filters import lowpass_with_rate as lowpass_with_rate
from .filters import velocity_filter as velocity_filter
from .identification import composite_update as composite_update
from .identification import filtered_regressor as filtered_regressor
from .identification import gradient_update as gradient_update
from .identification import identification_error as identification_error
from .identification import regressor as regressor
from .joints import decoupled_joints as decoupled_joints
from .joints import estimated_model as estimated_model
from .joints import inertial_joints as inertial_joints
from .joints import motor_side as motor_side
from .joints import normalised as normalised
from .manipulator import two_link_arm as two_link_arm
from .measurement import encoder as encoder
from .measurement import noisy_measurement as noisy_measurement
from .rigid_body.arm import articulated_arm as articulated_arm
from .rigid_body.mjcf import read_mjcf as read_mjcf
from .rigid_body.urdf import read_urdf as read_urdf
from .signals import interconnect as interconnect
from .signals import summing as summing

__version__: str
