//! A `wag watch` as a process, and requests to it byte by byte.

use super::support::Running;
use rustix::process::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// A watcher that ends when dropped.
pub(crate) struct Watch {
    process: Running,
    pub(crate) url: String,
}

#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Watch {
    pub(crate) fn start(args: &str) -> Self {
        let (process, reported) = Running::start(&format!("watch {args}"));
        Self {
            process,
            url: reported["url"].as_str().unwrap().to_owned(),
        }
    }

    pub(crate) fn pid(&self) -> u32 {
        self.process.0.id()
    }

    /// `127.0.0.1:PORT`.
    pub(crate) fn host(&self) -> &str {
        self.url.split('/').nth(2).unwrap()
    }

    /// `/TOKEN/`.
    pub(crate) fn home(&self) -> &str {
        &self.url["http://".len() + self.host().len()..]
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.host()).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        stream
    }

    /// Asks for something of this page.
    pub(crate) fn get(&self, mut stream: &TcpStream, path: &str) {
        let (home, host) = (self.home(), self.host());
        write!(stream, "GET {home}{path} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    }

    /// Sends these bytes; reads one answer.
    pub(crate) fn raw(&self, text: &str) -> Answer {
        let mut stream = self.connect();
        // A refused request may be cut short by its answer.
        let _ = stream.write_all(text.as_bytes());
        read_answer(&mut BufReader::new(stream))
    }

    /// A request as a page of this server makes it.
    pub(crate) fn ask(&self, method: &str, path: &str) -> Answer {
        let (home, host) = (self.home(), self.host());
        self.raw(&format!(
            "{method} {home}{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n\r\n"
        ))
    }

    /// Follows the state.
    pub(crate) fn states(&self) -> States {
        let stream = self.connect();
        self.get(&stream, "state");
        let mut reader = BufReader::new(stream);
        assert!(head(&mut reader).contains("text/event-stream"));
        States(reader)
    }

    pub(crate) fn resident_mb(&self) -> f64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid())).unwrap();
        let line = status.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
        let kilobytes = line.split_whitespace().nth(1).unwrap();
        kilobytes.parse::<f64>().unwrap() / 1e3
    }

    /// Ends it as Ctrl-C does; its exit code.
    pub(crate) fn end(mut self) -> Option<i32> {
        self.process.end(Signal::INT).0
    }
}

impl Answer {
    /// What stands behind a name in its head.
    pub(crate) fn line(&self, name: &str) -> Option<&str> {
        let mut lines = self.head.lines().filter_map(|l| l.split_once(": "));
        lines.find_map(|(n, v)| (n == name).then_some(v))
    }
}

pub(crate) struct States(BufReader<TcpStream>);

impl States {
    pub(crate) fn next(&mut self) -> Value {
        loop {
            let mut line = String::new();
            assert!(self.0.read_line(&mut line).unwrap() > 0, "the stream ended");
            if let Some(state) = line.strip_prefix("data: ") {
                return serde_json::from_str(state).unwrap();
            }
        }
    }

    /// The first state that is as wanted.
    pub(crate) fn until(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            let state = self.next();
            if wanted(&state) {
                return state;
            }
            assert!(began.elapsed() < Duration::from_secs(30), "{what}: {state}");
        }
    }
}

fn head(reader: &mut BufReader<TcpStream>) -> String {
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        let read = reader.read_line(&mut head).unwrap();
        assert!(read > 0, "no answer: {head}");
    }
    head
}

pub(crate) fn read_answer(reader: &mut BufReader<TcpStream>) -> Answer {
    let head = head(reader);
    let mut answer = Answer {
        status: head.split(' ').nth(1).unwrap().parse().unwrap(),
        head,
        body: Vec::new(),
    };
    let length = answer.line("Content-Length").unwrap().parse().unwrap();
    answer.body.resize(length, 0);
    reader.read_exact(&mut answer.body).unwrap();
    answer
}
