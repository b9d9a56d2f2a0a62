//! Who may ask: only a page of this server's own, under a name that nobody else can
//! give it, with the token in its address.
//!
//! A page of somebody else in the same browser cannot read the token; the checks of
//! `Host` and `Origin` keep it out even if it could, and keep out a name that somebody
//! lets point at this machine.

use super::request::{Request, Unread};
use crate::live::token::Token;
use std::net::IpAddr;

/// The part of the path behind the token, `None` where it ends without a slash.
pub(crate) fn admit<'a>(
    request: &'a Request,
    token: &Token,
    bound: IpAddr,
) -> Result<Option<&'a str>, Unread> {
    if !is_own_name(&request.host, bound) {
        return Err(Unread::Refused(403, "foreign Host"));
    }
    let own = format!("http://{}", request.host);
    if request.origin.as_ref().is_some_and(|origin| *origin != own) {
        return Err(Unread::Refused(403, "foreign Origin"));
    }
    let path = request.path.strip_prefix('/').unwrap_or("");
    let (word, rest) = match path.split_once('/') {
        Some((word, rest)) => (word, Some(rest)),
        None => (path, None),
    };
    if token.is(word) {
        Ok(rest)
    } else {
        Err(Unread::Refused(
            403,
            "the address lacks the token that the command printed",
        ))
    }
}

/// Whether a `Host` is this machine by number or as `localhost`. A name could be let
/// point here by whoever owns it; a number cannot. The port may be another, so that one
/// forwarded from another machine works.
fn is_own_name(host: &str, bound: IpAddr) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        _ => host,
    };
    let name = name
        .strip_prefix('[')
        .and_then(|n| n.strip_suffix(']'))
        .unwrap_or(name);
    match name.parse::<IpAddr>() {
        Ok(address) => address.is_loopback() || !bound.is_loopback(),
        Err(_) => name == "localhost",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_own_where_nobody_else_can_give_them() {
        for (host, own_here, own_where_opened) in [
            ("127.0.0.1:80", true, true),
            ("127.0.0.1", true, true),
            ("localhost:9", true, true),
            ("localhost", true, true),
            ("[::1]:80", true, true),
            ("10.0.0.7:80", false, true),
            ("[fe80::1]:80", false, true),
            ("example.org", false, false),
            ("127.0.0.1.example.org:80", false, false),
            ("localhost.x", false, false),
            ("", false, false),
        ] {
            for (bound, own) in [("127.0.0.1", own_here), ("10.0.0.7", own_where_opened)] {
                let found = is_own_name(host, bound.parse().unwrap());
                assert_eq!(found, own, "{host}, bound to {bound}");
            }
        }
    }
}
