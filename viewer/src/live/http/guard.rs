//! Who may ask: only a page of this server's own, under a name that nobody else can
//! give it, with the token in its address.
//!
//! A page of somebody else in the same browser cannot read the token; the checks of
//! `Host` and `Origin` keep it out even if it could, and keep out a name that somebody
//! lets point at this machine.

use super::request::Request;
use crate::live::token::Token;
use std::net::IpAddr;

/// Why somebody is sent away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SentAway(pub u16, pub &'static str);

/// The part of the path behind the token, `None` where it ends without a slash.
pub(crate) fn admit<'a>(
    request: &'a Request,
    token: &Token,
    bound: IpAddr,
) -> Result<Option<&'a str>, SentAway> {
    if !is_own_name(&request.host, bound) {
        return Err(SentAway(403, "foreign Host"));
    }
    let own = format!("http://{}", request.host);
    if request.origin.as_ref().is_some_and(|origin| *origin != own) {
        return Err(SentAway(403, "foreign Origin"));
    }
    let path = request.path.strip_prefix('/').unwrap_or("");
    let (word, rest) = match path.split_once('/') {
        Some((word, rest)) => (word, Some(rest)),
        None => (path, None),
    };
    if token.is(word) {
        Ok(rest)
    } else {
        Err(SentAway(
            403,
            "the address lacks the token that `wag watch` printed",
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
    use std::net::Ipv4Addr;

    fn ask(path: &str, host: &str, origin: Option<&str>) -> Request {
        Request {
            method: "GET".to_owned(),
            path: path.to_owned(),
            query: String::new(),
            host: host.to_owned(),
            origin: origin.map(str::to_owned),
            keep: true,
        }
    }

    const HERE: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

    #[test]
    fn only_the_token_opens_and_only_under_an_own_name() {
        let token = Token::draw().unwrap();
        let home = format!("/{}/state", token.as_str());
        let admit =
            |request: &Request| super::admit(request, &token, HERE).map(|p| p.map(str::to_owned));
        for host in [
            "127.0.0.1:80",
            "localhost:9",
            "localhost",
            "[::1]:80",
            "127.0.0.1",
        ] {
            assert_eq!(
                admit(&ask(&home, host, None)),
                Ok(Some("state".to_owned())),
                "{host}"
            );
        }
        for host in [
            "example.org",
            "127.0.0.1.example.org:80",
            "10.0.0.7:80",
            "",
            "localhost.x",
        ] {
            assert_eq!(
                admit(&ask(&home, host, None)).unwrap_err().1,
                "foreign Host",
                "{host}"
            );
        }
        assert!(admit(&ask(&home, "localhost:9", Some("http://localhost:9"))).is_ok());
        for origin in [
            "http://example.org",
            "null",
            "https://localhost:9",
            "http://localhost:8",
        ] {
            let away = admit(&ask(&home, "localhost:9", Some(origin))).unwrap_err();
            assert_eq!(away.1, "foreign Origin", "{origin}");
        }
        for path in ["/", "/state", "//state", "state", &home[..5], &home[1..]] {
            let path = if path == &home[1..] {
                format!("/x{path}")
            } else {
                path.to_owned()
            };
            assert_eq!(
                admit(&ask(&path, "localhost", None)).unwrap_err().0,
                403,
                "{path}"
            );
        }
        let bare = format!("/{}", token.as_str());
        assert_eq!(admit(&ask(&bare, "localhost", None)), Ok(None));
    }

    #[test]
    fn numbers_of_other_machines_count_where_the_server_was_opened_to_them() {
        assert!(!is_own_name("10.0.0.7:80", HERE));
        let open: IpAddr = "10.0.0.7".parse().unwrap();
        assert!(is_own_name("10.0.0.7:80", open) && is_own_name("[fe80::1]:80", open));
        assert!(!is_own_name("lab.example.org:80", open));
    }
}
