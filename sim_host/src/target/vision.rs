//! What the camera's board measured of itself, in units for people.

use firmware::camera::Exposure;
use hal::process::Look;
use serde::Serialize;

/// What one run of the board measured.
#[derive(Clone, Debug, Default)]
pub struct CameraFigures {
    /// Instructions that vision took for each image, with what interrupted it, in the order of the exposures.
    pub vision: Vec<(Exposure, u64)>,
    /// Deepest stack, bytes: up to the first tick, and since.
    pub stack: [u32; 2],
}

impl CameraFigures {
    /// Instructions of the images of one kind.
    pub fn of(&self, look: Look) -> impl Iterator<Item = u64> {
        let such = self.vision.iter().filter(move |(exposure, _)| exposure.look == look);
        such.map(|(_, instructions)| *instructions)
    }
}

/// The camera's image under QEMU, in instructions of the Cortex-M4F: vision to 20 of them, and with what interrupts it, under 1 %.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct VisionFigures {
    /// Images of the seam looked at.
    pub images: usize,
    /// From pixels to a sighting, median over the images.
    pub vision_median_instructions: u64,
    /// The same, greatest.
    pub vision_max_instructions: u64,
    /// Deepest stack up to the first tick, painted and looked at.
    pub stack_boot_bytes: u32,
    /// Deepest stack from then on.
    pub stack_painted_bytes: u32,
}

impl VisionFigures {
    /// Over several runs; `None` over none.
    pub fn new<'a>(runs: impl IntoIterator<Item = &'a CameraFigures>) -> Option<Self> {
        let runs: Vec<_> = runs.into_iter().collect();
        let mut seam: Vec<u64> = runs.iter().flat_map(|run| run.of(Look::Seam)).collect();
        seam.sort_unstable();
        let deepest = |place: usize| runs.iter().map(|run| run.stack[place]).max();
        Some(Self {
            images: seam.len(),
            vision_median_instructions: seam.get(seam.len().saturating_sub(1) / 2).copied().unwrap_or(0),
            vision_max_instructions: seam.last().copied().unwrap_or(0),
            stack_boot_bytes: deepest(0)?,
            stack_painted_bytes: deepest(1)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_maximum_are_over_the_seams_images_of_all_runs_and_the_stack_is_the_deepest() {
        let run = |costs: &[u64], look, stack| CameraFigures {
            vision: costs.iter().map(|cost| (Exposure { stamp: 1, look }, *cost)).collect(),
            stack,
        };
        let runs = [
            run(&[500, 700], Look::Seam, [10, 300]),
            run(&[600], Look::Seam, [20, 200]),
            run(&[9000], Look::Dark, [0, 0]),
        ];
        let figures = VisionFigures::new(&runs).unwrap();
        assert_eq!(
            (
                figures.images,
                figures.vision_median_instructions,
                figures.vision_max_instructions
            ),
            (3, 600, 700)
        );
        assert_eq!((figures.stack_boot_bytes, figures.stack_painted_bytes), (20, 300));
        assert_eq!(VisionFigures::new([]), None);
    }
}
