# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 1. The loop: identify a robot while it is under control
#
# A robot arm runs in closed loop. You want its parameters, but you cannot open the loop, you cannot
# measure acceleration, and the sensors are noisy. *Closed-loop input error* identification (CLIE)
# answers with one idea: run a **model beside the robot, under the same controller, and compare what
# the two controllers ask for.** Where they differ, the model is wrong, and the difference says how
# to correct it.
#
# This notebook builds that loop block by block, as one would in Simulink. Every block is a
# [python-control](https://python-control.readthedocs.io) system, every picture is drawn from the
# diagram that runs, and headings name the figure or table of the paper ("Stable Robot Manipulator
# Parameter Identification: A Closed-Loop Input Error Approach").
#
# The course has five notebooks; each runs alone.
#
# | | Notebook | Question |
# |---|---|---|
# | 1 | **The loop** | What does the method of the paper do? Figs. 1 and 2 |
# | 2 | [Convergence](2_convergence.ipynb) | How fast are the estimates right, and when never? Figs. 3 and 4, Table 2 |
# | 3 | [Limits](3_limits.ipynb) | Which gains, filters, noises and solvers does it bear, and what are its numbers good for? Figs. 5 and 6, Tables 1 and 3 |
# | 4 | [The gap](4_the_gap.ipynb) | The fit is good, and still the robot differs. Why? |
# | 5 | [Real robots](5_real_robots.ipynb) | And on a real machine, and on an arm with a URDF? |
#
# **How to read it.** Each figure has a question above and its answer below: say your own answer before
# you look. Each claim is an `assert`: change a number, run the cell, and see which claim breaks. Sliders
# need a running kernel; without one the picture shows their first position.

# %% [markdown]
# ### Notation
#
# | symbol | in code | meaning | unit |
# |---|---|---|---|
# | $q,\ \dot q$ | `q`, `dq` | joint position and velocity | rad, rad/s |
# | $q_d$ | `q_d` | set-point | rad |
# | $u$ | `u` | motor torque that the controller asks for | N m |
# | $PE$ | `pe` | excitation, a torque added on purpose | N m |
# | $K_p,\ K_d$ | `kp`, `kd` | controller gains | N m/rad, N m s/rad |
# | $p,\ \dot p,\ v$ | `q_model`, `dq_model`, `u_model` | the same signals of the model | |
# | $A,\ B,\ D$ | `a`, `b`, `d` | parameters of $\ddot q = -A\dot q + Bu - D$ | 1/s, 1/(kg m²), rad/s² |
# | $\Theta,\ \hat\Theta$ | `theta`, `theta_hat` | $[A, B, D]$ of all joints, and the estimate | |
# | $e_u = v - u$ | `e_u` | input error | N m |
# | $\Gamma,\ \alpha$ | `gamma`, `alpha` | adaptation gains | |

# %%
# %matplotlib inline
# %config InlineBackend.figure_formats = ["png"]
import control as ct
import matplotlib.pyplot as plt
import numpy as np

from clie_blocks import (
    clie_loop,
    compile_diagram,
    decoupled_joints,
    estimated_model,
    gradient_update,
    interconnect,
    joint_loop,
    paper,
    pd_controller,
    regressor,
    summing,
    velocity_filter,
)
from clie_blocks.analysis.lesson import exercise, explore, picture, set_style
from clie_blocks.analysis.theory.frequency import closed_loop_poles
from clie_blocks.excitation import paper_excitation
from clie_blocks.manipulator import gravity
from clie_blocks.signals import signal

set_style()
KP, KD, Q_D = paper.KP, paper.KD, paper.SET_POINT
A, B, D = paper.THETA.reshape(3, 2)

# %% [markdown]
# ---
# ## 1.1 One joint under PD control (Fig. 1)
#
# The robot is the two-link arm of the paper's section 5: rigid links, gears, motors, gravity.
# The controller is (11),
#
# $$u = K_p\,(q_d - q) - K_d\,\dot q + PE .$$
#
# **Question.** The picture has two blocks. Which wire makes it a *closed* loop, and where do you
# expect gravity to show?
# %%
arm = paper.paper_arm()
fig_1 = joint_loop(arm, KP, KD)
picture(fig_1, names={"pd": "PD controller", "plant": "two-link arm"})

# %% [markdown]
# **Answer.** The wires $q,\ \dot q$ run back to the controller: the torque depends on the motion that
# it causes. Gravity is inside the arm. A thick line is a vector, here with one entry per joint.
#
# **Question.** There is no integral term. By how much will each joint miss its set-point, and what
# does the excitation add?

# %%
joint_program = compile_diagram(fig_1)
run = joint_program.run(10, step=1e-3, inputs={"q_d": Q_D, "pe": paper_excitation}, every=5)

fig, axes = plt.subplots(1, 2, layout="constrained")
for k, ax in enumerate(axes):
    ax.plot(run.time, 1e3 * (Q_D[k] - signal(run, "q")[k]))
    ax.set(xlabel="time [s]", ylabel="$q_d - q$ [mrad]", title=f"joint {k + 1}", ylim=(-40, 60))

# %% [markdown]
# **Answer.** At rest the controller must hold the weight, $K_p (q_d - q) = G(q)/r$, so the mean error
# is the gravity torque at the motor over $K_p$: about 2 mrad at joint 1. Around that mean, the
# excitation moves the arm by some $\pm 22$ mrad. That wobble is the price of learning anything.

# %%
whole_periods = (run.time >= 6 - 1e-9) & (run.time < 10 - 1e-9)
mean_error = np.mean(Q_D[:, None] - signal(run, "q")[:, whole_periods], axis=1)
weight = gravity(Q_D, paper.MASS, paper.LENGTH, paper.LENGTH) / paper.GEAR_RATIO

print("Kp x mean error [N m]:", KP * mean_error)
print("gravity at motor [N m]:", weight)
assert np.allclose(KP * mean_error, weight, atol=4e-4)
swing = np.ptp(signal(run, "q")[:, whole_periods], axis=1)
assert np.all((0.04 < swing) & (swing < 0.05))

# %% [markdown]
# **Try it.** Stiffer gains hold the weight better. Do they also make the wobble smaller, and what does
# it cost? Move $K_p$ first, then $K_d$.

# %%
def settle(kp=10.0, kd=5.0):
    """Run Fig. 1 with other gains of both joints, and draw error and torque of joint 1."""
    run = joint_program.run(10, step=1e-3, inputs={"q_d": Q_D, "pe": paper_excitation}, every=5,
                      params={"kp": [kp] * 2, "kd": [kd] * 2})
    fig, axes = plt.subplots(1, 2, layout="constrained")
    axes[0].plot(run.time, 1e3 * (Q_D[0] - signal(run, "q")[0]))
    axes[1].plot(run.time, signal(run, "u")[0])
    axes[0].set(xlabel="time [s]", ylabel="$q_d - q$ of joint 1 [mrad]", ylim=(-60, 60))
    axes[1].set(xlabel="time [s]", ylabel="torque $u$ of joint 1 [N m]", ylim=(-15, 15))
    plt.show()


explore(settle, kp=(2.0, 60.0), kd=(0.5, 12.0))

# %% [markdown]
# **Answer.** Twice the $K_p$ halves the mean error, but the torque at the start doubles, and the wobble stays
# as it is: at the frequencies of the excitation, $K_d$ and the inertia hold against it. Twice the $K_d$
# takes 30 % of the wobble away, and with it some of what there is to learn from (notebook 2). The first
# picture shows the gains of the paper.

# %%
swing = {}
for kp, kd in ((10.0, 5.0), (20.0, 5.0), (10.0, 10.0)):
    run = joint_program.run(20, step=1e-3, inputs={"q_d": Q_D, "pe": paper_excitation}, every=5,
                            params={"kp": [kp] * 2, "kd": [kd] * 2})
    late = signal(run, "q")[0, run.time >= 16 - 1e-9]
    swing[kp, kd] = np.ptp(late)
    print(f"Kp {kp:g}, Kd {kd:g}: mean error {1e3 * (Q_D[0] - late.mean()):.2f} mrad, "
          f"wobble +-{500 * np.ptp(late):.0f} mrad")
assert abs(swing[20.0, 5.0] / swing[10.0, 5.0] - 1) < 0.03
assert 0.65 < swing[10.0, 10.0] / swing[10.0, 5.0] < 0.75

# %% [markdown]
# ---
# ## 1.2 The identification loop, one block at a time (Fig. 2)
#
# Behind a gear of 100, the links hardly feel each other, and each joint is nearly (9)
#
# $$\ddot q = -A\,\dot q + B\,u - D .$$
#
# For the theory we let the robot *be* (9), with the "approximate real values" of Table 2. The six
# numbers in $A$, $B$, $D$ are what we want to find.
#
# **Block 1: the robot under its controller.** Every port that no wire feeds must be an input of
# the diagram; every port that no wire reads must be shown. Anything else is an error, not a guess.

# %%
robot = decoupled_joints(A, B, D, name="plant")
blocks_1 = [pd_controller(KP, KD, name="pd"), robot]
wires_1 = [("plant.u", "pd.u"), ("pd.q", "plant.q"), ("pd.dq", "plant.dq")]

step_1 = interconnect(
    blocks_1, wires_1, name="step_1",
    inputs={"q_d": "pd.q_d", "pe": "pd.pe"},
    outputs={"q": "plant.q", "u": "pd.u"})
assert step_1.nstates == 4
picture(step_1)

# %% [markdown]
# **Block 2: the estimated model** (19), $\ddot p = -\hat A\,\dot p + \hat B\,v - \hat D$. It has the
# robot's ports, and one more: its parameters arrive as a *signal*, because they will change while it
# runs.
#
# **Question.** What feeds the model now?

# %%
blocks_2 = [*blocks_1, estimated_model(2, name="model")]

step_2 = interconnect(
    blocks_2, wires_1, name="step_2",
    inputs={"q_d": "pd.q_d", "pe": "pd.pe", "u_model": "model.u", "theta_hat": "model.theta_hat"},
    outputs={"q": "plant.q", "q_model": "model.q", "dq_model": "model.dq"})
assert step_2.nstates == 8 and step_2.ninputs == 12
picture(step_2)

# %% [markdown]
# **Answer.** Nothing yet: `u_model` and `theta_hat` are inputs of the diagram. The next blocks will
# close these open ends.
#
# **Block 3: the model's own controller** (20). Same law, same gains, same set-point, same
# excitation, but it sees the *model's* motion.
#
# **Question.** Why not simply send the robot's $u$ to the model?

# %%
blocks_3 = [*blocks_2, pd_controller(KP, KD, name="pd_model")]
wires_3 = [*wires_1,
           ("model.u", "pd_model.u"), ("pd_model.q", "model.q"), ("pd_model.dq", "model.dq")]

step_3 = interconnect(
    blocks_3, wires_3, name="step_3",
    inputs={"q_d": ["pd.q_d", "pd_model.q_d"], "pe": ["pd.pe", "pd_model.pe"],
            "theta_hat": "model.theta_hat"},
    outputs={"q": "plant.q", "u": "pd.u", "q_model": "model.q", "u_model": "pd_model.u"})

free_model = ct.linearize(step_2, np.zeros(8), np.r_[np.zeros(6), A, B, D])
held_model = ct.linearize(step_3, np.zeros(8), np.r_[np.zeros(4), A, B, D])
free_poles, held_poles = np.linalg.eigvals(free_model.A), np.linalg.eigvals(held_model.A)
print("poles with an open model  [rad/s]:", np.sort(free_poles.real).round(2))
print("poles with a closed model [rad/s]:", np.sort(held_poles.real).round(2))
assert np.max(free_poles.real) > -1e-9 and np.max(held_poles.real) < -1
picture(step_3)

# %% [markdown]
# **Answer.** An open model has a pole at zero: the smallest parameter error makes it drift away from
# the robot for ever. Under its own controller it stays near, whatever its parameters are. That is
# the "closed loop" in the name of the method.
#
# **Block 4: the input error** (26), $e_u = v - u$.
#
# **Question.** Take one wrong parameter, say $\hat A$ 20 % too small. What do you see in $e_u$?

# %%
blocks_4 = [*blocks_3, summing("u_model", "-u", output="e_u", n=2, name="input_error")]
wires_4 = [*wires_3, ("input_error.u_model", "pd_model.u"), ("input_error.u", "pd.u")]

step_4 = interconnect(
    blocks_4, wires_4, name="step_4",
    inputs={"q_d": ["pd.q_d", "pd_model.q_d"], "pe": ["pd.pe", "pd_model.pe"],
            "theta_hat": "model.theta_hat"},
    outputs={"q": "plant.q", "q_model": "model.q", "e_u": "input_error.e_u"})
picture(step_4)

# %%
program = compile_diagram(step_4)
drive = {"q_d": Q_D, "pe": paper_excitation}
watched = ["e_u", "plant.q", "plant.dq", "model.q", "model.dq"]
right, wrong = (
    program.run(10, step=1e-3, inputs={**drive, "theta_hat": theta}, log=watched, every=5)
    for theta in (np.r_[A, B, D], np.r_[0.8 * A, B, D]))

fig, ax = plt.subplots(layout="constrained")
ax.plot(wrong.time, signal(wrong, "e_u")[0], label=r"$\hat A$ 20 % too small")
ax.plot(right.time, signal(right, "e_u")[0], label="true parameters")
ax.set(xlabel="time [s]", ylabel="input error $e_u$, joint 1 [N m]")
ax.legend();

# %% [markdown]
# **Answer.** With the true parameters the two controllers ask for the same: $e_u = 0$. With a wrong
# one they do not. Nothing was measured that the controller did not have already: by (26), $e_u$ is
# just the output error as the controller sees it, $e_u = K_p e + K_d \dot e$ with $e = q - p$.

# %%
e = signal(wrong, "plant.q") - signal(wrong, "model.q")
de = signal(wrong, "plant.dq") - signal(wrong, "model.dq")
assert np.allclose(signal(wrong, "e_u"), KP[:, None] * e + KD[:, None] * de, atol=1e-12)
assert np.max(np.abs(signal(right, "e_u"))) < 1e-12

# %% [markdown]
# **Block 5: the regressor** (22), which says *which* parameter is to blame. The model's acceleration
# is linear in its parameters,
#
# $$\ddot p = -\Phi_p^T\,\hat\Theta, \qquad
# \Phi_p = [\,\dot p,\; -v,\; 1\,]^T \text{ for each joint.}$$
#
# **Question.** The regressor is built from the model's signals, not the robot's. What does that buy?

# %%
blocks_5 = [*blocks_4, regressor(2, name="regressor")]
wires_5 = [*wires_4, ("regressor.dq", "model.dq"), ("regressor.u", "pd_model.u")]

step_5 = interconnect(
    blocks_5, wires_5, name="step_5",
    inputs={"q_d": ["pd.q_d", "pd_model.q_d"], "pe": ["pd.pe", "pd_model.pe"],
            "theta_hat": "model.theta_hat"},
    outputs={"q": "plant.q", "q_model": "model.q", "e_u": "input_error.e_u",
             "phi": "regressor.phi"})
picture(step_5)

# %%
theta_hat = np.array([1.5, 2.5, 0.4, 0.6, 0.1, -0.2])
x = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])  # plant q, dq, then model q, dq
u = np.r_[Q_D, 0.3, -0.1, theta_hat]
phi = step_5.output(0, x, u)[-12:].reshape(6, 2)
assert np.allclose(step_5.dynamics(0, x, u)[6:], -phi.T @ theta_hat)

# %% [markdown]
# **Answer.** No sensor noise enters $\Phi_p$. (Noise still enters through $e_u$, once the controller
# uses a measured position. We come back to that in notebook 3.)
#
# **Block 6: the update law** (27) closes the figure:
#
# $$\dot{\hat\Theta} = -\Gamma\,\Phi_p\,K_d K_p^{-1} e_u .$$
#
# **Question.** Which inputs are left?

# %%
blocks_6 = [*blocks_5, gradient_update(20.0, KP, KD, name="update")]
wires_6 = [*wires_5, ("update.e_u", "input_error.e_u"), ("update.phi", "regressor.phi"),
           ("model.theta_hat", "update.theta_hat")]

fig_2 = interconnect(
    blocks_6, wires_6, name="fig_2",
    inputs={"q_d": ["pd.q_d", "pd_model.q_d"], "pe": ["pd.pe", "pd_model.pe"]},
    outputs={"q": "plant.q", "q_model": "model.q", "e_u": "input_error.e_u",
             "theta_hat": "update.theta_hat"})
picture(fig_2, names={"pd": "PD controller", "plant": "robot", "pd_model": "PD controller",
                      "model": "estimated model", "update": "update law"})

# %% [markdown]
# **Answer.** Only the set-point and the excitation. The loop now teaches itself. The package has the
# same diagram as one function, `clie_loop`; the two agree in every derivative.

# %%
ready_made = clie_loop(robot, KP, KD, 20.0)
random = np.random.default_rng(0)
for _ in range(5):
    x, u = random.normal(size=14), random.normal(size=4)
    assert np.allclose(fig_2.dynamics(0, x, u), ready_made.dynamics(0, x, u), atol=1e-12)

# %% [markdown]
# ---
# ## 1.3 Exercises
#
# Replace `...` by your answer and run the cell below it. It says whether you are right.
# A solution is folded under each exercise.

# %% [markdown]
# ### Exercise 1. The update law
#
# Write the right-hand side of (27), $-\Gamma\,\Phi_p K_d K_p^{-1} e_u$, for a scalar `gamma`, `phi` of
# shape (3n, n) and gains as vectors of length n.

# %%
my_update = ...  # a function of phi, e_u, gamma, kp, kd


# %%
@exercise
def exercise_1(update):
    block = gradient_update(7.0, [8.0, 3.0], [4.0, 2.0])
    for seed in range(5):
        draw_one = np.random.default_rng(seed)
        phi, e_u = draw_one.normal(size=(6, 2)), draw_one.normal(size=2)
        wanted = block.dynamics(0, np.zeros(6), np.r_[e_u, phi.ravel()])
        found = update(phi, e_u, 7.0, np.array([8.0, 3.0]), np.array([4.0, 2.0]))
        assert np.shape(found) == (6,), f"shape {np.shape(found)}, wanted (6,)"
        assert np.allclose(found, wanted), "look at the order Kd / Kp and at the sign"


exercise_1(my_update)

# %% [markdown]
# <details><summary>Solution</summary>
#
# ```python
# def my_update(phi, e_u, gamma, kp, kd):
#     return -gamma * phi @ (kd / kp * e_u)
# ```
#
# </details>

# %% [markdown]
# ### Exercise 2. Wire it yourself
#
# Build Fig. 1 for `decoupled_joints(A, B, D)` with the velocity from the filter G1: the blocks are
# named `pd`, `plant` and `velocity_filter` (its ports are `q` and `dq`). Show `q` only. The plant's
# own `dq` then stays open on purpose: `unused=["plant.dq"]`.

# %%
filtered_loop = ...


# %%
@exercise
def exercise_2(diagram):
    assert {block.name for block in diagram.syslist} == {"pd", "plant", "velocity_filter"}
    assert diagram.noutputs == 2, "show q of both joints, and nothing else"
    poles = np.linalg.eigvals(ct.linearize(diagram, np.zeros(8), np.zeros(4)).A)
    wanted = closed_loop_poles(decoupled_joints(A, B, D), KP, KD, filtered=True).values
    assert np.allclose(np.sort_complex(poles), np.sort_complex(wanted), atol=1e-6), (
        "the poles differ: does pd.dq come from the filter, and does the filter read plant.q?")


exercise_2(filtered_loop)

# %% [markdown]
# <details><summary>Solution</summary>
#
# ```python
# filtered_loop = interconnect(
#     [pd_controller(KP, KD, name="pd"), decoupled_joints(A, B, D), velocity_filter(2)],
#     [("plant.u", "pd.u"), ("pd.q", "plant.q"),
#      ("velocity_filter.q", "plant.q"), ("pd.dq", "velocity_filter.dq")],
#     inputs={"q_d": "pd.q_d", "pe": "pd.pe"}, outputs={"q": "plant.q"},
#     unused=["plant.dq"], name="filtered_loop")
# ```
#
# </details>

