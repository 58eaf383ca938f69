//! Weights of the net, made by `tesaki train`: do not edit.

use super::{HIDDEN, Net, OUTPUTS};

/// For lap joints whose line steps to the right, down the image.
pub const CRANK: Net = Net {
    hidden: [[0.0; 4]; HIDDEN],
    output: [[0.0; HIDDEN + 1]; OUTPUTS],
};

/// For bends.
pub const VEE: Net = Net {
    hidden: [[0.0; 4]; HIDDEN],
    output: [[0.0; HIDDEN + 1]; OUTPUTS],
};
