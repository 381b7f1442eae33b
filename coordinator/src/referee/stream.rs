//! Messages of `worker.proto` in a stream of bytes, each after its length, in prost's encoding.

use std::io;

use prost::Message;

/// Most bytes of a message. A specification has at most 1 MiB, a genotype with a gene per network
/// parameter some 9 MB, and the results of an evaluation 16 MiB.
const MESSAGE_LEN_MAX: usize = 64 << 20;
/// Most bytes of an encoded length.
const LENGTH_LEN_MAX: usize = 10;

/// Bytes of a stream that have arrived and are not read yet.
#[derive(Debug, Default)]
pub(super) struct Arrived(pub(super) Vec<u8>);

impl Arrived {
    /// Takes the first message; `None` if it has not arrived completely. Fails with `InvalidData`
    /// if it is not a message.
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

    /// Checks the end of the stream: fails with `UnexpectedEof` within a message.
    pub(super) fn end(&self) -> io::Result<()> {
        if self.0.is_empty() { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }
}

/// An error about invalid data from the other side.
pub(super) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.into())
}

#[cfg(test)]
mod tests {
    use swarm_proto::v1::TrialMeasures;

    use super::*;

    #[test]
    fn messages_arrive_unchanged_however_the_stream_is_cut() {
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
    fn invalid_bytes_are_refused() {
        for bytes in [&[1, 255][..], &[255; 12], &[255, 255, 255, 127, 0]] {
            let refused = Arrived(bytes.to_vec()).take::<TrialMeasures>().unwrap_err();
            assert_eq!(refused.kind(), io::ErrorKind::InvalidData, "{bytes:?}");
        }
    }
}
