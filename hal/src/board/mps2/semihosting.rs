//! Two pipes to the program that started the emulator: its standard input and output, by semihosting (Arm IHI 0070).
//!
//! A blocked read stops the emulator, and with `-icount` its time: that is the lock step.

use core::arch::asm;

const SYS_OPEN: u32 = 0x01;
const SYS_WRITE: u32 = 0x05;
const SYS_READ: u32 = 0x06;
const SYS_EXIT: u32 = 0x18;

/// Reason of SYS_EXIT that the emulator turns into exit code 1: ADP_Stopped_RunTimeErrorUnknown.
const STOPPED: u32 = 0x20023;

/// Name of the console; opened to read it is standard input, opened to write standard output.
const CONSOLE: &[u8; 4] = b":tt\0";
const READ_BINARY: u32 = 1;
const WRITE_BINARY: u32 = 5;

/// # Safety
/// `parameter` is what `operation` takes: a value, or the address of its block, all of whose buffers are valid.
unsafe fn call(operation: u32, parameter: u32) -> u32 {
    let mut answer = operation;
    // SAFETY: under the emulator the trap returns with the answer in r0 and changes nothing else but what the block names.
    unsafe { asm!("bkpt 0xAB", inout("r0") answer, in("r1") parameter, options(nostack)) };
    answer
}

/// Both pipes.
pub(super) struct Pipes {
    input: u32,
    output: u32,
}

impl Pipes {
    /// Not open yet.
    pub(super) const CLOSED: Self = Self { input: 0, output: 0 };

    pub(super) fn open() -> Self {
        let open = |mode: u32| {
            let block = [CONSOLE.as_ptr() as u32, mode, CONSOLE.len() as u32 - 1];
            // SAFETY: name, mode, length of the name.
            unsafe { call(SYS_OPEN, block.as_ptr() as u32) }
        };
        Self {
            input: open(READ_BINARY),
            output: open(WRITE_BINARY),
        }
    }

    /// Writes all of `bytes`; stops the emulator if nobody takes them any more.
    pub(super) fn write(&mut self, bytes: &[u8]) {
        let block = [self.output, bytes.as_ptr() as u32, bytes.len() as u32];
        // SAFETY: handle, address and length of bytes that are only read.
        let left = unsafe { call(SYS_WRITE, block.as_ptr() as u32) };
        if left != 0 {
            stop();
        }
    }

    /// Fills all of `bytes`, however long that takes; stops the emulator at the end of the input.
    pub(super) fn read(&mut self, bytes: &mut [u8]) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let block = [self.input, rest.as_mut_ptr() as u32, rest.len() as u32];
            // SAFETY: handle, address and length of bytes that nobody else holds.
            let left = unsafe { call(SYS_READ, block.as_ptr() as u32) } as usize;
            let read = rest.len().saturating_sub(left);
            match core::mem::take(&mut rest).split_at_mut_checked(read) {
                Some((_, tail)) if read > 0 => rest = tail,
                _ => stop(),
            }
        }
    }
}

/// Ends the emulator with exit code 1.
pub(super) fn stop() -> ! {
    loop {
        // SAFETY: takes a value, not a block; does not return.
        unsafe { call(SYS_EXIT, STOPPED) };
    }
}
