//! `wag watch` and `wag report` as a browser meets them: who is let in, how fast the
//! page is told, what it may ask for, and what a real browser makes of it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

mod browser;
mod chromium;
mod client;
mod fake;
mod server;
