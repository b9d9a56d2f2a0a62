//! Registers without a typed command.

use super::ArmModel;
use arm_model::kinematics::{JOINT_ORIGIN_M, JOINT_QUARTER_TURNS_X};
use rt_controller::xarm::Register;

impl ArmModel {
    /// Data of the reply to a register without a typed command; `None` when
    /// this controller does not know what to do with it.
    pub(super) fn raw(&mut self, register: Register, parameters: &[u8]) -> Option<Vec<u8>> {
        Some(match register {
            Register::ReportedEffort => vec![u8::from(self.settings.reports_current)],
            Register::GetReducedMode => vec![u8::from(self.settings.reduced.on)],
            Register::ReducedState => self.settings.reduced_state(),
            Register::JointTorque => self.effort_nm().iter().flat_map(f32_le).collect(),
            Register::DhTable => dh_table(),
            Register::PowerBoardVersion => vec![0; 6],
            Register::HardwareTypes => vec![0; 2],
            Register::SaveConfiguration => {
                self.saved = self.settings;
                Vec::new()
            }
            Register::ClearConfiguration => {
                self.saved = super::Settings::factory(&self.config);
                self.settings = self.saved;
                Vec::new()
            }
            register => {
                self.settings.set_raw(register, parameters)?;
                Vec::new()
            }
        })
    }
}

fn f32_le(value: &f64) -> [u8; 4] {
    (*value as f32).to_le_bytes()
}

/// The vendor's table, modified convention: offset (rad), d (mm), alpha (rad), a (mm) of
/// each joint.
fn dh_table() -> Vec<u8> {
    let rows = JOINT_ORIGIN_M.into_iter().zip(JOINT_QUARTER_TURNS_X);
    rows.flat_map(|([x, y, z], turns)| {
        let alpha_rad = core::f32::consts::FRAC_PI_2 * f32::from(turns);
        // One of y and z is zero: a joint is moved along its own axis or along the turned one.
        let [d_mm, a_mm] = [y.abs() + z, x].map(|m| (m * 1e3) as f32);
        [0.0, d_mm, alpha_rad, a_mm]
    })
    .flat_map(f32::to_le_bytes)
    .collect()
}
