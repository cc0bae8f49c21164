//! What a `recording.toml` says.

use std::fmt;
use std::num::NonZeroU16;
use std::path::{Path, PathBuf};

use asperity_model::scenario::text::{self, Lines};
use asperity_model::scenario::typed;
use asperity_record::MOST_BLOCKS;
use asperity_record::bounds::check_toml;
use serde::de::value::{self, StrDeserializer};
use serde::{Deserialize, Serialize};
use toml::{Spanned, Value};

use crate::array::Numbers;
use crate::error::{RecordingError, Result};
use crate::unit::{Quantity, Unit};

/// A description with every key.
pub const EXAMPLE: &str = include_str!("example.toml");

/// What a channel measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The sum of the driving forces, `F_T`.
    TangentialForce,
    /// The normal load, `F_N`.
    NormalForce,
    /// The position of the drive.
    LoadPoint,
    /// The displacement of the slider.
    Slip,
    /// The area of real contact, in any unit.
    ContactArea,
    /// The local shear force.
    ShearForce,
    /// The local shear strain.
    ShearStrain,
    /// A sensor of sound.
    Acoustic,
}

impl Role {
    /// What its unit measures; none where any will do.
    fn quantity(self) -> Option<Quantity> {
        match self {
            Role::TangentialForce | Role::NormalForce | Role::ShearForce => Some(Quantity::Force),
            Role::LoadPoint | Role::Slip => Some(Quantity::Length),
            Role::ShearStrain => Some(Quantity::Ratio),
            Role::ContactArea | Role::Acoustic => None,
        }
    }

    /// The role of this name.
    pub fn named(name: &str) -> Option<Role> {
        Value::from(name).try_into().ok()
    }

    /// The sign of a detachment.
    pub(crate) fn sign(self) -> f64 {
        if self == Role::Slip { 1.0 } else { -1.0 }
    }
}

/// A recording as it is described.
#[derive(Debug, Clone)]
pub struct Description {
    /// The file.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// Name of the recording.
    pub name: String,
    pub(crate) sample_s: Option<f64>,
    pub(crate) slider: Slider,
    pub(crate) streams: Vec<Stream>,
    pub(crate) detection: Detection,
    /// The stream whose array makes the contacts.
    pub(crate) contacts: Option<usize>,
    /// The stream with the tangential force.
    pub(crate) forces: Option<usize>,
}

/// Numbers of which only some are accepted, with a default.
macro_rules! numbers {
    ($($(#[doc = $about:literal])+ $Name:ident = $default:literal: $accepted:literal, $accepts:expr;)+) => {$(
        $(#[doc = $about])+
        #[derive(Debug, Clone, Copy, Deserialize)]
        #[serde(try_from = "f64")]
        pub(crate) struct $Name(pub(crate) f64);

        impl Default for $Name {
            fn default() -> $Name {
                $Name($default)
            }
        }

        impl TryFrom<f64> for $Name {
            type Error = &'static str;

            fn try_from(number: f64) -> Result<$Name, &'static str> {
                let accepts: fn(f64) -> bool = $accepts;
                if number.is_finite() && accepts(number) { Ok($Name(number)) } else { Err($accepted) }
            }
        }
    )+};
}

numbers! {
    /// Above 0.
    Positive = 1.0: "accepted: a number above 0", |number| number > 0.0;
    /// From 0.
    FromZero = 0.0: "accepted: a number from 0", |number| number >= 0.0;
    /// Not 0.
    Factor = 1.0: "accepted: a number other than 0", |number| number != 0.0;
    /// Any.
    Finite = 0.0: "accepted: a finite number", |_| true;
    /// Least size of a step, in scatters of the step statistic.
    Threshold = 6.0: "accepted: a number above 0", |number| number > 0.0;
    /// As in a scenario.
    LinkTimeRatio = 100.0: "accepted: a number above 0", |number| number > 0.0;
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    format: Spanned<u64>,
    name: String,
    #[serde(rename = "summary")]
    _summary: Option<String>,
    sample_s: Option<Positive>,
    slider: Spanned<Slider>,
    #[serde(default)]
    stream: Vec<Spanned<Stream>>,
    #[serde(default)]
    detection: Detection,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Slider {
    pub(crate) length_m: Positive,
    pub(crate) width_m: Positive,
    pub(crate) height_m: Positive,
    pub(crate) youngs_modulus_pa: Positive,
    wave_speed_m_per_s: Option<Positive>,
    density_kg_per_m3: Option<Positive>,
    pub(crate) normal_force_n: Option<Positive>,
}

impl Slider {
    /// The speed of long waves.
    pub(crate) fn wave_speed_m_per_s(&self) -> f64 {
        let by_density = |density: Positive| (self.youngs_modulus_pa.0 / density.0).sqrt();
        let speed = self.wave_speed_m_per_s.map(|speed| speed.0);
        speed.or(self.density_kg_per_m3.map(by_density)).expect("a slider has one of both")
    }
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Stream {
    name: Option<String>,
    pub(crate) file: String,
    kind: Option<Kind>,
    pub(crate) units_row: bool,
    pub(crate) skip_rows: u32,
    pub(crate) delimiter: Option<Delimiter>,
    pub(crate) axis: Axis,
    /// An array in the file.
    pub(crate) dataset: Option<String>,
    pub(crate) numbers: Option<Numbers>,
    pub(crate) channels_in_file: Option<NonZeroU16>,
    pub(crate) skip_bytes: u32,
    pub(crate) time: Option<Time>,
    pub(crate) rate_hz: Option<Positive>,
    pub(crate) start_s: Finite,
    pub(crate) offset_s: Finite,
    pub(crate) starts: Option<Time>,
    pub(crate) gaps: Gaps,
    pub(crate) missing: Option<Missing>,
    pub(crate) resample: Option<Resample>,
    pub(crate) channel: Vec<Channel>,
    array: Vec<Spanned<Array>>,
    /// The working sensors of the array.
    #[serde(skip)]
    pub(crate) sensors: Vec<Channel>,
}

/// Words that a key accepts.
macro_rules! words {
    ($($(#[$about:meta])* $Name:ident { $($(#[$of:meta])* $Word:ident $(= $byte:literal)?),+ })+) => {$(
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub(crate) enum $Name {
            $($(#[$of])* $Word $(= $byte as isize)?),+
        }
    )+};
}

words! {
    /// A format of files.
    Kind {
        #[serde(alias = "tsv", alias = "txt")] Csv, Npy, Npz, #[serde(alias = "h5", alias = "tpc5")] Hdf5, Mat,
        #[serde(alias = "bin")] Raw, Tdms
    }
    /// What separates cells.
    Delimiter { Comma = b',', Semicolon = b';', Tab = b'\t', Space = b' ' }
    #[derive(Default)] Axis { ChannelsFirst, #[default] SamplesFirst }
    Missing { Gap }
    #[derive(Default)] Gaps { #[default] Refuse, Allow }
    Resample { Linear }
}

impl Axis {
    /// The axis of the array with its sides exchanged.
    pub(crate) fn turned(self) -> Axis {
        if self == Axis::SamplesFirst { Axis::ChannelsFirst } else { Axis::SamplesFirst }
    }
}

/// A column of times: of samples in their own file, of the starts of segments in another.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Time {
    #[serde(default)]
    pub(crate) file: String,
    pub(crate) column: Column,
    pub(crate) unit: Option<Unit>,
}

/// A channel.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Channel {
    pub(crate) column: Column,
    pub(crate) role: Role,
    /// The unit, unless the file states it.
    unit: Option<Unit>,
    #[serde(default)]
    pub(crate) factor: Factor,
    /// In the unit.
    #[serde(default)]
    pub(crate) offset: Finite,
    area_m2: Option<Positive>,
    pub(crate) x_m: Option<f64>,
    /// Normal load on the area that a shear gauge of an array reads.
    #[serde(skip)]
    pub(crate) normal_n: Option<Positive>,
    /// How many SI units a stored 1 is; known once the file is opened.
    #[serde(skip)]
    pub(crate) scale: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Array {
    role: Role,
    unit: Option<Unit>,
    channels: Columns,
    x_m: Option<Vec<f64>>,
    x0_m: Option<f64>,
    dx_m: Option<Positive>,
    #[serde(default)]
    dead: Vec<u64>,
    #[serde(default)]
    factor: Factor,
    normal_n: Option<Vec<Positive>>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Detection {
    array: Option<Spanned<String>>,
    pub(crate) window_s: Option<Positive>,
    pub(crate) force_window_s: Option<Positive>,
    pub(crate) threshold: Threshold,
    /// In the unit of the array.
    pub(crate) least_step: FromZero,
    pub(crate) least_drop_n: FromZero,
    pub(crate) link_time_ratio: LinkTimeRatio,
    /// Whether the log has the samples about each rupture; by default it has.
    pub(crate) traces: Option<bool>,
}

/// A channel of a source: by name, or by number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "Value")]
pub(crate) enum Column {
    /// By its name in a heading.
    Name(String),
    /// By its number, from 1.
    Number(u64),
}

impl fmt::Display for Column {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Column::Name(name) => write!(f, "{name}"),
            Column::Number(number) => write!(f, "{number}"),
        }
    }
}

impl TryFrom<Value> for Column {
    type Error = &'static str;

    fn try_from(value: Value) -> Result<Column, &'static str> {
        match value {
            Value::String(name) => Ok(Column::Name(name)),
            Value::Integer(number @ 1..) => Ok(Column::Number(number.unsigned_abs())),
            _ => Err("accepted: a name in quotes, or a number from 1"),
        }
    }
}

/// Channels as a list, or as a range `"1..20"`.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "Value")]
struct Columns(Vec<Column>);

impl TryFrom<Value> for Columns {
    type Error = &'static str;

    fn try_from(value: Value) -> Result<Columns, &'static str> {
        let range = |text: &str| {
            let (first, last) = text.split_once("..")?;
            let (first, last) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
            let is_fit = first > 0 && first <= last && last - first < MOST_BLOCKS;
            is_fit.then(|| (first..=last).map(Column::Number).collect())
        };
        let read: Option<Vec<Column>> = match value {
            Value::String(text) => range(&text),
            Value::Array(list) => list.into_iter().map(|value| value.try_into().ok()).collect(),
            _ => None,
        };
        let is_fit = |columns: &Vec<Column>| (1..=MOST_BLOCKS).contains(&(columns.len() as u64));
        let read = read.filter(is_fit).map(Columns);
        read.ok_or("accepted: a range as \"1..20\", or a list of names or numbers from 1")
    }
}

impl Channel {
    /// What is stored, in SI units.
    pub(crate) fn si(&self, stored: f64) -> f64 {
        stored * self.scale + self.offset.0 * self.scale / self.factor.0
    }

    /// Its unit and how many SI units that is; the SI unit if there is none, or of another quantity.
    pub(crate) fn unit_or_si(&self) -> (&str, f64) {
        match (&self.unit, self.role.quantity()) {
            (Some(unit), due) if due == Some(unit.quantity) => (&unit.name, unit.scale),
            (_, Some(Quantity::Force)) => ("N", 1.0),
            (_, Some(Quantity::Length)) => ("m", 1.0),
            _ => ("1", 1.0),
        }
    }

    /// How many SI units a stored 1 is, given the unit that a file states for it.
    ///
    /// # Errors
    /// What is wrong with the unit.
    pub(crate) fn scale_by(&self, stated: Option<&str>) -> Result<f64, String> {
        let due = self.role.quantity();
        let misfit = |unit: &str| match due {
            Some(due) => format!("unit {unit} where {} is due", due.words()),
            None => format!("unknown unit {unit}"),
        };
        let of_file = stated.map(|stated| Unit::of(stated).ok_or_else(|| misfit(stated))).transpose()?;
        let unit = of_file.as_ref().or(self.unit.as_ref());
        let unit = unit.ok_or("no unit in the file, nor in recording.toml")?;
        let scale = match (due, self.area_m2) {
            // Of any quantity, so in its own unit.
            (None, _) => 1.0,
            (Some(due), _) if due == unit.quantity => unit.scale,
            // A stress on an area is a force.
            (Some(Quantity::Force), Some(area)) if unit.quantity == Quantity::Stress => unit.scale * area.0,
            _ => return Err(misfit(&unit.name)),
        };
        match &self.unit {
            Some(given) if (given.quantity, given.scale) != (unit.quantity, unit.scale) => {
                Err(format!("unit {} in the file, {} in recording.toml", unit.name, given.name))
            }
            _ => Ok(self.factor.0 * scale),
        }
    }
}

impl Stream {
    /// Its name, that of its file if it has none.
    pub(crate) fn name(&self) -> &str {
        self.name.as_ref().unwrap_or(&self.file)
    }

    /// The format of its files, if it is known.
    pub(crate) fn kind(&self) -> Option<Kind> {
        let of = |ending: &str| Kind::deserialize(StrDeserializer::<value::Error>::new(ending)).ok();
        self.kind.or_else(|| of(&Path::new(&self.file).extension()?.to_str()?.to_lowercase()))
    }

    /// Its channels: sensors first.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.sensors.iter().chain(&self.channel)
    }

    /// The channel of a role, beside the array.
    pub(crate) fn with(&self, role: Role) -> Option<&Channel> {
        self.channel.iter().find(|channel| channel.role == role)
    }

    /// The role of its array, if that can make the contacts.
    pub(crate) fn contact_role(&self) -> Option<Role> {
        let role = self.sensors.first()?.role;
        let makes_contacts =
            matches!(role, Role::Slip | Role::ContactArea | Role::ShearForce | Role::ShearStrain);
        makes_contacts.then_some(role)
    }
}

/// A byte in the text, and what is wrong there.
type Refused = (usize, String);

/// Refuses what stands at a place, unless it is accepted.
fn must(accepted: bool, at: usize, problem: impl fmt::Display) -> Result<(), Refused> {
    if accepted { Ok(()) } else { Err((at, problem.to_string())) }
}

impl Description {
    /// Reads a description.
    ///
    /// # Errors
    /// If it cannot be read, or a value in it is not accepted.
    pub fn read(file: &Path) -> Result<Description> {
        let text = text::read(file).map_err(RecordingError::io(file))?;
        Description::parse(file, &text)
    }

    /// Parses a description, with the name of its file.
    ///
    /// # Errors
    /// If a value in it is not accepted.
    pub fn parse(file: &Path, text: &str) -> Result<Description> {
        let read = || -> Result<Description, Refused> {
            check_toml(text).map_err(|too_long| (0, too_long.to_string()))?;
            resolve(file, text, typed::parse(text, "`asperity recording show`")?)
        };
        read().map_err(|(at, problem)| {
            let place = Lines::of(text).place(text, at);
            RecordingError::Description(format!("{}:{place}: {problem}", file.display()))
        })
    }

    /// The role of the array that makes the contacts, if there is one.
    pub(crate) fn contact_role(&self) -> Option<Role> {
        self.streams[self.contacts?].contact_role()
    }

    /// The positions of the contacts, m from the driven end; none without an array.
    pub fn positions_m(&self) -> Vec<f64> {
        let sensors = self.contacts.map_or(&[][..], |stream| &self.streams[stream].sensors);
        sensors.iter().filter_map(|sensor| sensor.x_m).collect()
    }
}

fn resolve(file: &Path, text: &str, written: Written) -> Result<Description, Refused> {
    let (format, slider) = (written.format, written.slider);
    let (at, format) = (format.span().start, format.into_inner());
    must(format == 1, at, format_args!("format = {format} (accepted: 1)"))?;
    let (at, slider) = (slider.span().start, slider.into_inner());
    let has_one = slider.wave_speed_m_per_s.is_some() != slider.density_kg_per_m3.is_some();
    must(has_one, at, "slider needs one of wave_speed_m_per_s and density_kg_per_m3")?;
    let places: Vec<usize> = written.stream.iter().map(|stream| stream.span().start).collect();
    let streams = written.stream.into_iter().map(|stream| self::stream(stream, slider.length_m.0));
    let streams = streams.collect::<Result<Vec<Stream>, Refused>>()?;
    let named = written.detection.array.as_ref();
    let is_meant = |n: &usize| named.is_none_or(|named| streams[*n].name() == named.get_ref());
    let mut with_array = (0..streams.len()).filter(|n| streams[*n].contact_role().is_some()).filter(is_meant);
    let (contacts, second) = (with_array.next(), with_array.next().filter(|_| named.is_none()));
    if let Some(named) = named {
        let problem = format!("array = {:?} (accepted: the name of a stream with an array)", named.get_ref());
        must(contacts.is_some(), named.span().start, problem)?;
    }
    let accepted = "a second array (accepted: one, or detection.array, which names its stream)";
    must(second.is_none(), second.map_or(0, |second| places[second]), accepted)?;
    let forces = streams.iter().position(|stream| stream.with(Role::TangentialForce).is_some());
    for (n, stream) in streams.iter().enumerate() {
        for role in [Role::TangentialForce, Role::NormalForce, Role::LoadPoint] {
            let count = stream.channel.iter().filter(|channel| channel.role == role).count();
            let problem = "a force or a load point too many (accepted: one of each, beside tangential-force)";
            must(count <= usize::from(forces == Some(n)), places[n], problem)?;
        }
    }
    let none =
        "nothing from which events follow (accepted: a stream with an array, or with a tangential-force)";
    must(contacts.or(forces).is_some(), 0, none)?;
    Ok(Description {
        file: file.to_owned(),
        text: text.to_owned(),
        name: written.name,
        sample_s: written.sample_s.map(|interval| interval.0),
        slider,
        streams,
        detection: written.detection,
        contacts,
        forces,
    })
}

fn stream(spanned: Spanned<Stream>, length_m: f64) -> Result<Stream, Refused> {
    let (at, mut stream) = (spanned.span().start, spanned.into_inner());
    let (file, kind) = (&stream.file, stream.kind());
    let (is_raw, is_table) = (kind == Some(Kind::Raw), kind == Some(Kind::Csv));
    let of_tables = stream.units_row || stream.skip_rows > 0 || stream.delimiter.is_some();
    let of_arrays = stream.dataset.is_some() || stream.axis == Axis::ChannelsFirst;
    let is_alien = if is_table { of_arrays } else { of_tables } || stream.skip_bytes > 0 && !is_raw;
    let [has_starts, has_rate] = [stream.starts.is_some(), stream.rate_hz.is_some()];
    let units = [&stream.time, &stream.starts].into_iter().flatten().filter_map(|time| time.unit.as_ref());
    let mut places_m = stream.channel.iter().filter_map(|channel| channel.x_m);
    for (is_fit, problem) in [
        (
            kind.is_some(),
            &*format!("file = {file:?} (accepted: csv, npy, npz, hdf5, mat, tdms, raw; or kind says which)"),
        ),
        (
            [stream.numbers.is_some(), stream.channels_in_file.is_some()] == [is_raw; 2],
            "raw needs numbers and channels_in_file, and only it has them",
        ),
        (
            !is_alien,
            "units_row, skip_rows and delimiter are of csv, dataset and axis of arrays, skip_bytes of raw",
        ),
        (
            stream.missing.is_none() || stream.resample.is_none(),
            "resample would fill the gaps of missing (accepted: one of both)",
        ),
        (stream.time.is_some() != has_rate, "a stream has one of time and rate_hz"),
        (
            units.into_iter().all(|unit| unit.quantity == Quantity::Time),
            "a unit of another kind (accepted: s, ms, us, ns)",
        ),
        (
            file.contains('*') == has_starts && (has_rate || !has_starts),
            "segments (a * in file) need starts and rate_hz, and only they have starts",
        ),
        (
            places_m.all(|x_m| (0.0..=length_m).contains(&x_m)),
            &format!("a channel beside the slider (accepted: x_m from 0 to {length_m})"),
        ),
        (stream.array.len() < 2, "a second array (accepted: one in a stream)"),
    ] {
        must(is_fit, at, problem)?;
    }
    if let Some(array) = stream.array.pop() {
        stream.sensors = sensors(array, length_m)?;
    }
    Ok(stream)
}

/// The working sensors of an array.
fn sensors(spanned: Spanned<Array>, length_m: f64) -> Result<Vec<Channel>, Refused> {
    let (at, array) = (spanned.span().start, spanned.into_inner());
    let Array { role, unit, channels: Columns(columns), dead, factor, .. } = array;
    let count = columns.len();
    let x_m: Vec<f64> = match (array.x_m, array.x0_m, array.dx_m) {
        (Some(x_m), None, None) => x_m,
        (None, Some(first_m), Some(Positive(step_m))) => {
            (0..count).map(|n| first_m + step_m * n as f64).collect()
        }
        _ => return Err((at, "an array has x_m, or x0_m and dx_m".to_owned())),
    };
    let loads = array.normal_n.as_ref().map_or(count, Vec::len);
    let problem = format!("{} positions, {loads} loads (accepted: as many as channels, {count})", x_m.len());
    must(x_m.len() == count && loads == count, at, problem)?;
    let is_fit = x_m.iter().all(|x_m| (0.0..=length_m).contains(x_m)) && x_m.is_sorted_by(|a, b| a < b);
    must(is_fit, at, format_args!("positions {x_m:?} (accepted: ascending, from 0 to {length_m})"))?;
    let are_sensors = dead.iter().all(|dead| (1..=count as u64).contains(dead));
    must(are_sensors, at, format_args!("dead = {dead:?} (accepted: sensors from 1 to {count})"))?;
    let all = (1..).zip(columns.into_iter().zip(x_m)).filter(|(number, _)| !dead.contains(number));
    let channel = |(number, (column, x_m))| {
        let normal_n = array.normal_n.as_ref().map(|loads| loads[number as usize - 1]);
        let (offset, area_m2, unit) = (Finite(0.0), None, unit.clone());
        Channel { column, role, unit, factor, offset, area_m2, x_m: Some(x_m), normal_n, scale: 0.0 }
    };
    let working: Vec<Channel> = all.map(channel).collect();
    must(!working.is_empty(), at, "all sensors are dead (accepted: one that works)")?;
    Ok(working)
}
