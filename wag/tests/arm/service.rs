//! A controller and a guardian that run as services, as their units start them, and commands
//! that use them.

use super::support::{
    Rig, Running, alone, command, json_in, moved_in, refused_in, send, shared_memory_of,
    until_moving,
};
use rustix::process::Signal;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// One of both, and the socket at which a service manager hears it.
struct Service {
    process: Running,
    manager: UnixDatagram,
}

impl Service {
    fn start(name: &str, folder: &Path) -> Self {
        let socket = folder.join(format!("{name}.socket"));
        let manager = UnixDatagram::bind(&socket).unwrap();
        let patience = Some(Duration::from_secs(20));
        manager.set_read_timeout(patience).unwrap();
        let config = folder.join("controller.toml");
        let process = command(&format!("process {name} --config {}", config.display()))
            .env("NOTIFY_SOCKET", &socket)
            .env("WATCHDOG_USEC", "400000")
            // Its files lie beside its configuration, wherever it runs.
            .current_dir("/")
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap();
        let service = Self {
            process: Running(process),
            manager,
        };
        assert_eq!(service.says(), "READY=1");
        service
    }

    /// The next that the service manager hears.
    fn says(&self) -> String {
        let mut text = [0; 64];
        let length = self.manager.recv(&mut text).unwrap();
        String::from_utf8_lossy(&text[..length]).trim().to_owned()
    }
}

#[test]
fn a_service_takes_one_command_after_the_other_and_a_stop_is_acknowledged() {
    let _turn = alone();
    let rig = Rig::start("");
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let domain = format!("service{}", std::process::id());
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/robot/xarm7.toml");
    std::fs::copy(shipped, here.join("limits.toml")).unwrap();
    let [command_port, joints, normal, rich, _] = rig.ports();
    let config = format!(
        "domain = \"{domain}\"\nsimulated = true\ncommand_port = {command_port}\n\
         report_port = {joints}\nstatus_ports = [{rich}, {normal}]\non_difference = \"set\"\n\
         limits_file = \"limits.toml\"\n[thresholds]\nprofile = \"relaxed\"\n"
    );
    std::fs::write(here.join("controller.toml"), config).unwrap();

    let on = format!("wiggle --controller {domain}");
    let nobody = refused_in(here, 1, &format!("{on} --out early"));
    assert!(nobody.contains("no controller runs in domain"), "{nobody}");
    assert!(!here.join("early").exists());
    assert_eq!(shared_memory_of(&domain), Vec::<String>::new());

    let mut controller = Service::start("rt-controller", here);
    let mut guardian = Service::start("guardian", here);
    for run in ["first", "second"] {
        let done = moved_in(here, &on, run);
        assert_eq!(done["ok"], true, "{done}");
        let replayed = json_in(here, &format!("replay {run}"));
        assert_eq!(replayed["replay"]["differing_bytes"], 0, "{replayed}");
    }
    for service in [&controller, &guardian] {
        for _ in 0..3 {
            assert_eq!(service.says(), "WATCHDOG=1");
        }
    }

    // Standard input has ended: that of the next command is its own.
    let let_go = refused_in(here, 1, &format!("{on} --out let-go --dead-man"));
    assert!(let_go.contains("DeadManReleased"), "{let_go}");
    let broken_off = command(&format!("{on} --out broken-off --acknowledge"));
    let mut broken_off = { broken_off }.current_dir(here).spawn().unwrap();
    // Earlier it would break off the bring-up, and no motion.
    until_moving(&here.join("broken-off"));
    send(broken_off.id(), Signal::INT);
    assert_eq!(broken_off.wait().unwrap().code(), Some(1));
    let stopped = refused_in(here, 1, &format!("{on} --out third"));
    assert!(stopped.contains("OperatorStop"), "{stopped}");
    assert!(stopped.contains("--acknowledge"), "{stopped}");
    let done = moved_in(here, &format!("{on} --acknowledge"), "third");
    assert_eq!(done["ok"], true, "{done}");
    let twice = refused_in(here, 2, &format!("{on} --out fourth --limits limits.toml"));
    assert!(twice.contains("cannot be used with"), "{twice}");

    assert_eq!(controller.process.end(Signal::TERM).0, Some(0));
    assert_eq!(guardian.process.end(Signal::TERM).0, Some(0));
    assert_eq!(shared_memory_of(&domain), Vec::<String>::new());
}
