//! What the coordinator and its referee say to each other. Both ends are the same
//! release, so that nothing here has to stay compatible.

use prost::{Message, Oneof};
use sim_core::{Output, TrialSet};

use super::RefereeRequest;

/// Compiled specifications that the process keeps; the coordinator chooses which.
pub(super) const SLOTS: usize = 4;

/// Evaluate an item.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Request {
    /// Chosen by the coordinator; the answer repeats it.
    #[prost(uint64, tag = "1")]
    pub(super) id: u64,
    /// Where the compiled specification is, below [`SLOTS`].
    #[prost(uint32, tag = "2")]
    pub(super) slot: u32,
    /// Compile this into the slot first, in place of what was there.
    #[prost(string, optional, tag = "3")]
    pub(super) specification: Option<String>,
    #[prost(double, repeated, tag = "4")]
    pub(super) genotype: Vec<f64>,
    /// First trial.
    #[prost(uint32, tag = "5")]
    pub(super) trials_start: u32,
    /// The trial after the last one.
    #[prost(uint32, tag = "6")]
    pub(super) trials_end: u32,
    /// Whether the steps are to be measured, too.
    #[prost(bool, tag = "7")]
    pub(super) measures: bool,
    #[prost(oneof = "TrialSetCode", tags = "8, 9, 10, 11")]
    pub(super) trial_set: Option<TrialSetCode>,
}

/// A [`TrialSet`] on its way.
#[derive(Clone, Copy, PartialEq, Oneof)]
pub(super) enum TrialSetCode {
    #[prost(uint64, tag = "8")]
    Generation(u64),
    #[prost(message, tag = "9")]
    HeldOut(HeldOutCode),
    /// The value means nothing.
    #[prost(bool, tag = "10")]
    Evaluation(bool),
    #[prost(uint64, tag = "11")]
    Judgement(u64),
}

/// A block of held-out trials on its way.
#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct HeldOutCode {
    #[prost(uint64, tag = "1")]
    pub(super) generation: u64,
    #[prost(uint32, tag = "2")]
    pub(super) block: u32,
}

/// What the process says.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Answer {
    /// The request that this answers; 0 for [`Outcome::Ready`].
    #[prost(uint64, tag = "1")]
    pub(super) id: u64,
    #[prost(oneof = "Outcome", tags = "2, 3, 4, 5")]
    pub(super) outcome: Option<Outcome>,
}

#[derive(Clone, PartialEq, Oneof)]
pub(super) enum Outcome {
    /// Said once, at the start: the fingerprint of the process's simulation.
    #[prost(string, tag = "2")]
    Ready(String),
    #[prost(message, tag = "3")]
    Values(Values),
    /// Why the item cannot be computed.
    #[prost(string, tag = "4")]
    Failure(String),
    /// There are that many values, which no message holds.
    #[prost(uint64, tag = "5")]
    TooLarge(u64),
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct Values {
    #[prost(double, repeated, tag = "1")]
    pub(super) values: Vec<f64>,
}

impl Request {
    /// `specification`: only if the slot does not hold it yet.
    pub(super) fn new(
        id: u64,
        slot: u32,
        specification: Option<String>,
        request: &RefereeRequest,
    ) -> Self {
        let RefereeRequest { genotype, trial_set, trials, output, .. } = request;
        Self {
            id,
            slot,
            specification,
            genotype: genotype.to_vec(),
            trials_start: trials.start,
            trials_end: trials.end,
            measures: *output == Output::Measures,
            trial_set: Some(match *trial_set {
                TrialSet::Generation(generation) => TrialSetCode::Generation(generation),
                TrialSet::HeldOut { generation, block } => {
                    TrialSetCode::HeldOut(HeldOutCode { generation, block: block.into() })
                }
                TrialSet::Judgement(generation) => TrialSetCode::Judgement(generation),
                TrialSet::Evaluation => TrialSetCode::Evaluation(true),
            }),
        }
    }

    pub(super) fn output(&self) -> Output {
        if self.measures { Output::Measures } else { Output::Fitness }
    }

    pub(super) fn trial_set(&self) -> Option<TrialSet> {
        Some(match self.trial_set? {
            TrialSetCode::Generation(generation) => TrialSet::Generation(generation),
            TrialSetCode::HeldOut(HeldOutCode { generation, block }) => {
                TrialSet::HeldOut { generation, block: u8::try_from(block).ok()? }
            }
            TrialSetCode::Judgement(generation) => TrialSet::Judgement(generation),
            TrialSetCode::Evaluation(_) => TrialSet::Evaluation,
        })
    }
}
