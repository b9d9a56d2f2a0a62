//! A thousand control cycles in a program that has no `std`, no operating system
//! to speak of and 64 KiB of memory for the box that a motion comes in. It ends
//! with 0 when the arm it holds stays held.
//!
//! With `std` anywhere below the core it does not link: there would be two panic
//! handlers.
#![no_std]
#![no_main]

extern crate alloc;

use control_core::control::{ArmCommand, ControlState, CycleInput, ControlCommand, Thresholds};
use control_core::xarm::frame::{MAX_FRAME_LEN, emit_command};
use control_core::xarm::{Command, Protocol};
use core::alloc::{GlobalAlloc, Layout};
use core::sync::atomic::{AtomicUsize, Ordering};
use arm_model::{JointVector, Limits, LimitsSpec};

const PERIOD_NS: u64 = 4_000_000;
const POSE: JointVector = JointVector([0.0, -0.3, 0.0, 0.8, 0.0, 1.1, 0.0]);

#[unsafe(no_mangle)]
extern "C" fn main() -> i32 {
    let Ok(limits) = Limits::try_from(LimitsSpec {
        position_min_rad: JointVector::splat(-6.0),
        position_max_rad: JointVector::splat(6.0),
        velocity_max_rad_s: JointVector::splat(3.0),
        acceleration_max_rad_s2: JointVector::splat(20.0),
        jerk_max_rad_s3: JointVector::splat(500.0),
        tcp_speed_max_m_s: 1.2,
        tcp_offset_m: [0.0; 3],
        rate_hz: 250.0,
    }) else {
        return 2;
    };
    let mut control = ControlState::new(limits, Thresholds::relaxed());
    let mut command = Some(ControlCommand::Engage { hold: POSE });
    let mut held = 0;
    for cycle in 1..=1000_u64 {
        let input = CycleInput {
            deadline_ns: cycle * PERIOD_NS,
            command: command.take(),
            ..CycleInput::default()
        };
        let out = control.step(input);
        let Some(ArmCommand::Position(q)) = out.command else {
            continue;
        };
        let mut frame = [0; MAX_FRAME_LEN];
        let id = u16::try_from(cycle).unwrap_or(u16::MAX);
        let sent = emit_command(
            &mut frame,
            id,
            Protocol::PrivateHeartbeat,
            &Command::ServoJoint(q),
        );
        held += i32::from(q == POSE && sent.is_ok());
    }
    i32::from(held != 1000)
}

/// Gives memory and takes none back: a motion's box is all the core ever needs.
struct Once {
    used: AtomicUsize,
}

const ROOM: usize = 64 << 10;

#[repr(align(64))]
struct Room(core::cell::UnsafeCell<[u8; ROOM]>);

// SAFETY: bytes of it are handed out once each, by `Once::alloc`.
unsafe impl Sync for Room {}

static MEMORY: Room = Room(core::cell::UnsafeCell::new([0; ROOM]));

#[global_allocator]
static ALLOCATOR: Once = Once {
    used: AtomicUsize::new(0),
};

// SAFETY: every byte range is handed out once, aligned to 64, which is as much as
// anything here asks for; larger alignments get nothing.
unsafe impl GlobalAlloc for Once {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let size = layout.size().next_multiple_of(64);
        let begin = self.used.fetch_add(size, Ordering::Relaxed);
        if layout.align() > 64 || begin + size > ROOM {
            return core::ptr::null_mut();
        }
        MEMORY.0.get().cast::<u8>().wrapping_add(begin)
    }

    unsafe fn dealloc(&self, _memory: *mut u8, _layout: Layout) {}
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    loop {}
}

/// The ready-made `alloc` was compiled to unwind and names this and the next; nothing
/// here ever unwinds.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

#[unsafe(no_mangle)]
extern "C" fn _Unwind_Resume() -> ! {
    loop {}
}
