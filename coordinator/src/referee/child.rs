//! The referee's process: a worker whose coordinator is at its standard input and output.

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

/// Answers requests until standard input ends, then stops computing and returns. Fails
/// if what arrives is no request, or if nobody reads the answers.
pub fn serve_stdio() -> io::Result<()> {
    // Where there is no such file, as on other systems, all goes well without. First:
    // if memory runs out, this process is to go and not the coordinator.
    let _ = fs::write("/proc/self/oom_score_adj", "1000");
    // What `ps` and `top` call it.
    let _ = fs::write("/proc/self/comm", "swarm-referee");
    let is_over = Arc::new(AtomicBool::new(false));
    let (sender, requests) = mpsc::sync_channel(1);
    let over = Arc::clone(&is_over);
    // Reads while an item is computed, and so finds out that nobody waits for it.
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
    // Has a stack of the size of a worker's slots, not of a main thread: an item whose
    // recursion is too deep for one is too deep for the other.
    let computing = thread::Builder::new()
        .name("slot-0".into())
        .spawn(move || answer(&requests, &mut io::stdout(), &is_over))?;
    computing.join().unwrap_or_else(|_| Err(io::Error::other("answering panicked")))
}

/// The next message; none if the stream ends before it.
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

/// The compiled specifications of jobs, or why there is none.
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
            _ => return Err(invalid("a message is none for a referee")),
        }
    }
    Ok(())
}

/// The results of assignments of a job; none after it was stopped, and the reason is what arrives
/// next.
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
