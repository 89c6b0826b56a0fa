//! A program without an operating system that has `footplate-core` and `footplate-wire` in it.
//!
//! It defines what a program on a microcontroller defines: what to do on a panic and where memory comes from.
//! Were there std anywhere below, there would be a second panic handler, and the compiler would refuse. So no
//! other target than the host's is needed to prove that both crates run on one.
#![no_std]

use core::alloc::{GlobalAlloc, Layout};
use core::panic::PanicInfo;

use footplate_core as _;
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

/// What a controller without floating point asks before every stop; linked whether or not anybody calls it.
#[unsafe(no_mangle)]
pub extern "C" fn footplate_command_in(stop: &footplate_core::kinematics::IntegerStop, distance: i32) -> i64 {
    stop.command_in(distance)
}

/// Where it has got to since.
#[unsafe(no_mangle)]
pub extern "C" fn footplate_run_since_command(
    stop: &footplate_core::kinematics::IntegerStop,
    ticks: i64,
) -> i32 {
    stop.run_since_command(ticks)
}
