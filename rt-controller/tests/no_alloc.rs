//! The real-time thread touches the heap in no cycle: counted over the real
//! loop body, through every mode and every fault it can meet.
#![cfg(test)]
#![allow(unsafe_code, reason = "a counting allocator is unsafe by nature")]

mod gauntlet;

use arm_model::Limits;
use gauntlet::Watch;
use rt_controller::warm_up::CacheWarmUp;
use shared_types::CommandInterface;
use shared_types::ipc::{GuardianBeat, OperatorBeat};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static TOUCHES: Cell<u64> = const { Cell::new(0) };
}

fn touched() {
    let _ = TOUCHES.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is passed on to the system's allocator unchanged; the
// count is thread-local, const-initialised and does not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        touched();
        // SAFETY: the caller's obligations are those of `System.alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        touched();
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        touched();
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn touches() -> u64 {
    TOUCHES.with(Cell::get)
}

/// Heap touches inside of cycles.
#[derive(Default)]
struct Touches(u64);

impl Watch for Touches {
    fn around(&mut self, body: &mut dyn FnMut()) {
        let before = touches();
        body();
        self.0 += touches() - before;
    }
}

#[test]
fn no_cycle_of_a_hundred_thousand_touches_the_heap() {
    let mut watch = Touches::default();
    let cycles = gauntlet::scenarios::run(100_000, &mut watch);
    assert!(cycles >= 100_000);
    assert_eq!(watch.0, 0);
}

/// Ten minutes: the swing of the shadow controller ends once and begins again.
#[test]
fn no_warm_up_touches_the_heap() {
    let (limits, interface) = (Limits::default(), CommandInterface::ServoPosition);
    let mut warm_up = CacheWarmUp::new(limits, interface, 200).unwrap();
    let before = touches();
    for cycle in 1..=150_000_u64 {
        warm_up.cycle(
            cycle * 4_000_000,
            OperatorBeat::default(),
            GuardianBeat::default(),
        );
    }
    assert_eq!(touches() - before, 0);
}

#[test]
fn the_counter_sees_a_vec() {
    let before = touches();
    std::hint::black_box(vec![0_u8; 100]);
    assert_eq!(touches() - before, 2);
}
