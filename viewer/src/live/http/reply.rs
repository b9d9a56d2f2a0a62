//! Writing answers.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

/// Said with every answer: kept nowhere.
const COMMON: &str = "Cache-Control: no-store\r\n\
    X-Content-Type-Options: nosniff\r\n\
    Referrer-Policy: no-referrer\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n";
/// What a page of this server may do: it loads nothing from elsewhere and is framed by nobody.
/// Another page of the server may stand in a frame of its own.
const OF_PAGES: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
    connect-src 'self'; img-src data:; frame-src 'self'; frame-ancestors 'none'; \
    base-uri 'none'; form-action 'none'";
/// What a document may do that a run folder holds: run what it contains, load nothing, ask this
/// server for nothing (it has no origin), and stand in a page of this server.
const OF_DOCUMENTS: &str = "default-src 'none'; script-src 'unsafe-inline'; \
    style-src 'unsafe-inline'; img-src data:; sandbox allow-scripts; frame-ancestors 'self'; \
    base-uri 'none'; form-action 'none'";

/// An answer of known length.
#[derive(Debug)]
pub struct Reply {
    pub(crate) status: u16,
    /// Type of the body.
    pub(crate) kind: &'static str,
    /// Further header lines, each with its end.
    pub(crate) more: String,
    pub(crate) body: Vec<u8>,
    pub(crate) policy: &'static str,
}

impl Reply {
    /// A whole answer of a type.
    pub fn of(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self {
            status: 200,
            kind,
            more: String::new(),
            body: body.into(),
            policy: OF_PAGES,
        }
    }

    /// A report of a run: its scripts run, and load nothing.
    pub fn document(html: impl Into<Vec<u8>>) -> Self {
        Self {
            policy: OF_DOCUMENTS,
            ..Self::of("text/html; charset=utf-8", html)
        }
    }

    /// A value.
    pub fn json(value: &impl serde::Serialize) -> Self {
        match serde_json::to_vec(value) {
            Ok(body) => Self::of("application/json", body),
            Err(error) => Self::said(500, &error.to_string()),
        }
    }

    /// Its status.
    #[must_use]
    pub const fn status(&self) -> u16 {
        self.status
    }

    /// A line of text with a status.
    pub fn said(status: u16, text: &str) -> Self {
        Self {
            status,
            ..Self::of("text/plain; charset=utf-8", text)
        }
    }

    pub(crate) fn write(&self, mut to: &TcpStream, keep: bool) -> std::io::Result<()> {
        let head = format!(
            "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: {}\r\nContent-Security-Policy: {}\r\n{}{COMMON}\r\n",
            self.status,
            reason(self.status),
            self.kind,
            self.body.len(),
            if keep { "keep-alive" } else { "close" },
            self.policy,
            self.more,
        );
        to.write_all(&[head.as_bytes(), &self.body].concat())
    }
}

/// The head of a stream of events without end.
pub(crate) fn begin_events(mut to: &TcpStream) -> std::io::Result<()> {
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n{COMMON}\r\n"
    );
    to.write_all(head.as_bytes())
}

/// Ends a connection whose request was not read to its end, so that the answer is not
/// lost with what still comes.
pub(crate) fn end_unread(mut stream: &TcpStream) {
    let _ = stream.shutdown(Shutdown::Write);
    let _ = stream.set_read_timeout(Some(Duration::from_millis(100)));
    let mut bin = [0; 4096];
    for _ in 0..64 {
        if !matches!(stream.read(&mut bin), Ok(n) if n > 0) {
            return;
        }
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        204 => "No Content",
        308 => "Permanent Redirect",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        409 => "Conflict",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        500 => "Internal Server Error",
        503 => "Service Unavailable",
        _ => "Error",
    }
}
