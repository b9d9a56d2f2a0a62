//! `wag watch` and `wag report` as a browser meets them: who is let in, how fast the
//! page is told, what it may ask for, and what a real browser makes of it.
#![cfg(test)]

mod browser;
mod chromium;
mod client;
mod fake;
#[cfg(feature = "foxglove")]
mod foxglove;
mod preview;
mod server;
mod stop;
mod studio;
#[path = "../support/mod.rs"]
mod support;
