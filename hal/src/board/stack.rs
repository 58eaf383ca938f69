//! How deep the stack went: painted below its end, and looked at later.

use core::arch::asm;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};

/// What no code leaves by chance over a whole word.
const PAINT: u32 = 0xC5C5_C5C5;

/// Most bytes painted: more than any image's boot takes. A board with megabytes of RAM would otherwise be long at it.
const PAINTED_MAX: u32 = 1024 * 1024;

/// Deepest before the tick was started.
static BOOT: AtomicU32 = AtomicU32::new(0);

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Address of the stack's beginning; it grows downward.
fn top() -> u32 {
    (&raw const _stack_start) as u32
}

/// Where painting begins: the stack's end, or as far from its beginning as is painted at most.
fn bottom() -> u32 {
    let end = (&raw const _stack_end) as u32;
    end.max(top().saturating_sub(PAINTED_MAX))
}

/// Paints everything below the caller.
#[inline(never)]
pub(super) fn paint() {
    let end: u32;
    // SAFETY: reads a register.
    unsafe { asm!("mov {}, sp", out(reg) end, options(nomem, nostack, preserves_flags)) };
    let mut at = bottom();
    // An interrupt's frame would be painted over: none may come. It is a leaf without locals in memory.
    cortex_m::interrupt::free(|_| {
        while at < end - 128 {
            // SAFETY: RAM between variables and stack, by the linker's script, and nobody uses it.
            unsafe { ptr::write_volatile(at as *mut u32, PAINT) };
            at += 4;
        }
    });
}

/// Bytes of stack used since [`paint`].
fn depth() -> u32 {
    let mut at = bottom();
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
