//! Migrations of single rows, step by step.

use super::*;

#[test]
fn experiments_of_the_first_schema_are_kept_and_may_be_paused() {
    let mut connection = Connection::open_in_memory().unwrap();
    connection.execute_batch(MIGRATIONS[0]).unwrap();
    connection
        .execute_batch(
            "INSERT INTO experiments (id, request_id, name, config, config_digest, fingerprint,
                                      genotype_len, state, reason, submitted_at_ms, digest)
             VALUES (3, 'key', 'n', '{}', 'd', 'f', 5, 'failed', 'why', 7, 'link');
             INSERT INTO checkpoints VALUES (3, 'checkpoint');
             PRAGMA user_version = 1;",
        )
        .unwrap();
    migrate(&mut connection).unwrap();
    assert_eq!(version(&connection).unwrap(), VERSION);
    let row = "SELECT id || request_id || state || reason || digest || priority FROM experiments";
    let text = |sql: &str| connection.query_row(sql, [], |row| row.get::<_, String>(0)).unwrap();
    assert_eq!(text(row), "3keyfailedwhylink100");
    assert_eq!(text("SELECT count(*) || '' FROM keyframes"), "0", "nothing can use it");
    connection.execute("UPDATE experiments SET state = 'paused'", []).unwrap();
    connection
        .execute("INSERT INTO keyframes VALUES (9, 0, x'', x'')", [])
        .expect_err("references are checked again");
    connection
        .execute(
            "INSERT INTO experiments (name, config_digest, fingerprint, genotype_len, state,
                                      submitted_at_ms)
             SELECT name, config_digest, fingerprint, genotype_len, state, submitted_at_ms
             FROM experiments",
            [],
        )
        .unwrap();
    assert_eq!(connection.last_insert_rowid(), 4, "ids are not reused");
}

#[test]
fn the_number_of_a_deleted_experiment_is_not_used_again_in_a_later_version() {
    let put = "INSERT INTO experiments (name, config, config_digest, fingerprint, genotype_len,
                                        state, submitted_at_ms)
               VALUES ('n', '{\"seed\": 5}', 'd', 'f', 5, 'failed', 7);";
    for kept in ["", put] {
        let mut connection = Connection::open_in_memory().unwrap();
        for statements in &MIGRATIONS[..10] {
            connection.execute_batch(statements).unwrap();
        }
        connection.execute_batch(&format!("{put}{put}DELETE FROM experiments;")).unwrap();
        connection.execute_batch(&format!("{kept}PRAGMA user_version = 10;")).unwrap();
        migrate(&mut connection).unwrap();
        let summaries: Vec<String> = connection
            .prepare("SELECT summary FROM experiments")
            .and_then(|mut statement| statement.query_map([], |row| row.get(0))?.collect())
            .unwrap();
        assert!(summaries.iter().all(|summary| summary.starts_with("[5,null,")));
        assert_eq!(summaries.len(), usize::from(!kept.is_empty()));
        let put_later = "INSERT INTO experiments (name, config_digest, fingerprint,
                                                  genotype_len, state, submitted_at_ms)
                         VALUES ('n', 'd', 'f', 5, 'failed', 7)";
        connection.execute_batch(put_later).unwrap();
        let n_before = 2 + i64::from(!kept.is_empty());
        assert_eq!(connection.last_insert_rowid(), n_before + 1);
    }
}
