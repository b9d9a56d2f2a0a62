#!/usr/bin/env python3
"""Rest shapes of ropes laid over a fixed horizontal cylinder, made with MuJoCo.

  python rope_over_cylinder.py [OUTPUT.json]

The attach frame stands still. The rope starts straight along the frame's -z axis, at
rest, a few millimetres clear of the cylinder; it is let go, falls, swings and comes to
rest over the cylinder, its lead hanging on the far side. The frame stands above the
cylinder, so that the rope between them is taut and the rest shape hardly depends on how
it came about. How much it does depend on step, contact softness, friction and release
is measured by running those variants, and written beside each shape.

SI units. The world's z axis points up; quaternions are w, x, y, z.
Default output: rope-sim/tests/fixtures/rope-over-cylinder.json of this repository.
"""
import dataclasses
import json
import math
import multiprocessing
import pathlib
import sys

import mujoco
import numpy as np

GRAVITY_M_S2 = 9.81
CYLINDER_RADIUS_M = 0.04
CYLINDER_HALF_LENGTH_M = 0.25
CLEARANCE_M = 0.005
AT_REST_M_S = 1e-4
VARIANT_STEP_S = 2e-4
LONGEST_S = 60.0
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
DEFAULT_OUTPUT = REPOSITORY / "rope-sim/tests/fixtures/rope-over-cylinder.json"


@dataclasses.dataclass(frozen=True)
class Rope:
    """The nine parameters, named as in the rope model."""

    N: int
    L: float
    c: float
    k: float
    r: float
    mu: float
    m_L: float
    r_L: float
    link_extra_scale: float

    @property
    def link_length_m(self):
        return self.L / self.N

    @property
    def link_mass_kg(self):
        return self.mu * self.L / self.N

    @property
    def link_inertia_kg_m2(self):
        radius_m = max(self.link_extra_scale * self.link_length_m / 2, self.r)
        return 0.4 * self.link_mass_kg * radius_m**2

    @property
    def lead_inertia_kg_m2(self):
        return 0.4 * self.m_L * self.r_L**2


@dataclasses.dataclass(frozen=True)
class Scene:
    """Where the rope starts, and against what it comes to rest."""

    slope_deg: float = 20.0
    span_m: float = 0.12
    attach_m: tuple = (0.0, 0.0, 0.5)
    friction: float = 0.5
    release_slope_deg: float | None = None

    @property
    def direction(self):
        """Unit vector of the attach frame's -z axis: towards +x, down by the slope."""
        a = math.radians(self.slope_deg)
        return np.array([math.cos(a), 0.0, -math.sin(a)])

    @property
    def attach_q_wxyz(self):
        """Rotation about y that takes -z onto `direction`."""
        half = -(math.pi / 2 - math.radians(self.slope_deg)) / 2
        return np.array([math.cos(half), 0.0, math.sin(half), 0.0])

    def cylinder_centre_m(self, rope):
        """The rope passes the cylinder at CLEARANCE_M, `span_m` from the attach point."""
        down = np.array([self.direction[2], 0.0, -self.direction[0]])
        depth_m = CYLINDER_RADIUS_M + rope.r + CLEARANCE_M
        return np.array(self.attach_m) + self.span_m * self.direction + depth_m * down

    @property
    def joint0_rotvec(self):
        """Turn of joint 0 that starts the rope at `release_slope_deg` instead."""
        if self.release_slope_deg is None:
            return np.zeros(3)
        return np.array([0.0, math.radians(self.release_slope_deg - self.slope_deg), 0.0])


@dataclasses.dataclass(frozen=True)
class Solver:
    """MuJoCo's settings."""

    step_s: float = 5e-5
    solref: str = "0.001 1"
    solimp: str = "0.95 0.99 0.0005"
    impratio: float = 10.0


def model_xml(rope, scene, solver):
    """Ball-jointed capsules, the lead a sphere on the last; only the cylinder is touched."""
    s, m, i = rope.link_length_m, rope.link_mass_kg, rope.link_inertia_kg_m2
    centre = scene.cylinder_centre_m(rope)
    vec = lambda v: " ".join(repr(float(x)) for x in v)
    contact = (
        f'friction="{scene.friction!r} 0 0" condim="{3 if scene.friction > 0 else 1}" '
        f'solref="{solver.solref}" solimp="{solver.solimp}"'
    )
    links = []
    for index in range(rope.N):
        pose = (
            f'pos="{vec(scene.attach_m)}" quat="{vec(scene.attach_q_wxyz)}"'
            if index == 0
            else f'pos="0 0 {-s!r}"'
        )
        links.append(
            f"<body {pose}>"
            f'<joint type="ball" stiffness="{rope.k!r}" damping="{rope.c!r}"/>'
            f'<inertial pos="0 0 {-s / 2!r}" mass="{m!r}" diaginertia="{i!r} {i!r} {i!r}"/>'
            f'<geom type="capsule" size="{rope.r!r}" fromto="0 0 0 0 0 {-s!r}" '
            f'contype="0" conaffinity="1" {contact}/>'
        )
    j = rope.lead_inertia_kg_m2
    lead = (
        f'<body pos="0 0 {-s!r}">'
        f'<inertial pos="0 0 0" mass="{rope.m_L!r}" diaginertia="{j!r} {j!r} {j!r}"/>'
        f'<geom type="sphere" size="{rope.r_L!r}" contype="0" conaffinity="1" {contact}/></body>'
    )
    return (
        '<mujoco><compiler inertiafromgeom="false" balanceinertia="false" boundmass="0" boundinertia="0"/>'
        f'<option gravity="0 0 {-GRAVITY_M_S2}" timestep="{solver.step_s!r}" integrator="implicitfast" '
        f'cone="elliptic" impratio="{solver.impratio!r}" solver="Newton" tolerance="1e-12" iterations="100"/>'
        "<worldbody>"
        # A capsule touches as a cylinder does, its round ends being far away.
        f'<geom type="capsule" size="{CYLINDER_RADIUS_M!r} {CYLINDER_HALF_LENGTH_M!r}" pos="{vec(centre)}" '
        f'euler="90 0 0" contype="1" conaffinity="0" {contact}/>'
        + "".join(links) + lead + "</body>" * rope.N + "</worldbody></mujoco>"
    )


def come_to_rest(job):
    """Rest shape of one rope, shape (N + 1, 3), and what the run was like."""
    rope, scene, solver, longest_s = job
    model = mujoco.MjModel.from_xml_string(model_xml(rope, scene, solver))
    data = mujoco.MjData(model)
    angle = float(np.linalg.norm(scene.joint0_rotvec))
    if angle > 0.0:
        axis = scene.joint0_rotvec / angle
        data.qpos[:4] = [math.cos(angle / 2), *(math.sin(angle / 2) * axis)]
    mujoco.mj_forward(model, data)
    start = data.xpos[1:].copy()
    last, still_since_s = start, None
    deepest_m, every_s = 0.0, 0.05
    while data.time < longest_s:
        mujoco.mj_step(model, data, nstep=round(every_s / solver.step_s))
        mujoco.mj_kinematics(model, data)
        nodes = data.xpos[1:].copy()
        speed = np.abs(nodes - last).max() / every_s
        last = nodes
        if data.ncon:
            deepest_m = max(deepest_m, -float(data.contact.dist.min()))
        if speed > AT_REST_M_S:
            still_since_s = None
        elif still_since_s is None:
            still_since_s = data.time
        elif data.time - still_since_s > 1.0:
            break
    return {
        "start": start,
        "nodes": last,
        "at_rest_after_s": still_since_s,
        "speed_at_end_m_s": float(speed),
        "penetration_at_rest_m": max(0.0, -float(data.contact.dist.min())) if data.ncon else 0.0,
        "greatest_sampled_penetration_m": deepest_m,
        "touching_links": sorted({int(max(c.geom1, c.geom2)) - 1 for c in data.contact}),
    }


ROPES = {
    "soft": Rope(24, 0.50, 0.050, 0.05, 0.008, 0.040, 0.040, 0.020, 0.80),
    "stiff": Rope(22, 0.45, 0.050, 0.30, 0.008, 0.060, 0.060, 0.030, 0.80),
    "heavy lead": Rope(26, 0.45, 0.050, 0.05, 0.005, 0.030, 0.120, 0.030, 1.00),
}


def variants():
    """The reference run, and what is changed one at a time. Variants take longer steps."""
    scene, change = Scene(), dataclasses.replace
    solver = Solver()
    coarse = change(solver, step_s=VARIANT_STEP_S)
    return {
        "reference": (scene, solver),
        "longer step": (scene, coarse),
        "softer contact": (scene, change(coarse, solref="0.003 1", solimp="0.9 0.95 0.001")),
        "tangential contact 10 times softer": (scene, change(coarse, impratio=1.0)),
        "friction 0": (change(scene, friction=0.0), coarse),
        "friction 0.3": (change(scene, friction=0.3), coarse),
        "friction 1": (change(scene, friction=1.0), coarse),
        "released 15 deg higher": (change(scene, release_slope_deg=5.0), coarse),
    }


def case(name, rope, runs):
    """One entry of the file."""
    scene, solver = variants()["reference"]
    reference = runs["reference"]
    for label, run in runs.items():
        if run["at_rest_after_s"] is None:
            raise SystemExit(f"{name}, {label}: still moving at {run['speed_at_end_m_s']} m/s")
    offset_mm = {
        label: round(1e3 * float(np.linalg.norm(run["nodes"] - reference["nodes"], axis=1).max()), 4)
        for label, run in runs.items()
        if label != "reference"
    }
    return {
        "name": name,
        "rope": dataclasses.asdict(rope),
        "attach_p_m": list(scene.attach_m),
        "attach_q_wxyz": scene.attach_q_wxyz.tolist(),
        "initial_joint0_rotvec": scene.joint0_rotvec.tolist(),
        "cylinder": {
            "centre_m": scene.cylinder_centre_m(rope).tolist(),
            "axis": [0.0, 1.0, 0.0],
            "radius_m": CYLINDER_RADIUS_M,
            "half_length_m": CYLINDER_HALF_LENGTH_M,
        },
        "friction": scene.friction,
        "start_nodes_m": np.round(reference["start"], 9).tolist(),
        "rest_nodes_m": np.round(reference["nodes"], 7).tolist(),
        "at_rest_after_s": round(reference["at_rest_after_s"], 2),
        "rest_means_slower_than_m_s": AT_REST_M_S,
        "penetration_at_rest_m": reference["penetration_at_rest_m"],
        "touching_links": reference["touching_links"],
        "largest_node_offset_mm": offset_mm,
    }


def main():
    output = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_OUTPUT
    names = [(rope, label) for rope in ROPES for label in variants()]
    jobs = [(ROPES[rope], *variants()[label], LONGEST_S) for rope, label in names]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        results = dict(zip(names, pool.map(come_to_rest, jobs, chunksize=1)))
    cases = []
    for name, rope in ROPES.items():
        cases.append(case(name, rope, {label: results[name, label] for label in variants()}))
        print(name, json.dumps({k: v for k, v in cases[-1].items() if not k.endswith("nodes_m")}, indent=1))
    solver = dataclasses.asdict(Solver())
    document = {
        "what": "rest shapes of ropes let go over a fixed horizontal cylinder",
        "units": "m, s, kg, rad, N m/rad, N m s/rad; world z up; quaternions w x y z; "
        "the rope starts straight along -z of the attach frame, at rest",
        "links": "capsules of the rope's radius; the lead is a sphere at the last node; "
        "neither rope nor lead touches itself",
        "gravity_m_s2": [0.0, 0.0, -GRAVITY_M_S2],
        "largest_node_offset_mm": "largest distance of any node from rest_nodes_m when "
        f"one thing is changed, in steps of {VARIANT_STEP_S} s",
        "made_with": {"mujoco": mujoco.__version__, "integrator": "implicitfast", "cone": "elliptic", **solver},
        "cases": cases,
    }
    output.write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()
