//! Seam sensor: where the seam is in an image of the lit slit, and where that is in the sensor frame Σ_S.
//!
//! An image goes through six steps, each a file, each with constant bounds:
//! 1. [`image`]: a checked view of the pixels;
//! 2. `band`: every fourth row, summed with its neighbour, yields up to four places where a line may be;
//! 3. `track`: dynamic programming (`ways`) joins them to the one line that runs through the image, past ghosts and glints;
//! 4. [`window`]: a window about that line in every row yields a trimmed sub-pixel centre and its weight;
//! 5. `search`: a filter for the [`joint`]'s step or kink names bands, a `fit` of its shape chooses the likeliest;
//! 6. `place`: the shape about it gives a bend, or the sheets' lines; by these lines the rows say where the one sheet's light
//!    goes over to the other's (`exchange`) or ends (`ending`), and all of them together ([`edge`]) give the seam to a fraction of a row.
//!
//! [`camera`] turns the seam's pixel into a point by the exact pinhole formula, once the [`lens`] is undone; [`sensor`] puts it all together and
//! refuses, with a reason, what it cannot vouch for. [`printed`] is the paper's own method (3.29)–(3.44), for reference, and [`net`] its neural one.
//!
//! [`two_slit`] does this for the two slits of one image, which together give the seam's pose.
//!
//! Pixels count from the centre of the top-left one, x right (along the seam), y down. f32, no allocation.

mod band;
pub mod camera;
pub mod edge;
mod ending;
pub mod exchange;
mod fit;
pub mod image;
pub mod joint;
pub mod lens;
pub mod net;
mod number;
mod place;
pub mod printed;
mod search;
pub mod sensor;
pub mod start;
mod track;
pub mod two_slit;
mod ways;
pub mod window;

pub use sensor::{Refusal, SeamSensor};
pub use two_slit::TwoSlitSensor;
