//! Converts jobs, trial sets and outputs between core types and messages of coordinator and
//! workers.

use experiment_file::limits;
use sim_core::{Output, TrialSet};
use swarm_proto::v1::{self, job_id::Job, trial_set};

use crate::ids::{EvaluationId, ExperimentId, JobId};

/// Converts a job's id to a message.
pub fn job(id: JobId) -> v1::JobId {
    let job = match id {
        JobId::Experiment(id) => Job::Experiment(id.0),
        JobId::Evaluation(id) => Job::Evaluation(id.0),
    };
    v1::JobId { job: Some(job) }
}

/// Reads a job's id; `None` if this version does not know its kind.
pub fn read_job(job: Option<v1::JobId>) -> Option<JobId> {
    Some(match job?.job? {
        Job::Experiment(id) => ExperimentId(id).into(),
        Job::Evaluation(id) => EvaluationId(id).into(),
    })
}

/// Converts a trial set to a message.
pub fn trial_set(set: TrialSet) -> v1::TrialSet {
    let set = match set {
        TrialSet::Generation(generation) => trial_set::TrialSet::Generation(generation),
        TrialSet::HeldOut { generation, block } => {
            let block = block.into();
            trial_set::TrialSet::HeldOut(v1::HeldOutTrials { generation, block })
        }
        TrialSet::Judgement(generation) => trial_set::TrialSet::Judgement(generation),
        TrialSet::Evaluation => trial_set::TrialSet::Evaluation(v1::EvaluationTrials {}),
    };
    v1::TrialSet { trial_set: Some(set) }
}

/// Reads a trial set, or describes the mistake in it, because the sender is not trusted.
pub fn read_trial_set(set: Option<v1::TrialSet>) -> Result<TrialSet, String> {
    let set = set.and_then(|set| set.trial_set).ok_or("the assignment names no trial set")?;
    let set = match set {
        trial_set::TrialSet::Generation(generation) => TrialSet::Generation(generation),
        trial_set::TrialSet::HeldOut(v1::HeldOutTrials { generation, block }) => {
            let block = u8::try_from(block).map_err(|_| format!("there is no block {block}"))?;
            TrialSet::HeldOut { generation, block }
        }
        trial_set::TrialSet::Judgement(generation) => TrialSet::Judgement(generation),
        trial_set::TrialSet::Evaluation(_) => TrialSet::Evaluation,
    };
    match set.generation() {
        Some(generation) if generation > limits::GENERATIONS => {
            Err(format!("there is no generation {generation}"))
        }
        _ => Ok(set),
    }
}

/// Converts the kind of result for a trial to a message.
pub fn output(output: Output) -> v1::Output {
    match output {
        Output::Fitness => v1::Output::Fitness,
        Output::Measures => v1::Output::Measures,
        Output::Descriptors => v1::Output::Descriptors,
    }
}

/// Reads the kind of result for a trial; `None` if this version does not know it.
pub fn read_output(output: v1::Output) -> Option<Output> {
    match output {
        v1::Output::Fitness => Some(Output::Fitness),
        v1::Output::Measures => Some(Output::Measures),
        v1::Output::Descriptors => Some(Output::Descriptors),
        v1::Output::Unspecified => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_message_reads_back() {
        let jobs = [JobId::from(ExperimentId(u64::MAX)), EvaluationId(0).into()];
        for id in jobs {
            assert_eq!(read_job(Some(job(id))), Some(id));
        }
        for set in [
            TrialSet::Generation(limits::GENERATIONS),
            TrialSet::HeldOut { generation: 7, block: u8::MAX },
            TrialSet::Judgement(0),
            TrialSet::Evaluation,
        ] {
            assert_eq!(read_trial_set(Some(trial_set(set))), Ok(set));
        }
        for wanted in [Output::Fitness, Output::Measures, Output::Descriptors] {
            assert_eq!(read_output(output(wanted)), Some(wanted));
        }
        assert_eq!(read_output(v1::Output::Unspecified), None);
    }

    #[test]
    fn an_invalid_trial_set_is_refused() {
        let beyond = limits::GENERATIONS + 1;
        let beyond = [
            TrialSet::Generation(beyond),
            TrialSet::HeldOut { generation: beyond, block: 0 },
            TrialSet::Judgement(beyond),
        ];
        for set in beyond {
            assert!(read_trial_set(Some(trial_set(set))).unwrap_err().contains("no generation"));
        }
        let block = v1::HeldOutTrials { generation: 0, block: 256 };
        let block = v1::TrialSet { trial_set: Some(trial_set::TrialSet::HeldOut(block)) };
        assert_eq!(read_trial_set(Some(block)).unwrap_err(), "there is no block 256");
        read_trial_set(None).unwrap_err();
        read_trial_set(Some(v1::TrialSet { trial_set: None })).unwrap_err();
        assert_eq!(read_job(Some(v1::JobId { job: None })), None);
    }
}
