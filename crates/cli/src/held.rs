//! Events as a log holds them against events as the detectors find them now.

use std::collections::VecDeque;

use asperity_record::Event;

/// Both, but for those that agree.
#[derive(Debug, Default)]
pub(crate) struct Held {
    logged: VecDeque<Event>,
    found: VecDeque<Event>,
    agreed: usize,
}

/// Where they part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("other events from number {number} on\n  logged:   {logged}\n  found:    {found}")]
pub(crate) struct Difference {
    /// How many agree before.
    pub(crate) number: usize,
    /// What the log holds there.
    pub(crate) logged: String,
    /// What the detectors find there.
    pub(crate) found: String,
}

impl Held {
    /// Takes an event out of the log.
    pub(crate) fn logged(&mut self, event: Event) {
        self.logged.push_back(event);
    }

    /// Takes an event that a detector found.
    pub(crate) fn found(&mut self, event: Event) {
        self.found.push_back(event);
    }

    /// Lets go of those that agree.
    pub(crate) fn compare(&mut self) -> Result<(), Difference> {
        while let (Some(logged), Some(found)) = (self.logged.front(), self.found.front()) {
            if logged != found {
                return Err(self.difference());
            }
            self.logged.pop_front();
            self.found.pop_front();
            self.agreed += 1;
        }
        Ok(())
    }

    /// The same, where no more are to come.
    pub(crate) fn finish(mut self) -> Result<(), Difference> {
        self.compare()?;
        if self.logged.is_empty() && self.found.is_empty() { Ok(()) } else { Err(self.difference()) }
    }

    fn difference(&self) -> Difference {
        let told = |event: Option<&Event>| {
            event.map_or("nothing".to_owned(), |event| format!("{} {}", event.topic, event.payload))
        };
        Difference { number: self.agreed, logged: told(self.logged.front()), found: told(self.found.front()) }
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::Event;

    use super::Held;

    #[test]
    fn the_first_difference_is_told() {
        let event = |payload: &str| Event { topic: "/events/slip".to_owned(), payload: payload.to_owned() };
        let hold = |logged: &[&str], found: &[&str]| {
            let mut held = Held::default();
            logged.iter().for_each(|payload| held.logged(event(payload)));
            found.iter().for_each(|payload| held.found(event(payload)));
            held.finish()
        };
        assert_eq!(hold(&["a", "b"], &["a", "b"]), Ok(()));
        for (logged, found) in
            [(&["a", "b"][..], &["a", "c"][..]), (&["a"], &["a", "b"]), (&["a", "b"], &["a"])]
        {
            assert_eq!(hold(logged, found).unwrap_err().number, 1);
        }
    }
}
