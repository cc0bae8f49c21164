//! The detectors that every run and replay goes through. To add one: its crate,
//! and a line here. The order is the order of events in the log.

use asperity_detect::Detector;
use asperity_detect_extent::ExtentDetector;
use asperity_detect_global::GlobalDetector;
use asperity_detect_onset::OnsetDetector;
use asperity_record::RunHeader;

pub(crate) fn all(header: &RunHeader) -> Vec<Box<dyn Detector>> {
    vec![
        Box::new(OnsetDetector::new(header.blocks)),
        Box::new(ExtentDetector::new(header.blocks)),
        Box::new(GlobalDetector::new(header.blocks)),
    ]
}
