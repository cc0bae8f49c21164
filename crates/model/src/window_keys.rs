//! The keys of dense windows; a scenario may have any number of windows.

use crate::keys::{Key, Window};

/// Prefix of the keys inside each `[[recording.window]]`.
pub(crate) const WINDOW: &str = "recording.window";

/// The keys of a dense window.
pub(crate) const WINDOW_KEYS: &[Key] = Window::KEYS;
