//! The referee's process: a worker that talks to its coordinator through standard input and
//! output.

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Read, Write},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
        mpsc::{self, Receiver},
    },
    thread,
};

use prost::Message as _;
use sim_core::{Isa, Output, SpecifiedSimulation, panic_to_failure};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{self, item_result::Outcome, work_request, work_response::Message},
};

use super::stream::{Arrived, invalid};
use crate::{codec, ids::JobId};

/// Answers requests until standard input ends, then stops computing and returns.
///
/// # Errors
///
/// If the input contains an invalid request, or if the output is closed.
pub fn serve_stdio() -> io::Result<()> {
    // If memory runs out, the system should kill this process and not the coordinator. Other
    // systems have no such file, and work without it.
    let _ = fs::write("/proc/self/oom_score_adj", "1000");
    // The name in `ps` and `top`.
    let _ = fs::write("/proc/self/comm", "swarm-referee");
    let is_over = Arc::new(AtomicBool::new(false));
    let (sender, requests) = mpsc::sync_channel(1);
    let over = Arc::clone(&is_over);
    // Reads during a computation, to notice when the coordinator goes away.
    thread::Builder::new().name("requests".into()).spawn(move || {
        let (mut input, mut arrived) = (io::stdin().lock(), Arrived::default());
        loop {
            let request = read(&mut input, &mut arrived);
            let is_last = !matches!(request, Ok(Some(_)));
            over.fetch_or(is_last, Relaxed);
            if sender.send(request).is_err() || is_last {
                return;
            }
        }
    })?;
    // A slot of a worker has a stack of this size, unlike a main thread. So too deep a recursion
    // fails in both programs.
    let computing = thread::Builder::new()
        .name("slot-0".into())
        .spawn(move || answer(&requests, &mut io::stdout(), &is_over))?;
    computing.join().unwrap_or_else(|_| Err(io::Error::other("answering panicked")))
}

/// The next message; `None` if the stream has ended.
fn read(input: &mut impl Read, arrived: &mut Arrived) -> io::Result<Option<v1::WorkResponse>> {
    let mut bytes = [0; 1 << 16];
    loop {
        if let Some(message) = arrived.take()? {
            return Ok(Some(message));
        }
        match input.read(&mut bytes)? {
            0 => return arrived.end().map(|()| None),
            n_read => arrived.0.extend(&bytes[..n_read]),
        }
    }
}

/// The compiled specifications of jobs, or why they do not compile.
type Jobs = BTreeMap<JobId, Result<SpecifiedSimulation, String>>;

/// Computes and answers, one item at a time.
fn answer(
    requests: &Receiver<io::Result<Option<v1::WorkResponse>>>,
    output: &mut impl Write,
    is_over: &AtomicBool,
) -> io::Result<()> {
    let hello = v1::Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.into(),
        slots: 1,
        ..v1::Hello::default()
    };
    say(output, work_request::Message::Hello(hello))?;
    let mut jobs = Jobs::new();
    let read_job = |job| codec::read_job(job).ok_or_else(|| invalid("a message names no job"));
    while let Some(request) = requests.recv().map_err(io::Error::other)?? {
        match request.message {
            Some(Message::Spec(v1::JobSpec { job, config_json })) => {
                let compile = || SpecifiedSimulation::compile(&config_json, Isa::best());
                jobs.insert(read_job(job)?, panic_to_failure(compile));
            }
            Some(Message::EndJob(v1::EndJob { job })) => {
                jobs.remove(&read_job(job)?);
            }
            Some(Message::Assignments(assignments)) => {
                let job = jobs.get(&read_job(assignments.job)?);
                let job = job.ok_or_else(|| invalid("a job has no specification"))?;
                for result in compute(job, assignments, is_over)? {
                    let results = v1::ItemResults { results: vec![result] };
                    say(output, work_request::Message::Results(results))?;
                }
            }
            _ => return Err(invalid("the message is of a kind that a referee does not handle")),
        }
    }
    Ok(())
}

/// The results of assignments of a job; `None` if the computation was stopped; the next event
/// says why.
fn compute(
    job: &Result<SpecifiedSimulation, String>,
    assignments: v1::Assignments,
    is_over: &AtomicBool,
) -> io::Result<impl Iterator<Item = v1::ItemResult>> {
    let trial_set = codec::read_trial_set(assignments.trial_set).map_err(invalid)?;
    let output = codec::read_output(assignments.output());
    let output = output.ok_or_else(|| invalid("the assignment names no output"))?;
    Ok(assignments.assignments.into_iter().map_while(move |assignment| {
        let v1::Assignment { assignment_id, first_trial, trial_count, genotype, .. } = assignment;
        let trials = first_trial..first_trial.saturating_add(trial_count);
        let keep_going = || !is_over.load(Relaxed);
        let computed = job.as_ref().map_err(String::clone).and_then(|job| {
            panic_to_failure(|| job.compute(&genotype, trial_set, trials, output, &keep_going))
        });
        let outcome = match (computed.transpose()?, output) {
            (Ok(values), Output::Fitness) => Outcome::Fitness(v1::TrialFitness { values }),
            (Ok(values), Output::Measures) => Outcome::Measures(v1::TrialMeasures { values }),
            (Ok(values), Output::Descriptors) => {
                Outcome::Descriptors(v1::TrialDescriptors { values })
            }
            (Err(message), _) => Outcome::Failure(v1::ItemFailure { message }),
        };
        Some(v1::ItemResult { assignment_id, outcome: Some(outcome), compute_us: 0 })
    }))
}

fn say(output: &mut impl Write, message: work_request::Message) -> io::Result<()> {
    let message = v1::WorkRequest { message: Some(message) };
    output.write_all(&message.encode_length_delimited_to_vec())?;
    output.flush()
}

#[cfg(test)]
mod tests {
    use sim_core::TrialSet;

    use super::*;
    use crate::ids::EvaluationId;

    #[test]
    fn a_job_that_has_ended_is_forgotten() {
        let job = || Some(codec::job(EvaluationId(1).into()));
        // It does not compile, and an item of it fails.
        let spec = || Message::Spec(v1::JobSpec { job: job(), config_json: String::new() });
        let item = || {
            Message::Assignments(v1::Assignments {
                job: job(),
                trial_set: Some(codec::trial_set(TrialSet::Evaluation)),
                output: v1::Output::Fitness.into(),
                assignments: vec![v1::Assignment::default()],
            })
        };
        let end = || Message::EndJob(v1::EndJob { job: job() });
        let answer = |messages: Vec<Message>| {
            let (sender, requests) = mpsc::channel();
            for message in messages {
                sender.send(Ok(Some(v1::WorkResponse { message: Some(message) }))).unwrap();
            }
            sender.send(Ok(None)).unwrap();
            let mut output = Vec::new();
            answer(&requests, &mut output, &AtomicBool::new(false)).map(|()| output.len())
        };
        let n_bytes = answer(vec![end(), spec(), item()]).unwrap();
        assert!(answer(vec![spec(), item(), end(), spec(), item()]).unwrap() > n_bytes);
        let error = answer(vec![spec(), item(), end(), item()]).unwrap_err();
        assert_eq!(error.to_string(), "a job has no specification");
    }
}
