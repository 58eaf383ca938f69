//! In place of a CAN controller: frames go to the program that emulates the bus and come from it, at the times it says.
//!
//! At the end of each timer event the image's frames and trace are handed over, and the emulator stands still until the
//! bus and all that hangs on it have come to the next event; so it is at the end of "CAN receive" on a board that
//! answers frames at once. The answer holds the frames of that stretch; the alarm
//! moves each into the receive FIFO at its time and raises "CAN receive". Nothing of this is seen above [`super::can`].
//!
//! The alarm has the tick's priority, so that neither interrupts the other, and is silent for
//! [`GUARD_US`](crate::board::frames::GUARD_US) before each tick, so that it delays none.

use super::device::Interrupt;
use super::semihosting::{Pipes, stop};
use super::timer::{Alarm, PER_US, since_tick, wait};
use crate::board::fifo::Fifo;
use crate::board::frames::{FRAMES_MAX, Head, ReadOut, Stamped, TRACE_MAX, ask};
use crate::board::report::HALF_US;
use crate::camera::{Pixels, Size};
use crate::can::Frame;
use crate::wire::{Sink, Wire};
use core::cell::UnsafeCell;
use cortex_m::peripheral::NVIC;
use heapless::Vec;

/// The receive FIFO that a CAN controller would have.
pub(super) static FIFO: Fifo = Fifo::new();

/// A stall begins this long before the tick: after the last frame was taken in, which is there 50 µs before.
const STALL_LEAD_US: u32 = 20;

/// Head and frames of a message.
const MESSAGE: usize = Head::BYTES + FRAMES_MAX * Stamped::BYTES;

/// Bytes appended up to a fixed end; what does not fit is left out whole.
struct Buffer<const L: usize>(Vec<u8, L>);

impl<const L: usize> Sink for Buffer<L> {
    #[inline(never)] // into every field of a report: eight kilobytes of flash
    fn put(&mut self, bytes: &[u8]) {
        // A message is bounded by construction: at most FRAMES_MAX frames and TRACE_MAX bytes of trace.
        let _ = self.0.extend_from_slice(bytes);
    }
}

/// What has come of an image. Like all else here it begins as zero: ten kilobytes of initial values that take no flash.
#[derive(Default)]
enum Arrival {
    /// Nothing yet.
    #[default]
    None,
    /// That it was lost on its way.
    Lost,
    /// All of it.
    Whole(Size),
}

pub(super) struct Shim {
    pipes: Pipes,
    alarm: Alarm,
    /// Frames of this event, to be handed over, each with the counts since the event's start.
    leaving: Vec<(u32, Frame), FRAMES_MAX>,
    trace: Buffer<TRACE_MAX>,
    message: Buffer<MESSAGE>,
    answer: [u8; MESSAGE],
    /// Frames of the stretch up to the next event, and how many of them are in the FIFO by now.
    coming: Vec<Stamped, FRAMES_MAX>,
    come: usize,
    /// Frames dropped since the last message.
    dropped: u8,
    /// What the surroundings asked with their last answer.
    asked: u8,
    /// Counts for which the next tick is to be held up.
    stall: u32,
    /// Memory that the image sensor is read out into, and what has come.
    pixels: Option<&'static mut Pixels>,
    arrival: Arrival,
}

impl Shim {
    /// A frame leaves, `at` counts after the event's start.
    pub(super) fn send(&mut self, frame: Frame, at: u32) {
        if self.leaving.push((at, frame)).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Bytes for whoever traces the image.
    pub(super) fn trace(&mut self) -> &mut impl Sink {
        &mut self.trace
    }

    /// What was asked with the last answer.
    pub(super) fn asked(&self) -> u8 {
        self.asked
    }

    /// Hands over, waits, takes over.
    pub(super) fn exchange(&mut self) {
        let length = self.leaving.len() * Stamped::BYTES + self.trace.0.len();
        self.message.0.clear();
        let head = Head {
            length: length as u16,
            frames: self.leaving.len() as u8,
            flags: self.dropped,
            read_out: ReadOut::None,
        };
        head.write(&mut self.message);
        for (at, frame) in &self.leaving {
            let at_us = (at / PER_US) as u16;
            Stamped { at_us, frame: *frame }.write(&mut self.message);
        }
        self.pipes.write(&self.message.0);
        self.pipes.write(&self.trace.0);
        self.leaving.clear();
        self.trace.0.clear();
        self.dropped = 0;

        let mut bytes = [0; Head::BYTES];
        self.pipes.read(&mut bytes);
        let head = Head::read(&mut bytes.as_slice()).unwrap_or_default();
        self.asked = head.flags;
        self.stall = u32::from(head.flags >> ask::STALL_SHIFT) * ask::STALL_US * PER_US;
        self.coming.clear();
        self.come = 0;
        if let Some(bytes) = self.answer.get_mut(..usize::from(head.length)) {
            self.pipes.read(bytes);
            let mut rest = &*bytes;
            for _ in 0..head.frames {
                if let Some(stamped) = Stamped::read(&mut rest) {
                    let _ = self.coming.push(stamped); // the answer holds no more than fit
                }
            }
        }
        match head.read_out {
            ReadOut::None => {}
            ReadOut::Image => self.read_image(),
            ReadOut::Lost => self.finish_read_out(Arrival::Lost),
        }
        self.deliver(since_tick()); // after all the copying, which takes its time
    }

    /// The image sensor exposes.
    pub(super) fn expose(&mut self, pixels: &'static mut Pixels) {
        self.pixels = Some(pixels);
        self.arrival = Arrival::None;
    }

    /// What has been read out, once.
    pub(super) fn take_image(&mut self) -> Option<(&'static mut Pixels, Option<Size>)> {
        let size = match core::mem::take(&mut self.arrival) {
            Arrival::None => return None,
            Arrival::Lost => None,
            Arrival::Whole(size) => Some(size),
        };
        Some((self.pixels.take()?, size))
    }

    fn read_image(&mut self) {
        let mut bytes = [0; <(u16, u16)>::BYTES];
        self.pipes.read(&mut bytes);
        let (width, height) = <(u16, u16)>::read(&mut bytes.as_slice()).unwrap_or_default();
        let length = usize::from(width) * usize::from(height);
        let pixels = self.pixels.as_deref_mut();
        // The pipe would be out of step for good: whoever sends what was not asked for has to be stopped.
        match pixels.and_then(|pixels| pixels.get_mut(..length)) {
            Some(image) => self.pipes.read(image),
            None => stop(),
        }
        self.finish_read_out(Arrival::Whole([width, height]));
    }

    fn finish_read_out(&mut self, arrival: Arrival) {
        self.arrival = arrival;
        NVIC::pend(Interrupt::FRAME);
    }

    /// Moves what is due into the FIFO, and sets the alarm to the next.
    fn deliver(&mut self, since: u32) {
        let mut moved = false;
        while let Some(next) = self.coming.get(self.come) {
            let due = u32::from(next.at_us) * PER_US;
            if due > since {
                self.alarm.set(due - since);
                break;
            }
            if !FIFO.put(&next.frame) {
                self.dropped = self.dropped.saturating_add(1);
            }
            self.come += 1;
            moved = true;
        }
        if self.come >= self.coming.len() && self.stall > 0 {
            let begin = (HALF_US - STALL_LEAD_US) * PER_US;
            if since < begin {
                self.alarm.set(begin - since);
            } else {
                wait(core::mem::take(&mut self.stall));
            }
        }
        if moved {
            NVIC::pend(Interrupt::CANRX);
        }
    }
}

/// The one shim, for the alarm's handler, which cannot own it.
struct Place(UnsafeCell<Shim>);

// SAFETY: reached only through `with`, which nothing interrupts.
unsafe impl Sync for Place {}

static SHIM: Place = Place(UnsafeCell::new(Shim {
    pipes: Pipes::CLOSED,
    // SAFETY: there is one shim.
    alarm: unsafe { Alarm::new() },
    leaving: Vec::new(),
    trace: Buffer(Vec::new()),
    message: Buffer(Vec::new()),
    answer: [0; MESSAGE],
    coming: Vec::new(),
    come: 0,
    dropped: 0,
    asked: 0,
    stall: 0,
    pixels: None,
    arrival: Arrival::None,
}));

/// Opens the pipes.
pub(super) fn open() {
    with(|shim| shim.pipes = Pipes::open());
}

/// Acts on the shim with interrupts off: few instructions, and while time stands still.
pub(super) fn with<R>(act: impl FnOnce(&mut Shim) -> R) -> R {
    cortex_m::interrupt::free(|_| {
        // SAFETY: one core, no interrupt, and no `act` here calls `with`: this is the only reference.
        act(unsafe { &mut *SHIM.0.get() })
    })
}

/// The alarm's handler, by the name that the vector table knows.
#[unsafe(no_mangle)]
extern "C" fn DUALTIMER() {
    with(|shim| {
        shim.alarm.acknowledge();
        shim.deliver(since_tick());
    });
}
