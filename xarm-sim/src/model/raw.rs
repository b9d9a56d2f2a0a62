//! Registers without a typed command.

use super::ArmModel;
use arm_model::kinematics::JOINT_QUARTER_TURNS_X;
use rt_controller::xarm::Register;

/// Distances of the vendor's table, modified convention: d and a of each joint
/// (mm).
const DH_MM: [[f32; 2]; 7] = [
    [267.0, 0.0],
    [0.0, 0.0],
    [293.0, 0.0],
    [0.0, 52.5],
    [342.5, 77.5],
    [0.0, 0.0],
    [97.0, 76.0],
];

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

/// Offset (rad), d (mm), alpha (rad), a (mm) of each joint.
fn dh_table() -> Vec<u8> {
    let rows = DH_MM.iter().zip(JOINT_QUARTER_TURNS_X);
    rows.flat_map(|([d, a], turns)| [0.0, *d, core::f32::consts::FRAC_PI_2 * f32::from(turns), *a])
        .flat_map(f32::to_le_bytes)
        .collect()
}
