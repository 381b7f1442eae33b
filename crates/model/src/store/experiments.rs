//! Reads rows of experiments, with their latest generation.

use rusqlite::{Connection, OptionalExtension, Row, params_from_iter, types::Value};

use crate::{group::Membership, ids::ExperimentId, priority::Priority};

use super::{
    ExperimentRecord, ExperimentState, ForkRecord, LogGap, StoreError, StoredExperiment, Summary,
    error::Result, history, labels,
};

/// Filters of a list of experiments, which must pass all of them.
#[derive(Debug, Clone, Default)]
pub struct Filter {
    /// In the group of this name; if there is no such group, experiments of this name.
    pub named: Option<String>,
    /// In one of these states; empty: in any.
    pub states: Vec<ExperimentState>,
    /// With all of these labels, each with any value or with the given one.
    pub labels: Vec<(String, Option<String>)>,
    /// Whether to leave out archived experiments.
    pub without_archived: bool,
    /// With this digest of the file.
    pub config_digest: Option<String>,
    /// With numbers larger than this one.
    pub after: u64,
    /// Most experiments to list, those with the smallest numbers; `None`: no limit.
    pub limit: Option<u32>,
}

impl Filter {
    /// The filter for experiments that have not ended.
    pub fn unfinished() -> Self {
        let states = vec![ExperimentState::Running, ExperimentState::Paused];
        Self { states, ..Self::default() }
    }

    /// The condition in SQL, and the values of its `?`.
    fn condition(&self) -> (String, Vec<Value>) {
        let (mut conditions, mut values) = (Vec::new(), Vec::<Value>::new());
        let mut add = |condition: String, of: Vec<Value>| {
            conditions.push(condition);
            values.extend(of);
        };
        if self.after > 0 {
            // SQLite's integers are signed.
            add("e.id > ?".into(), vec![i64::try_from(self.after).unwrap_or(i64::MAX).into()]);
        }
        if let Some(name) = &self.named {
            let condition = "(e.group_name = ? OR e.name = ? AND NOT EXISTS
                              (SELECT 1 FROM experiments WHERE group_name = ?))";
            add(condition.into(), vec![name.clone().into(); 3]);
        }
        if !self.states.is_empty() {
            let places = vec!["?"; self.states.len()].join(", ");
            let names = self.states.iter().map(|state| state.name().to_owned().into());
            add(format!("e.state IN ({places})"), names.collect());
        }
        for (key, value) in &self.labels {
            let of_label = "SELECT 1 FROM json_each(e.labels) WHERE key = ?";
            match value {
                None => add(format!("EXISTS ({of_label})"), vec![key.clone().into()]),
                Some(value) => {
                    let values = vec![key.clone().into(), value.clone().into()];
                    add(format!("EXISTS ({of_label} AND value = ?)"), values);
                }
            }
        }
        if self.without_archived {
            add("NOT e.archived".into(), Vec::new());
        }
        if let Some(digest) = &self.config_digest {
            add("e.config_digest = ?".into(), vec![digest.clone().into()]);
        }
        let condition = match conditions.is_empty() {
            true => "true".to_owned(),
            false => conditions.join(" AND "),
        };
        (condition, values)
    }
}

/// One experiment, with its file.
pub fn get(connection: &Connection, id: ExperimentId) -> Result<Option<StoredExperiment>> {
    if i64::try_from(id.0).is_err() {
        return Ok(None); // SQLite's integers are signed.
    }
    let sql = format!(
        "SELECT {COLUMNS}, (SELECT config FROM configs WHERE experiment_id = e.id) AS config
         FROM {TABLES} WHERE e.id = ?1"
    );
    let mut statement = connection.prepare_cached(&sql)?;
    let stored = statement.query_row([id.0], |row| Ok((read(row)?, row.get("config")?)));
    let Some((record, config_json)) = stored.optional()? else { return Ok(None) };
    let lost = || StoreError::Corrupt(format!("experiment {id} has lost its configuration"));
    let config_json: Option<String> = config_json;
    Ok(Some(StoredExperiment { record: record?, config_json: config_json.ok_or_else(lost)? }))
}

/// The experiments that pass a filter, oldest first.
pub fn list(connection: &Connection, filter: &Filter) -> Result<Vec<ExperimentRecord>> {
    let (condition, values) = filter.condition();
    let limit = filter.limit.map_or(-1, i64::from);
    let sql =
        format!("SELECT {COLUMNS} FROM {TABLES} WHERE {condition} ORDER BY e.id LIMIT {limit}");
    let mut statement = connection.prepare_cached(&sql)?;
    let rows = statement.query_map(params_from_iter(values), read)?;
    rows.map(|row| row?).collect()
}

const COLUMNS: &str =
    "e.id, e.name, e.config_digest, e.fingerprint, e.genotype_len, e.state, e.reason,
     e.submitted_at_ms, e.digest, c.held_out_mean, c.judged_mean,
     g.generation, g.best, g.mean, g.min, g.standard_deviation, g.digest,
     g.duration_ms, g.episodes, g.workers, g.idle_share, e.priority,
     (SELECT max(sequence) FROM events WHERE experiment_id = e.id),
     e.group_name, e.variant, e.log_from, e.log_gap,
     f.parent_id, f.generation, f.link, f.changes, e.labels, e.archived,
     CASE WHEN e.state IN ('running', 'paused') THEN
         (SELECT avg(r.duration_ms) FROM generations r
          WHERE r.experiment_id = e.id AND r.generation > g.generation - 10) END,
     e.summary";

const TABLES: &str = "experiments e
     LEFT JOIN forks f ON f.experiment_id = e.id
     LEFT JOIN champions c ON c.experiment_id = e.id
     LEFT JOIN generations g ON g.experiment_id = e.id AND g.generation =
               (SELECT max(generation) FROM generations WHERE experiment_id = e.id)";

fn read(row: &Row<'_>) -> rusqlite::Result<Result<ExperimentRecord>> {
    let id = ExperimentId(row.get(0)?);
    let state: String = row.get(5)?;
    let Some(state) = ExperimentState::from_name(&state) else {
        return Ok(Err(StoreError::Corrupt(format!("experiment {id} has state \"{state}\""))));
    };
    let Some(priority) = Priority::new(row.get(21)?) else {
        return Ok(Err(StoreError::Corrupt(format!("experiment {id} has no valid priority"))));
    };
    let log_gap: String = row.get(26)?;
    let Some(log_gap) = LogGap::from_name(&log_gap) else {
        let what = format!("experiment {id} has a log without \"{log_gap}\"");
        return Ok(Err(StoreError::Corrupt(what)));
    };
    Ok(Ok(ExperimentRecord {
        id,
        name: row.get(1)?,
        summary: Summary::from_column(row.get_ref(34)?.as_str_or_null()?),
        config_digest: row.get(2)?,
        fingerprint: row.get(3)?,
        genotype_len: row.get(4)?,
        state,
        reason: row.get(6)?,
        submitted_at_ms: row.get(7)?,
        digest: row.get(8)?,
        held_out_fitness: row.get(9)?,
        judged_fitness: row.get(10)?,
        latest: history::read_generation(row, 11)?,
        priority,
        last_sequence: row.get::<_, Option<u64>>(22)?.unwrap_or_default(),
        membership: membership(row.get(23)?, row.get(24)?),
        labels: labels::from_json(&row.get::<_, String>(31)?),
        is_archived: row.get(32)?,
        recent_generation_ms: row.get(33)?,
        log_from: row.get(25)?,
        log_gap,
        fork: match row.get(27)? {
            Some(parent) => Some(ForkRecord {
                parent: ExperimentId(parent),
                generation: row.get(28)?,
                link: row.get(29)?,
                changes: serde_json::from_str(row.get_ref(30)?.as_str()?).unwrap_or_default(),
            }),
            None => None,
        },
    }))
}

/// The membership in a row.
fn membership(group: Option<String>, variant: Option<String>) -> Option<Membership> {
    group.map(|group| Membership { group, variant: variant.unwrap_or_default() })
}

#[cfg(test)]
mod tests {
    use crate::{
        labels::Labels,
        store::{Store, tests::new_experiment},
    };

    use super::*;

    /// Runs named a, b, b, a; the last three in the groups b, b and c; the first one ended, the
    /// second one archived, the third one paused.
    fn store() -> (tempfile::TempDir, Store) {
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let runs = [
            ("a", None, "ada"),
            ("b", Some("b"), "eve"),
            ("x", Some("b"), "ada"),
            ("a", Some("c"), "eve"),
        ];
        for (name, group, user) in runs {
            let mut new = new_experiment(None);
            new.config.name = name.to_owned();
            new.membership =
                group.map(|group| Membership { group: group.into(), variant: String::new() });
            new.labels = Labels::from([
                ("user".to_owned(), user.to_owned()),
                ("a b".to_owned(), String::new()),
            ]);
            store.create(&new, 0).unwrap();
        }
        for id in [1, 2] {
            store.set_state(ExperimentId(id), 1, ExperimentState::Cancelled, "").unwrap();
        }
        store.set_archived(ExperimentId(2), true).unwrap();
        store.set_state(ExperimentId(3), 1, ExperimentState::Paused, "").unwrap();
        (directory, store)
    }

    fn ids(store: &Store, filter: Filter) -> Vec<u64> {
        store.experiments(&filter).unwrap().iter().map(|found| found.id.0).collect()
    }

    #[test]
    fn a_name_means_a_group_or_else_experiments() {
        let (_directory, store) = store();
        let named =
            |name: &str| ids(&store, Filter { named: Some(name.into()), ..Filter::default() });
        assert_eq!(named("a"), [1, 4]);
        assert_eq!(named("b"), [2, 3]);
        assert_eq!(named("c"), [4]);
        assert_eq!(named("x"), [3]);
        assert_eq!(named("?"), [0_u64; 0]);
    }

    #[test]
    fn experiments_have_to_pass_all_filters() {
        let (_directory, store) = store();
        let all = Filter::default;
        assert_eq!(ids(&store, all()), [1, 2, 3, 4]);
        assert_eq!(ids(&store, Filter::unfinished()), [3, 4]);
        assert_eq!(ids(&store, Filter { without_archived: true, ..all() }), [1, 3, 4]);
        let label =
            |key: &str, value: Option<&str>| vec![(key.to_owned(), value.map(str::to_owned))];
        assert_eq!(ids(&store, Filter { labels: label("user", None), ..all() }), [1, 2, 3, 4]);
        assert_eq!(ids(&store, Filter { labels: label("a b", Some("")), ..all() }), [1, 2, 3, 4]);
        let of_ada = || label("user", Some("ada"));
        assert_eq!(ids(&store, Filter { labels: of_ada(), ..all() }), [1, 3]);
        assert_eq!(ids(&store, Filter { labels: of_ada(), ..Filter::unfinished() }), [3]);
        assert_eq!(ids(&store, Filter { labels: label("us%", None), ..all() }), [0_u64; 0]);
        assert_eq!(ids(&store, Filter { after: 2, ..all() }), [3, 4]);
        assert_eq!(ids(&store, Filter { after: 1, limit: Some(2), ..all() }), [2, 3]);
        assert_eq!(ids(&store, Filter { after: u64::MAX, ..all() }), [0_u64; 0]);
        let config_digest = Some(store.experiments(&all()).unwrap()[0].config_digest.clone());
        assert_eq!(ids(&store, Filter { config_digest, ..all() }), [1, 2, 3, 4]);
        let config_digest = Some("0".to_owned());
        assert_eq!(ids(&store, Filter { config_digest, ..all() }), [0_u64; 0]);
    }
}
