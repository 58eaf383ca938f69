//! FDCAN1 as CAN port: classic frames at 1 Mbit/s, one mailbox per identifier, "CAN receive" at every frame.
//!
//! | what happens | reaction |
//! |---|---|
//! | a newer frame of an identifier, the older still waits | the older is withdrawn ([`mailboxes`](crate::board::m_can::mailboxes)) |
//! | all 32 buffers wait | the frame is dropped: the bus carries nothing, and the ages of what it should have brought tell |
//! | receive FIFO full, 64 frames | the newest are lost, likewise |
//! | no acknowledgement, error passive | the controller repeats by itself, always the newest |
//! | bus off | all that waits is withdrawn, and the controller rejoins after the 129 × 11 recessive bits of ISO 11898-1; \
//! tried at every timer event. Meanwhile there is no SYNC: drives hold for four cycles, then stop by themselves |

use super::CAN_HZ;
use crate::board::m_can::element::{self, WORDS};
use crate::board::m_can::filter::{self, Range};
use crate::board::m_can::mailboxes::{BUFFERS, Mailboxes};
use crate::board::m_can::timing::BitTiming;
use crate::can::Frame;
use crate::wire::Wire;
use core::ptr;
use stm32h7xx_hal::pac;
use stm32h7xx_hal::pac::fdcan1::RegisterBlock;

/// Bit rate, 1/s.
const BIT_HZ: u32 = 1_000_000;

/// Bits are sampled at 87.5 % (CiA 301). With 80 quanta and a jump of 10 the clocks of two nodes may differ by
/// 0.97 % in all, 2 · 10 / (2 · (13 · 80 − 10)); crystals are a hundred times better.
const TIMING: u32 = match BitTiming::new(CAN_HZ, BIT_HZ, 875) {
    Some(timing) => timing.register(),
    None => panic!("CAN_HZ gives no exact bit"),
};

/// The message memory, 2560 words for both controllers.
const MEMORY: usize = 0x4000_AC00;

/// Its first words hold the filters, at most 32;
const FILTERS: usize = 0;
/// then comes receive FIFO 0,
const FIFO: usize = FILTERS + 32;
/// with this many elements, the most it can have: more than 2.5 ms of the shortest frames,
const FIFO_ELEMENTS: usize = 64;
/// then the transmit buffers.
const SENT: usize = FIFO + FIFO_ELEMENTS * WORDS;
/// End of what is used.
const END: usize = SENT + BUFFERS * WORDS;
const _: () = assert!(END <= 2560);

/// A word of the message memory.
fn word(at: usize) -> *mut u32 {
    (MEMORY + 4 * at) as *mut u32
}

fn registers() -> &'static RegisterBlock {
    // SAFETY: the registers are there for ever; who writes which is said at each use.
    unsafe { &*pac::FDCAN1::PTR }
}

/// Joins the bus, and lets in what is in `ranges`, at most 32.
///
/// # Safety
/// Called once, before [`Port`] and [`Receive`] are used; clock and pins are set up.
pub(super) unsafe fn open(ranges: &[Range]) {
    let can = registers();
    can.cccr.write(|w| w.init().set_bit());
    while can.cccr.read().init().bit_is_clear() {}
    can.cccr.write(|w| w.init().set_bit().cce().set_bit());
    // SAFETY: all fields are legal, and every address is in the message memory: FILTERS + 32 < END.
    unsafe {
        // The clock goes to the bit timing as it is, not by way of the calibration on received frames.
        (*pac::CAN_CCU::PTR).ccfg.write(|w| w.bcc().set_bit());
        for at in 0..END {
            ptr::write_volatile(word(at), 0);
        }
        for (at, range) in ranges.iter().take(FIFO - FILTERS).enumerate() {
            ptr::write_volatile(word(FILTERS + at), filter::element(*range));
        }
        can.nbtp.write(|w| w.bits(TIMING));
        can.sidfc.write(|w| {
            w.flssa()
                .bits(FILTERS as u16)
                .lss()
                .bits(ranges.len().min(FIFO - FILTERS) as u8)
        });
        can.xidfc.write(|w| w.bits(0));
        // Remote frames, and what passes no filter, stay outside.
        can.gfc
            .write(|w| w.rrfe().set_bit().rrfs().set_bit().anfe().bits(0b11).anfs().bits(0b11));
        can.rxf0c
            .write(|w| w.f0sa().bits(FIFO as u16).f0s().bits(FIFO_ELEMENTS as u8));
        can.txbc
            .write(|w| w.tbsa().bits(SENT as u16).ndtb().bits(BUFFERS as u8));
        // Elements hold eight data bytes.
        can.rxesc.write(|w| w.bits(0));
        can.txesc.write(|w| w.bits(0));
    }
    can.ie.write(|w| w.rf0ne().set_bit());
    can.ile.write(|w| w.eint0().set_bit());
    // All zero: classic frames, repeated until acknowledged, and INIT off.
    can.cccr.write(|w| w);
}

/// Leaves the bus, whatever waits.
pub(super) fn leave() {
    registers().cccr.modify(|_, w| w.init().set_bit());
}

/// CAN, sending. Nobody listens to the trace of this board.
pub struct Port {
    mailboxes: Mailboxes,
}

impl Port {
    /// # Safety
    /// There is one `Port`.
    pub(super) const unsafe fn new() -> Self {
        Self {
            mailboxes: Mailboxes::new(),
        }
    }

    /// Gives a frame to the controller.
    pub fn send(&mut self, frame: Frame) {
        let can = registers();
        let Some(place) = self.mailboxes.place(frame.cob(), can.txbrp.read().bits()) else {
            return;
        };
        // SAFETY: all bits of both registers may be written, and only here and in `commit`. The words are those of a
        // buffer that does not wait, 0 to 31, and the memory is a device: the request comes after them.
        unsafe {
            can.txbcr.write(|w| w.bits(place.withdrawn));
            let base = SENT + place.buffer as usize * WORDS;
            for (at, value) in element::to_send(&frame).into_iter().enumerate() {
                ptr::write_volatile(word(base + at), value);
            }
            can.txbar.write(|w| w.bits(1 << place.buffer));
        }
    }

    /// Adds to what is traced with this timer event.
    pub fn trace(&mut self, _: &impl Wire) {}

    /// What whoever traces has asked for: nothing.
    pub fn asked(&self) -> u8 {
        0
    }

    /// Ends the timer event: looks after the bus.
    pub fn commit(&mut self) {
        let can = registers();
        if can.psr.read().bo().bit_is_set() {
            // SAFETY: as in `send`.
            can.txbcr.write(|w| unsafe { w.bits(u32::MAX) });
            can.cccr.modify(|_, w| w.init().clear_bit());
        }
    }
}

/// CAN, receiving.
pub struct Receive(());

impl Receive {
    /// # Safety
    /// There is one `Receive`.
    pub(super) const unsafe fn new() -> Self {
        Self(())
    }

    /// The oldest frame in the receive FIFO.
    pub fn take(&mut self) -> Option<Frame> {
        let can = registers();
        loop {
            // Before looking: a frame that comes later raises the interrupt again.
            can.ir.write(|w| w.rf0n().set_bit());
            let status = can.rxf0s.read();
            if status.f0fl().bits() == 0 {
                return None;
            }
            let at = status.f0gi().bits();
            let base = FIFO + usize::from(at) * WORDS;
            // SAFETY: the element at the get index, which the controller leaves alone until it is acknowledged, below.
            let words = core::array::from_fn(|k| unsafe { ptr::read_volatile(word(base + k)) });
            // SAFETY: acknowledges what was read.
            can.rxf0a.write(|w| unsafe { w.f0ai().bits(at) });
            if let Some(frame) = element::received(words) {
                return Some(frame);
            }
        }
    }
}
