//! A dead-man switch for a terminal: standard input is the handle. As long as it
//! is open and silent the switch is held; a line, its end, or an error lets go.
//! So does a pipe whose other end, a button's driver, goes away.

use anyhow::Context;
use std::io::{BufRead, stdin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The switch; once let go it stays so.
#[derive(Debug)]
pub struct DeadMan {
    let_go: Arc<AtomicBool>,
}

impl DeadMan {
    /// Held from now on. Its thread may outlive the switch: nothing can wake a read of
    /// standard input.
    pub fn hold() -> anyhow::Result<Self> {
        let let_go = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&let_go);
        std::thread::Builder::new()
            .name("dead-man".to_owned())
            .spawn(move || {
                // Whatever ends the wait lets go.
                let _ = stdin().lock().read_line(&mut String::new());
                flag.store(true, Ordering::SeqCst);
            })
            .context("cannot watch the dead-man switch")?;
        Ok(Self { let_go })
    }

    pub fn is_let_go(&self) -> bool {
        self.let_go.load(Ordering::SeqCst)
    }
}
