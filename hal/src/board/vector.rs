//! Entries of a Cortex-M's vector table.

/// One entry.
#[repr(C)]
pub union Vector {
    /// What serves the interrupt.
    pub handler: unsafe extern "C" fn(),
    /// Nothing does: the interrupt is never enabled.
    pub reserved: u32,
}

impl Vector {
    /// No handler.
    pub const NONE: Self = Self { reserved: 0 };
}
