//! How deep the stack went: painted below its end, and looked at later.

use core::arch::asm;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};

/// What no code leaves by chance over a whole word.
const PAINT: u32 = 0xC5C5_C5C5;

/// Bytes painted, of 4 MB: more than boot takes, which moves whole parameter sets about.
const PAINTED: u32 = 1024 * 1024;

/// Deepest before the tick was started.
static BOOT: AtomicU32 = AtomicU32::new(0);

unsafe extern "C" {
    static _stack_start: u32;
}

/// Address of the stack's beginning; it grows downward.
fn top() -> u32 {
    (&raw const _stack_start) as u32
}

/// Paints everything below the caller.
#[inline(never)]
pub(super) fn paint() {
    let end: u32;
    // SAFETY: reads a register.
    unsafe { asm!("mov {}, sp", out(reg) end, options(nomem, nostack, preserves_flags)) };
    let mut at = top() - PAINTED;
    // An interrupt's frame would be painted over: none may come. It is a leaf without locals in memory.
    cortex_m::interrupt::free(|_| {
        while at < end - 128 {
            // SAFETY: RAM between variables and stack; memory.x leaves megabytes there, and nobody uses it.
            unsafe { ptr::write_volatile(at as *mut u32, PAINT) };
            at += 4;
        }
    });
}

/// Bytes of stack used since [`paint`].
fn depth() -> u32 {
    let mut at = top() - PAINTED;
    // SAFETY: RAM, only read.
    while at < top() && unsafe { ptr::read_volatile(at as *const u32) } == PAINT {
        at += 4;
    }
    top() - at
}

/// Ends what counts as boot.
pub(super) fn booted() {
    BOOT.store(depth(), Ordering::Relaxed);
    paint();
}

/// Deepest stack in bytes: up to the start of the tick, and since. Takes longer than a tick.
pub fn depths() -> [u32; 2] {
    [BOOT.load(Ordering::Relaxed), depth()]
}
