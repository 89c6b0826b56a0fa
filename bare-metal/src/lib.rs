//! A program without an operating system that has `footplate-core` and `footplate-wire` in it.
//!
//! It defines what a program on a microcontroller defines: what to do on a panic and where memory comes from.
//! Were there std anywhere below, there would be a second panic handler, and the compiler would refuse. So no
//! other target than the host's is needed to prove that both crates run on one.
#![no_std]

use core::alloc::{GlobalAlloc, Layout};
use core::panic::PanicInfo;

use footplate_core::kinematics::IntegerStop;
use footplate_wire as _;

/// A heap that is always full: the program is built, never run.
struct NoMemory;

// SAFETY: null is the allowed answer of an allocator that has nothing to give, so nothing comes back either.
unsafe impl GlobalAlloc for NoMemory {
    unsafe fn alloc(&self, _: Layout) -> *mut u8 {
        core::ptr::null_mut()
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}

#[global_allocator]
static HEAP: NoMemory = NoMemory;

#[panic_handler]
fn on_panic(_: &PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}

/// A stop whose constants example 05 printed on a computer; were they unusable, this would not build.
const STOP: IntegerStop = match IntegerStop::from_constants(CONSTANTS) {
    Ok(stop) => stop,
    Err(_) => panic!("no constants of a stop"),
};

/// Speed 544 mm/s, delay 180 ms, deceleration 160 mm/s², ticks of 1 ms.
const CONSTANTS: [i64; 9] = [
    6_124_895_493_223_875,
    50,
    193_273_528_320,
    3_650_722_201_600,
    0,
    0,
    4_503_599_627_370_496,
    52,
    3_843_995_729_920,
];

/// In how many ticks to command the stop, for a target so many tenths of a millimetre ahead.
#[unsafe(no_mangle)]
pub extern "C" fn footplate_command_in(distance: i32) -> i64 {
    STOP.command_in(distance)
}

/// How far the train has run so many ticks after the command.
#[unsafe(no_mangle)]
pub extern "C" fn footplate_run_since_command(ticks: i64) -> i32 {
    STOP.run_since_command(ticks)
}
