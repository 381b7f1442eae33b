//! Messages in a stream of bytes: each is preceded by its length, 4 bytes, the lowest
//! first.

use std::io::{self, Read, Write};

use prost::Message;
use tokio::io::{AsyncRead, AsyncReadExt as _};

/// Bytes of a message. A specification has at most 1 MiB, and a genotype, of up to a
/// gene per network parameter, some 9 MB; the results of an evaluation have 16 MiB.
pub(super) const MESSAGE_LEN_MAX: usize = 64 << 20;

/// A message with its length, or the number of its bytes if these are too many.
pub(super) fn encode(message: &impl Message) -> Result<Vec<u8>, usize> {
    let n_bytes = message.encoded_len();
    let header = match u32::try_from(n_bytes) {
        Ok(length) if n_bytes <= MESSAGE_LEN_MAX => length.to_le_bytes(),
        _ => return Err(n_bytes),
    };
    let mut frame = Vec::with_capacity(header.len() + n_bytes);
    frame.extend(header);
    frame.extend(message.encode_to_vec());
    Ok(frame)
}

/// Writes a message that [`encode`] has framed.
pub(super) fn write(output: &mut impl Write, frame: &[u8]) -> io::Result<()> {
    output.write_all(frame)?;
    output.flush()
}

/// Reads a message; none if the stream ends before it. A stream that ends within a
/// message is `UnexpectedEof`, what is no message `InvalidData`.
pub(super) fn read<M: Message + Default>(input: &mut impl Read) -> io::Result<Option<M>> {
    let mut header = Vec::new();
    input.by_ref().take(4).read_to_end(&mut header)?;
    let Some(n_bytes) = length(&header)? else { return Ok(None) };
    let mut body = Vec::new();
    input.by_ref().take(n_bytes).read_to_end(&mut body)?;
    decode(n_bytes, &body).map(Some)
}

/// As [`read`].
pub(super) async fn read_async<M: Message + Default>(
    input: &mut (impl AsyncRead + Unpin),
) -> io::Result<Option<M>> {
    let mut header = Vec::new();
    (&mut *input).take(4).read_to_end(&mut header).await?;
    let Some(n_bytes) = length(&header)? else { return Ok(None) };
    let mut body = Vec::new();
    input.take(n_bytes).read_to_end(&mut body).await?;
    decode(n_bytes, &body).map(Some)
}

/// The length of the message that follows; none if nothing follows.
fn length(header: &[u8]) -> io::Result<Option<u64>> {
    if header.is_empty() {
        return Ok(None);
    }
    let header = header.try_into().map_err(|_| io::ErrorKind::UnexpectedEof)?;
    let n_bytes = u32::from_le_bytes(header);
    if n_bytes as usize > MESSAGE_LEN_MAX {
        return Err(invalid(format!("a message of {n_bytes} bytes")));
    }
    Ok(Some(n_bytes.into()))
}

fn decode<M: Message + Default>(n_bytes: u64, body: &[u8]) -> io::Result<M> {
    if (body.len() as u64) < n_bytes {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    M::decode(body).map_err(|error| invalid(error.to_string()))
}

/// An error of what the other side has written.
pub(super) fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

#[cfg(test)]
mod tests {
    use super::{super::messages::Values, *};

    #[test]
    fn messages_come_out_as_they_went_in_and_bits_stay() {
        let values = vec![0.1, -0.0, f64::NAN, f64::from_bits(1), f64::INFINITY];
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let frame = encode(&Values { values: values.clone() }).unwrap();
        let mut stream = &[frame.clone(), frame].concat()[..];
        for _ in 0..2 {
            let read: Values = read(&mut stream).unwrap().unwrap();
            assert_eq!(bits(&read.values), bits(&values));
        }
        assert_eq!(read::<Values>(&mut stream).unwrap(), None);
    }

    #[test]
    fn what_is_no_message_is_refused() {
        let kind = |mut bytes: &[u8]| read::<Values>(&mut bytes).unwrap_err().kind();
        assert_eq!(kind(&[1, 0]), io::ErrorKind::UnexpectedEof);
        assert_eq!(kind(&[2, 0, 0, 0, 10]), io::ErrorKind::UnexpectedEof);
        assert_eq!(kind(&[1, 0, 0, 0, 255]), io::ErrorKind::InvalidData);
        assert_eq!(kind(&[255; 8]), io::ErrorKind::InvalidData, "longer than any message");
    }

    #[test]
    fn a_message_that_is_too_long_is_not_written() {
        let values = vec![0.0; MESSAGE_LEN_MAX / 8];
        assert!(encode(&Values { values }).unwrap_err() > MESSAGE_LEN_MAX);
    }
}
