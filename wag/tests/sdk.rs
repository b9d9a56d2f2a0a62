//! The vendor's own Python client against `wag rig`, by the conformance check
//! that lies beside the checkout.
#![cfg(test)]

mod support;

use std::path::Path;
use std::process::Command;
use support::Rig;

/// Two clients of the vendor's SDK: one streams, the other watches, then stops it.
const TWO_CLIENTS: &str = r"
import sys, time
from xarm.core.config.x_config import XCONF
port, norm, rich, real = (int(x) for x in sys.argv[1:5])
XCONF.SocketConf.TCP_CONTROL_PORT = port
(XCONF.SocketConf.TCP_REPORT_NORM_PORT, XCONF.SocketConf.TCP_REPORT_RICH_PORT,
 XCONF.SocketConf.TCP_REPORT_REAL_PORT) = norm, rich, real
from xarm.x3.report import ReportDataStructure
layout, make = {norm: 30001, rich: 30002, real: 30003}, ReportDataStructure.create
ReportDataStructure.create = classmethod(lambda cls, p, **kw: make(layout.get(p, p), **kw))
from xarm.wrapper import XArmAPI
a, b = (XArmAPI('127.0.0.1', is_radian=True, check_joint_limit=False, forbid_uds=True) for _ in 'ab')
assert a.connected and b.connected
for call in (a.clean_error, lambda: a.motion_enable(True), lambda: a.set_mode(1), lambda: a.set_state(0)):
    call()
q = list(b.get_servo_angle(is_real=True)[1])
begin = q[6]
for k in range(50):
    q[6] = begin + 0.001 * k
    assert a.set_servo_angle_j(q) == 0
    time.sleep(0.004)
time.sleep(0.4)
assert abs(b.get_servo_angle(is_real=True)[1][6] - q[6]) < 1e-3, 'the other client sees the motion'
b.set_state(4)
assert a.set_servo_angle_j(q) in (1, 9), 'the other client stopped the arm'
time.sleep(0.4)
assert a.state == 4 and b.state == 4, (a.state, b.state)
print('both agree')
";

#[test]
fn two_clients_of_the_vendor_sdk_share_the_simulated_arm() {
    let Some(python) = std::env::var_os("WAG_SDK_PYTHON") else {
        println!("skipped: WAG_SDK_PYTHON does not name a Python with xarm-python-sdk installed");
        return;
    };
    let rig = Rig::start("");
    let ports = rig.ports();
    let output = Command::new(python)
        .args(["-c", TWO_CLIENTS, &ports[0]])
        .args(&ports[2..])
        .output()
        .unwrap();
    drop(rig);
    let said = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("both agree"), "{said}\n{errors}");
}

#[test]
fn the_vendor_sdk_accepts_the_simulated_arm() {
    let check = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/checks/xarm_sdk_check.py");
    if !check.is_file() {
        println!("skipped: {} not found", check.display());
        return;
    }
    let Some(python) = std::env::var_os("WAG_SDK_PYTHON") else {
        println!("skipped: WAG_SDK_PYTHON does not name a Python with xarm-python-sdk installed");
        return;
    };
    let rig = Rig::start("");
    let ports = rig.ports();
    let reports = ports[2..].join(",");
    let output = Command::new(python)
        .arg(&check)
        .args(["127.0.0.1", "--control-port", &ports[0]])
        .args(["--report-ports", &reports])
        .output()
        .unwrap();
    drop(rig);
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(
        output.status.success(),
        "{said}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
