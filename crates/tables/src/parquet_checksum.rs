//! A checksum over the whole of a Parquet file, since a flipped bit in it may be another number.
//!
//! The format has checksums of pages, which leave out the headers of pages and the footer, and polars
//! writes none. So a CRC-32 (that of zlib) of the whole file is stored in its footer, as eight hexadecimal
//! digits under the key [`KEY`]: computed with eight zeros in their place. Other readers ignore it. Files
//! with a checksum are verified before they are read here.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};

use polars::prelude::KeyValueMetadata;
use polars_parquet_format::FileMetaData;

/// The key in the footer.
pub const KEY: &str = "asperity:crc32";

/// The placeholder until the checksum is known, and while it is computed.
const UNKNOWN: &[u8; DIGITS] = b"00000000";

const DIGITS: usize = 8;

/// How the footer has the text behind its key: the second field, a text, and its length.
const VALUE_HEAD: [u8; 2] = [0x18, DIGITS as u8];

/// Bytes of a file that are in memory at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Metadata that the footer needs for a later call of [`seal`]. None for a pipe, which cannot be modified
/// afterwards.
pub(crate) fn pair(file: &File) -> io::Result<Option<(String, String)>> {
    let unknown = String::from_utf8_lossy(UNKNOWN).into_owned();
    Ok(file.metadata()?.is_file().then(|| (KEY.to_owned(), unknown)))
}

/// The placeholder of the checksum as polars metadata.
pub(crate) fn metadata(file: &File) -> io::Result<Option<KeyValueMetadata>> {
    Ok(pair(file)?.map(|pair| KeyValueMetadata::from_static(vec![pair])))
}

/// Puts the checksum of a file that is written to its end in its place.
///
/// # Errors
/// If the system refuses.
pub(crate) fn seal(file: &mut File) -> io::Result<()> {
    if !file.metadata()?.is_file() {
        return Ok(());
    }
    let lost = || io::Error::other(format!("the footer has no {KEY}"));
    let at = digits_at(file)?.ok_or_else(lost)?;
    let crc = crc(file, at)?;
    file.seek(SeekFrom::Start(at))?;
    write!(file, "{crc:08x}")?;
    file.seek(SeekFrom::End(0)).map(drop)
}

/// Compares a file with the checksum in its footer; one without is by another program.
///
/// # Errors
/// In words, if they differ or the file cannot be read.
pub(crate) fn verify(file: &mut File, footer: &FileMetaData) -> Result<(), String> {
    let pairs = footer.key_value_metadata.iter().flatten();
    let Some(written) = pairs.filter(|pair| pair.key == KEY).map(|pair| &pair.value).next() else {
        return Ok(());
    };
    let written = written.as_deref().unwrap_or_default();
    let problem = |error: io::Error| error.to_string();
    let Some(at) = digits_at(file).map_err(problem)? else {
        return Err(format!("it is damaged: {KEY} = {written:?} (accepted: {DIGITS} hexadecimal digits)"));
    };
    let found = format!("{:08x}", crc(file, at).map_err(problem)?);
    if found != written {
        return Err(format!("it is damaged: its footer says {KEY} = {written:?}, its bytes give {found}"));
    }
    Ok(())
}

/// Position of the digits: after the key, in the footer.
fn digits_at(file: &mut File) -> io::Result<Option<u64>> {
    let length = file.metadata()?.len();
    let mut tail = [0; 4];
    file.seek(SeekFrom::Start(length.saturating_sub(8)))?;
    file.read_exact(&mut tail)?;
    let footer_at = length.saturating_sub(8 + u64::from(u32::from_le_bytes(tail)));
    file.seek(SeekFrom::Start(footer_at))?;
    let mut footer = Vec::new();
    file.read_to_end(&mut footer)?;
    let place = [KEY.as_bytes(), &VALUE_HEAD].concat();
    let behind = footer.windows(place.len()).position(|bytes| bytes == place).map(|at| at + place.len());
    let is_there = |at: &usize| at + DIGITS <= footer.len();
    Ok(behind.filter(is_there).map(|at| footer_at + at as u64))
}

/// The checksum of a file with [`UNKNOWN`] where its own digits are.
fn crc(file: &mut File, digits_at: u64) -> io::Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    file.seek(SeekFrom::Start(0))?;
    update(&mut hasher, file.take(digits_at))?;
    hasher.update(UNKNOWN);
    file.seek(SeekFrom::Start(digits_at + DIGITS as u64))?;
    update(&mut hasher, file)?;
    Ok(hasher.finalize())
}

fn update(hasher: &mut crc32fast::Hasher, mut bytes: impl Read) -> io::Result<()> {
    let mut buffer = vec![0; BUFFER_BYTES];
    loop {
        match bytes.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(read) => hasher.update(&buffer[..read]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use asperity_files::{Existing, FileSet, Inputs};
    use polars::prelude::{Column, DataFrame, NamedFrom, Series};

    use crate::table_file;

    /// Every bit of a table affects its numbers, their order, or whether they can be read at all.
    #[test]
    fn no_flipped_bit_gives_another_table() {
        let folder = tempfile::tempdir().unwrap();
        let numbers: Vec<f64> = (0..40).map(|n| 0.1 * f64::from(n)).collect();
        let counts: Vec<u32> = (0..40).map(|n| n / 3).collect();
        let columns: Vec<Column> =
            vec![Series::new("onset_s".into(), numbers).into(), Series::new("block".into(), counts).into()];
        let mut table = DataFrame::new_infer_height(columns).unwrap();
        let files = FileSet::new(Existing::Refuse, Inputs::default());
        table_file::write(&files, folder.path(), "table", &mut table).unwrap();
        files.publish().unwrap();
        let [csv, parquet] = table_file::paths(folder.path(), "table");
        let (csv, good) = (fs::read(csv).unwrap(), fs::read(&parquet).unwrap());
        let print = || {
            let mut out = Vec::new();
            table_file::print_parquet(&mut out, &parquet).map(|()| out)
        };
        assert_eq!(print().unwrap(), csv);
        let mut refused = 0;
        for bit in 0..8 * good.len() {
            let mut flipped = good.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            fs::write(&parquet, &flipped).unwrap();
            match print() {
                Ok(printed) => assert!(printed == csv, "bit {bit} of {} gives another table", good.len()),
                Err(_) => refused += 1,
            }
        }
        // Only the key of the checksum itself remains; once damaged, it is an unknown key.
        assert!(8 * good.len() - refused <= 8 * super::KEY.len() + 64, "{refused} of {}", 8 * good.len());
    }

    /// The checksum of a known program, over the bytes as they are except for the digits.
    #[test]
    fn the_checksum_is_that_of_zlib_with_zeros_in_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let columns: Vec<Column> = vec![Series::new("step".into(), [1_u64, 2]).into()];
        let files = FileSet::new(Existing::Refuse, Inputs::default());
        let mut table = DataFrame::new_infer_height(columns).unwrap();
        table_file::write(&files, folder.path(), "table", &mut table).unwrap();
        files.publish().unwrap();
        let mut bytes = fs::read(&table_file::paths(folder.path(), "table")[1]).unwrap();
        let key = super::KEY.as_bytes();
        let at = bytes.windows(key.len()).position(|found| found == key).unwrap() + key.len() + 2;
        let written = String::from_utf8(bytes[at..at + 8].to_vec()).unwrap();
        bytes[at..at + 8].copy_from_slice(b"00000000");
        assert_eq!(written, format!("{:08x}", crc32fast::hash(&bytes)));
    }
}
