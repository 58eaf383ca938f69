//! The neural seam finder alone on the emulated target: what it makes of an image, and in how many instructions.

use super::emulator::{Emulator, SHIFT};
use super::{figures, image};
use firmware::vision::joint::Joint;
use firmware::vision::net::OUTPUTS;

/// The image of the net.
pub struct Net(Emulator);

/// What it made of a camera's image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The seam's pixel; `None` if it saw none.
    pub seam: Option<(f32, f32)>,
    /// What the net for lap joints says of the first window; `None` if no line is in it.
    pub first: Option<[f32; OUTPUTS]>,
    /// Instructions from the pixels to the seam.
    pub frame: u64,
    /// Instructions from the first window's pixels to what the net says of it.
    pub window: u64,
}

impl Net {
    /// Starts it.
    pub fn start() -> anyhow::Result<Self> {
        Ok(Self(Emulator::start(&image::find("net")?, &[], SHIFT)?))
    }

    /// Looks for a seam of `joint` in an image of the one-slit sensor.
    pub fn find(&mut self, joint: Joint, image: &[u8]) -> anyhow::Result<Answer> {
        self.0.put(&joint)?;
        self.0.write(image)?;
        let (seam, first, [frame, window]): (_, _, [u32; 2]) = self.0.get()?;
        Ok(Answer {
            seam,
            first,
            frame: figures::instructions(frame),
            window: figures::instructions(window),
        })
    }
}
