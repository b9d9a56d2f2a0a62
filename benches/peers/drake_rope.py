"""The rope in Drake, stepped by its own discrete update or its own integrators.

The attach frame sits on six actuated joints with so much reflected rotor inertia that
the actuators alone decide its acceleration. Their input is a piecewise linear function
of time, exact for cubic splines, evaluated inside the library.

Drake's native spring is a bushing whose torque follows roll, pitch and yaw instead of the
rotation vector, which moves the tip by up to 24 mm. The law of the reference has to be
applied as an outside force from Python. The time spent there is measured and taken off,
so Drake gets its springs for nothing.
"""
import importlib.metadata
import time

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint, FixedOffsetFrame, PrismaticJoint, RevoluteJoint, RotationalInertia, SpatialInertia,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Multiplexer, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from truth import CHANNELS, derived

ROTOR_INERTIA = 1e9
DISCRETE = "discrete"
RADAU3 = "radau3"
AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "yaw": [0, 0, 1], "pitch": [0, 1, 0], "roll": [1, 0, 0]}


def version():
    return importlib.metadata.version("drake")


def sphere_inertia(mass, inertia, com=(0.0, 0.0, 0.0)):
    return SpatialInertia.MakeFromCentralInertia(mass, com, RotationalInertia(inertia, inertia, inertia))


def add_base(plant):
    """Three slides and three hinges, x y z yaw pitch roll; returns the last body."""
    body = plant.world_body()
    for name in CHANNELS:
        child = plant.AddRigidBody(f"base-{name}", plant.GetModelInstanceByName("base"), sphere_inertia(1e-3, 1e-6))
        kind = PrismaticJoint if name in "xyz" else RevoluteJoint
        joint = plant.AddJoint(kind(name, body.body_frame(), child.body_frame(), AXES[name]))
        actuator = plant.AddJointActuator(name, joint)
        actuator.set_default_rotor_inertia(ROTOR_INERTIA)
        actuator.set_default_gear_ratio(1.0)
        body = child
    return body


class RotationVectorSprings(LeafSystem):
    """Generalised forces -k phi of all joints from the state of the plant, in Python."""

    def __init__(self, plant, stiffness_nm_per_rad):
        super().__init__()
        self.base = len(CHANNELS)
        self.rope = slice(self.base, plant.num_positions())
        self.stiffness_nm_per_rad = stiffness_nm_per_rad
        self.cpu_s = 0.0
        self.DeclareVectorInputPort("state", plant.num_multibody_states())
        self.DeclareVectorOutputPort("force", plant.num_velocities(), self.calc_force)

    def calc_force(self, context, output):
        started_s = time.process_time()
        state = self.get_input_port(0).Eval(context)
        phi = rotation_vectors(state[self.rope].reshape(-1, 3))
        output.SetFromVector(np.concatenate([np.zeros(self.base), -self.stiffness_nm_per_rad * phi.ravel()]))
        self.cpu_s += time.process_time() - started_s


def rotation_vectors(roll_pitch_yaw):
    """Rotation vectors of Rz(yaw) Ry(pitch) Rx(roll), rows of shape (n, 3), angles below pi."""
    cr, cp, cy = np.cos(roll_pitch_yaw / 2).T
    sr, sp, sy = np.sin(roll_pitch_yaw / 2).T
    w = cy * cp * cr + sy * sp * sr
    v = np.stack([cy * cp * sr - sy * sp * cr, cy * sp * cr + sy * cp * sr, sy * cp * cr - cy * sp * sr], axis=1)
    sine = np.linalg.norm(v, axis=1)
    return v * (2.0 * np.arctan2(sine, w) / np.maximum(sine, 1e-300))[:, np.newaxis]


def add_rope(plant, case, parent):
    """Ball-jointed links, lead welded to the last."""
    rope = case.rope
    s, m, i, lead_i = derived(rope)
    model = plant.AddModelInstance("rope")
    # Pitch is singular at 90 degrees: make it the twist, which stays small.
    turned = RotationMatrix.MakeXRotation(np.pi / 2)
    for index in range(rope["N"]):
        link = plant.AddRigidBody(f"link-{index}", model, sphere_inertia(m, i, [0, 0, -s / 2]))
        offset = case.arm_m if index == 0 else [0, 0, -s]
        above = plant.AddFrame(FixedOffsetFrame(f"above-{index}", parent.body_frame(), RigidTransform(turned, offset)))
        below = plant.AddFrame(FixedOffsetFrame(f"below-{index}", link.body_frame(), RigidTransform(turned, [0, 0, 0])))
        plant.AddJoint(BallRpyJoint(f"ball-{index}", above, below, damping=rope["c"]))
        parent = link
    lead = plant.AddRigidBody("lead", model, sphere_inertia(rope["m_L"], lead_i))
    plant.WeldFrames(parent.body_frame(), lead.body_frame(), RigidTransform([0, 0, -s]))


def build(case, step_s):
    """Diagram of plant, input and springs; `step_s` 0 for a continuous plant."""
    builder = DiagramBuilder()
    plant = MultibodyPlant(step_s)
    base = plant.AddModelInstance("base")
    add_rope(plant, case, add_base(plant))
    plant.set_gravity_enabled(base, False)
    plant.Finalize()
    plant = builder.AddSystem(plant)
    mux = builder.AddSystem(Multiplexer(len(CHANNELS)))
    for port, name in enumerate(CHANNELS):
        times_s, values = case.channel_accelerations(name)
        if times_s[-1] < case.duration_s:
            times_s, values = np.append(times_s, case.duration_s + 1.0), np.append(values, 0.0)
        torque = PiecewisePolynomial.FirstOrderHold(times_s, ROTOR_INERTIA * values[np.newaxis])
        builder.Connect(builder.AddSystem(TrajectorySource(torque)).get_output_port(), mux.get_input_port(port))
    builder.Connect(mux.get_output_port(), plant.get_actuation_input_port())
    springs = builder.AddSystem(RotationVectorSprings(plant, case.rope["k"]))
    builder.Connect(plant.get_state_output_port(), springs.get_input_port())
    builder.Connect(springs.get_output_port(), plant.get_applied_generalized_force_input_port())
    return builder.Build(), plant, springs


def simulate(case, scheme, step_s):
    """Tip track, shape (frames, 3), and CPU seconds of the stepping without the springs."""
    frame_s = 1.0 / case.frame_rate_hz
    step_s = frame_s / round(frame_s / step_s)
    diagram, plant, springs = build(case, step_s if scheme == DISCRETE else 0.0)
    simulator = Simulator(diagram)
    if scheme != DISCRETE:
        ResetIntegratorFromFlags(simulator, scheme, step_s).set_fixed_step_mode(True)
    simulator.Initialize()
    context = plant.GetMyContextFromRoot(simulator.get_context())
    lead = plant.GetBodyByName("lead")
    tip_m = np.full((case.frame_count, 3), np.nan)
    cpu_s, springs.cpu_s = 0.0, 0.0
    for frame in range(case.frame_count):
        started = time.process_time()
        try:
            simulator.AdvanceTo(frame / case.frame_rate_hz)
        except (RuntimeError, ValueError):  # blown up, or no step short enough
            break
        cpu_s += time.process_time() - started
        tip_m[frame] = plant.EvalBodyPoseInWorld(context, lead).translation()
        if not np.abs(tip_m[frame]).max() < 100.0:
            break
    return tip_m, cpu_s - springs.cpu_s

