//! Merges the events of many experiments in the order of time, with one page of each
//! in memory.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, VecDeque},
};

use swarm_proto::v1::{Event, Experiment};

use crate::{connection::Connection, error::Error};

/// The events to print, up to the last event of each experiment that was known at the
/// start.
pub struct Merge<'a> {
    connection: &'a Connection,
    sources: Vec<Source<'a>>,
    /// Time of the next event of each source that has one, and index of the source. Within a
    /// millisecond, events of the older experiment come first.
    heads: BinaryHeap<Reverse<(u64, usize)>>,
    is_begun: bool,
}

struct Source<'a> {
    experiment: &'a Experiment,
    page: VecDeque<Event>,
    /// Sequence number of the first event that is not in `page` yet.
    next_sequence: u64,
    /// The time of the previous event: the coordinator's clock may have been set back,
    /// but an experiment's events keep their order.
    latest_ms: u64,
}

impl<'a> Merge<'a> {
    /// Merges events of experiments, each from its sequence number on.
    pub fn new(connection: &'a Connection, from: Vec<(&'a Experiment, u64)>) -> Self {
        let source = |(experiment, next_sequence)| Source {
            experiment,
            page: VecDeque::new(),
            next_sequence,
            latest_ms: 0,
        };
        let sources = from.into_iter().map(source).collect();
        Self { connection, sources, heads: BinaryHeap::new(), is_begun: false }
    }

    /// The next event; none at the end.
    pub async fn next(&mut self) -> Result<Option<(&'a Experiment, Event)>, Error> {
        if !self.is_begun {
            self.is_begun = true;
            for index in 0..self.sources.len() {
                self.push_head(index).await?;
            }
        }
        let Some(Reverse((_, index))) = self.heads.pop() else { return Ok(None) };
        let source = &mut self.sources[index];
        let event = source.page.pop_front().expect("a source with a head has an event");
        let experiment = source.experiment;
        self.push_head(index).await?;
        Ok(Some((experiment, event)))
    }

    async fn push_head(&mut self, index: usize) -> Result<(), Error> {
        let source = &mut self.sources[index];
        let last_sequence = source.experiment.last_sequence;
        if source.page.is_empty() && source.next_sequence <= last_sequence {
            let id = source.experiment.id;
            source.page = self.connection.events_page(id, source.next_sequence).await?.into();
            source.page.retain(|event| event.sequence <= last_sequence);
            source.next_sequence =
                source.page.back().map_or(last_sequence, |event| event.sequence) + 1;
        }
        if let Some(event) = source.page.front() {
            source.latest_ms = source.latest_ms.max(event.at_ms);
            self.heads.push(Reverse((source.latest_ms, index)));
        }
        Ok(())
    }
}
