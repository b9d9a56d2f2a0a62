//! Values on the command line, with what they may be.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use shared_types::Task;
use std::net::{IpAddr, ToSocketAddrs};
use std::str::FromStr;

/// One of these by its name, each with what `--help` says of it; one of which it says
/// nothing is not listed there.
pub(super) fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    known: [(&'static str, &'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let names = known.map(|(name, help, _)| {
        let value = PossibleValue::new(name).hide(help.is_empty());
        if help.is_empty() {
            value
        } else {
            value.help(help)
        }
    });
    PossibleValuesParser::new(names).try_map(move |name| {
        let found = known.iter().find(|(known, ..)| *known == name);
        found.map(|(.., value)| *value).ok_or("it is not known")
    })
}

/// A frame rate (Hz).
pub(super) fn rate_hz(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rate) if (0.1..=10_000.0).contains(&rate) => Ok(rate),
        _ => Err("a frame rate is a number from 0.1 to 10000, a second".to_owned()),
    }
}

/// How far two clocks may be apart (ms).
pub(super) fn offset_ms(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(offset) if (-1000.0..=1000.0).contains(&offset) => Ok(offset),
        _ => Err("an offset of clocks is a number from -1000 to 1000, in ms".to_owned()),
    }
}

/// A span of time (s).
pub(super) fn span_s(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(span) if span > 0.0 && f64::is_finite(span) => Ok(span),
        _ => Err("a time is a number above zero, in s".to_owned()),
    }
}

/// A mass (kg).
pub(super) fn mass_kg(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(mass) if mass > 0.0 && mass < 10.0 => Ok(mass),
        _ => Err("a lead's mass is a number above 0 and below 10, in kg".to_owned()),
    }
}

/// An address, or a name that has one; version 4 is what an arm speaks.
pub(super) fn host(text: &str) -> Result<IpAddr, String> {
    if let Ok(address) = text.parse() {
        return Ok(address);
    }
    let port = text.rsplit_once(':').map(|(_, port)| port.parse::<u16>());
    if matches!(port, Some(Ok(_))) {
        return Err(format!("`{text}` has a port: name it with --command-port"));
    }
    let found: Vec<IpAddr> = (text, 0u16)
        .to_socket_addrs()
        .map_err(|e| {
            format!(
                "cannot resolve `{text}`: it is neither an IP address nor a known host name ({e})"
            )
        })?
        .map(|socket| socket.ip())
        .collect();
    let first = found.iter().find(|ip| ip.is_ipv4()).or(found.first());
    first
        .copied()
        .ok_or_else(|| format!("`{text}` has no address"))
}

/// So many numbers with commas between them, each as it should be.
fn listed<T: FromStr, const N: usize>(
    text: &str,
    what: &str,
    fits: impl Fn(&T) -> bool,
) -> Result<[T; N], String> {
    let numbers: Option<Vec<T>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    numbers
        .filter(|numbers| numbers.iter().all(fits))
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("`{text}` must be {what}"))
}

/// Three finite numbers `x,y,z`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point(pub [f64; 3]);

impl FromStr for Point {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let fits = |v: &f64| v.is_finite();
        listed(text, "three finite numbers x,y,z", fits).map(Self)
    }
}

/// A colour `R,G,B`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

impl FromStr for Colour {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        listed(text, "three whole numbers R,G,B from 0 to 255", |_| true).map(Self)
    }
}

/// What throws are for, by name.
pub const TASKS: [(&str, &str, Task); 3] = [
    ("strike", "The tip passes through the target", Task::Strike),
    (
        "lob",
        "The tip fells a domino on a board and stays there",
        Task::Lob,
    ),
    ("drape", "The rope comes to hang over a wall", Task::Drape),
];
