"""A servo of another engine on a battery that runs down, whose voltage is in its log or is not."""

import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

import numpy as np  # noqa: E402
from law_robots import (  # noqa: E402
    DAMPING,
    K_T,
    OHM,
    PERIOD,
    SERVO_MOTOR,
    SERVO_TEXT,
    SUBSTEPS,
    SUPPLY,
    Robot,
    servo,
)

from clie_blocks import gap  # noqa: E402

SAG, SECONDS = 0.3, 8.0  # of the voltage over one log, and its duration [s]
BACK_EMF = K_T**2 / OHM  # N m s/rad, which the robot file counts as viscous friction


def voltage(time):
    return SUPPLY * (1.0 - SAG * time / SECONDS + 0.05 * np.sin(9.0 * time))


def battery():
    """Torque of a servo whose voltage falls and sways; each log begins with a charged battery."""
    steps, whole = 0, round(SECONDS / PERIOD)

    def torque(u, dq):
        nonlocal steps
        volts = voltage(PERIOD * (steps // SUBSTEPS % whole))
        steps += 1
        return K_T * (volts * u - K_T * dq) / OHM
    return torque


@pytest.mark.slow
@pytest.mark.parametrize("is_logged", [True, False])
def test_a_battery_that_runs_down_is_no_fault_where_its_voltage_was_logged(tmp_path, is_logged):
    Robot(lambda: servo(6.0, 0.0, 0.0), SERVO_TEXT, motor=SERVO_MOTOR,
          options={"torque": battery()}).write(tmp_path, seconds=SECONDS)
    file = tmp_path / "robot.toml"
    text = file.read_text().replace(f"[{DAMPING:g}]", f"[{DAMPING + BACK_EMF:g}]")
    file.write_text(text + ('[columns]\nsupply = "vbus"\n' if is_logged else ""))
    for log in tmp_path.glob("log-*.csv"):
        table = np.genfromtxt(log, delimiter=",")[1:]
        np.savetxt(log, np.column_stack([table, 1e3 * voltage(table[:, 0])]), "%.10g", ",",
                   header="time,q1,u1[duty],qd1,vbus [mV]", comments="")
    diagnosis = gap.diagnose(gap.read(tmp_path))
    assert (diagnosis.verdict == "none") is is_logged
    if not is_logged:
        assert diagnosis.reduction.before > 5 * diagnosis.reduction.floor
