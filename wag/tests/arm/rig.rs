//! `wag rig`: one in each domain, which leaves nothing; the vendor's own Python client
//! against it, by the conformance check that lies beside the checkout.

use super::support::{
    Rig, alone, beside_others, has, missing, said, shared, shared_memory_of, wag,
};
use rustix::process::Signal;
use std::process::Command;

#[test]
fn a_second_rig_in_a_domain_says_so_and_an_ended_one_leaves_nothing() {
    let _turn = beside_others();
    let domain = format!("cam{}", std::process::id());
    let filming = format!("--rope random --camera {domain}");
    let mut first = Rig::start(&filming);
    assert_ne!(first.reported["command_port"], 0);
    let line = format!("rig --command-port 0 --report-ports 0,0,0,0 {filming}");
    let second = wag(&line);
    let refusal = said(&second);
    assert_eq!(second.status.code(), Some(1), "{refusal}");
    assert!(second.stdout.is_empty(), "it never listened");
    has(&refusal, &[&domain, "in use by another rig"]);
    assert_eq!(first.process.end(Signal::INT), (Some(0), String::new()));
    assert_eq!(shared_memory_of(&domain), Vec::<String>::new());
}

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

/// A Python with the vendor's SDK; `None`, said aloud, where there is none.
fn python() -> Option<Command> {
    missing::named("WAG_SDK_PYTHON", "Python with xarm-python-sdk").map(Command::new)
}

#[test]
fn two_clients_of_the_vendor_sdk_share_the_simulated_arm() {
    let Some(mut python) = python() else { return };
    let _alone = alone();
    let rig = Rig::start("");
    let ports = rig.ports();
    python.args(["-c", TWO_CLIENTS, &ports[0]]);
    let output = python.args(&ports[2..]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("both agree"), "{text}\n{}", said(&output));
}

#[test]
fn the_vendor_sdk_accepts_the_simulated_arm() {
    let Some(check) = shared("checks/xarm_sdk_check.py") else {
        return;
    };
    let Some(mut python) = python() else { return };
    let _alone = alone();
    let rig = Rig::start("");
    let ports = rig.ports();
    let reports = ports[2..].join(",");
    python
        .arg(&check)
        .args(["127.0.0.1", "--control-port", &ports[0]]);
    let output = python.args(["--report-ports", &reports]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}");
    assert!(output.status.success(), "{text}\n{}", said(&output));
}

#[test]
fn our_encoder_is_compared_with_what_the_vendor_sdk_encodes() {
    let Some(mut python) = python() else { return };
    let folder = "../rt-controller/core/sdk-requests";
    let output = python.arg(format!("{folder}/make.py")).output().unwrap();
    let kept = std::fs::read_to_string(format!("{folder}/requests.txt")).unwrap();
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        kept,
        "{}",
        said(&output)
    );
}
