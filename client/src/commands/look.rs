//! Commands that look at experiments.

use super::{explain, history, list, watch};
use crate::remote::family;

family! {
    /// Looks at experiments.
    Look {
        List(list::ListArgs),
        Watch(watch::WatchArgs),
        History(history::HistoryArgs),
        Explain(explain::ExplainArgs),
    }
}
