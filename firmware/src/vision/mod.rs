//! Seam sensor: where the seam is in an image of the lit slit, and where that is in the sensor frame Σ_S.
//!
//! An image goes through five steps, each a file, each with constant bounds:
//! 1. [`image`]: a checked view of the pixels;
//! 2. `band`: every fourth row, summed with its neighbour, yields up to four places where a line may be;
//! 3. `track`: dynamic programming joins them to the one line that runs through the image, past ghosts and glints;
//! 4. [`window`]: a window about that line in every row yields a trimmed sub-pixel centre and its weight;
//! 5. [`joint`]: the joint's shape is fitted at every place along the line; the best place is near the seam;
//! 6. [`edge`]: the rows about it say on which sheet each shows light, which gives the place to a fraction of a row.
//!
//! [`camera`] turns the seam's pixel into a point by the exact pinhole formula; [`sensor`] puts it all together and
//! refuses, with a reason, what it cannot vouch for. [`printed`] is the paper's own method (3.29)–(3.44), for reference.
//!
//! [`two_slit`] does this for the two slits of one image, which together give the seam's pose.
//!
//! Pixels count from the centre of the top-left one, x right (along the seam), y down. f32, no allocation.

mod band;
pub mod camera;
pub mod edge;
pub mod image;
pub mod joint;
mod number;
pub mod printed;
pub mod sensor;
pub mod start;
mod track;
pub mod two_slit;
pub mod window;

pub use sensor::{Refusal, SeamSensor};
pub use two_slit::TwoSlitSensor;
