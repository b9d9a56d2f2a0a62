//! How an arm follows its setpoints, as measured: `arm-response.toml`.
//!
//! Each joint is described by silence, then a second-order lag of gain one:
//! `q'' = w² (u(t - dead time) - q) - 2 z w q'`, where `u` is the staircase of
//! setpoints at the instants they left this machine. A joint whose motion told
//! too little has no numbers at all, never guessed ones.
//!
//! ```toml
//! format = 1
//! version = "0.1.0"                  # of the program that measured
//! source = "arm 192.168.1.215:502"   # or the run folder
//! command_to_target_s = [0.0002, 0.0011]   # left out when it was not seen
//! [excitation]                       # left out when a recorded run was used
//! seed = 1
//! # ... see [`Excitation`]
//! [[joints]]                         # seven, joint 1 first
//! joint = 1
//! excited = true
//! dead_time_s = 0.0214
//! dead_time_interval_s = [0.0209, 0.0216]
//! natural_frequency_hz = 11.3
//! natural_frequency_interval_hz = [11.1, 11.5]
//! damping_ratio = 0.82
//! damping_ratio_interval = [0.80, 0.84]
//! residual_rad = 1.1e-5
//! samples = 900
//! [[joints]]
//! joint = 2
//! excited = false
//! why = "still"
//! ```

mod file;
mod measured;

pub use file::{ArmResponse, ArmResponseError, RESPONSE_FORMAT};
pub use measured::{Estimate, Excitation, JointResponse, NotExcited, TrackingLag};

#[cfg(test)]
mod tests;
