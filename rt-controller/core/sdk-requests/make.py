"""Prints the requests that the vendor's SDK (xarm-python-sdk 1.18.4) encodes for known arguments.

Each line is a protocol, a name and the bytes on the wire in hexadecimal: first as the SDK sends
them, then in the variant of the protocol that keeps a heartbeat (3 in place of 2), in which the
controller streams. `requests.txt` beside this file is the output; the test of the commands compares
our encoder with it byte for byte. Speed, acceleration and time of `servo_joint` are ignored by the
arm; the SDK's own wrapper fills in others than the zeros that are sent here.

    python rt-controller/core/sdk-requests/make.py > rt-controller/core/sdk-requests/requests.txt
"""

from xarm.core.wrapper.uxbus_cmd_tcp import UxbusCmdTcp

ANGLES = [0.5, -0.25, 0.75, 1.0, -1.5, 2.0, -3.0]
POSE_MM_RAD = [0.0, -50.0, 200.0, 0.5, 0.25, -1.0]


class Wire:
    """A port that keeps what is written to it and answers every request with success."""

    def __init__(self):
        self.sent = []

    def flush(self):
        pass

    def write(self, data):
        self.sent.append(bytes(data))
        return 0

    def read(self, timeout):
        transaction, register = self.sent[-1][0:2], self.sent[-1][6:7]
        data = bytes(160)
        length = (2 + len(data)).to_bytes(2, "big")
        return transaction + self.sent[-1][2:4] + length + register + b"\x00" + data


wire = Wire()
sdk = UxbusCmdTcp(wire)
REQUESTS = {
    "version": lambda: sdk.get_version(),
    "serial_numbers": lambda: sdk.get_robot_sn(),
    "motion_enable": lambda: sdk.motion_en(8, True),
    "motion_disable": lambda: sdk.motion_en(3, False),
    "state_ready": lambda: sdk.set_state(0),
    "state_pause": lambda: sdk.set_state(3),
    "state_stop": lambda: sdk.set_state(4),
    "state_decelerated_stop": lambda: sdk.set_state(6),
    "get_state": lambda: sdk.get_state(),
    "buffered": lambda: sdk.get_cmdnum(),
    "get_fault": lambda: sdk.get_err_code(),
    "clean_error": lambda: sdk.clean_err(),
    "clean_warning": lambda: sdk.clean_war(),
    "brake_release": lambda: sdk.set_brake(8, True),
    "mode_position": lambda: sdk.set_mode(0),
    "mode_servo": lambda: sdk.set_mode(1),
    "mode_velocity": lambda: sdk.set_mode(4),
    "move_joint": lambda: sdk.move_joint(ANGLES, 0.5, 2.0, 0),
    "move_joint_checked": lambda: sdk.move_joint(ANGLES, 0.5, 2.0, 0, only_check_type=1),
    "move_home": lambda: sdk.move_gohome(0.5, 2.0, 0),
    "servo_joint": lambda: sdk.move_servoj(ANGLES, 0, 0, 0),
    "joint_jerk": lambda: sdk.set_joint_jerk(20.0),
    "joint_acceleration": lambda: sdk.set_joint_maxacc(10.0),
    "tcp_offset": lambda: sdk.set_tcp_offset(POSE_MM_RAD),
    "tcp_load": lambda: sdk.set_tcp_load(0.5, [1.0, -2.0, 64.0]),
    "collision_sensitivity": lambda: sdk.set_collis_sens(3),
    "teach_sensitivity": lambda: sdk.set_teach_sens(2),
    "tcp_pose": lambda: sdk.get_tcp_pose(),
    "joints_commanded": lambda: sdk.get_joint_pos(),
    "joints_measured": lambda: sdk.get_joint_states(1),
    "joints_measured_with_rates": lambda: sdk.get_joint_states(3),
    "forward_kinematics": lambda: sdk.get_fk(ANGLES),
    "digital_inputs": lambda: sdk.cgpio_get_auxdigit(),
    "joint_limit_test": lambda: sdk.is_joint_limit(ANGLES),
    "velocity": lambda: sdk.vc_set_jointv(ANGLES, 1),
    "velocity_with_duration": lambda: sdk.vc_set_jointv(ANGLES, 0, 0.5),
    "set_speed_limit_factor": lambda: sdk.set_common_param(1, 1.25),
    "get_speed_limit_factor": lambda: sdk.get_common_param(1),
    "feedback_check": lambda: sdk.check_feedback(),
    "feedback_mask": lambda: sdk.set_feedback_type(3),
}
for protocol in (2, 3):
    sdk._protocol_identifier = protocol
    for name, request in REQUESTS.items():
        wire.sent.clear()
        request()
        assert len(wire.sent) == 1, name
        print(protocol, name, wire.sent[0].hex())
