//! Commands that show experiments.

use super::{explain, history, list, watch};
use crate::remote::family;

family! {
    /// Commands that show experiments.
    Look {
        List(list::ListArgs),
        Watch(watch::WatchArgs),
        History(history::HistoryArgs),
        Explain(explain::ExplainArgs),
    }
}
