"""A rope that hangs on a moving frame, with physics that the planner's equations leave out.

Reads one request from standard input, a JSON object, and writes one answer to standard
output. MuJoCo has the equations of motion; this file adds what it lacks. The request (SI units,
quaternions scalar first):

    rope            the nine parameters of a rope file, and its table `extras` or null
    refinement      links for each link of the rope; bending stiffness and damping stay
    clamp_tilt_rad  [x, y]: the rope leaves the frame at this angle
    sway            {"angle_rad": [x, y], "rate_rad_s": [x, y]}: swing at the start, about the
                    world's horizontal axes
    seed            of the shape from which the rope comes to rest before the start
    pose_period_s   time between two poses of the frame; also the step of the simulation
    poses           [x, y, z, qw, qx, qy, qz] of the frame; the rope leaves along its -z
    times_s         when nodes are wanted, in increasing order
    nodes           how many, uniform in arc length; the first is the clamp, the last the tip

The answer is {"mujoco": version, "nodes_m": numbers}: time by time, node by node, x y z.
"""
import json
import sys

import mujoco
import numpy as np

GRAVITY_M_S2 = 9.81
# So large that only the drive decides how the frame moves: the rope does not push back.
ARMATURE = 1e9
BASE_DOFS = 6
# Newmark's weight of new accelerations in the springs; stable at any step from 1/4 on.
IMPLICIT = 0.25
# Coming to rest: step (s), steps, damping per mass (1/s), damping per stiffness (s).
REST_STEP_S, REST_STEPS, REST_RATE, REST_RETARDATION_S = 1e-3, 4000, 10.0, 0.02
# Angle of the swing from which the shape of a rate is taken (rad).
SHAPE_RAD = 0.02
# How far from equilibrium the rope starts on its way to rest: swing (rad), curvature (rad/m).
HANDLED_RAD, HANDLED_RAD_PER_M = 0.05, 0.3


def product(a, b):
    """Products of quaternions in rows."""
    w = a[..., 0] * b[..., 0] - np.sum(a[..., 1:] * b[..., 1:], axis=-1)
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([w[..., None], v], axis=-1)


def inverse(q):
    """Inverse unit quaternions."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def exponential(turn):
    """Quaternions of rotation vectors."""
    half = np.linalg.norm(turn, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), turn / 2 * np.sinc(half / np.pi)], axis=-1)


def logarithm(q):
    """Rotation vectors of unit quaternions, the shorter way round."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    return q[..., 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)


def across(pair):
    """A vector across the rope."""
    return np.array([pair[0], pair[1], 0.0])


class Rope:
    """Model, state and everything that acts on the rope beside MuJoCo's own forces."""

    def __init__(self, request):
        rope, self.sway = request["rope"], request["sway"]
        self.tilt = exponential(across(request["clamp_tilt_rad"]))
        extras = rope["extras"] or {}
        refinement = request["refinement"]
        self.links = rope["links"] * refinement
        self.s = rope["length_m"] / self.links
        place = (2 * np.arange(self.links) + 1) / self.links - 1
        mass = rope["mass_per_length_kg_per_m"] * self.s
        radius = max(rope["link_extra_scale"] * self.s / 2, rope["radius_m"])
        first = np.ones(self.links)
        first[0] = extras.get("clamp_stiffness", 1.0)
        self.k = refinement * rope["joint_stiffness_nm_per_rad"] * np.repeat(first, 3)
        self.c = refinement * rope["joint_damping_nms_per_rad"] * np.repeat(first, 3)
        self.model = mujoco.MjModel.from_xml_string(self.xml(
            mass * (1 + extras.get("mass_slope", 0.0) * place), 0.4 * mass * radius**2,
            rope["lead_mass_kg"], 0.4 * rope["lead_mass_kg"] * rope["lead_radius_m"] ** 2))
        self.data = mujoco.MjData(self.model)
        # Those of the step before.
        self.velocity = self.data.qvel.copy()
        curvature = np.array(extras.get("rest_curvature_per_m", (0.0, 0.0, 0.0)))
        self.model.qpos_spring[7:] = np.tile(exponential(self.s * curvature), self.links)
        # Friction: its limit, its stiffness below that, and its moment now, joint by joint.
        friction = extras.get("friction") or {"moment_max_nm": 0.0, "slip_curvature_per_m": 1.0}
        self.slip_rad = friction["slip_curvature_per_m"] * self.s
        self.limit = friction["moment_max_nm"] * first[:, None]
        self.sigma = np.repeat(self.limit / self.slip_rad, 3)
        self.rubs = friction["moment_max_nm"] > 0
        self.moment = np.zeros((self.links, 3))
        drag = extras.get("air_drag")
        self.drag = None
        if drag:
            thick, lead = 2 * rope["radius_m"] * self.s, np.pi * rope["lead_radius_m"] ** 2
            self.drag = [drag["air_density_kg_m3"] / 2 * x for x in (
                drag["normal_coefficient"] * thick, drag["tangential_coefficient"] * thick,
                drag["lead_coefficient"] * lead)]

    def xml(self, masses, inertia, lead_mass, lead_inertia):
        """Driven frame, ball-jointed links, lead; neither contacts nor constraints."""
        slides = "".join(
            f'<joint type="slide" axis="{axis}" armature="{ARMATURE!r}"/>'
            for axis in ("1 0 0", "0 1 0", "0 0 1"))
        tilt = " ".join(repr(float(x)) for x in self.tilt)
        bodies = "".join(
            f'<body pos="0 0 {0 if index == 0 else -self.s!r}" quat="{tilt if index == 0 else "1 0 0 0"}">'
            f'<joint type="ball" stiffness="{float(self.k[3 * index])!r}"/>'
            f'<inertial pos="0 0 {-self.s / 2!r}" mass="{float(mass)!r}" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
            for index, mass in enumerate(masses))
        return (
            '<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false" boundmass="0" boundinertia="0"/>'
            '<option integrator="Euler"><flag constraint="disable" contact="disable" autoreset="disable"/></option>'
            '<worldbody><body><inertial pos="0 0 0" mass="1e-3" diaginertia="1e-6 1e-6 1e-6"/>'
            f'{slides}<joint type="ball" armature="{ARMATURE!r}"/>{bodies}'
            f'<body pos="0 0 {-self.s!r}"><inertial pos="0 0 0" mass="{lead_mass!r}" '
            f'diaginertia="{lead_inertia!r} {lead_inertia!r} {lead_inertia!r}"/></body>'
            + "</body>" * (self.links + 1) + "</worldbody></mujoco>")

    def set_step(self, step_s, c):
        """Chooses the step and the joints' damping.

        MuJoCo's Euler scheme knows implicit damping only. Given half of the true damping and a
        quarter of step times stiffness, and with what `step` applies, it becomes leapfrog with
        Newmark's implicit springs and the trapezoidal rule for the damping: of second order and
        stable at any step.
        """
        self.step_s, self.damping = step_s, c
        self.model.opt.timestep = step_s
        self.implicit = c / 2 + IMPLICIT * step_s * (self.k + self.sigma)
        self.model.dof_damping[BASE_DOFS:] = self.implicit

    def step(self, drive=0.0):
        """One step; `drive` is the frame's acceleration, linear in the world, angular in itself."""
        data, step_s = self.data, self.step_s
        # The velocities belong to the middle of the step before; forces get them half a step on.
        velocity = data.qvel.copy()
        data.qvel[:] += (velocity - self.velocity) / 2
        self.velocity = velocity
        now = data.qvel[BASE_DOFS:].copy()
        mujoco.mj_step1(self.model, data)
        force = data.qfrc_applied
        force[:BASE_DOFS] = ARMATURE * drive
        force[BASE_DOFS:] = self.implicit * now - self.damping * velocity[BASE_DOFS:]
        if self.rubs:
            force[BASE_DOFS:] -= self.moment.ravel()
        if self.drag:
            data.xfrc_applied[2:, :3] = self.air()
        data.qvel[:] = velocity
        mujoco.mj_step2(self.model, data)
        if self.rubs:
            # Dahl: d moment/dt = sigma (w - |w| moment / limit), exactly for a constant w.
            w = data.qvel[BASE_DOFS:].reshape(-1, 3)
            speed = np.linalg.norm(w, axis=1, keepdims=True)
            slipping = self.limit * w / np.maximum(speed, 1e-12)
            kept = np.exp(-step_s * speed / self.slip_rad)
            self.moment = slipping + (self.moment - slipping) * kept

    def air(self):
        """Drag on links and lead (N), against the velocities of their centres."""
        data, (normal, tangential, lead) = self.data, self.drag
        arm = data.xipos[2:] - data.subtree_com[1]
        v = data.cvel[2:, 3:] + np.cross(data.cvel[2:, :3], arm)
        axis = data.xmat[2:].reshape(-1, 3, 3)[:, :, 2]
        slip = np.sum(v * axis, axis=1, keepdims=True)
        side = v - slip * axis
        force = -normal * np.linalg.norm(side, axis=1, keepdims=True) * side - tangential * np.abs(slip) * slip * axis
        force[-1] = -lead * np.linalg.norm(v[-1]) * v[-1]
        return force

    def rest(self, tilt=(0.0, 0.0)):
        """Lets the rope come to rest under a weight turned by `tilt`, the frame standing."""
        down = np.array([0.0, 0.0, 0.0, -GRAVITY_M_S2])
        turn = exponential(across(tilt))
        self.model.opt.gravity = product(product(turn, down), inverse(turn))[1:]
        self.set_step(REST_STEP_S, REST_RETARDATION_S * self.k)
        for _ in range(REST_STEPS):
            self.step()
            self.data.qvel[BASE_DOFS:] *= 1 - REST_RATE * REST_STEP_S
        self.model.opt.gravity = [0.0, 0.0, -GRAVITY_M_S2]
        self.data.qvel[:] = 0
        self.velocity = self.data.qvel.copy()

    def start(self, pose, seed):
        """Hangs the rope from the frame's first pose, at rest but for the swing asked for."""
        data = self.data
        random = np.random.default_rng(seed)
        data.qpos[:7] = pose
        # From the frame to a rope that hangs straight, without twist, then by hand.
        up = product(product(inverse(pose[3:]), np.array([0.0, 0.0, 0.0, 1.0])), pose[3:])
        hang = np.array([1 + up[3], -up[2], up[1], 0.0])
        first = product(inverse(self.tilt), hang / np.linalg.norm(hang))
        swing = exponential(across(HANDLED_RAD * random.standard_normal(2)))
        data.qpos[7:11] = product(first, swing)
        bend = exponential(self.s * across(HANDLED_RAD_PER_M * random.standard_normal(2)))
        data.qpos[11:] = np.tile(bend, self.links - 1)
        self.rest()
        sway = self.sway
        if any(sway["angle_rad"] + sway["rate_rad_s"]):
            hanging, moment = data.qpos.copy(), self.moment
            rate = np.linalg.norm(sway["rate_rad_s"])
            self.rest(np.array(sway["rate_rad_s"]) * (SHAPE_RAD / max(rate, 1e-12)))
            shape = logarithm(product(inverse(hanging[7:].reshape(-1, 4)), data.qpos[7:].reshape(-1, 4)))
            data.qpos[:], self.moment = hanging, moment
            self.rest(sway["angle_rad"])
            data.qvel[BASE_DOFS:] = shape.ravel() * (rate / SHAPE_RAD)
            self.velocity = data.qvel.copy()

    def nodes(self):
        """Positions of joints and tip."""
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.xpos[2:].copy()


def simulate(request):
    """Node positions at the times asked for, shape (times, nodes, 3)."""
    poses, step_s = np.array(request["poses"]), request["pose_period_s"]
    times_s = np.array(request["times_s"])
    steps = len(poses) - 1
    if times_s[0] < 0 or times_s[-1] > steps * step_s + 1e-9:
        raise SystemExit(f"times_s must lie within the {steps * step_s} s of the poses")
    rope = Rope(request)
    rope.start(poses[0], request["seed"])
    rope.set_step(step_s, rope.c)
    # Steps of the frame, the first before the start: it stands. Their differences are what the
    # drive has to give, so that every pose is met.
    moves = np.zeros((steps + 1, BASE_DOFS))
    moves[1:, :3] = np.diff(poses[:, :3], axis=0)
    moves[1:, 3:] = logarithm(product(inverse(poses[:-1, 3:]), poses[1:, 3:]))
    drives = np.diff(moves, axis=0) / step_s**2
    place = np.linspace(0, rope.links, request["nodes"])
    node = np.minimum(place.astype(int), rope.links - 1)
    part = (place - node)[:, None]
    out = np.empty((len(times_s), len(place), 3))
    done, before = 0, rope.nodes()
    for index, drive in enumerate(drives):
        rope.step(drive)
        end = (index + 1) * step_s + 1e-12
        if done == len(times_s):
            break
        after = rope.nodes() if times_s[done] <= end + step_s else before
        while done < len(times_s) and times_s[done] <= end:
            between = before + (after - before) * (times_s[done] / step_s - index)
            out[done] = between[node] + part * (between[node + 1] - between[node])
            done += 1
        before = after
    if not np.isfinite(out).all() or np.abs(out).max() > 100.0:
        raise SystemExit("the rope's simulation blew up: shorten pose_period_s")
    return out


if __name__ == "__main__":
    # Else they go to a file in the folder that this happens to run in.
    mujoco.set_mju_user_warning(lambda text: print(text, file=sys.stderr))
    nodes_m = simulate(json.load(sys.stdin))
    json.dump({"mujoco": mujoco.__version__, "nodes_m": nodes_m.round(7).ravel().tolist()}, sys.stdout)
