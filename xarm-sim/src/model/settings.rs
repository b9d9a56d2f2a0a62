//! Configuration that clients may change, and what the controller saves of it.

use crate::config::ArmConfig;
use arm_model::JOINTS;
use nalgebra::Vector3;
use rt_controller::xarm::{Register, TcpPose};

/// Bytes of the reply to register 53.
const REDUCED_STATE_LEN: usize = 79;

/// The payload that its owner has taught it with the tool: pole, holder and rope (kg).
const TAUGHT_LOAD_KG: f64 = 0.3;

/// Settings of the controller.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Settings {
    pub(crate) tcp_offset: TcpPose,
    pub(crate) load_kg: f64,
    pub(crate) load_centre_m: [f64; 3],
    pub(crate) collision_sensitivity: u8,
    pub(crate) teach_sensitivity: u8,
    pub(crate) joint_jerk_rad_s3: f64,
    pub(crate) joint_acceleration_rad_s2: f64,
    pub(crate) speed_limit_factor: f64,
    pub(crate) self_collision: bool,
    pub(crate) reports_current: bool,
    pub(crate) collision_rebound: bool,
    pub(crate) boundary: Boundary,
    pub(crate) reduced: Reduced,
}

/// Safety boundary of the tool centre point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Boundary {
    pub(crate) on: bool,
    /// x+, x-, y+, y-, z+, z- (mm), as on the wire.
    pub(crate) sides_mm: [i32; 6],
}

/// Reduced mode. It is stored and told, but limits nothing here: what it does
/// to streamed setpoints is not documented.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reduced {
    pub(crate) on: bool,
    pub(crate) tcp_speed_mm_s: f32,
    pub(crate) joint_speed_rad_s: f32,
    pub(crate) joint_ranges_rad: [f32; 2 * JOINTS],
}

impl Settings {
    /// As its owner has set it up.
    pub(crate) fn factory(config: &ArmConfig) -> Self {
        let limits = &config.limits;
        Self {
            tcp_offset: TcpPose {
                position_m: limits.tcp_offset_m,
                rpy_rad: [0.0; 3],
            },
            load_kg: TAUGHT_LOAD_KG,
            load_centre_m: limits.tcp_offset_m.map(|m| 0.5 * m),
            collision_sensitivity: 3,
            teach_sensitivity: 3,
            joint_jerk_rad_s3: 20.0,
            joint_acceleration_rad_s2: limits.acceleration_max_rad_s2[0],
            speed_limit_factor: config.speed_limit_factor,
            self_collision: config.self_collision_check,
            reports_current: false,
            collision_rebound: false,
            boundary: Boundary {
                on: config.fence_mm.is_some(),
                sides_mm: config
                    .fence_mm
                    .unwrap_or([2000, -2000, 2000, -2000, 2000, -2000]),
            },
            reduced: Reduced {
                on: false,
                tcp_speed_mm_s: 250.0,
                joint_speed_rad_s: 1.0,
                joint_ranges_rad: core::array::from_fn(|i| {
                    let range = [&limits.position_min_rad, &limits.position_max_rad];
                    range[i % 2][i / 2] as f32
                }),
            },
        }
    }

    /// The safety boundary as smallest and largest coordinates (m).
    pub(crate) fn fence_m(&self) -> Option<[Vector3<f64>; 2]> {
        let [x1, x0, y1, y0, z1, z0] = self.boundary.sides_mm.map(|mm| f64::from(mm) * 1e-3);
        self.boundary
            .on
            .then(|| [Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)])
    }

    /// Changes a setting that has no typed command; `None` for too few
    /// parameters or a register that is no setting.
    pub(super) fn set_raw(&mut self, register: Register, parameters: &[u8]) -> Option<()> {
        let flag = || parameters.first().map(|byte| *byte != 0);
        match register {
            Register::SafetyBoundary => {
                self.boundary.sides_mm = words(parameters)?.map(i32::from_le_bytes);
            }
            Register::Fence => self.boundary.on = flag()?,
            Register::CollisionRebound => self.collision_rebound = flag()?,
            Register::SelfCollisionCheck => self.self_collision = flag()?,
            Register::ReportEffort => self.reports_current = flag()?,
            Register::SetReducedMode => self.reduced.on = flag()?,
            Register::ReducedTcpSpeed => {
                [self.reduced.tcp_speed_mm_s] = words(parameters)?.map(f32::from_le_bytes);
            }
            Register::ReducedJointSpeed => {
                [self.reduced.joint_speed_rad_s] = words(parameters)?.map(f32::from_le_bytes);
            }
            Register::ReducedJointRange => {
                self.reduced.joint_ranges_rad = words(parameters)?.map(f32::from_le_bytes);
            }
            register if is_without_effect(register) => {}
            _ => return None,
        }
        Some(())
    }

    /// Reply to register 53.
    pub(super) fn reduced_state(&self) -> Vec<u8> {
        let mut out = vec![u8::from(self.reduced.on)];
        out.extend(self.boundary_i16());
        out.extend(self.reduced.tcp_speed_mm_s.to_le_bytes());
        out.extend(self.reduced.joint_speed_rad_s.to_le_bytes());
        for angle in self.reduced.joint_ranges_rad {
            out.extend(angle.to_le_bytes());
        }
        out.extend([u8::from(self.boundary.on), u8::from(self.collision_rebound)]);
        debug_assert_eq!(out.len(), REDUCED_STATE_LEN);
        out
    }

    /// The boundary as reports hold it: six i16, big-endian (mm).
    pub(crate) fn boundary_i16(&self) -> Vec<u8> {
        let narrow = |mm: &i32| i16::try_from(*mm).unwrap_or(i16::MAX);
        self.boundary
            .sides_mm
            .iter()
            .flat_map(|mm| narrow(mm).to_be_bytes())
            .collect()
    }
}

/// `N` words of four bytes; more than needed are ignored.
fn words<const N: usize>(parameters: &[u8]) -> Option<[[u8; 4]; N]> {
    let mut out = [[0; 4]; N];
    for (word, bytes) in out.iter_mut().zip(parameters.chunks_exact(4)) {
        word.copy_from_slice(bytes);
    }
    (parameters.len() >= 4 * N).then_some(out)
}

/// Settings that a real arm takes and this one has no use for.
fn is_without_effect(register: Register) -> bool {
    matches!(
        register,
        Register::ReloadDynamics
            | Register::SystemControl
            | Register::TcpJerk
            | Register::TcpAcceleration
            | Register::GravityDirection
            | Register::ApproximateMotion
            | Register::ToolModel
            | Register::SimulationMode
            | Register::SetParameter
    )
}
