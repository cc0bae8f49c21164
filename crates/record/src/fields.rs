//! Records of the blocks themselves: what the profiles in figures are drawn
//! from, and what a run can be restarted from.

use std::any::Any;
use std::slice;

use prost::Message;
use prost::encoding::{self, WireType};

/// A record with an array for each quantity. A log has it as a message of Protocol Buffers, which programs read ten
/// times as fast as text, and its schema from the declaration of its fields here.
pub trait BulkRecord: Message + Default {
    /// Name of the message.
    const NAME: &'static str;
    /// Its fields.
    const FIELDS: &'static [BulkField];

    /// The first field that has a number which is not finite.
    fn not_finite(&self) -> Option<&'static str>;

    /// The message, with numbers equal to the bit: as [`Message::encode`] writes it, in far fewer instructions.
    fn to_message(&self) -> Vec<u8>;

    /// Reads a message.
    ///
    /// # Errors
    /// What is wrong with it: it is torn, has a field of another kind, one that is not declared or not as it is written,
    /// or a number that is not finite.
    fn of_message(message: &[u8]) -> Result<Self, String> {
        let record = Self::decode(message).map_err(|error| error.to_string())?;
        if record.encoded_len() != message.len() {
            let (known, found) = (record.encoded_len(), message.len());
            return Err(format!("its known fields have {known} bytes, of {found}"));
        }
        match record.not_finite() {
            Some(name) => Err(format!("{name} has a number that is not finite")),
            None => Ok(record),
        }
    }
}

/// A field of a [`BulkRecord`].
#[derive(Debug, Clone, Copy)]
pub struct BulkField {
    /// Its name, with the unit last.
    pub name: &'static str,
    /// Its number in messages, which never changes.
    pub number: i32,
    /// The type in Protocol Buffers: `double`, `uint32`, `uint64` or `bytes`.
    pub kind: &'static str,
    /// Whether it is an array.
    pub is_repeated: bool,
    /// What it is, in lines that begin with a space.
    pub about: &'static str,
}

/// Declares a [`BulkRecord`], each field with its number and type in Protocol Buffers.
macro_rules! bulk {
    (
        $(#[doc = $about:literal])+
        pub struct $Record:ident as $name:literal {
            $($(#[doc = $doc:literal])+ #[prost(tag = $tag:tt, $kind:ident $($label:tt)*)] pub $field:ident: $type:ty,)+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, PartialEq, Message)]
        pub struct $Record {
            $($(#[doc = $doc])+ #[prost(tag = $tag, $kind $($label)*)] pub $field: $type,)+
        }

        impl BulkRecord for $Record {
            const NAME: &'static str = $name;
            const FIELDS: &'static [BulkField] = &[$(BulkField {
                name: stringify!($field),
                number: $tag,
                kind: stringify!($kind),
                // Behind the type there is nothing, `= "vec"` or `, repeated`.
                is_repeated: matches!(stringify!($($label)*).as_bytes(), [b',', ..]),
                about: concat!($($doc, "\n"),+),
            }),+];

            fn not_finite(&self) -> Option<&'static str> {
                let fields = [$((stringify!($field), &self.$field as &dyn Any)),+];
                fields.into_iter().find(|(_, field)| !is_finite(*field)).map(|(name, _)| name)
            }

            fn to_message(&self) -> Vec<u8> {
                let mut message = Vec::with_capacity(self.encoded_len());
                $(append!(message, $tag, self.$field, $type, $kind $($label)*);)+
                message
            }
        }
    };
}

/// Appends a field of this type to a message, unless it is empty or 0.
macro_rules! append {
    ($message:ident, $tag:tt, $field:expr, $type:ty, double, repeated) => {
        append_doubles(&mut $message, $tag, &$field)
    };
    ($message:ident, $tag:tt, $field:expr, $type:ty, $kind:ident, repeated) => {
        encoding::$kind::encode_packed($tag, &$field, &mut $message)
    };
    ($message:ident, $tag:tt, $field:expr, $type:ty, $kind:ident $($as:tt)*) => {
        if $field != <$type>::default() {
            encoding::$kind::encode($tag, &$field, &mut $message);
        }
    };
}

fn append_doubles(message: &mut Vec<u8>, tag: u32, numbers: &[f64]) {
    if numbers.is_empty() {
        return;
    }
    encoding::encode_key(tag, WireType::LengthDelimited, message);
    encoding::encode_varint(size_of_val(numbers) as u64, message);
    let bytes: Vec<[u8; 8]> = numbers.iter().map(|number| number.to_le_bytes()).collect();
    message.extend_from_slice(bytes.as_flattened());
}

/// Whether a field has no number that is infinite or NaN.
#[expect(clippy::eq_op, reason = "infinity without itself is no number")]
fn is_finite(field: &dyn Any) -> bool {
    let one = field.downcast_ref::<f64>().map(slice::from_ref);
    let numbers = one.or_else(|| field.downcast_ref::<Vec<f64>>().map(Vec::as_slice));
    // All of them, so that several are seen at once: what is left of a number without itself has no bit, or is no number.
    numbers.is_none_or(|numbers| numbers.iter().fold(0, |bits, x| bits | (x - x).to_bits()) == 0)
}

bulk! {
    /// The state of every block after a step; each array has one value per block. The blocks of a slab, a
    /// sheet or a body are its contacts.
    ///
    /// Written for the initial state, at the onset and end of every slip event, and
    /// at a cadence of its own.
    pub struct FieldRecord as "Fields" {
        /// The step; 0 is the initial state.
        #[prost(tag = 1, uint64)]
        pub step: u64,
        /// Simulated time at the end of the step, s.
        #[prost(tag = 2, double)]
        pub time_s: f64,
        /// Displacement `u_n` from the initial grid, m.
        #[prost(tag = 3, double, repeated)]
        pub displacement_m: Vec<f64>,
        /// Velocity `v_n`, m/s.
        #[prost(tag = 4, double, repeated)]
        pub velocity_m_per_s: Vec<f64>,
        /// Tangential force without friction `tau_n` that this step's update used, N.
        #[prost(tag = 5, double, repeated)]
        pub tangential_force_n: Vec<f64>,
        /// Normal load `p_n` that this step's update used, N; none of a chain or a sheet, whose load follows
        /// from the scenario.
        #[prost(tag = 6, double, repeated)]
        pub normal_load_n: Vec<f64>,
        /// Anchor `u_stick,n` of the friction spring, m; without meaning while the
        /// block slides.
        #[prost(tag = 7, double, repeated)]
        pub stick_position_m: Vec<f64>,
        /// A byte for each block: 1 if it enters the next step detached, else 0.
        #[prost(tag = 8, bytes = "vec")]
        pub detached: Vec<u8>,
        /// How many junctions of the contact slip; none by laws without junctions, as below.
        #[prost(tag = 9, uint32, repeated)]
        pub junctions_slipping: Vec<u32>,
        /// Mean force of the contact's pinned junctions over the load that each bears, `p_n / N_s`; 0 if
        /// none is pinned, or the contact bears nothing.
        #[prost(tag = 10, double, repeated)]
        pub pinned_mean_ratio: Vec<f64>,
        /// Width of the uniform distribution with the standard deviation of these forces, `sqrt(12)` times
        /// that, over the same load; 0 likewise.
        #[prost(tag = 11, double, repeated)]
        pub pinned_width_ratio: Vec<f64>,
        /// State of rate-and-state friction, `psi_n = f_0 + b_n ln(V_0 theta_n / D_c)`; none by other laws.
        #[prost(tag = 12, double, repeated)]
        pub state: Vec<f64>,
        /// Displacement across the sliding direction, from the initial grid, m; none where contacts lie in a
        /// single row, as below.
        #[prost(tag = 13, double, repeated)]
        pub displacement_across_m: Vec<f64>,
        /// Velocity across it, m/s.
        #[prost(tag = 14, double, repeated)]
        pub velocity_across_m_per_s: Vec<f64>,
        /// Tangential force without friction across it that this step's update used, N.
        #[prost(tag = 15, double, repeated)]
        pub tangential_force_across_n: Vec<f64>,
        /// Anchor of the friction spring across it, m; without meaning while the contact slides.
        #[prost(tag = 16, double, repeated)]
        pub stick_position_across_m: Vec<f64>,
    }
}

bulk! {
    /// The state of some neighbouring blocks after a step inside a dense window.
    pub struct WindowRecord as "Window" {
        /// Which window of the scenario this belongs to, counted from 0.
        #[prost(tag = 1, uint32)]
        pub window: u32,
        /// The step.
        #[prost(tag = 2, uint64)]
        pub step: u64,
        /// Simulated time at the end of the step, s.
        #[prost(tag = 3, double)]
        pub time_s: f64,
        /// How many blocks of the whole chain slid in this step.
        #[prost(tag = 4, uint32)]
        pub sliding: u32,
        /// The block that the first value of each array belongs to.
        #[prost(tag = 5, uint32)]
        pub first_block: u32,
        /// Displacement `u_n` from the initial grid, m.
        #[prost(tag = 6, double, repeated)]
        pub displacement_m: Vec<f64>,
        /// Velocity `v_n`, m/s.
        #[prost(tag = 7, double, repeated)]
        pub velocity_m_per_s: Vec<f64>,
        /// Tangential force without friction `tau_n` that this step's update used, N.
        #[prost(tag = 8, double, repeated)]
        pub tangential_force_n: Vec<f64>,
        /// Displacement across the sliding direction, from the initial grid, m; none where contacts lie in a
        /// single row, as below.
        #[prost(tag = 9, double, repeated)]
        pub displacement_across_m: Vec<f64>,
        /// Velocity across it, m/s.
        #[prost(tag = 10, double, repeated)]
        pub velocity_across_m_per_s: Vec<f64>,
        /// Tangential force without friction across it that this step's update used, N.
        #[prost(tag = 11, double, repeated)]
        pub tangential_force_across_n: Vec<f64>,
    }
}

bulk! {
    /// What channels of a stream of a recording read over up to a thousand samples, sensors first, each in SI units or,
    /// where any unit will do, in its own.
    pub struct SignalRecord as "Signal" {
        /// The step nearest to the first of the samples.
        #[prost(tag = 1, uint64)]
        pub step: u64,
        /// Its time, s.
        #[prost(tag = 2, double)]
        pub time_s: f64,
        /// The stream, counted from 1.
        #[prost(tag = 3, uint32)]
        pub stream: u32,
        /// The part of the stream, counted from 1.
        #[prost(tag = 4, uint64)]
        pub part: u64,
        /// How many samples each channel has here.
        #[prost(tag = 5, uint32)]
        pub samples: u32,
        /// From one sample to the next, s.
        #[prost(tag = 6, double)]
        pub interval_s: f64,
        /// The least of each channel.
        #[prost(tag = 7, double, repeated)]
        pub least: Vec<f64>,
        /// The mean of each channel.
        #[prost(tag = 8, double, repeated)]
        pub mean: Vec<f64>,
        /// The largest of each channel.
        #[prost(tag = 9, double, repeated)]
        pub largest: Vec<f64>,
    }
}

bulk! {
    /// Samples of all sensors about a rupture, from four windows before its first arrival to four behind its last stop.
    /// Long ones are several messages.
    pub struct TraceRecord as "Traces" {
        /// The step nearest to the first sample.
        #[prost(tag = 1, uint64)]
        pub step: u64,
        /// Its time, s.
        #[prost(tag = 2, double)]
        pub time_s: f64,
        /// The rupture, which stands behind its traces.
        #[prost(tag = 3, uint64)]
        pub rupture: u64,
        /// The part of the stream, counted from 1.
        #[prost(tag = 4, uint64)]
        pub part: u64,
        /// How many sensors there are.
        #[prost(tag = 5, uint32)]
        pub sensors: u32,
        /// From one sample to the next, s.
        #[prost(tag = 6, double)]
        pub interval_s: f64,
        /// How many samples each sensor has here.
        #[prost(tag = 7, uint32)]
        pub samples: u32,
        /// All samples of the first sensor, then of the next, in SI units or those of the array.
        #[prost(tag = 8, double, repeated)]
        pub values: Vec<f64>,
    }
}

impl SignalRecord {
    /// Most samples that one record sums up, and most of each sensor in one [`TraceRecord`].
    pub const MOST_SAMPLES: u32 = 1000;
}

#[cfg(test)]
mod tests {
    use prost::Message;

    use super::{BulkRecord, FieldRecord, WindowRecord};

    #[test]
    fn numbers_are_read_as_they_were_to_the_bit() {
        let record = WindowRecord {
            window: u32::MAX,
            step: u64::MAX,
            time_s: 0.1,
            displacement_m: vec![-0.0, 5e-324, 0.1 + 0.2, f64::MAX],
            ..WindowRecord::default()
        };
        let message = record.to_message();
        assert_eq!(message, record.encode_to_vec());
        let read = WindowRecord::of_message(&message).unwrap();
        assert_eq!(read, record);
        assert!(read.displacement_m[0].is_sign_negative());
        // Ten bytes at most for each field but the array.
        assert!(message.len() < 4 * 8 + 50, "{} bytes", message.len());
        let state = vec![0.5; 3];
        let (detached, junctions_slipping) = (vec![0, 1, 0], vec![0, 300, 7]);
        let record = FieldRecord { state, detached, junctions_slipping, ..FieldRecord::default() };
        assert_eq!(record.to_message(), record.encode_to_vec());
    }

    #[test]
    fn what_is_no_message_of_the_record_is_refused_with_the_reason() {
        let record =
            WindowRecord { step: 7, velocity_m_per_s: vec![0.5, f64::NAN], ..WindowRecord::default() };
        let of_nan = record.to_message();
        let sound = WindowRecord { step: 7, ..WindowRecord::default() }.to_message();
        for (message, says) in [
            (of_nan.clone(), "velocity_m_per_s has a number that is not finite"),
            (of_nan[..of_nan.len() - 1].to_vec(), "buffer underflow"),
            // The step as text, another field, and the step twice.
            (b"\x12\x01x".to_vec(), "invalid wire type"),
            ([&sound[..], b"\x78\x01"].concat(), "its known fields have 2 bytes, of 4"),
            (sound.repeat(2), "its known fields have 2 bytes, of 4"),
        ] {
            let error = WindowRecord::of_message(&message).unwrap_err();
            assert!(error.contains(says), "{says}: {error}");
        }
    }
}
