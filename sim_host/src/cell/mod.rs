//! What lies in the work cell: the seam as it was drawn and the part as it really is.
//!
//! - [`path`]: nominal seam geometry in the work frame Σ_W;
//! - [`panel`]: the true part in the base frame Σ_B, displaced, deformed and dented. Truth: for rendering and scoring only.

pub mod panel;
pub mod path;
