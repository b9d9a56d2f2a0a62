//! The line to an arm: who answers, how fast, and what that means.

use super::{Finding, Verdict};
use rt_controller::arm_settings::{ArmSettings, summary};
use rt_controller::config::EnablingInput;
use rt_controller::session::ArmSession;
use rt_controller::set_up::{Headroom, ToolSpeed, read_status};
use rt_controller::xarm::{ArmVersion, Command, Firmware, ReplyData};
use std::io::Read;
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Questions for the version; half of them tell a typical round trip.
const QUESTIONS: usize = 200;
/// Longest wait for anything.
const WAIT: Duration = Duration::from_secs(2);
/// Round trips that leave a cycle of 4 ms room: median and p99 (µs).
const ROUND_TRIP_US: (f64, f64) = (500.0, 2000.0);

/// Asks an arm for its version, again and again, for its tool speed limit beside that of the
/// plans, and listens to its report ports. Nothing is set and nothing moves. Also whether a
/// real arm answers.
pub fn judge_line(
    ip: IpAddr,
    command_port: u16,
    report_ports: &[u16],
    plans_m_s: f64,
) -> (Vec<Finding>, bool) {
    let address = SocketAddr::new(ip, command_port);
    let mut round_trips_us = Vec::with_capacity(QUESTIONS);
    let version = ask(address, &mut round_trips_us);
    round_trips_us.sort_by(f64::total_cmp);
    let mut findings = vec![Finding::new(
        "arm",
        Verdict::fail_unless(version.is_ok()),
        match &version {
            Ok((ArmVersion { axes, firmware, .. }, simulated)) => {
                let kind = if *simulated { "simulated, " } else { "" };
                format!("{address}: {kind}{axes} axes, firmware {firmware}")
            }
            Err(reason) => format!("{address}: {reason}"),
        },
        "check power, cable and address (the arm's own page shows it in a browser), and that this machine has an address in its network",
    )];
    if let Ok((version, _)) = &version {
        let ports = report_ports.iter();
        findings.extend(ports.map(|port| report_port(SocketAddr::new(ip, *port))));
        findings.push(tool_speed(address, version.firmware, plans_m_s));
    }
    findings.extend(round_trips(&round_trips_us));
    let is_real = version.is_ok_and(|(_, simulated)| !simulated);
    (findings, is_real)
}

/// The arm's own tool speed limit beside that of the plans.
fn tool_speed(address: SocketAddr, firmware: Firmware, plans_m_s: f64) -> Finding {
    let read = ArmSession::connect(address, WAIT)
        .and_then(|mut session| ToolSpeed::read(&mut session, firmware, plans_m_s));
    let (verdict, found, remedy) = match read {
        Ok(found) => {
            let verdict = match found.headroom() {
                Headroom::Enough => Verdict::Pass,
                Headroom::Little => Verdict::Warn,
                Headroom::Unfit => Verdict::Fail,
            };
            (verdict, found.to_string(), found.remedy())
        }
        Err(reason) => (Verdict::Fail, reason.to_string(), String::new()),
    };
    Finding::new("tool speed", verdict, found, &remedy)
}

/// Its version, and whether it is the simulated arm.
fn ask(address: SocketAddr, round_trips_us: &mut Vec<f64>) -> Result<(ArmVersion, bool), String> {
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
    Ok((version, session.proves_simulated().unwrap_or(false)))
}

/// Whether anything comes from a report port.
fn report_port(address: SocketAddr) -> Finding {
    let listen = || {
        let mut stream = TcpStream::connect_timeout(&address, WAIT)?;
        stream.set_read_timeout(Some(WAIT))?;
        stream.read(&mut [0; 4])
    };
    let speaks = listen().is_ok_and(|bytes: usize| bytes > 0);
    let found = if speaks { "reports" } else { "is silent" };
    Finding::new(
        "report port",
        Verdict::fail_unless(speaks),
        format!("{} {found}", address.port()),
        "end other clients (the arm takes a few only); port 30000 needs firmware 2.1.101 or newer",
    )
}

/// Compares the settings that an arm reports on its `status` port with those `wanted` of an
/// arm whose tool centre point is `tool_m` from its flange.
pub fn settings(status: SocketAddr, wanted: &ArmSettings, tool_m: [f64; 3]) -> Finding {
    let name = "arm settings";
    let (normal, rich) = match read_status(status) {
        Ok(report) => report,
        Err(reason) => {
            let remedy = "see the row of the report port";
            return Finding::new(name, Verdict::Fail, reason.to_string(), remedy);
        }
    };
    let differ = wanted.differences(&normal, rich.as_ref(), tool_m);
    let messages: Vec<_> = differ.into_iter().map(|d| d.message).collect();
    Finding::new(
        name,
        Verdict::fail_unless(messages.is_empty()),
        summary(&normal, rich.as_ref()),
        &messages.join("; "),
    )
}

/// Levels of the digital inputs of an arm's control box, and whether the enabling switch among
/// them is held.
pub fn inputs(command: SocketAddr, enabling: Option<EnablingInput>) -> Finding {
    let name = "digital inputs";
    let read = ArmSession::connect(command, WAIT).and_then(|mut arm| arm.digital_inputs());
    let levels = match read {
        Ok(levels) => levels,
        Err(reason) => {
            let verdict = Verdict::fail_unless(enabling.is_none());
            return Finding::new(name, verdict, reason.to_string(), "see the row of the arm");
        }
    };
    let eight = |from: u16| -> String {
        let high = |i: u16| levels >> i & 1 != 0;
        let bits = (from..from + 8).map(|i| if high(i) { '1' } else { '0' });
        bits.collect()
    };
    let switch = match enabling {
        None => "no enabling switch configured",
        Some(input) if input.is_held(levels) => "enabling switch held",
        Some(_) => "enabling switch not held",
    };
    let found = format!("CI0-7 {}, DI0-7 {}; {switch}", eight(0), eight(8));
    Finding::new(name, Verdict::Pass, found, "")
}

/// Judges sorted round trips.
fn round_trips(sorted_us: &[f64]) -> Option<Finding> {
    let max = sorted_us.last()?;
    let at = |percent: usize| sorted_us[(sorted_us.len() - 1) * percent / 100];
    let (median, p99) = (at(50), at(99));
    Some(Finding::new(
        "round trip",
        Verdict::warn_unless(median <= ROUND_TRIP_US.0 && p99 <= ROUND_TRIP_US.1),
        format!(
            "{} requests: median {median:.0} µs, p99 {p99:.0} µs, max {max:.0} µs",
            sorted_us.len()
        ),
        "a direct cable to a network port of its own, no switch, no wireless, interrupt coalescing off",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rt_controller::arm_settings::Load;
    use xarm_sim::{ArmConfig, SimulatedArm};

    #[test]
    fn an_arm_set_otherwise_than_wanted_fails_and_says_what() {
        let arm = SimulatedArm::start(ArmConfig {
            command_port: 0,
            report_ports: [0; 4],
            ..ArmConfig::default()
        });
        let arm = arm.unwrap();
        let [_, _, rich, _] = arm.ports().reports;
        let at = |port| SocketAddr::from(([127, 0, 0, 1], port));
        let any = ArmSettings::default();
        let found = settings(at(rich), &any, [0.0, 0.0, 0.2]);
        assert_eq!(found.verdict, Verdict::Pass, "{found:?}");
        let wanted = ArmSettings {
            load: Some(Load {
                mass_kg: 1.0,
                centre_m: [0.0; 3],
            }),
            self_collision: Some(true),
            ..any
        };
        let found = settings(at(rich), &wanted, [0.0, 0.0, 0.2]);
        assert_eq!(found.verdict, Verdict::Fail);
        assert!(found.remedy.contains("1.000 kg"), "{found:?}");
        assert!(found.remedy.contains("self-collision"), "{found:?}");
        assert_eq!(settings(at(9), &any, [0.0; 3]).verdict, Verdict::Fail);
        // Its inputs are open, that is high.
        let command = at(arm.ports().command);
        for (held_high, word) in [(true, "switch held"), (false, "not held")] {
            let number = 9;
            let found = inputs(command, Some(EnablingInput { number, held_high }));
            assert!(found.found.contains(word), "{found:?}");
            assert!(found.found.starts_with("CI0-7 11111111"), "{found:?}");
        }
        // Its tool speed limit is 1.2 m/s.
        for (plans_m_s, verdict) in [
            (1.0, Verdict::Pass),
            (1.2, Verdict::Warn),
            (1.3, Verdict::Fail),
            (0.7, Verdict::Fail),
        ] {
            let found = tool_speed(at(arm.ports().command), Firmware::new(2, 7, 1), plans_m_s);
            assert_eq!(found.verdict, verdict, "{found:?}");
            let passed = verdict == Verdict::Pass;
            assert_eq!(found.remedy.is_empty(), passed, "{found:?}");
        }
    }

    #[test]
    fn a_slow_line_is_warned_of_and_a_silent_port_fails() {
        let quick: Vec<f64> = (0..200).map(|i| 100.0 + f64::from(i)).collect();
        assert_eq!(round_trips(&quick).unwrap().verdict, Verdict::Pass);
        let mut stalls = quick;
        stalls.truncate(190);
        stalls.extend([190_000.0; 10]);
        let slow = round_trips(&stalls).unwrap();
        assert_eq!(slow.verdict, Verdict::Warn);
        assert!(slow.found.contains("max 190000 µs"), "{}", slow.found);
        // Port 9 of this machine: nobody is there.
        let here = [127, 0, 0, 1].into();
        let (nobody, is_real) = judge_line(here, 9, &[9], 1.2);
        assert!(!is_real);
        let found = [nobody, vec![report_port((here, 9).into())]].concat();
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found.iter().all(|f| f.verdict == Verdict::Fail));
        assert!(found[0].found.starts_with("127.0.0.1:9: "), "{found:?}");
        assert_eq!(found[1].found, "9 is silent");
    }
}
