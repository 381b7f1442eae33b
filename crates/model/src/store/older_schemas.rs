//! Reads databases of older versions as if they had the latest one.

use rusqlite::Connection;

use super::schema::{SEALED, summary};

/// The first version with steps of checkpoints.
const WITH_STEPS: i64 = 5;

/// The first version with judged champions.
const JUDGED: i64 = 6;

/// The first version with groups.
const GROUPS: i64 = 7;

/// The first version with a fitness log.
const LOGGED: i64 = 8;

/// The first version with forks.
const FORKS: i64 = 9;

/// The first version with labels and an archive.
const LABELS: i64 = 10;

/// The first version with summaries.
const SUMMARIES: i64 = 11;

/// The first version with configurations in a table of their own.
const CONFIGS: i64 = 13;

/// Makes a database of an older version readable as if it had the latest one, without changing
/// it. Missing seals are empty.
pub fn read_as_latest(connection: &Connection, version: i64) -> rusqlite::Result<()> {
    // The views are in the temporary schema, in which SQLite looks names up first.
    let if_before = |first, columns: &str| match version < first {
        true => columns.to_owned(),
        false => String::new(),
    };
    let seal = if_before(SEALED, ", x'' AS seal");
    let mut views = vec![
        ("generations", format!("*{seal} FROM main.generations")),
        ("champions", {
            let judged = ", NULL AS judged_mean, NULL AS judged_low, NULL AS judged_high,
                            NULL AS judged_trials, NULL AS judged_generation";
            format!("*{}{seal} FROM main.champions", if_before(JUDGED, judged))
        }),
    ];
    if version < LOGGED {
        let steps = match version < WITH_STEPS {
            true => {
                "(SELECT 0 AS experiment_id, 0 AS generation, x'' AS step, x'' AS seal
                      WHERE false)"
            }
            false => "main.checkpoint_steps",
        };
        views.push((
            "fitness_log",
            format!("experiment_id, generation, step AS told, seal FROM {steps}"),
        ));
        views.push((
            "keyframes",
            format!(
                "experiment_id,
                 (SELECT count(*) FROM main.generations AS g
                  WHERE g.experiment_id = c.experiment_id)
                 - (SELECT count(*) FROM {steps} AS s WHERE s.experiment_id = c.experiment_id)
                 AS n_generations,
                 state, {} AS seal FROM main.checkpoints AS c",
                if version < SEALED { "x''" } else { "seal" }
            ),
        ));
    }
    if version < FORKS {
        let none = "0 AS experiment_id, 0 AS parent_id, 0 AS generation, '' AS link,
                    '' AS changes, x'' AS seal WHERE false";
        views.push(("forks", none.to_owned()));
    }
    if version < CONFIGS {
        views.push(("configs", "id AS experiment_id, config FROM main.experiments".to_owned()));
    }
    let priority = if_before(2, ", 100 AS priority");
    let log = if_before(
        LOGGED,
        ", ifnull((SELECT n_generations FROM keyframes WHERE experiment_id = id),
                  (SELECT count(*) FROM main.generations WHERE experiment_id = id)) AS log_from,
           'older' AS log_gap",
    );
    let group = if_before(GROUPS, ", NULL AS group_name, NULL AS variant");
    let labels = if_before(LABELS, ", '{}' AS labels, 0 AS archived");
    let summary = if_before(SUMMARIES, concat!(", ", summary!(), " AS summary"));
    let experiments =
        format!("*{priority}{group}{seal}{log}{labels}{summary} FROM main.experiments");
    views.push(("experiments", experiments));
    for (name, select) in views {
        connection.execute_batch(&format!("CREATE TEMP VIEW {name} AS SELECT {select}"))?;
    }
    Ok(())
}

#[cfg(test)]
pub mod tests;
