//! Addresses of genotypes, with the number or the name of the experiment.

use std::{fmt, str::FromStr};

use model::{Address, NotAnAddress, Who, ids::ExperimentId};

use crate::subject::Subject;

/// A genotype of an experiment: `3@5/7`, or `leader@5/7`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedAddress {
    pub experiment: Subject,
    pub who: Who,
}

impl NamedAddress {
    /// The address in the experiment of that number.
    pub fn in_experiment(&self, experiment_id: u64) -> Address {
        Address { experiment: ExperimentId(experiment_id), who: self.who }
    }
}

impl FromStr for NamedAddress {
    type Err = NotAnAddress;

    fn from_str(text: &str) -> Result<Self, NotAnAddress> {
        let not_numbered = match text.parse::<Address>() {
            Ok(Address { experiment, who }) => {
                return Ok(Self { experiment: Subject::Experiment(experiment.0), who });
            }
            Err(error) => error,
        };
        let name_len = text.find('@').unwrap_or(text.len());
        let (name, place) = text.split_at(name_len);
        match name.parse() {
            Ok(experiment @ Subject::Group(_)) => {
                let Address { who, .. } = format!("0{place}").parse().map_err(|_| not_numbered)?;
                Ok(Self { experiment, who })
            }
            _ => Err(not_numbered),
        }
    }
}

impl fmt::Display for NamedAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The number is the first part.
        let numbered = self.in_experiment(0).to_string();
        write!(f, "{}{}", self.experiment, &numbered[1..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_experiment_has_its_number_or_its_name() {
        for text in ["3", "3@5/7", "leader", "leader@5", "leader_2@5/7", "größe@5/mean"] {
            let address: NamedAddress = text.parse().unwrap();
            assert_eq!(address.to_string(), text);
        }
        for wrong in ["", "@5", "leader@", "leader@x", "a.json", "a/b@5", "leader@5/", "3@x"] {
            wrong.parse::<NamedAddress>().unwrap_err();
        }
    }
}
