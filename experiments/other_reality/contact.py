"""A rope on a moving frame that touches boxes, a floor and a domino, in MuJoCo.

Reads one request from standard input, a JSON object, and writes one answer to standard
output (SI units, quaternions scalar first). The request:

    rope            the nine parameters of a rope file; it hangs straight at the start
    bodies          what it can touch: [{"half_m": edges or null for a floor, "pose": [x, y, z,
                    qw, qx, qy, qz], "friction": number}]
    domino          null, or {"half_m", "pose", "mass_kg", "friction"}: a free box
    domino_stays    whether the rope still feels the domino once it has fallen
    pose_period_s   time between two poses of the frame; also the step of the simulation
    poses           [x, y, z, qw, qx, qy, qz] of the frame; the rope leaves along its -z
    every           steps from one reported place of the tip to the next

The answer: {"mujoco": version, "tip_m": x y z, time by time from the start, "first_s": when
the rope first touched anything or null, "down_at_s": when the domino's tilt passed 45 degrees
or null, "peak_tilt_rad": its greatest tilt up to then}.
"""
import json
import sys

import mujoco
import numpy as np

GRAVITY_M_S2 = 9.81
# So large that only the drive decides how the frame moves: the rope does not push back.
ARMATURE = 1e7
BASE_DOFS = 6
# Contacts: an overdamped spring, `timeconst dampratio`. One of damping ratio z returns about
# 1 / (4 z^2) of the speed of an impact, here 1 %; at 3 m/s it yields by 0.6 mm.
SOLREF = "4e-4 5"
SOLIMP = "0.99 0.999 0.0002"
# Friction that creeps a hundredth as fast as contacts yield.
IMPRATIO = 100
ROPE, DOMINO = 1, 2


def words(numbers):
    """Numbers as an attribute of MuJoCo's XML."""
    return " ".join(repr(float(x)) for x in numbers)


def moves_of(poses):
    """Turns from each attitude to the next, as rotation vectors in the moving frame."""
    q = poses[:, 3:].copy()
    before, after = q[:-1] * np.array([1.0, -1.0, -1.0, -1.0]), q[1:]
    w = before[:, :1] * after[:, :1] - np.sum(before[:, 1:] * after[:, 1:], axis=1, keepdims=True)
    v = before[:, :1] * after[:, 1:] + after[:, :1] * before[:, 1:] + np.cross(before[:, 1:], after[:, 1:])
    v = np.where(w < 0, -v, v)
    sine = np.linalg.norm(v, axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, np.abs(w))
    return v * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)


def xml(request):
    """Driven frame, ball-jointed capsules, lead, and what they touch.

    Springs and damping are implicit, as in `rope.py`: Newmark's weight of a quarter and the
    trapezoidal rule make leapfrog of second order and stable at any step. Here they count as
    armature of the joints, so that contacts know how heavy the rope is within a step.
    """
    rope, step_s = request["rope"], request["pose_period_s"]
    s = rope["length_m"] / rope["links"]
    mass = rope["mass_per_length_kg_per_m"] * s
    inertia = 0.4 * mass * max(rope["link_extra_scale"] * s / 2, rope["radius_m"]) ** 2
    lead_mass, lead_radius = rope["lead_mass_kg"], rope["lead_radius_m"]
    lead_inertia = 0.4 * lead_mass * lead_radius**2
    k, c = rope["joint_stiffness_nm_per_rad"], rope["joint_damping_nms_per_rad"]
    implicit = step_s * c / 2 + step_s**2 * k / 4
    touch = f'contype="{ROPE}" conaffinity="0" friction="0 0 0"'
    slides = "".join(
        f'<joint type="slide" axis="{axis}" armature="{ARMATURE!r}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    links = "".join(
        f'<body pos="0 0 {0.0 if index == 0 else -s!r}"><joint type="ball" stiffness="{k!r}" armature="{implicit!r}"/>'
        f'<inertial pos="0 0 {-s / 2!r}" mass="{mass!r}" diaginertia="{words([inertia] * 3)}"/>'
        f'<geom type="capsule" size="{rope["radius_m"]!r}" fromto="0 0 0 0 0 {-s!r}" {touch}/>'
        for index in range(rope["links"]))
    lead = (
        f'<body name="lead" pos="0 0 {-s!r}"><inertial pos="0 0 0" mass="{lead_mass!r}" '
        f'diaginertia="{words([lead_inertia] * 3)}"/><geom type="sphere" size="{lead_radius!r}" {touch}/></body>')
    static = "".join(
        f'<geom type="{"box" if body["half_m"] else "plane"}" size="{words(body["half_m"] or [0, 0, 1])}" '
        f'pos="{words(body["pose"][:3])}" quat="{words(body["pose"][3:])}" friction="{body["friction"]!r} 0 0" '
        f'contype="0" conaffinity="{ROPE | DOMINO}"/>'
        for body in request["bodies"])
    domino = request["domino"]
    free = "" if domino is None else (
        f'<body name="domino" pos="{words(domino["pose"][:3])}" quat="{words(domino["pose"][3:])}"><freejoint/>'
        f'<geom name="domino" type="box" size="{words(domino["half_m"])}" mass="{domino["mass_kg"]!r}" '
        f'friction="{domino["friction"]!r} 0 0" contype="{DOMINO}" conaffinity="{ROPE}"/></body>')
    return (
        '<mujoco><compiler angle="radian" inertiafromgeom="auto" balanceinertia="false" boundmass="0" boundinertia="0"/>'
        f'<option timestep="{step_s!r}" gravity="0 0 {-GRAVITY_M_S2}" integrator="Euler" solver="Newton" '
        f'cone="elliptic" impratio="{IMPRATIO}" tolerance="1e-12" iterations="50">'
        '<flag autoreset="disable" eulerdamp="disable"/></option>'
        f'<default><geom condim="3" solref="{SOLREF}" solimp="{SOLIMP}"/></default><worldbody>'
        '<body><inertial pos="0 0 0" mass="1e-3" diaginertia="1e-6 1e-6 1e-6"/>'
        f'{slides}<joint type="ball" armature="{ARMATURE!r}"/>{links}{lead}'
        f'{"</body>" * (rope["links"] + 1)}{static}{free}</worldbody></mujoco>')


def simulate(request):
    """The answer, see above."""
    model = mujoco.MjModel.from_xml_string(xml(request))
    data = mujoco.MjData(model)
    # The solver's tolerance is relative to it, and the drive is no part of the rope.
    model.stat.meaninertia = 1e-4
    rope_dofs = slice(BASE_DOFS, BASE_DOFS + 3 * request["rope"]["links"])
    damping = request["rope"]["joint_damping_nms_per_rad"]
    poses, step_s = np.array(request["poses"]), request["pose_period_s"]
    steps, every = len(poses) - 1, request["every"]
    # Steps of the frame, the first before the start: it stands. Their differences are what the
    # drive has to give, so that every pose is met.
    moves = np.zeros((steps + 1, BASE_DOFS))
    moves[1:, :3] = np.diff(poses[:, :3], axis=0)
    moves[1:, 3:] = moves_of(poses)
    rates, drives = moves[:-1] / step_s, ARMATURE * np.diff(moves, axis=0) / step_s**2
    lead = model.body("lead").id
    domino = request["domino"] and model.geom("domino").id
    is_rope = model.geom_contype == ROPE
    data.qpos[:7] = poses[0]
    tips, first_s, down_at_s, peak_rad = [], None, None, 0.0
    last = data.qvel.copy()
    for index in range(steps + 1):
        data.qpos[:7] = poses[index]
        if index == steps:
            mujoco.mj_kinematics(model, data)
        else:
            # Velocities belong to the middle of the step before; forces get them half a step on.
            data.qvel[:BASE_DOFS] = rates[index]
            velocity = data.qvel.copy()
            data.qvel[:] += (velocity - last) / 2
            last = velocity
            mujoco.mj_step1(model, data)
            data.qvel[:] = velocity
        if first_s is None and data.ncon and is_rope[data.contact.geom].any():
            first_s = index * step_s
        if index % every == 0:
            tips.append(data.xpos[lead].copy())
        if domino and down_at_s is None:
            tilt_rad = float(np.arccos(np.clip(data.geom_xmat[domino][8], -1.0, 1.0)))
            peak_rad = max(peak_rad, tilt_rad)
            if tilt_rad > np.pi / 4:
                down_at_s = index * step_s
                if not request["domino_stays"]:
                    model.geom_conaffinity[domino] = 0
        if index < steps:
            data.qfrc_applied[:BASE_DOFS] = drives[index]
            data.qfrc_applied[rope_dofs] = -damping * velocity[rope_dofs]
            mujoco.mj_step2(model, data)
    tips = np.array(tips)
    if not np.isfinite(tips).all() or np.abs(tips).max() > 100.0:
        raise SystemExit("the rope's simulation blew up: shorten pose_period_s")
    return {
        "mujoco": mujoco.__version__, "tip_m": tips.ravel().tolist(), "first_s": first_s,
        "down_at_s": down_at_s, "peak_tilt_rad": peak_rad}


if __name__ == "__main__":
    # Else they go to a file in the folder that this happens to run in.
    mujoco.set_mju_user_warning(lambda text: print(text, file=sys.stderr))
    json.dump(simulate(json.load(sys.stdin)), sys.stdout)
