//! What the steps of a run were made of.

/// Counts of a solver's work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Steps taken one by one.
    pub plain_steps: u64,
    /// Jumps over stick phases.
    pub jumps: u64,
    /// Steps that they covered.
    pub jump_steps: u64,
    /// Windows taken.
    pub windows: u64,
    /// Steps that they covered.
    pub window_steps: u64,
    /// Differences that were taken for windows, those of refused ones included.
    pub applications: u64,
    /// Block switches.
    pub switches: u64,
}
