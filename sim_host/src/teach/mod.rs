//! Teaching in the emulated cell: how a trial runs, what is made of the points that come over the bus, and how good it is.
//!
//! The points are all that leaves the controller. [`collect`] hears them; `order` says how far along the seam each lies; `spline` and
//! [`smooth`] make one path of them, wrong ones left out; [`score`] holds it against the true part, which none of the others sees.

pub mod campaign;
pub mod collect;
mod order;
pub mod scenario;
pub mod score;
pub mod smooth;
mod spline;
pub mod trial;
pub mod words;
