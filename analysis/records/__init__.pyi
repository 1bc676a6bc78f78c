"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .model import Record as Record
from .read import read_record as read_record
from .read import read_records as read_records
from .read import read_trial as read_trial
from .resampling import align as align
from .resampling import resample as resample
from .robot import Robot as Robot
from .robot_file import read_robot as read_robot
from .write import write_record as write_record
