"""The rope in MuJoCo, stepped by its own integrators.

The attach frame hangs on six driven joints (three slides, three hinges). Each carries so
much armature that the motor alone decides its acceleration, so that velocity and
acceleration of the frame enter the rope's equations.
"""
import time

import mujoco
import mujoco.rollout
import numpy as np

from truth import CHANNELS, derived

ARMATURE = 1e9
# On this model "implicitfast" gives the same motion to the last bit, at the same speed.
# "implicit" costs four times as much a step and is no more accurate here; RK4 treats
# damping explicitly and is stable below about 2 us only.
SCHEMES = ("Euler",)


def version():
    return mujoco.__version__


def model_xml(case, scheme, step_s):
    """Driven base, ball-jointed links, lead as part of the last link; no contacts."""
    rope = case.rope
    s, m, i, lead_i = derived(rope)
    kinds = {"x": ("slide", "1 0 0"), "y": ("slide", "0 1 0"), "z": ("slide", "0 0 1"),
             "yaw": ("hinge", "0 0 1"), "pitch": ("hinge", "0 1 0"), "roll": ("hinge", "1 0 0")}
    joints = "".join(
        f'<joint name="{name}" type="{kinds[name][0]}" axis="{kinds[name][1]}" armature="{ARMATURE!r}"/>'
        for name in CHANNELS
    )
    motors = "".join(f'<motor joint="{name}" gear="{ARMATURE!r}"/>' for name in CHANNELS)
    arm = " ".join(repr(x) for x in case.arm_m)
    bodies = "".join(
        f'<body pos="{arm if index == 0 else f"0 0 {-s!r}"}">'
        f'<joint type="ball" stiffness="{rope["k"]!r}" damping="{rope["c"]!r}"/>'
        f'<inertial pos="0 0 {-s / 2!r}" mass="{m!r}" diaginertia="{i!r} {i!r} {i!r}"/>'
        for index in range(rope["N"])
    )
    return (
        '<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false" boundmass="0" boundinertia="0"/>'
        f'<option gravity="0 0 -9.81" timestep="{step_s!r}" integrator="{scheme}">'
        '<flag constraint="disable" contact="disable"/></option>'
        '<worldbody><body><inertial pos="0 0 0" mass="1e-3" diaginertia="1e-6 1e-6 1e-6"/>'
        + joints + bodies
        + f'<body pos="0 0 {-s!r}"><inertial pos="0 0 0" mass="{rope["m_L"]!r}" '
        f'diaginertia="{lead_i!r} {lead_i!r} {lead_i!r}"/></body>'
        + "</body>" * (rope["N"] + 1)
        + f"</worldbody><actuator>{motors}</actuator></mujoco>"
    )


def accelerations(case, scheme, step_s, steps):
    """Motor inputs, shape (steps, 6), that put the frame exactly on its path.

    One-stage schemes advance velocity first and position with the new velocity: central
    second differences make every position exact and every acceleration centred. RK4
    holds its input over the step: the mean acceleration of the step.
    """
    out = np.zeros((steps, len(CHANNELS)))
    t_s = step_s * np.arange(steps + 1)
    for column, name in enumerate(CHANNELS):
        channel = case.channels[name]
        if channel is None:
            continue
        if scheme == "RK4":
            velocity = (channel.value(t_s + 1e-6) - channel.value(t_s - 1e-6)) / 2e-6
            out[:, column] = np.diff(velocity) / step_s
        else:
            path = np.concatenate([[channel.value(0.0)], channel.value(t_s)])
            out[:, column] = np.diff(path, 2) / step_s**2
    return out


def simulate(case, scheme, step_s):
    """Tip track, shape (frames, 3), and CPU seconds of the stepping alone.

    Steps run inside the library (`mujoco.rollout`) from one frame to the next; inputs
    are made beforehand and not timed.
    """
    per_frame = round(1.0 / (case.frame_rate_hz * step_s))
    step_s = 1.0 / (case.frame_rate_hz * per_frame)
    model = mujoco.MjModel.from_xml_string(model_xml(case, scheme, step_s))
    data = mujoco.MjData(model)
    steps = per_frame * (case.frame_count - 1)
    controls = accelerations(case, scheme, step_s, steps).reshape(case.frame_count - 1, per_frame, -1)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.zeros(size)
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.zeros((1, per_frame, size))
    sensors = np.zeros((1, per_frame, 0))
    tip_m = np.full((case.frame_count, 3), np.nan)
    cpu_s = 0.0
    for frame in range(case.frame_count):
        if frame > 0:
            started = time.process_time()
            mujoco.rollout.rollout(model, data, state, controls[frame - 1], state=states, sensordata=sensors)
            cpu_s += time.process_time() - started
            state = states[0, -1].copy()
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        mujoco.mj_kinematics(model, data)
        tip_m[frame] = data.xpos[-1]
        if np.abs(tip_m[frame]).max() > 100.0 or not np.isfinite(tip_m[frame]).all():
            return np.full((case.frame_count, 3), np.nan), cpu_s
    return tip_m, cpu_s
