//! The line to an arm: who answers, and how fast.

use rt_controller::session::ArmSession;
use rt_controller::xarm::{ArmVersion, Command, ReplyData};
use std::io::Read;
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Questions for the version; half of them tell a typical round trip.
const QUESTIONS: usize = 200;
/// Longest wait for anything.
const WAIT: Duration = Duration::from_secs(2);

/// What was found on the line to an arm.
#[derive(Debug)]
pub struct ArmLine {
    /// Command port.
    pub address: SocketAddr,
    /// Version of the arm, or why there is none.
    pub version: Result<ArmVersion, String>,
    /// Round trips (µs), in increasing order.
    pub round_trips_us: Vec<f64>,
    /// Report ports, and whether one said something.
    pub reports: Vec<(u16, bool)>,
}

impl ArmLine {
    /// Asks an arm for its version, again and again, and listens to its report
    /// ports. Nothing is set and nothing moves.
    pub fn measure(ip: IpAddr, command_port: u16, report_ports: &[u16]) -> Self {
        let address = SocketAddr::new(ip, command_port);
        let mut round_trips_us = Vec::with_capacity(QUESTIONS);
        let version = ask(address, &mut round_trips_us);
        round_trips_us.sort_by(f64::total_cmp);
        let reports = if version.is_ok() { report_ports } else { &[] };
        Self {
            address,
            version,
            round_trips_us,
            reports: reports
                .iter()
                .map(|port| (*port, reports_at(SocketAddr::new(ip, *port))))
                .collect(),
        }
    }
}

fn ask(address: SocketAddr, round_trips_us: &mut Vec<f64>) -> Result<ArmVersion, String> {
    let mut session = ArmSession::connect(address, WAIT).map_err(|e| e.to_string())?;
    let mut version = Err("it answered with something that is no version".to_owned());
    for _ in 0..QUESTIONS {
        let began = Instant::now();
        let reply = session.ask(&Command::Version).map_err(|e| e.to_string())?;
        round_trips_us.push(began.elapsed().as_secs_f64() * 1e6);
        if let ReplyData::Text(text) = reply {
            version = ArmVersion::parse(text.as_str()).map_err(|e| e.to_string());
        }
    }
    let version = version?;
    version.check().map_err(|e| e.to_string())?;
    Ok(version)
}

/// Whether anything comes from a report port.
fn reports_at(address: SocketAddr) -> bool {
    let listen = || {
        let mut stream = TcpStream::connect_timeout(&address, WAIT)?;
        stream.set_read_timeout(Some(WAIT))?;
        stream.read(&mut [0; 4])
    };
    listen().is_ok_and(|bytes: usize| bytes > 0)
}
