//! Requests and answers: the length of a header (u32), the header (JSON), and bytes. Numbers are
//! little-endian.

use serde::{Serialize, de::DeserializeOwned};

/// Splits a message into its header and its bytes.
pub fn read<H: DeserializeOwned>(message: &[u8]) -> Result<(H, &[u8]), String> {
    let (len, rest) = message.split_first_chunk().ok_or("the message is too short")?;
    let (header, bytes) = rest
        .split_at_checked(u32::from_le_bytes(*len) as usize)
        .ok_or("the message is shorter than its header")?;
    let header = serde_json::from_slice(header).map_err(|error| error.to_string())?;
    Ok((header, bytes))
}

/// A message.
pub fn write(header: &impl Serialize, bytes: &[u8]) -> Vec<u8> {
    let header = serde_json::to_vec(header).expect("plain data serialises");
    [&(header.len() as u32).to_le_bytes(), &*header, bytes].concat()
}

/// The bytes of numbers.
pub fn bytes_of(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

/// The numbers of bytes.
pub fn numbers_of(bytes: &[u8]) -> Result<Vec<f64>, String> {
    let (numbers, rest) = bytes.as_chunks();
    if !rest.is_empty() {
        return Err("the message ends within a number".to_owned());
    }
    Ok(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect())
}
