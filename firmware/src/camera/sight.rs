//! From pixels to sightings: which sensor looks at which image.

use super::{Exposure, Params};
use crate::vision::image::View;
use crate::vision::sensor::{Refusal, SeamSensor};
use hal::camera::SLITS;
use hal::process::Sighting;

/// The sensors of a camera.
#[derive(Clone, Copy, Debug)]
pub struct Sensors {
    seam: SeamSensor,
}

impl Sensors {
    /// Those that these parameters describe.
    pub fn new(params: &Params) -> Self {
        Self {
            seam: SeamSensor::new(params.pinhole, params.joint),
        }
    }

    /// What is seen in the image of an exposure, `height` rows of `width` bytes, by slit. Bytes that are no such image show no line.
    pub fn see(&self, exposure: &Exposure, pixels: &[u8], [width, height]: [usize; 2]) -> [Option<Sighting>; SLITS] {
        let seen = match View::new(pixels, width, height) {
            Ok(view) => self.seam.sight(&view),
            Err(_) => Sighting {
                refusal: Refusal::NoLine as u8,
                ..Sighting::default()
            },
        };
        let sighting = Sighting {
            stamp: exposure.stamp,
            look: exposure.look,
            ..seen
        };
        [Some(sighting), None]
    }
}
