//! The image sensor: an MT9V034 on the camera interface, triggered by a pin, read out by DMA 1, stream 0.
//!
//! It exposes all its rows at once (a global shutter), at the edge of its EXPOSURE pin, and then puts out [`FULL`]; the camera
//! interface lets through the middle of it, as large as what is looked at needs. The image is there when the last of its words is
//! in memory; an image that is not there [`PATIENCE_US`] after the trigger, or of which the interface lost a pixel, is lost.
//!
//! The next trigger is heard once the sensor has put out everything: 15 ms after the one before.

use super::{Interrupt, TIMERS_HZ};
use crate::board::crop::{Crop, squeeze};
use crate::camera::{Pixels, START, Size};
use crate::process::Look;
use core::ptr::NonNull;
use core::sync::atomic::{Ordering, fence};
use cortex_m::peripheral::NVIC;
use stm32h7xx_hal::pac;

/// What the sensor puts out, pixels: the largest image, and columns enough for whole words.
pub(super) const FULL: Size = [456, 450];
const _: () = assert!(FULL[0] >= START[0].next_multiple_of(4) + 2 && FULL[1] >= START[1]);

/// How long an image may take, µs: exposure and read-out of all rows are 14 ms.
const PATIENCE_US: u32 = 17_000;
/// Rate that the time-out's 16-bit timer counts with, Hz.
const PATIENCE_HZ: u32 = 100_000;

/// Request line of the camera interface (RM0433).
const REQUEST: u8 = 75;

/// An image under way.
struct ReadOut {
    pixels: NonNull<Pixels>,
    crop: Crop,
}

/// The image sensor: exposes, and reads out into memory that is lent to it.
pub struct Sensor {
    interface: pac::DCMI,
    dma: pac::DMA1,
    patience: pac::TIM7,
    lights: pac::GPIOE,
    under_way: Option<ReadOut>,
    refused: Option<&'static mut Pixels>,
}

// SAFETY: the pointer is to memory that was lent for good and that nobody else uses.
unsafe impl Send for Sensor {}

impl Sensor {
    /// Sets up interface, DMA and time-out; their clocks run already.
    pub(super) fn new(
        interface: pac::DCMI,
        dma: pac::DMA1,
        route: &pac::DMAMUX1,
        patience: pac::TIM7,
        lights: pac::GPIOE,
    ) -> Self {
        // SAFETY: the request line is one of the device's, the address that of the interface's data.
        unsafe {
            route.ccr[0].write(|w| w.dmareq_id().bits(REQUEST));
            dma.st[0].par.write(|w| w.bits(pac::DCMI::PTR as u32 + 0x28));
        }
        patience
            .psc
            .write(|w| w.psc().bits((TIMERS_HZ / PATIENCE_HZ - 1) as u16));
        patience
            .arr
            .write(|w| w.arr().bits((PATIENCE_US / (1_000_000 / PATIENCE_HZ)) as _));
        patience.cr1.write(|w| w.urs().set_bit().opm().set_bit());
        patience.egr.write(|w| w.ug().set_bit());
        patience.dier.write(|w| w.uie().set_bit());
        Self {
            interface,
            dma,
            patience,
            lights,
            under_way: None,
            refused: None,
        }
    }

    /// Exposes now by the light that `look` takes, and reads the middle, as large as `size`, out into `pixels`;
    /// [`Interrupt::FRAME`] comes when that is done or has failed. An image for which the memory is too small is lost. So is one while
    /// another is under way, and its memory comes back after the other's; there is room for one such.
    pub fn expose(&mut self, look: Look, size: Size, pixels: &'static mut Pixels) {
        let crop = Crop::centred(size, FULL);
        if self.under_way.is_some() || pixels.len() < crop.bytes() {
            self.refused = Some(pixels);
            NVIC::pend(Interrupt::FRAME);
            return;
        }
        let pixels = NonNull::from(pixels);
        let stream = &self.dma.st[0];
        // SAFETY: the stream is off; `crop` keeps what it writes within the memory lent.
        unsafe {
            stream.m0ar.write(|w| w.bits(pixels.cast::<u8>().as_ptr() as u32));
            stream.ndtr.write(|w| w.bits(crop.bytes() as u32 / 4));
            self.interface.cwstrt.write(|w| w.bits(crop.start()));
            self.interface.cwsize.write(|w| w.bits(crop.extent()));
            self.interface.icr.write(|w| w.bits(0x1F));
        }
        fence(Ordering::SeqCst);
        // Words to words, from the interface, to rising addresses, by way of the stream's FIFO.
        stream.fcr.write(|w| w.dmdis().set_bit().fth().full());
        stream.cr.write(|w| {
            w.pl().high().msize().bits32().psize().bits32().minc().set_bit();
            w.tcie().set_bit().teie().set_bit().en().set_bit()
        });
        // One image; data are valid while HSYNC and VSYNC are high, and change at the clock's falling edge.
        self.interface.cr.write(|w| {
            w.cm().set_bit().crop().set_bit().pckpol().set_bit();
            w.enable().set_bit().capture().set_bit()
        });
        self.under_way = Some(ReadOut { pixels, crop });
        self.patience.cr1.modify(|_, w| w.cen().set_bit());
        // PE9 triggers; PE11 is the slit projector, PE13 the lamp.
        self.lights.bsrr.write(|w| match look {
            Look::Dark => w.bs9().set_bit(),
            Look::Seam | Look::StartSlit => w.bs9().set_bit().bs11().set_bit(),
            Look::StartGrey => w.bs9().set_bit().bs13().set_bit(),
        });
    }

    /// After the interrupt: the memory back and, if an image came whole, its width and height.
    pub fn take(&mut self) -> Option<(&'static mut Pixels, Option<Size>)> {
        if self.under_way.is_none() {
            return self.refused.take().map(|pixels| (pixels, None));
        }
        let (status, late) = (self.dma.lisr.read(), self.patience.sr.read().uif().bit_is_set());
        let (complete, failed) = (status.tcif0().bit_is_set(), status.teif0().bit_is_set());
        if !(complete || failed || late) {
            return None;
        }
        let lost_a_pixel = self.interface.ris.read().ovr_ris().bit_is_set();
        self.stop();
        if self.refused.is_some() {
            NVIC::pend(Interrupt::FRAME);
        }
        let ReadOut { mut pixels, crop } = self.under_way.take()?;
        // SAFETY: the memory was lent as this reference, and the stream, now off, was its only user.
        let pixels: &'static mut Pixels = unsafe { pixels.as_mut() };
        if !complete || failed || lost_a_pixel {
            return Some((pixels, None));
        }
        squeeze(pixels, &crop);
        Some((pixels, Some(crop.size)))
    }

    /// Ends the read-out, whatever came of it: lights off, everything quiet.
    fn stop(&mut self) {
        self.lights
            .bsrr
            .write(|w| w.br9().set_bit().br11().set_bit().br13().set_bit());
        self.interface.cr.reset();
        let stream = &self.dma.st[0];
        stream.cr.modify(|_, w| w.en().clear_bit());
        // At most the words in the FIFO are still written.
        while stream.cr.read().en().bit_is_set() {}
        // SAFETY: clears all flags of stream 0.
        self.dma.lifcr.write(|w| unsafe { w.bits(0x3D) });
        self.patience.cr1.modify(|_, w| w.cen().clear_bit());
        self.patience.egr.write(|w| w.ug().set_bit());
        self.patience.sr.reset();
        fence(Ordering::SeqCst);
    }
}
