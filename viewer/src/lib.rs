//! What people look at: [`live`], a page in the browser that follows a running
//! controller, and [`report`], a run as one HTML file. Both only read, but for the stop
//! that somebody asks for on the live page.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod live;
pub mod report;
