//! Reading a request: a head of bounded size within bounded time, and no body.

use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

pub(crate) const HEAD_MAX_BYTES: usize = 8192;
const HEADERS_MAX: usize = 64;
/// How long a head may take from its first byte.
const HEAD_PATIENCE: Duration = Duration::from_secs(3);
/// How long a connection may be silent between two requests.
const IDLE_PATIENCE: Duration = Duration::from_secs(5);

/// A request without a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Request {
    pub method: String,
    /// Path, without what follows a `?`.
    pub path: String,
    /// What follows it.
    pub query: String,
    /// The one `Host` line.
    pub host: String,
    pub origin: Option<String>,
    /// Whether another request may follow on this connection.
    pub keep: bool,
}

/// Why a request is not answered as it was meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unread {
    /// The other end is gone, silent or too slow: nothing to answer.
    Gone,
    /// An answer with this status, then the end of the connection.
    Refused(u16, &'static str),
}

/// Reads the next request. `rest` holds what came after the one before.
pub(crate) fn read(stream: &TcpStream, rest: &mut Vec<u8>) -> Result<Request, Unread> {
    let mut stream = stream;
    let patience = if rest.is_empty() {
        IDLE_PATIENCE
    } else {
        HEAD_PATIENCE
    };
    let mut until = Instant::now() + patience;
    let mut piece = [0; 2048];
    loop {
        if let Some((request, used)) = parse(rest)? {
            rest.drain(..used);
            return Ok(request);
        }
        let left = until
            .checked_duration_since(Instant::now())
            .filter(|left| !left.is_zero())
            .ok_or(Unread::Gone)?;
        stream
            .set_read_timeout(Some(left))
            .map_err(|_e| Unread::Gone)?;
        match stream.read(&mut piece) {
            Ok(0) => return Err(Unread::Gone),
            Ok(n) => {
                if rest.is_empty() {
                    until = Instant::now() + HEAD_PATIENCE;
                }
                rest.extend_from_slice(&piece[..n]);
            }
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(_) => return Err(Unread::Gone),
        }
    }
}

/// A whole head and its length; `None` when more must come.
fn parse(bytes: &[u8]) -> Result<Option<(Request, usize)>, Unread> {
    let mut lines = [httparse::EMPTY_HEADER; HEADERS_MAX];
    let mut head = httparse::Request::new(&mut lines);
    let seen = &bytes[..bytes.len().min(HEAD_MAX_BYTES)];
    let used = match head.parse(seen) {
        Ok(httparse::Status::Complete(used)) => used,
        Ok(httparse::Status::Partial) if bytes.len() >= HEAD_MAX_BYTES => {
            return Err(Unread::Refused(431, "the head is longer than 8 KiB"));
        }
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => {
            return Err(Unread::Refused(431, "more than 64 header lines"));
        }
        Err(_) => return Err(Unread::Refused(400, "this is not HTTP/1")),
    };
    let (Some(method), Some(target), Some(version)) = (head.method, head.path, head.version) else {
        return Ok(None);
    };
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let mut request = Request {
        method: method.to_owned(),
        path: path.to_owned(),
        query: query.to_owned(),
        host: String::new(),
        origin: None,
        keep: version == 1,
    };
    let mut hosts = 0;
    for line in head.headers.iter() {
        let text = std::str::from_utf8(line.value)
            .map(str::trim)
            .unwrap_or("?");
        match line.name.to_ascii_lowercase().as_str() {
            "host" => {
                hosts += 1;
                request.host = text.to_ascii_lowercase();
            }
            // Two that differ are told apart from none: neither is trusted.
            "origin" if request.origin.is_some() => request.origin = Some("twice".to_owned()),
            "origin" => request.origin = Some(text.to_ascii_lowercase()),
            "connection" if text.eq_ignore_ascii_case("close") => request.keep = false,
            "content-length" if text == "0" => {}
            "content-length" | "transfer-encoding" => {
                return Err(Unread::Refused(413, "no request has a body here"));
            }
            _ => {}
        }
    }
    if hosts != 1 {
        return Err(Unread::Refused(400, "there must be one Host line"));
    }
    Ok(Some((request, used)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Option<(Request, usize)>, Unread> {
        parse(text.as_bytes())
    }

    #[test]
    fn a_head_is_read_whole_and_what_follows_is_left() {
        let text = "GET /a/b?n=1 HTTP/1.1\r\nHost: X:1\r\nOrigin: http://x:1\r\n\r\nGET";
        for cut in 0..text.len() - 3 {
            assert_eq!(parsed(&text[..cut]), Ok(None), "{cut}");
        }
        let (request, used) = parsed(text).unwrap().unwrap();
        assert_eq!(&text[used..], "GET");
        assert_eq!((&*request.path, &*request.query), ("/a/b", "n=1"));
        assert_eq!(request.host, "x:1");
        assert_eq!(request.origin.as_deref(), Some("http://x:1"));
        assert!(request.keep);
        let old = parsed("GET / HTTP/1.0\r\nHost: x\r\n\r\n")
            .unwrap()
            .unwrap()
            .0;
        assert!(!old.keep);
    }

    #[test]
    fn what_is_too_much_or_ambiguous_is_refused() {
        let status = |text: &str| match parsed(text) {
            Err(Unread::Refused(status, _)) => status,
            other => panic!("{other:?}"),
        };
        let long = format!("GET /{} HTTP/1.1\r\n", "a".repeat(HEAD_MAX_BYTES));
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(65));
        for (text, refused) in [
            (&*long, 431),
            (&*many, 431),
            ("GET / HTTP/1.1\r\n\r\n", 400),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400),
            ("\u{1}\u{2}\r\n\r\n", 400),
            (
                "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\n",
                413,
            ),
            (
                "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n",
                413,
            ),
        ] {
            assert_eq!(status(text), refused, "{text}");
        }
        assert!(parsed("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n\r\n").is_ok());
    }
}
