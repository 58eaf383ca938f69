//! How busy the bus is: busy time by cycle, its mean and its maximum.

/// Bus load figures. A frame counts for the cycle in which it starts.
#[derive(Clone, Debug)]
pub struct Load {
    cycle_ns: u64,
    since_ns: u64,
    cycle: u64,
    cycle_busy_ns: u64,
    total_busy_ns: u64,
    max_busy_ns: u64,
    /// Frames sent whole.
    pub frames: u64,
    /// Frames destroyed.
    pub errors: u64,
}

impl Load {
    pub(super) fn new(cycle_ns: u64) -> Self {
        Self {
            cycle_ns,
            since_ns: 0,
            cycle: 0,
            cycle_busy_ns: 0,
            total_busy_ns: 0,
            max_busy_ns: 0,
            frames: 0,
            errors: 0,
        }
    }

    /// Counts anew from `t_ns` on.
    pub(super) fn restart(&mut self, t_ns: u64) {
        *self = Self {
            since_ns: t_ns,
            ..Self::new(self.cycle_ns)
        };
    }

    pub(super) fn add(&mut self, start_ns: u64, busy_ns: u64) {
        let cycle = start_ns / self.cycle_ns;
        if cycle != self.cycle {
            self.cycle = cycle;
            self.cycle_busy_ns = 0;
        }
        self.cycle_busy_ns += busy_ns;
        self.total_busy_ns += busy_ns;
        self.max_busy_ns = self.max_busy_ns.max(self.cycle_busy_ns);
    }

    /// Busy fraction of the cycle under way or last used, 0..=1.
    pub fn cycle(&self) -> f64 {
        self.cycle_busy_ns as f64 / self.cycle_ns as f64
    }

    /// Mean busy fraction up to `t_ns` from where counting began: time zero, or [`super::Bus::restart_load`].
    pub fn mean(&self, t_ns: u64) -> f64 {
        self.total_busy_ns as f64 / t_ns.saturating_sub(self.since_ns).max(1) as f64
    }

    /// Highest busy fraction of a cycle.
    pub fn max(&self) -> f64 {
        self.max_busy_ns as f64 / self.cycle_ns as f64
    }
}
