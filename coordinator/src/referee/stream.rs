//! The messages of `worker.proto` in a stream of bytes, each after its length, as prost writes it.

use std::io;

use prost::Message;

/// Bytes of a message. A specification has at most 1 MiB, and a genotype, of up to a
/// gene per network parameter, some 9 MB; the results of an evaluation have 16 MiB.
const MESSAGE_LEN_MAX: usize = 64 << 20;
/// Bytes of the longest length.
const LENGTH_LEN_MAX: usize = 10;

/// What has arrived of a stream, and is to be read.
#[derive(Debug, Default)]
pub(super) struct Arrived(pub(super) Vec<u8>);

impl Arrived {
    /// Takes the first message; none if not all of it is there. What is no message is
    /// `InvalidData`.
    pub(super) fn take<M: Message + Default>(&mut self) -> io::Result<Option<M>> {
        let mut rest = &self.0[..];
        let len = match prost::decode_length_delimiter(&mut rest) {
            Ok(len) if len <= MESSAGE_LEN_MAX => len,
            Ok(len) => return Err(invalid(format!("a message of {len} bytes"))),
            Err(_) if self.0.len() < LENGTH_LEN_MAX => return Ok(None),
            Err(error) => return Err(invalid(error.to_string())),
        };
        let Some(message) = rest.get(..len) else { return Ok(None) };
        let message = M::decode(message).map_err(|error| invalid(error.to_string()))?;
        let n_read = self.0.len() - rest.len() + len;
        self.0.drain(..n_read);
        Ok(Some(message))
    }

    /// The stream has ended: `UnexpectedEof` within a message.
    pub(super) fn end(&self) -> io::Result<()> {
        if self.0.is_empty() { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }
}

/// An error of what the other side has written.
pub(super) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.into())
}

#[cfg(test)]
mod tests {
    use swarm_proto::v1::TrialMeasures;

    use super::*;

    #[test]
    fn messages_come_out_as_they_went_in_however_they_are_cut_and_bits_stay() {
        let sent = TrialMeasures { values: vec![0.1, -0.0, f64::NAN, f64::from_bits(1), 0.5] };
        let bits =
            |sent: &TrialMeasures| sent.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let bytes = sent.encode_length_delimited_to_vec();
        for cut in 1..bytes.len() {
            let mut arrived = Arrived(bytes[..cut].to_vec());
            assert_eq!(arrived.take::<TrialMeasures>().unwrap(), None, "{cut}");
            arrived.end().unwrap_err();
            arrived.0.extend([&bytes[cut..], &bytes].concat());
            for _ in 0..2 {
                assert_eq!(bits(&arrived.take().unwrap().unwrap()), bits(&sent));
            }
            arrived.end().unwrap();
        }
    }

    #[test]
    fn what_is_no_message_is_refused() {
        for bytes in [&[1, 255][..], &[255; 12], &[255, 255, 255, 127, 0]] {
            let refused = Arrived(bytes.to_vec()).take::<TrialMeasures>().unwrap_err();
            assert_eq!(refused.kind(), io::ErrorKind::InvalidData, "{bytes:?}");
        }
    }
}
