//! The referee's process: requests from standard input, answers to standard output.

use std::{
    array, fs,
    io::{self, Write},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
        mpsc::{self, Receiver},
    },
    thread,
};

use sim_core::{Isa, SpecifiedSimulation, panic_to_failure};

use super::{
    framing::{self, invalid},
    messages::{Answer, Outcome, Request, SLOTS, Values},
};

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
        let mut input = io::stdin().lock();
        loop {
            let request = framing::read(&mut input);
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

/// A compiled specification, or why there is none.
type Compiled = Result<SpecifiedSimulation, String>;

/// Computes and answers, one request at a time.
fn answer(
    requests: &Receiver<io::Result<Option<Request>>>,
    output: &mut impl Write,
    is_over: &AtomicBool,
) -> io::Result<()> {
    send(output, 0, Outcome::Ready(sim_core::FINGERPRINT.into()))?;
    let mut slots: [Option<Compiled>; SLOTS] = array::from_fn(|_| None);
    while let Some(request) = requests.recv().map_err(io::Error::other)?? {
        let id = request.id;
        // None: it was stopped, and the reason is what arrives next.
        if let Some(outcome) = evaluate(request, &mut slots, is_over)? {
            send(output, id, outcome)?;
        }
    }
    Ok(())
}

fn evaluate(
    mut request: Request,
    slots: &mut [Option<Compiled>],
    is_over: &AtomicBool,
) -> io::Result<Option<Outcome>> {
    let slot = slots
        .get_mut(request.slot as usize)
        .ok_or_else(|| invalid(format!("there is no slot {}", request.slot)))?;
    if let Some(text) = request.specification.take() {
        // First, so that there are never more than the slots hold.
        *slot = None;
        *slot = Some(panic_to_failure(|| SpecifiedSimulation::compile(&text, Isa::best())));
    }
    let simulation = match slot {
        Some(Ok(simulation)) => simulation,
        Some(Err(failure)) => return Ok(Some(Outcome::Failure(failure.clone()))),
        None => return Err(invalid(format!("nothing is in slot {}", request.slot))),
    };
    let trial_set = request.trial_set().ok_or_else(|| invalid("no trial set".into()))?;
    let (trials, output) = (request.trials_start..request.trials_end, request.output());
    let keep_going = || !is_over.load(Relaxed);
    let computed = panic_to_failure(|| {
        simulation.compute(&request.genotype, trial_set, trials, output, &keep_going)
    });
    Ok(match computed {
        Ok(Some(values)) => Some(Outcome::Values(Values { values })),
        Ok(None) => None,
        Err(failure) => Some(Outcome::Failure(failure)),
    })
}

fn send(output: &mut impl Write, id: u64, outcome: Outcome) -> io::Result<()> {
    let answer = Answer { id, outcome: Some(outcome) };
    let frame = framing::encode(&answer).or_else(|_| {
        let n_values = match &answer.outcome {
            Some(Outcome::Values(Values { values })) => values.len() as u64,
            _ => 0,
        };
        let answer = Answer { id, outcome: Some(Outcome::TooLarge(n_values)) };
        framing::encode(&answer).map_err(|_| invalid("an answer is too long".into()))
    })?;
    framing::write(output, &frame)
}
