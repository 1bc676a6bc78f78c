"""Motors, passive parts of motors, tendons and sensors of a robot, as text for MuJoCo."""

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot

STEP, COARSE = 5e-4, 1e-3  # s, of the engine: where something is stiff, and elsewhere
ANCHOR, LEVER = 0.2, 0.06  # m, where a counterbalance holds on to the link before, and to its own
_OHM = 1e-9  # of a heated motor: small, so that its speed does not brake it
_EXPANSION = 4e-3  # 1/K, of the resistance of copper


def true_ratio(robot: DrawnRobot, p: Parameters, k: int) -> float:
    """Gear ratio as built: the link travels ``1 + ratio_error`` times as far as stated."""
    return float(robot.ratio[k] / (1 + p["ratio_error"][k]))


def motor(robot: DrawnRobot, p: Parameters, lane: int, k: int) -> str:
    """Motor of a joint; one that moves two joints pulls the tendon ``t{lane}_{k}``."""
    limit, ratio = p["limit"][k], true_ratio(robot, p, k)
    name = f'name="u{lane}_{k}"'
    at = f'tendon="t{lane}_{k}"' if p["travel_of_neighbour"][k] else f'joint="a{lane}_{k}"'
    if p["heating"][k] > 0:
        resistance = p["heating"][k] * _OHM / _EXPANSION  # K/W
        return (f'<dcmotor {name} {at} gear="{ratio}" motorconst="{_OHM} {_OHM}" '
                f'resistance="{_OHM}" thermal="{resistance} 0 {p["heating_time"][k]} '
                f'{_EXPANSION} 20 20"/>')
    if p["back_emf"][k] > 0:  # a torque of K (V - K w) / R is u - K w for K = R and V = u
        brake = p["back_emf"][k]
        return (f'<dcmotor {name} {at} gear="{ratio}" motorconst="{brake} {brake}" '
                f'resistance="{brake}"/>')
    parts = [f'{name} {at} gear="{ratio * p["gain"][k]}"']
    if np.isfinite(limit):
        parts.append(f'forcerange="-{limit} {limit}"')
    if p["lag"][k] > STEP / 2:  # the engine cannot follow what is faster, nor would it show
        parts.append(f'dyntype="filter" dynprm="{p["lag"][k]}"')
    if p["delay"][k] > 0:
        parts.append(f'delay="{p["delay"][k]}" nsample="{int(p["delay"][k] / STEP) + 4}" '
                     'interp="linear"')
    return f'<general {" ".join(parts)}/>'


def passive(robot: DrawnRobot, p: Parameters, lane: int, k: int) -> str:
    """Cogging and bristles, as a motor without input; in the gear, bristles alone."""
    parts, ratio = [], robot.ratio[k]
    if p["ripple"][k] > 0:
        parts.append(f'cogging="{p["ripple"][k]} {round(p["poles"][k])} {p["phase"][k]}"')
    if p["bristle"][k] > 0:
        level = p["bristle"][k]
        parts.append(_bristles(level, level / (p["bristle_range"][k] * ratio)))
    found = _without_input(f"a{lane}_{k}", ratio, parts) if parts else ""
    if p["twist_slip"][k] > 0:
        found += _without_input(f"b{lane}_{k}", 1.0, [_bristles(
            p["twist_slip"][k], p["twist_slip_stiffness"][k])])
    return found


def _bristles(level: float, stiffness: float) -> str:
    return f'lugre="{stiffness} 0 {level} {level} 1"'


def _without_input(joint: str, gear: float, parts: list[str]) -> str:
    return (f'<dcmotor joint="{joint}" gear="{gear}" input="none" motorconst="0 0" '
            f'resistance="1" {" ".join(parts)}/>')


def tendons(robot: DrawnRobot, p: Parameters, lane: int, k: int) -> str:
    """Belt that runs over the joint before, with the rotor at its end; counterbalance spring.

    The engine couples inertia along a chain alone, so links side by side can have no such belt.
    """
    found, r2, travel = "", true_ratio(robot, p, k) ** 2, p["travel_of_neighbour"][k]
    if travel:  # q_k = rotor + travel q_(k-1), so the rotor turns by the rest
        found += (f'<fixed name="t{lane}_{k}" armature="{p["rotor"][k] * r2}" '
                  f'damping="{p["drag"][k] * r2}">'
                  f'<joint joint="a{lane}_{k}" coef="1"/>'
                  f'<joint joint="a{lane}_{k - 1}" coef="{-travel}"/></fixed>')
    if p["balance"][k]:  # torque amplitude = rate of the spring times both levers
        rate = p["balance"][k] / (ANCHOR * LEVER)
        found += (f'<spatial name="c{lane}_{k}" stiffness="{rate}" '
                  f'springlength="{p["balance_slack"][k] * ANCHOR}">'
                  f'<site site="anchor{lane}_{k}"/><site site="lever{lane}_{k}"/></spatial>')
    return found


def delayed_encoder(delay: float, lane: int, k: int) -> str:
    """Angle some time ago [s]; the engine reads its sensors at the beginning of a step."""
    delay = max(delay - STEP, 1e-9)
    return (f'<jointpos name="s{lane}_{k}" joint="a{lane}_{k}" delay="{delay}" '
            f'nsample="{int(delay / STEP) + 4}" interp="linear"/>')
