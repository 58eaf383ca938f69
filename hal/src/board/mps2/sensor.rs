//! The image sensor, which the shim plays: where a camera interface and its DMA channel would be.

use super::shim;
use crate::camera::{Pixels, Size};
use crate::process::Look;

/// The image sensor: exposes, and reads out into memory that is lent to it.
pub struct Sensor(());

impl Sensor {
    /// # Safety
    /// There is one `Sensor`.
    pub(super) const unsafe fn new() -> Self {
        Self(())
    }

    /// Exposes now, and reads out into `pixels`; [`Interrupt::FRAME`](super::Interrupt::FRAME) comes when that is done. What is lit, and
    /// how large the image is, is the surroundings' here: they are told by the trace.
    pub fn expose(&mut self, _look: Look, _size: Size, pixels: &'static mut Pixels) {
        shim::with(|shim| shim.expose(pixels));
    }

    /// After the interrupt: the memory back and, if an image came whole, its width and height.
    pub fn take(&mut self) -> Option<(&'static mut Pixels, Option<Size>)> {
        shim::with(|shim| shim.take_image())
    }
}
