"""MuJoCo, used as the exported file tells its user."""

import numpy as np


def law_in_steps(law, log):
    """Command of the sampled law at each position, started at rest at the start of a log."""
    memory = np.zeros((2, len(log.start)))

    def command(i, q):
        x = q - log.start
        rate = law.numerator[0] * x + memory[0]
        memory[0] = law.numerator[1] * x - law.denominator[1] * rate + memory[1]
        memory[1] = law.numerator[2] * x - law.denominator[2] * rate
        return law.command(log.q_d[i] - q, rate, log.pe[i])

    return command


def run(model, problem, log):
    """Positions of a MuJoCo model under the law of a problem in the experiment of a log."""
    import mujoco

    data, command = mujoco.MjData(model), law_in_steps(problem.law, log)
    data.qpos[:] = log.start
    steps, positions = round(problem.period / model.opt.timestep), np.empty_like(log.q)
    for i in range(len(log)):
        positions[i] = data.qpos
        data.ctrl[:] = command(i, data.qpos.copy())
        mujoco.mj_step(model, data, steps)
    return positions


def loaded(text):
    """The exported file as it is written."""
    import mujoco

    return mujoco.MjModel.from_xml_string(text)


def gap(positions, logs):
    """RMS prediction error over all joints, as the report counts it."""
    squares = [np.sum((log.q - q) ** 2, axis=1) for q, log in zip(positions, logs, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(squares))))
