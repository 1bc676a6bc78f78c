"""The clean log of the simulated robot of three joints that the tests of records use."""

import importlib.util
from pathlib import Path

_records = Path(__file__).parents[2] / "records" / "conftest.py"
_spec = importlib.util.spec_from_file_location("conftest_of_records", _records)
_module = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_module)

robot, clean = _module.robot, _module.clean
