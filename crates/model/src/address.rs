//! Addresses of genotypes, as people write them.

use std::{fmt, str::FromStr};

use experiment_file::limits;

use crate::ids::ExperimentId;

/// The address of genotypes of an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    /// The experiment.
    pub experiment: ExperimentId,
    /// The genotypes within it.
    pub who: Who,
}

/// The genotypes that an address names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    /// `ID`: the champion.
    Champion,
    /// `ID@G`: all individuals of a generation, or the state of evolution after it.
    Generation(u64),
    /// `ID@G/I`: an individual, by its index.
    Individual(u64, u32),
    /// `ID@G/mean`: the mean of the distribution after a generation.
    Mean(u64),
    /// `ID@G/cell(A,B)`: the elite of a cell of the repertoire after a generation.
    Cell(u64, Cell),
}

/// A cell of a grid of descriptors, by its index on every axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    indices: [u32; limits::DESCRIPTORS],
    n_axes: usize,
}

impl Cell {
    /// The index on every axis.
    pub fn indices(&self) -> &[u32] {
        &self.indices[..self.n_axes]
    }

    /// The cell of these indices; `None` if there are none, or more than descriptors.
    pub fn new(indices: &[u32]) -> Option<Self> {
        let n_axes = indices.len();
        let mut all = [0; limits::DESCRIPTORS];
        all.get_mut(..n_axes).filter(|_| n_axes > 0)?.copy_from_slice(indices);
        Some(Self { indices: all, n_axes })
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let indices: Vec<String> = self.indices().iter().map(ToString::to_string).collect();
        write!(f, "cell({})", indices.join(","))
    }
}

/// The error for a text that is not an address.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not ID (the champion of experiment ID), ID@G (generation G), ID@G/I (its individual \
     I), ID@G/mean (the mean of the distribution after it) or 'ID@G/cell(A,B)' (an elite, in \
     quotes); all are numbers from 0"
)]
pub struct NotAnAddress(String);

impl FromStr for Address {
    type Err = NotAnAddress;

    fn from_str(text: &str) -> Result<Self, NotAnAddress> {
        parse(text).ok_or_else(|| NotAnAddress(text.chars().take(80).collect()))
    }
}

fn parse(text: &str) -> Option<Address> {
    // Parsing a `u64` would accept a sign.
    let number = |text: &str| -> Option<u64> {
        let is_number = text.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then(|| text.parse().ok()).flatten()
    };
    let (experiment, place) = match text.split_once('@') {
        Some((experiment, place)) => (experiment, Some(place)),
        None => (text, None),
    };
    let who = match place.map(|place| (place, place.split_once('/'))) {
        None => Who::Champion,
        Some((generation, None)) => Who::Generation(number(generation)?),
        Some((_, Some((generation, "mean")))) => Who::Mean(number(generation)?),
        Some((_, Some((generation, cell)))) if cell.starts_with("cell(") => {
            let indices = cell.strip_prefix("cell(")?.strip_suffix(')')?.split(',');
            let index = |text: &str| number(text)?.try_into().ok();
            let indices: Option<Vec<u32>> = indices.map(index).collect();
            Who::Cell(number(generation)?, Cell::new(&indices?)?)
        }
        Some((_, Some((generation, individual)))) => {
            Who::Individual(number(generation)?, number(individual)?.try_into().ok()?)
        }
    };
    Some(Address { experiment: ExperimentId(number(experiment)?), who })
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.experiment)?;
        match self.who {
            Who::Champion => Ok(()),
            Who::Generation(generation) => write!(f, "@{generation}"),
            Who::Individual(generation, individual) => write!(f, "@{generation}/{individual}"),
            Who::Mean(generation) => write!(f, "@{generation}/mean"),
            Who::Cell(generation, cell) => write!(f, "@{generation}/{cell}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_and_written_alike() {
        for (text, who) in [
            ("3", Who::Champion),
            ("3@0", Who::Generation(0)),
            ("3@12/7", Who::Individual(12, 7)),
            ("3@12/mean", Who::Mean(12)),
            ("3@12/cell(3,17)", Who::Cell(12, Cell::new(&[3, 17]).unwrap())),
            ("3@12/cell(0)", Who::Cell(12, Cell::new(&[0]).unwrap())),
            ("3@18446744073709551615/4294967295", Who::Individual(u64::MAX, u32::MAX)),
        ] {
            let address = Address { experiment: ExperimentId(3), who };
            assert_eq!(text.parse(), Ok(address));
            assert_eq!(address.to_string(), text);
        }
    }

    #[test]
    fn an_invalid_address_is_refused_in_one_line() {
        for text in [
            "",
            "@",
            "3@",
            "3@/",
            "3@1/",
            "@1",
            "-1",
            "+1",
            " 1",
            "1@-1",
            "1@1/+1",
            "1@1/Mean",
            "1@1/mean/",
            "1@1/2/3",
            "1@1/cell()",
            "1@1/cell(1",
            "1@1/cell(1,)",
            "1@1/cell(-1)",
            "1@1/cell(1,2,3,4,5,6,7,8,9)",
            "1@/cell(1)",
            "1@@1",
            "1/2",
            "1@1/4294967296",
            "18446744073709551616",
            "x",
            "é@1",
        ] {
            let error = text.parse::<Address>().unwrap_err().to_string();
            assert_eq!(error.lines().count(), 1, "{error}");
        }
        let long = "9".repeat(1000).parse::<Address>().unwrap_err();
        assert!(long.to_string().len() < 300);
    }
}
