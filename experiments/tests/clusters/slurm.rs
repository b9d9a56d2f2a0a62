//! Slurm's own daemons: two nodes of a cluster on this machine, one of which fails.

use crate::support::missing;
use crate::{Daemon, Submission, by_one, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

const CONTROLLER: &str = "/usr/sbin/slurmctld";
const NODE: &str = "/usr/sbin/slurmd";
const KEYS: &str = "/usr/sbin/munged";

/// The daemons, of which the nodes end first.
struct Cluster {
    nodes: Vec<Daemon>,
    _controller: Daemon,
    _keys: Daemon,
    config: PathBuf,
}

impl Cluster {
    fn start(dir: &Path) -> Option<Self> {
        if ![CONTROLLER, NODE, KEYS]
            .iter()
            .all(|p| Path::new(p).exists())
        {
            missing::without("no Slurm on this machine (slurm-wlm, munge)");
            return None;
        }
        if !rustix::process::geteuid().is_root() {
            missing::without("Slurm's daemons run as root");
            return None;
        }
        let at = |name: &str| dir.join(name);
        // The keys' daemon wants folders that nobody else writes to.
        std::fs::set_permissions(dir, PermissionsExt::from_mode(0o755)).unwrap();
        std::fs::write(at("key"), [7; 128]).unwrap();
        std::fs::set_permissions(at("key"), PermissionsExt::from_mode(0o400)).unwrap();
        let mut keys = Command::new(KEYS);
        keys.args(["--foreground", "--force"]);
        for (option, file) in [
            ("key-file", "key"),
            ("socket", "socket"),
            ("pid-file", "keys.pid"),
            ("log-file", "keys.log"),
            ("seed-file", "seed"),
        ] {
            keys.arg(format!("--{option}={}", at(file).display()));
        }
        let mut keys = Daemon::start(&mut keys, &at("keys.out"));
        keys.wait_until(|| at("socket").exists());
        let config = at("slurm.conf");
        std::fs::write(&config, configuration(dir)).unwrap();
        for folder in ["controller", "n1", "n2"] {
            std::fs::create_dir(at(folder)).unwrap();
        }
        let daemon = |program: &str, arguments: &[&str], log: &str| {
            let mut command = Command::new(program);
            command.arg("-D").args(arguments).env("SLURM_CONF", &config);
            Daemon::start(&mut command, &at(log))
        };
        let mut controller = daemon(CONTROLLER, &[], "controller.out");
        controller.wait_until(|| at("controller.pid").exists());
        let node = |name: &&str| daemon(NODE, &["-N", name], &format!("{name}.out"));
        let nodes = ["n1", "n2"].iter().map(node).collect();
        let cluster = Self {
            nodes,
            _controller: controller,
            _keys: keys,
            config,
        };
        wait_for("two idle nodes", || cluster.idle() == "2");
        Some(cluster)
    }

    fn ask(&self, program: &str, arguments: &[&str]) -> String {
        let mut command = Command::new(program);
        let command = command.args(arguments).env("SLURM_CONF", &self.config);
        let output = command.output().unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    fn idle(&self) -> String {
        self.ask("sinfo", &["--noheader", "--states=idle", "--format=%D"])
    }

    /// Kills the first node's daemon, and what it runs but for Slurm's own step, which tells the
    /// controller that its task has failed.
    fn fail_first_node(&mut self) {
        self.nodes[0].kill();
        let of_cluster = format!("SLURM_CONF={}", self.config.display());
        for process in std::fs::read_dir("/proc").unwrap().flatten() {
            let environment = std::fs::read(process.path().join("environ")).unwrap_or_default();
            let has = |wanted: &str| {
                environment
                    .split(|b| *b == 0)
                    .any(|e| e == wanted.as_bytes())
            };
            let pid = process
                .file_name()
                .to_str()
                .and_then(|pid| pid.parse().ok());
            let Some(pid) = pid.and_then(Pid::from_raw) else {
                continue;
            };
            if has("SLURMD_NODENAME=n1") && has(&of_cluster) {
                // It may have ended by itself.
                let _ = kill_process(pid, Signal::KILL);
            }
        }
    }

    fn submit(&self, dir: &Path) -> Submission {
        Submission::start(dir, "slurm", ("SLURM_CONF", &self.config))
    }
}

/// A cluster of two nodes with a processor each, on this machine.
fn configuration(dir: &Path) -> String {
    let sockets = [0; 3].map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
    let [controller, first, second] = sockets.map(|s| s.local_addr().unwrap().port());
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap();
    let host = host.trim().split('.').next().unwrap();
    let dir = dir.display();
    format!(
        "ClusterName=test\n\
         SlurmctldHost={host}(127.0.0.1)\n\
         SlurmctldPort={controller}\n\
         SlurmUser=root\n\
         AuthType=auth/munge\n\
         AuthInfo=socket={dir}/socket\n\
         ProctrackType=proctrack/linuxproc\n\
         TaskPlugin=task/none\n\
         SelectType=select/cons_tres\n\
         SelectTypeParameters=CR_Core\n\
         StateSaveLocation={dir}/controller\n\
         SlurmdSpoolDir={dir}/%n\n\
         SlurmctldPidFile={dir}/controller.pid\n\
         SlurmdPidFile={dir}/%n.pid\n\
         SlurmctldLogFile={dir}/controller.log\n\
         SlurmdLogFile={dir}/%n.log\n\
         SlurmdTimeout=5\n\
         ReturnToService=2\n\
         SchedulerParameters=sched_interval=2,batch_sched_delay=0\n\
         NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={first} CPUs=1 State=UNKNOWN\n\
         NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={second} CPUs=1 State=UNKNOWN\n\
         PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP\n"
    )
}

#[test]
fn two_nodes_make_the_bytes_of_one_process() {
    let dir = tempfile::tempdir().unwrap();
    let Some(cluster) = Cluster::start(dir.path()) else {
        return;
    };
    let one = by_one(dir.path());
    let submission = cluster.submit(dir.path());
    assert_eq!(submission.report(&one)["trials"], 24);
    wait_for("the end of all jobs", || {
        cluster.ask("squeue", &["--noheader"]).is_empty()
    });
}

#[test]
fn a_node_that_fails_costs_no_byte() {
    let dir = tempfile::tempdir().unwrap();
    let Some(mut cluster) = Cluster::start(dir.path()) else {
        return;
    };
    let one = by_one(dir.path());
    let submission = cluster.submit(dir.path());
    wait_for("a shard", || submission.marks() > 0);
    cluster.fail_first_node();
    assert!(submission.marks() < 12, "it failed too late");
    assert_eq!(submission.report(&one)["trials"], 24);
}
