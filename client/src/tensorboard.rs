//! Event files of TensorBoard: a file of TFRecords, each an `Event`.
//!
//! This module writes only scalars, so it declares only the fields of TensorFlow's
//! `event.proto` and `summary.proto` that scalars need.

use crc32c::crc32c;
use prost::Message;

/// The version string in the first event of a file.
const FILE_VERSION: &str = "brain.Event:2";

/// The constant added to a rotated checksum, so that a checksum over checksums is sound.
const MASK_DELTA: u32 = 0xa282_ead8;

/// The used part of `tensorflow.Event`.
#[derive(Clone, PartialEq, Message)]
struct Event {
    /// Seconds since 1970 UTC.
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(string, optional, tag = "3")]
    file_version: Option<String>,
    #[prost(message, optional, tag = "5")]
    summary: Option<Summary>,
}

/// `tensorflow.Summary`.
#[derive(Clone, PartialEq, Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    value: Vec<Value>,
}

/// `tensorflow.Summary.Value`.
#[derive(Clone, PartialEq, Message)]
struct Value {
    #[prost(string, tag = "1")]
    tag: String,
    /// Part of a `oneof`, so that a zero is written, too.
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
}

/// An event file in memory.
#[derive(Debug)]
pub struct EventFile(Vec<u8>);

impl EventFile {
    /// A file without scalars. `at_ms`: when it begins, ms since 1970 UTC.
    pub fn new(at_ms: u64) -> Self {
        let mut file = Self(Vec::new());
        let file_version = Some(FILE_VERSION.to_owned());
        file.push(&Event { wall_time: seconds(at_ms), step: 0, file_version, summary: None });
        file
    }

    /// Adds the scalars of a step.
    pub fn scalars<'a>(
        &mut self,
        step: u64,
        at_ms: u64,
        values: impl IntoIterator<Item = (&'a str, f64)>,
    ) {
        let value = |(tag, value): (&str, f64)| Value {
            tag: tag.to_owned(),
            simple_value: Some(value as f32),
        };
        let summary = Some(Summary { value: values.into_iter().map(value).collect() });
        let step = i64::try_from(step).unwrap_or(i64::MAX);
        self.push(&Event { wall_time: seconds(at_ms), step, file_version: None, summary });
    }

    /// The file.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    /// A record: length, its checksum, data, their checksum; numbers little-endian.
    fn push(&mut self, event: &Event) {
        let data = event.encode_to_vec();
        let length = (data.len() as u64).to_le_bytes();
        self.0.extend(length);
        self.0.extend(masked(&length).to_le_bytes());
        self.0.extend(&data);
        self.0.extend(masked(&data).to_le_bytes());
    }
}

fn masked(bytes: &[u8]) -> u32 {
    crc32c(bytes).rotate_right(15).wrapping_add(MASK_DELTA)
}

fn seconds(at_ms: u64) -> f64 {
    at_ms as f64 / 1000.0
}
