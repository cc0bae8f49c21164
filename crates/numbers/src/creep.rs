//! The progress of the creep front.

/// The creep front over time: the farthest block such that it and all blocks before it have slid.
#[derive(Debug, Clone)]
pub(crate) struct CreepFront {
    slid: Vec<bool>,
    /// The first step in which the front had reached a block, for each block that it reached; at most as
    /// many entries as blocks.
    came: Vec<(u64, u32)>,
}

impl CreepFront {
    pub(crate) fn new(blocks: u32) -> CreepFront {
        CreepFront { slid: vec![false; blocks as usize], came: Vec::new() }
    }

    /// Records that a block begins to slide in a step.
    pub(crate) fn slides(&mut self, block: u32, step: u64) {
        let index = block as usize - 1;
        if std::mem::replace(&mut self.slid[index], true) {
            return;
        }
        let front = self.came.last().map_or(0, |(_, block)| *block as usize);
        if index == front {
            let more = self.slid[front..].iter().take_while(|slid| **slid).count();
            self.came.push((step, (front + more) as u32));
        }
    }

    /// The front before a step, or the present one for None.
    pub(crate) fn before(&self, step: Option<u64>) -> Option<u32> {
        let until = step.map_or(self.came.len(), |step| self.came.partition_point(|(came, _)| *came < step));
        self.came[..until].last().map(|(_, block)| *block)
    }
}

#[cfg(test)]
mod tests {
    use super::CreepFront;

    #[test]
    fn it_is_as_far_as_there_is_no_gap() {
        let mut front = CreepFront::new(10);
        assert_eq!(front.before(None), None);
        for (block, step) in [(3, 5), (1, 10), (1, 11), (4, 20), (10, 21), (2, 30), (5, 40)] {
            front.slides(block, step);
        }
        assert_eq!(front.before(Some(10)), None);
        assert_eq!(front.before(Some(11)), Some(1));
        assert_eq!(front.before(Some(30)), Some(1));
        assert_eq!(front.before(Some(31)), Some(4));
        assert_eq!(front.before(None), Some(5));
    }
}
