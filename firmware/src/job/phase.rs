//! Where a job stands: the same phases for every job, whose numbers are on the bus and in logs.

use hal::wire_enum;

/// Where a job stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// Not begun.
    #[default]
    Idle,
    /// Up, clear of where the arm stands.
    Rise,
    /// To where the part is measured, from place to place.
    Measure,
    /// Point to point to a place over the start of the run-in.
    Approach,
    /// Down to the start of the run-in.
    Descend,
    /// Along the seam; in sealing, the bead is on between 0 and the seam's length.
    Follow,
    /// Up from the end of the run-out.
    Lift,
    /// At rest over the end.
    Done,
    /// Stopped on the seam before a corner, and about looking round it.
    Turn,
}

wire_enum!(Phase {
    Idle,
    Rise,
    Measure,
    Approach,
    Descend,
    Follow,
    Lift,
    Done,
    Turn
});
