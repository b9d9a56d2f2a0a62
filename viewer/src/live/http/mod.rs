//! A small HTTP server for one page: a thread for each connection, all of them bounded
//! in number, size and time. What it says is made elsewhere; here is who may hear it.
//!
//! Parsing is httparse's. A framework on an asynchronous runtime would bring dozens of
//! packages into the program for six addresses and a handful of readers.

mod guard;
mod reply;
mod request;

use super::ask::{Ask, Requested};
use super::desk::{Asked, Desk};
use super::film::Picture;
use super::newest::Newest;
use super::page;
use super::token::Token;
use anyhow::Context;
use guard::admit;
pub use reply::Reply;
use reply::{begin_events, end_unread};
use request::Unread;
use std::io::Write;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

const CONNECTIONS_MAX: usize = 64;
/// Most pages that follow the state at once; the rest of the connections are left for
/// pictures and stops.
const FOLLOWERS_MAX: usize = 16;
/// How long a reader may take nothing before it is given up.
const WRITE_PATIENCE: Duration = Duration::from_secs(2);
/// How long a page waits for the next picture.
const PICTURE_PATIENCE: Duration = Duration::from_secs(1);
/// Who asked for a picture within this time wants more.
const PICTURE_WANTED: Duration = Duration::from_secs(3);
/// How long the controller may take to answer.
const ANSWER_PATIENCE: Duration = Duration::from_secs(8);
/// Stack of a connection's thread (bytes): a desk may simulate a rope on it.
const STACK_BYTES: usize = 4 * 1024 * 1024;

/// What the server hands out, and where requests go.
#[derive(Debug)]
pub(crate) struct Site {
    token: Token,
    bound: IpAddr,
    /// The newest state as JSON.
    pub state: Newest<String>,
    pub pictures: Newest<Picture>,
    asks: Mutex<mpsc::Sender<Requested>>,
    /// What its pages offer beside looking on.
    desk: Option<Arc<dyn Desk>>,
    picture_asked: Mutex<Option<Instant>>,
    connections: AtomicUsize,
    followers: AtomicUsize,
}

impl Site {
    pub(crate) fn is_followed(&self) -> bool {
        self.followers.load(Ordering::SeqCst) > 0
    }

    pub(crate) fn wants_pictures(&self) -> bool {
        let requested = self.picture_asked.lock();
        requested
            .unwrap_or_else(PoisonError::into_inner)
            .is_some_and(|at| at.elapsed() < PICTURE_WANTED)
    }
}

/// Takes one of a bounded number of places; given back when dropped.
struct Place<'a>(&'a AtomicUsize);

impl<'a> Place<'a> {
    fn take(taken: &'a AtomicUsize, most: usize) -> Option<Self> {
        let place = Self(taken);
        (place.0.fetch_add(1, Ordering::SeqCst) < most).then_some(place)
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Begins to serve at `bind`. Returns the page's address and what it shows; requests
/// come out of `asks`' other end.
pub(crate) fn serve(
    bind: SocketAddr,
    asks: mpsc::Sender<Requested>,
    desk: Option<Arc<dyn Desk>>,
) -> anyhow::Result<(String, Arc<Site>)> {
    let listener = TcpListener::bind(bind).with_context(|| {
        format!("cannot listen on {bind}; name another address or port with --bind")
    })?;
    let bound = listener.local_addr().context("the server's own address")?;
    let token = Token::draw()?;
    let url = format!("http://{bound}/{}/", token.as_str());
    let site = Arc::new(Site {
        token,
        bound: bound.ip(),
        state: Newest::default(),
        pictures: Newest::default(),
        asks: Mutex::new(asks),
        desk,
        picture_asked: Mutex::new(None),
        connections: AtomicUsize::new(0),
        followers: AtomicUsize::new(0),
    });
    let shared = Arc::clone(&site);
    std::thread::Builder::new()
        .name("watch-accept".to_owned())
        .spawn(move || accept(&listener, &shared))
        .context("cannot start the server's thread")?;
    Ok((url, site))
}

fn accept(listener: &TcpListener, site: &Arc<Site>) {
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // Out of descriptors, for instance: try again, but not at full speed.
            std::thread::sleep(Duration::from_millis(50));
            continue;
        };
        let site = Arc::clone(site);
        let body = move || {
            let _ = stream.set_write_timeout(Some(WRITE_PATIENCE));
            let _ = stream.set_nodelay(true);
            match Place::take(&site.connections, CONNECTIONS_MAX) {
                Some(_place) => converse(&stream, &site),
                None => {
                    let full = Reply::said(503, "too many connections");
                    let _ = full.write(&stream, false);
                }
            }
        };
        let _ = std::thread::Builder::new()
            .name("watch-http".to_owned())
            .stack_size(STACK_BYTES)
            .spawn(body);
    }
}

/// Answers one request after the other.
fn converse(stream: &TcpStream, site: &Site) {
    let mut rest = Vec::new();
    let is_local = stream
        .peer_addr()
        .is_ok_and(|peer| peer.ip().to_canonical().is_loopback());
    loop {
        let request = request::read(stream, &mut rest);
        let done = request.and_then(|request| {
            let path = admit(&request, &site.token, site.bound)?;
            let done = match (request.method.as_str(), path) {
                ("GET", Some("state")) => follow(stream, site),
                (method, path) => {
                    let asked = Asked {
                        method,
                        path: path.unwrap_or(""),
                        query: &request.query,
                        is_local,
                    };
                    let desk = site.desk.as_ref().filter(|_| path.is_some());
                    let reply = desk.and_then(|desk| desk.answer(&asked));
                    let reply = reply.unwrap_or_else(|| answer(site, method, path, &request.query));
                    reply.write(stream, request.keep)
                }
            };
            Ok(done.is_ok() && request.keep)
        });
        match done {
            Ok(true) => {}
            Ok(false) | Err(Unread::Gone) => return,
            Err(Unread::Refused(status, why)) => {
                let _ = Reply::said(status, why).write(stream, false);
                return end_unread(stream);
            }
        }
    }
}

/// The answer to a request that has the token; `path` is what stands behind it.
fn answer(site: &Site, method: &str, path: Option<&str>, query: &str) -> Reply {
    let ask = path.and_then(|path| path.strip_prefix("ask/"));
    match (method, path) {
        ("GET", None) => Reply {
            more: format!("Location: /{}/\r\n", site.token.as_str()),
            ..Reply::said(308, "")
        },
        ("GET", Some("")) => Reply::of("text/html; charset=utf-8", page::HTML),
        ("GET", Some("watch.js")) => Reply::of("text/javascript; charset=utf-8", page::script()),
        ("GET", Some("watch.css")) => Reply::of("text/css; charset=utf-8", page::style()),
        ("GET", Some("picture")) => picture(site, query),
        ("POST", Some(_)) if ask.is_some() => match ask.and_then(Ask::named) {
            Some(ask) => request(site, ask),
            None => Reply::said(404, "unknown request"),
        },
        ("GET" | "POST", Some(path))
            if !matches!(path, "" | "watch.js" | "watch.css" | "state" | "picture")
                && ask.and_then(Ask::named).is_none() =>
        {
            Reply::said(404, "there is nothing here")
        }
        _ => Reply::said(405, "method not allowed"),
    }
}

/// The state as a stream of events, until the reader goes or stops reading. It gets
/// the newest state whenever it is ready for one, never those in between.
fn follow(mut stream: &TcpStream, site: &Site) -> std::io::Result<()> {
    let Some(_place) = Place::take(&site.followers, FOLLOWERS_MAX) else {
        return Reply::said(503, "too many pages follow already").write(stream, true);
    };
    begin_events(stream)?;
    let mut seen = 0;
    loop {
        match site.state.other_than(seen, Duration::from_secs(1)) {
            Some((number, state)) => {
                seen = number;
                stream.write_all(format!("data: {state}\n\n").as_bytes())?;
            }
            // Shows whether somebody is still there.
            None => stream.write_all(b":\n\n")?,
        }
    }
}

/// The newest picture, if it is another than the page has; what is drawn over it stands
/// in a header line.
fn picture(site: &Site, query: &str) -> Reply {
    let requested = site.picture_asked.lock();
    *requested.unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
    let seen = query.strip_prefix("after=");
    let seen = seen.and_then(|n| n.parse().ok()).unwrap_or(0);
    match site.pictures.other_than(seen, PICTURE_PATIENCE) {
        None => Reply {
            status: 204,
            ..Reply::of("image/jpeg", [])
        },
        Some((number, picture)) => Reply {
            more: format!("X-Number: {number}\r\nX-Over: {}\r\n", picture.over),
            ..Reply::of("image/jpeg", &*picture.jpeg)
        },
    }
}

/// Passes a request on and waits for the controller's answer.
fn request(site: &Site, ask: Ask) -> Reply {
    let (reply, answers) = mpsc::channel();
    let asks = site.asks.lock().unwrap_or_else(PoisonError::into_inner);
    let sent = asks.send(Requested { ask, reply });
    drop(asks);
    match sent
        .ok()
        .and_then(|()| answers.recv_timeout(ANSWER_PATIENCE).ok())
    {
        Some(Ok(())) => Reply::said(200, "done"),
        Some(Err(why)) => Reply::said(409, &why),
        None => Reply::said(503, "the controller did not answer; use the emergency stop"),
    }
}
