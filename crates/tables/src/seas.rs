//! Series as solved, in the text files of the SEAS benchmarks, while a log is read: comments, the names of the columns,
//! and a line for each recorded step of the solver. A block has `fltst_bNNN.txt`, the slider `global.txt`; on a fault
//! line in a medium a station has `fltst_dpXXX`, by its depth in units of 100 m, and all nodes `devol.dat`, with a line
//! for each of their recorded states.
//!
//! Comments tell the shortest and longest step, which only the end of the log knows, so lines wait until then.

use std::collections::BTreeMap;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use asperity_files::{FileError, FileSet, Spool, UntilRefused, spool};
use asperity_model::{Plan, Scenario};
use asperity_record::{Observer, Record, RunHeader, Series, SeriesBlock, rounded};

/// Units and names of the columns, of the slider, of a block, and of all nodes.
const GLOBAL: &str = "# s, log10 of m/s, N m/s\nt max_slip_rate moment_rate";
const BLOCK: &str = "# s, m, log10 of m/s, MPa, log10 of theta in s\nt slip slip_rate shear_stress state";
const NODES: &str =
    "# s, log10 of m/s, m at each depth; the first line has these depths, in m\nz\nt max_slip_rate slip";

/// Lines beyond this size wait in a file.
const IN_MEMORY_BYTES: usize = 1 << 20;

/// The files of one run.
pub struct Seas {
    header: RunHeader,
    plan: Plan,
    width_m: f64,
    /// By block; 0 is the whole slider.
    files: BTreeMap<u32, (PathBuf, BufWriter<Spool>)>,
    /// The shortest and the longest step that was recorded, s, and the number of the last one.
    steps: (f64, f64, u64),
    /// The time of the last state, s.
    last_state_s: f64,
    failed: Option<io::Error>,
}

impl Seas {
    /// Begins the files of a run in a folder, as files of a set.
    ///
    /// # Errors
    /// If a file cannot have its name.
    pub fn begin(run: &RunHeader, of: &Scenario, files: &FileSet, out: &Path) -> Result<Seas, FileError> {
        let plan = Plan::new(of);
        let name = |block: u32| match (&plan.medium, block.checked_sub(1)) {
            (None, None) => "global.txt".to_owned(),
            (None, Some(_)) => format!("fltst_b{block:03}.txt"),
            (Some(_), None) => "devol.dat".to_owned(),
            // To six digits, or 2400 m might be 23.999999999999996.
            (Some(medium), Some(n)) => {
                let hundreds = rounded(medium.depth_m(n as usize) / 100.0, 6).to_string();
                format!("fltst_dp{hundreds:0>3}")
            }
        };
        let blocks = plan.recording.series_blocks.iter().map(|n| *n as u32 + 1);
        let named: BTreeMap<u32, PathBuf> =
            std::iter::once(0).chain(blocks).map(|block| (block, out.join(name(block)))).collect();
        files.reserve(named.values().cloned())?;
        let begun = |(block, path)| (block, (path, BufWriter::new(spool(IN_MEMORY_BYTES))));
        let mut seas = Seas {
            header: run.clone(),
            plan,
            width_m: of.slider.width_m,
            files: named.into_iter().map(begun).collect(),
            steps: (f64::INFINITY, 0.0, 0),
            last_state_s: f64::NEG_INFINITY,
            failed: None,
        };
        if let Some(medium) = seas.plan.medium.clone() {
            let depths = (0..medium.nodes()).map(|n| medium.depth_m(n));
            seas.line(0, 0.0, [0.0].into_iter().chain(depths));
        }
        Ok(seas)
    }

    /// Writes the files, and returns their paths.
    ///
    /// # Errors
    /// If a file could not be written.
    pub fn finish(mut self, files: &FileSet) -> Result<Vec<PathBuf>, FileError> {
        let lines = std::mem::take(&mut self.files).into_iter();
        lines
            .map(|(block, (path, lines))| {
                let written = match self.failed.take() {
                    Some(error) => Err(error),
                    None => {
                        files.create(&path).map(|file| self.write(block, lines, UntilRefused::new(file)))?
                    }
                };
                written.map_err(FileError::io(&path)).map(|()| path)
            })
            .collect()
    }

    /// Writes a file: its comments, and the lines that have waited.
    fn write(&self, block: u32, lines: BufWriter<Spool>, file: impl Write) -> io::Result<()> {
        let RunHeader { scenario, code_version: version, blocks, scales, .. } = &self.header;
        let (shortest_s, longest_s, count) = self.steps;
        let mut file = BufWriter::new(file);
        // Whoever submits them knows author and date; a log has no clock.
        writeln!(file, "# problem={scenario:?}\n# author=\n# date=\n# code=asperity\n# version={version}")?;
        writeln!(file, "# element_size={} m\n# minimum_time_step={shortest_s:.6e}", scales.block_length_m)?;
        writeln!(file, "# maximum_time_step={longest_s:.6e}\n# num_time_steps={count}")?;
        let (location, columns) = match (&self.plan.medium, block) {
            (Some(medium), 0) => (format!("on fault, {} nodes", medium.nodes()), NODES),
            (Some(medium), _) => {
                (format!("on fault, {} km depth", medium.depth_m(block as usize - 1) / 1e3), BLOCK)
            }
            (None, 0) => (format!("block 0 of {blocks}"), GLOBAL),
            (None, _) => (format!("block {block} of {blocks}"), BLOCK),
        };
        writeln!(file, "# location={location}\n{columns}")?;
        let mut lines = lines.into_inner().map_err(io::IntoInnerError::into_error)?;
        lines.rewind()?;
        io::copy(&mut lines, &mut file)?;
        file.flush()
    }

    fn line(&mut self, block: u32, time_s: f64, values: impl Iterator<Item = f64>) {
        let Some((_, file)) = self.files.get_mut(&block) else { return };
        let values: String = values.map(|value| format!(" {value:14.6e}")).collect();
        let written = writeln!(file, "{time_s:21.13e}{values}");
        // The end tells of it.
        self.failed = self.failed.take().or(written.err());
    }

    /// All nodes of a fault line, of which a step may have two records.
    fn state(&mut self, time_s: f64, slip_m: &[f64], velocity_m_per_s: &[f64]) {
        if self.plan.medium.is_some() && time_s > self.last_state_s {
            self.last_state_s = time_s;
            let fastest = velocity_m_per_s.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            self.line(0, time_s, [log10(fastest)].into_iter().chain(slip_m.iter().copied()));
        }
    }

    /// The area over which the friction of a block is the shear stress, m2; in a medium that of a metre of strike.
    fn area_m2(&self, block: u32) -> f64 {
        let of_chain = || self.header.scales.block_length_m * self.width_m;
        self.plan.medium.as_ref().map_or_else(of_chain, |medium| medium.cell_m(block as usize - 1))
    }
}

/// Of 0 there is no logarithm.
fn log10(value: f64) -> f64 {
    value.abs().max(f64::MIN_POSITIVE).log10()
}

impl Observer for Seas {
    fn record(&mut self, record: &Record) {
        match record {
            Record::Row(row) => {
                if let Some(at) = row.values.get::<Series>() {
                    let (shortest_s, longest_s, _) = self.steps;
                    self.steps = (shortest_s.min(at.step_s), longest_s.max(at.step_s), at.solver_step);
                    if self.plan.medium.is_none() {
                        let values = [log10(at.v_max_m_per_s), at.moment_rate_n_m_per_s];
                        self.line(0, at.time_s, values.into_iter());
                    }
                } else if let Some(at) = row.values.get::<SeriesBlock>() {
                    let stress_mpa = at.friction_n / self.area_m2(at.block) / 1e6;
                    let values = [at.slip_m, log10(at.velocity_m_per_s), stress_mpa, log10(at.theta_s)];
                    self.line(at.block, at.time_s, values.into_iter());
                }
            }
            Record::Fields(at) => self.state(at.time_s, &at.displacement_m, &at.velocity_m_per_s),
            Record::Window(at) if at.window as usize == self.plan.recording.windows.len() => {
                self.state(at.time_s, &at.displacement_m, &at.velocity_m_per_s);
            }
            _ => {}
        }
    }
}
