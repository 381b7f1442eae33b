//! Encodes values as bytes, and decodes them: a byte for the version of the format, and the rest
//! in the format of postcard.
//!
//! The bytes may come from strangers. An empty list takes one byte when encoded, and 24 in
//! memory, so a few bytes could take much memory: the decoder bounds the number of such bytes.
//! Floating-point numbers take equally many bytes in both forms.

use postcard::{Deserializer, de_flavors::Flavor};
use serde::{Serialize, de::DeserializeOwned};

use super::CheckpointError;

/// Most lists, options and integers in a short value.
const SMALL_MAX: usize = 4 << 20;
/// Least bytes for each list, option and integer of a longer value: most lists of a state hold a
/// number of eight bytes or more.
const BYTES_PER_SMALL: usize = 8;

/// Encodes a value in this version of its format.
pub(crate) fn encode(version: u8, value: &impl Serialize) -> Vec<u8> {
    postcard::to_extend(value, vec![version]).expect("numbers and lists serialise")
}

/// Reads the bytes of [`encode`].
pub(crate) fn decode<T: DeserializeOwned>(
    supported: u8,
    bytes: &[u8],
) -> Result<T, CheckpointError> {
    decode_at_most(small_max(bytes.len()), supported, bytes)
}

/// Most lists, options and integers in a value of this many bytes.
fn small_max(n_bytes: usize) -> usize {
    SMALL_MAX.max(n_bytes / BYTES_PER_SMALL)
}

fn decode_at_most<T: DeserializeOwned>(
    n_small: usize,
    supported: u8,
    bytes: &[u8],
) -> Result<T, CheckpointError> {
    match bytes.split_first() {
        Some((&found, rest)) if found == supported => {
            let mut reader = Deserializer::from_flavor(Metered { rest, n_small });
            Ok(T::deserialize(&mut reader)?)
        }
        Some((&found, _)) => Err(CheckpointError::Version { found, supported }),
        None => Err(CheckpointError::Malformed(postcard::Error::DeserializeUnexpectedEnd)),
    }
}

/// Bytes to read, with a budget for the remaining number of lengths and integers.
struct Metered<'a> {
    rest: &'a [u8],
    n_small: usize,
}

impl<'a> Flavor<'a> for Metered<'a> {
    type Remainder = &'a [u8];
    type Source = &'a [u8];

    fn pop(&mut self) -> postcard::Result<u8> {
        let (&byte, rest) =
            self.rest.split_first().ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        // All bytes of a number except the last one have the highest bit set.
        if byte < 0x80 {
            self.n_small =
                self.n_small.checked_sub(1).ok_or(postcard::Error::DeserializeBadEncoding)?;
        }
        self.rest = rest;
        Ok(byte)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }

    fn try_take_n(&mut self, n: usize) -> postcard::Result<&'a [u8]> {
        let parts = self.rest.split_at_checked(n);
        let (taken, rest) = parts.ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        self.rest = rest;
        Ok(taken)
    }

    fn finalize(self) -> postcard::Result<&'a [u8]> {
        Ok(self.rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_values_read_back() {
        let value = (vec![vec![0.1, -0.0], Vec::new()], Some(300_u64), true);
        let bytes = encode(3, &value);
        assert_eq!(decode::<(Vec<Vec<f64>>, Option<u64>, bool)>(3, &bytes).unwrap(), value);
        for len in 0..bytes.len() {
            assert!(decode::<(Vec<Vec<f64>>, Option<u64>, bool)>(3, &bytes[..len]).is_err());
        }
    }

    #[test]
    fn the_number_of_lists_is_bounded_but_not_their_length() {
        let lists = |n_lists: usize, len: usize| encode(1, &vec![vec![0.5; len]; n_lists]);
        let read = |n, bytes: &[u8]| decode_at_most::<Vec<Vec<f64>>>(n, 1, bytes);
        // The length of the whole list counts as a number, too.
        assert_eq!(read(8, &lists(7, 1000)).unwrap().len(), 7);
        assert!(matches!(read(8, &lists(8, 0)), Err(CheckpointError::Malformed(_))));
        // As many individuals and populations as experiments may have.
        let n_genes = 50_000_000;
        assert!(small_max(n_genes * (1 + size_of::<f64>())) > n_genes);
        let hostile = encode(1, &vec![Vec::<f64>::new(); SMALL_MAX]);
        assert!(decode::<Vec<Vec<f64>>>(1, &hostile).is_err());
    }
}
