//! The fleet of a page, treated badly through the messages of a page.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::{Session, message};

/// The digest of this experiment on every fleet, as the first run of the manual prints it.
const DIGEST: &str = "c11a2917b82381af1a41371a42c3911ac5021fcc9648ee67041e4e9f52290003";

/// A page's view of the fleets.
struct Page {
    session: Session,
    report: Value,
    events: Vec<Value>,
}

impl Page {
    fn open(audits: f64) -> Self {
        let mut page =
            Self { session: Session::default(), report: Value::Null, events: Vec::new() };
        let begun = page.call(&json!({"call": "begin-fleets", "audits": audits}));
        assert_eq!(begun["workers"].as_array().unwrap().len(), 20);
        page.keep(begun["report"].clone());
        page
    }

    fn call(&mut self, request: &Value) -> Value {
        let answer = self.session.answer(&message::write(request, &[]));
        message::read::<Value>(&answer).unwrap().0
    }

    fn keep(&mut self, report: Value) {
        assert!(report.get("error").is_none(), "{report}");
        self.events.extend(report["events"].as_array().unwrap().iter().cloned());
        self.report = report;
    }

    fn treat(&mut self, worker: usize, health: &str) {
        let report = self.call(&json!({"call": "treat", "worker": worker, "health": health}));
        self.keep(report);
    }

    fn advance(&mut self, ms: f64) {
        let report = self.call(&json!({"call": "advance", "ms": ms}));
        self.keep(report);
    }

    fn advance_until(&mut self, is_met: impl Fn(&Self) -> bool) {
        for _ in 0..20_000 {
            if is_met(self) {
                return;
            }
            self.advance(500.0);
        }
        panic!("it does not happen: {}", self.report);
    }

    fn links(&self, run: &str) -> &[Value] {
        self.report[run]["links"].as_array().unwrap()
    }

    fn is_over(&self) -> bool {
        ["disturbed", "undisturbed"].iter().all(|run| self.report[run]["over_at"].is_number())
    }

    /// The workers that events of this kind name.
    fn told_of(&self, what: &str) -> Vec<u64> {
        let events = self.events.iter().filter(|event| event["what"] == what);
        events.map(|event| event["worker"].as_u64().unwrap()).collect()
    }
}

#[test]
fn kills_hangs_slowness_and_lies_move_no_bit_of_the_digest_of_every_other_fleet() {
    let mut page = Page::open(1.0);
    for (round, health) in ["killed", "hung", "slow", "lying"].iter().cycle().take(16).enumerate() {
        for worker in [round, (7 * round + 3) % 20] {
            page.treat(worker, health);
        }
        page.advance_until(|page| page.links("disturbed").len() > round);
        page.treat((3 * round + 1) % 20, "healthy");
    }
    for worker in 0..20 {
        page.treat(worker, "healthy");
    }
    page.advance_until(Page::is_over);
    assert_eq!(page.links("disturbed"), page.links("undisturbed"));
    let last = page.links("disturbed").last().unwrap();
    assert_eq!((&last["digest"], &last["is_last"]), (&json!(DIGEST), &json!(true)));
    let over = |run: &str| page.report[run]["over_at"].as_f64().unwrap();
    assert!(over("disturbed") > over("undisturbed"), "trouble costs time");
    assert!(!page.told_of("given-up").is_empty(), "no hung worker was given up");
}

#[test]
fn a_liar_is_quarantined_by_name_and_nobody_else_and_works_again_once_it_is_mended() {
    let mut page = Page::open(1.0);
    page.treat(4, "lying");
    page.advance_until(|page| !page.told_of("quarantined").is_empty());
    page.advance(5_000.0);
    assert_eq!(page.told_of("quarantined"), [4]);
    let worker = &page.report["workers"][4];
    assert!(worker["quarantined"].as_str().unwrap().contains("and the referee"), "{worker}");
    assert_eq!(worker["n_items"], 0);
    page.treat(4, "healthy");
    page.advance_until(|page| page.report["workers"][4]["n_items"] != 0);
    assert!(page.report["workers"][4]["quarantined"].is_null());
}

#[test]
fn without_audits_a_lie_changes_the_digest() {
    let mut page = Page::open(0.0);
    page.treat(4, "lying");
    page.advance_until(|page| page.links("disturbed").len() > 2);
    let n = page.links("disturbed").len().min(page.links("undisturbed").len());
    assert_ne!(page.links("disturbed")[..n], page.links("undisturbed")[..n]);
    assert!(page.told_of("quarantined").is_empty());
}

#[test]
fn a_fleet_whose_workers_are_all_killed_waits_and_goes_on() {
    let mut page = Page::open(1.0);
    page.advance_until(|page| page.links("disturbed").len() == 1);
    for worker in 0..20 {
        page.treat(worker, "killed");
    }
    page.advance(60_000.0);
    page.advance(60_000.0);
    assert_eq!(page.links("disturbed").len(), 1);
    for worker in 0..20 {
        page.treat(worker, "healthy");
    }
    page.advance_until(|page| page.links("disturbed").len() == 3);
    assert_eq!(page.links("disturbed"), &page.links("undisturbed")[..3]);
}

#[test]
fn items_have_an_end() {
    let mut page = Page::open(1.0);
    page.advance_until(|page| page.links("disturbed").len() == 4);
    let count = |what: &str| page.events.iter().filter(|event| event["what"] == what).count();
    assert!(count("sent") >= count("arrived") + count("dropped"), "{}", count("sent"));
    assert!(count("sent") - count("arrived") - count("dropped") <= 40);
    assert!(count("began") >= count("returned") && count("returned") >= count("arrived"));
    let rounds: Vec<&[Value]> = page.events.split(|event| event["what"] == "round").collect();
    for round in &rounds[1..5] {
        let trials = |purpose: &str| {
            let sent = round.iter().filter(|event| event["purpose"] == purpose);
            let trials = sent.flat_map(|event| {
                let [individual, first, end] =
                    ["individual", "first", "end"].map(|key| event[key].as_u64().unwrap());
                (first..end).map(move |trial| (individual, trial))
            });
            trials.collect::<BTreeSet<(u64, u64)>>().len()
        };
        assert_eq!((trials("item"), trials("audit")), (96, 96), "each trial is audited");
    }
    for worker in 0..20 {
        page.treat(worker, "killed");
    }
    assert_eq!(page.report["n_audits"], 0, "killed workers have none");
}

#[test]
fn senseless_requests_are_refused() {
    let mut session = Session::default();
    let mut page = Page::open(1.0);
    let refused = [
        json!({"call": "advance", "ms": -1.0}),
        json!({"call": "advance", "ms": 1e300}),
        json!({"call": "treat", "worker": 20, "health": "slow"}),
        json!({"call": "treat", "worker": 0, "health": "merry"}),
    ];
    for request in &refused {
        let answer = page.call(request);
        assert!(answer["error"].is_string(), "{request}: {answer}");
        let answer = session.answer(&message::write(request, &[]));
        assert!(message::read::<Value>(&answer).unwrap().0["error"].is_string(), "{request}");
    }
    // As long as a page may sleep; a call computes only so much of it.
    page.advance(1e9);
    assert!(page.report["now"].as_f64().unwrap() <= 60_000.0);
}
