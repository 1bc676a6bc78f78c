"""The causes that a gap is searched for, in the order of the report; one file per family."""

from clie_blocks.analysis.gap.causes import drive, friction, load, sensor, timed, transmission

CAUSES = (
    friction.COULOMB, friction.STRIBECK, friction.ASYMMETRIC_COULOMB, friction.QUADRATIC_DRAG,
    *friction.LOAD_DEPENDENT_FRICTION, friction.PRESLIDING, load.GRAVITY, load.GRAVITY_IN_SPACE,
    load.PAYLOAD, load.COUPLING, transmission.JOINT_ELASTICITY, transmission.BACKLASH,
    drive.ACTUATOR_SATURATION, drive.DEAD_ZONE, drive.ACTUATOR_LAG, drive.TIME_DELAY,
    drive.TORQUE_RIPPLE, drive.TORQUE_GAIN_ERROR, sensor.ENCODER_ECCENTRICITY,
    sensor.ENCODER_DELAY, timed.PERIODIC_DISTURBANCE, *friction.FRICTION_DRIFT, load.SPRING,
    *timed.STEP_FAULT, friction.DAHL, friction.MAXWELL_SLIP, friction.POSITION_DEPENDENT_FRICTION,
    friction.REST_TIME_BREAKAWAY, friction.DIRECTIONAL_EFFICIENCY, load.COUNTERBALANCE,
    load.BASE_TILT, load.BASE_TILT_IN_SPACE, drive.COMMUTATION_RIPPLE, drive.GEAR_MESH_RIPPLE,
    drive.TORQUE_SPEED_LIMIT, *drive.TORQUE_SLEW, drive.SUPPLY_SAG, drive.MOTOR_HEATING,
    friction.FLUID_DRAG, sensor.COUPLED_JOINTS, sensor.KINEMATIC_ERROR, load.SOFT_STOP,
    transmission.STIFFENING_ELASTICITY, transmission.TORSIONAL_HYSTERESIS, drive.TICK_JITTER,
    drive.PACKET_HOLD, drive.TORQUE_QUANTIZATION, sensor.KINEMATIC_ERROR_FELT,
    sensor.COUPLED_JOINTS_FELT,
)
