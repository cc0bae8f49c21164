//! Series as solved, in the text files of the SEAS benchmarks (`fltst_bNNN.txt` of a block, `global.txt`), while a log is
//! read: comments, the names of the columns, and a line for each recorded step of the solver.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use asperity_files::{FileError, FileSet, UntilRefused};
use asperity_model::Scenario;
use asperity_record::{Observer, Record, RunHeader, Series, SeriesBlock};

/// Units and names of the columns, of the slider and of a block.
const GLOBAL: &str = "# s, log10 of m/s, N m/s\nt max_slip_rate moment_rate";
const BLOCK: &str = "# s, m, log10 of m/s, MPa, log10 of theta in s\nt slip slip_rate shear_stress state";

/// The files of one run.
pub struct Seas {
    /// By block; 0 is the whole slider.
    files: BTreeMap<u32, (PathBuf, BufWriter<UntilRefused<File>>)>,
    /// Area of a block, over which its friction is the shear stress, m2.
    area_m2: f64,
}

impl Seas {
    /// Begins the files of a run in a folder, as files of a set.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn begin(run: &RunHeader, of: &Scenario, files: &FileSet, out: &Path) -> Result<Seas, FileError> {
        let length_m = run.scales.block_length_m;
        let begin = |block: u32| {
            let (name, columns) = match block {
                0 => ("global.txt".to_owned(), GLOBAL),
                _ => (format!("fltst_b{block:03}.txt"), BLOCK),
            };
            let path = out.join(name);
            let mut file = BufWriter::new(UntilRefused::new(files.create(&path)?));
            let RunHeader { scenario, code_version, blocks, .. } = run;
            let head =
                format!("# problem={scenario:?}\n# code=asperity\n# version={code_version}\n# element_size=");
            let written =
                writeln!(file, "{head}{length_m} m\n# location=block {block} of {blocks}\n{columns}");
            written.map_err(FileError::io(&path))?;
            Ok((block, (path, file)))
        };
        let blocks = of.recording.series_blocks.iter().map(|block| *block as u32);
        let files = std::iter::once(0).chain(blocks).map(begin).collect::<Result<_, FileError>>()?;
        Ok(Seas { files, area_m2: length_m * of.slider.width_m })
    }

    /// Ends the files, and returns their paths.
    ///
    /// # Errors
    /// If a file could not be written.
    pub fn finish(self) -> Result<Vec<PathBuf>, FileError> {
        let files = self.files.into_values();
        files.map(|(path, mut file)| file.flush().map_err(FileError::io(&path)).map(|()| path)).collect()
    }
}

impl Observer for Seas {
    fn record(&mut self, record: &Record) {
        let Record::Row(row) = record else { return };
        // Of 0 there is no logarithm.
        let log10 = |value: f64| value.abs().max(f64::MIN_POSITIVE).log10();
        let (block, values) = match (row.values.get::<Series>(), row.values.get::<SeriesBlock>()) {
            (Some(at), _) => (0, vec![log10(at.v_max_m_per_s), at.moment_rate_n_m_per_s]),
            (_, Some(at)) => {
                let stress_mpa = at.friction_n / self.area_m2 / 1e6;
                (at.block, vec![at.slip_m, log10(at.velocity_m_per_s), stress_mpa, log10(at.theta_s)])
            }
            _ => return,
        };
        let Some((_, file)) = self.files.get_mut(&block) else { return };
        let values: String = values.iter().map(|value| format!(" {value:14.6e}")).collect();
        // The end tells of what was refused.
        writeln!(file, "{:21.13e}{values}", row.time_s).ok();
    }
}
