//! The arm's reports as the bring-up reads them: one at a time, on connections of its own.

use super::{SetUp, SetUpError, refuse};
use crate::xarm::report::{MAX_REPORT_LEN, NORMAL_REPORT_LEN, NormalReport, RichReport};
use crate::xarm::{Firmware, ReportReader};
use core::ops::RangeInclusive;
use shared_types::FaultCode;
use std::io::Read;
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Longest wait for a status report; five come a second.
const REPORT_TIMEOUT: Duration = Duration::from_secs(2);

impl SetUp<'_> {
    /// Port with normal or rich reports.
    pub(super) fn status(&self) -> SocketAddr {
        let [status, _] = self.config.status_ports;
        SocketAddr::new(self.config.arm, status)
    }

    /// Compares the size of the reports with what the firmware is known to send.
    pub(super) fn match_layout(
        &self,
        firmware: Firmware,
        warnings: &mut Vec<String>,
    ) -> Result<String, SetUpError> {
        // Fields may lie elsewhere in reports of another size.
        let other_size = |address: SocketAddr, found: usize, sizes: &RangeInclusive<usize>| {
            let (port, least, most) = (address.port(), sizes.start(), sizes.end());
            let expected = if least == most {
                least.to_string()
            } else {
                format!("{least} to {most}")
            };
            let message = format!(
                "the arm says that its firmware is {firmware}, which sends reports of {expected} bytes on port {port}, but they have {found}: check which report port is which, then the firmware"
            );
            refuse(FaultCode::UnsupportedFirmware, message)
        };
        let status = read_report(self.status())?.len();
        let sizes = firmware.rich_sizes();
        // The normal report is the same everywhere.
        if status != NORMAL_REPORT_LEN && !sizes.contains(&status) {
            return other_size(self.status(), status, &sizes);
        }
        let sizes = firmware.realtime_sizes();
        let joints = SocketAddr::new(self.config.arm, self.config.report_port);
        match read_report(joints) {
            Ok(report) if sizes.contains(&report.len()) => Ok(format!(
                "{} and {status} bytes, as of {firmware}",
                report.len()
            )),
            Ok(report) => other_size(joints, report.len(), &sizes),
            // As many clients as it takes are there: the 100 Hz report serves.
            Err(reason) => {
                let fallback = self.config.fallback_report_port;
                warnings.push(format!(
                    "{reason}; until then the joints are those that port {fallback} reports, if it does"
                ));
                Ok(format!(
                    "{status} bytes, as of {firmware}; no real-time report"
                ))
            }
        }
    }
}

/// What the arm reports of itself on a status port; the rich report where its firmware has
/// it whole.
///
/// # Errors
/// Nothing comes within 2 s, or no report.
pub fn read_status(port: SocketAddr) -> Result<(NormalReport, Option<RichReport>), SetUpError> {
    let status = read_report(port)?;
    let normal = NormalReport::parse(&status).or_else(|e| no_status(port, e))?;
    Ok((normal, RichReport::parse(&status).ok()))
}

fn no_status<T>(address: SocketAddr, reason: impl core::fmt::Display) -> Result<T, SetUpError> {
    let message = format!("no report from the arm at {address} ({reason}): check the report ports");
    refuse(FaultCode::LinkLost, message)
}

/// The newest report of a port; one comes at once with every connection.
fn read_report(address: SocketAddr) -> Result<Vec<u8>, SetUpError> {
    let connected = TcpStream::connect_timeout(&address, REPORT_TIMEOUT).and_then(|stream| {
        stream.set_read_timeout(Some(REPORT_TIMEOUT))?;
        Ok(stream)
    });
    let mut stream = connected.or_else(|e| no_status(address, e))?;
    let mut reader = ReportReader::new();
    let (began, mut received) = (Instant::now(), 0);
    while received <= MAX_REPORT_LEN && began.elapsed() < REPORT_TIMEOUT {
        if let Some(frame) = reader.next_report().or_else(|e| no_status(address, e))? {
            return Ok(frame.to_vec());
        }
        let read = stream.read(reader.space());
        match read.or_else(|e| no_status(address, e))? {
            0 => break,
            n => {
                reader.commit(n);
                received = received.saturating_add(n);
            }
        }
    }
    no_status(
        address,
        std::io::Error::from(std::io::ErrorKind::UnexpectedEof),
    )
}
