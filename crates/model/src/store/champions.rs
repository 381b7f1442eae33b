//! The table of champions.

use rusqlite::{Connection, OptionalExtension, Row, Transaction, params, types::ValueRef};

use crate::ids::ExperimentId;
use evolution::{Champion, ChampionSource, HeldOut, Judged, Real};

use super::{
    StoreError,
    history::real,
    seals::{Seal, Sealer},
};

/// Replaces an experiment's champion. `latest`: the experiment's latest generation; `digest`: the
/// link that covers everything so far.
pub fn put(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    champion: &Champion,
    latest: Option<u64>,
    digest: &str,
) -> rusqlite::Result<()> {
    let individual = match champion.source {
        ChampionSource::Individual(individual) => Some(individual),
        ChampionSource::Mean => None,
    };
    let Champion { held_out, judged, .. } = champion;
    let mut statement = transaction.prepare_cached(
        "INSERT OR REPLACE INTO champions
                (experiment_id, generation, individual, trial_fitness, genotype, held_out_mean,
                 held_out_ci95, held_out_trials, held_out_generation, seal, judged_mean,
                 judged_low, judged_high, judged_trials, judged_generation)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15)",
    )?;
    let trial_fitness = to_json(&champion.trial_fitness)?;
    let genotype = to_json(&champion.genotype)?;
    let bounds = bounds(champion);
    let seal = seal_of(sealer, id, champion, bounds, &trial_fitness, &genotype, latest, digest);
    statement.execute(params![
        id.0,
        champion.generation,
        individual,
        trial_fitness,
        genotype,
        held_out.map(|held_out| held_out.mean.get()),
        held_out.map(|held_out| held_out.ci95.get()),
        held_out.map(|held_out| held_out.n_trials),
        held_out.map(|held_out| held_out.generation),
        seal,
        judged.map(|judged| judged.mean.get()),
        judged.map(|judged| judged.low.get()),
        judged.map(|judged| judged.high.get()),
        judged.map(|judged| judged.n_trials),
        judged.map(|judged| judged.generation),
    ])?;
    Ok(())
}

/// The ends of a champion's intervals.
fn bounds(champion: &Champion) -> [f64; 3] {
    let ci95 = champion.held_out.map_or(0.0, |held_out| held_out.ci95.get());
    let (low, high) =
        champion.judged.map_or((0.0, 0.0), |judged| (judged.low.get(), judged.high.get()));
    [ci95, low, high]
}

/// The seal of a champion, from its stored lists and intervals. It also covers the end of the
/// history, because an ended experiment has no checkpoint.
#[expect(clippy::too_many_arguments, reason = "each is a part of what is sealed")]
fn seal_of(
    sealer: &Sealer,
    id: ExperimentId,
    champion: &Champion,
    [ci95, low, high]: [f64; 3],
    trial_fitness: &str,
    genotype: &str,
    latest: Option<u64>,
    digest: &str,
) -> Seal {
    let mut seal = sealer
        .begin("champion", id)
        .number(latest.map_or(0, |latest| latest + 1))
        .text(digest.as_bytes())
        .number(champion.generation)
        .text(trial_fitness.as_bytes())
        .text(genotype.as_bytes());
    if let ChampionSource::Individual(individual) = champion.source {
        seal = seal.text(b"individual").number(individual.into());
    }
    if let Some(HeldOut { mean, n_trials, generation, .. }) = champion.held_out {
        seal = seal.text(b"held out").real(mean.get()).real(ci95);
        seal = seal.number(n_trials).number(generation);
    }
    if let Some(Judged { mean, n_trials, generation, .. }) = champion.judged {
        seal = seal.text(b"judged").real(mean.get()).real(low).real(high);
        seal = seal.number(n_trials.into()).number(generation);
    }
    seal.finish()
}

/// A stored champion.
struct Stored {
    /// The champion without its lists.
    champion: Champion,
    trial_fitness: String,
    genotype: String,
    seal: Vec<u8>,
    /// Whether each end of its intervals is NULL. Older versions wrote NULL for an end that they
    /// could not compute.
    are_unknown: [bool; 3],
    /// The experiment's latest generation and the digest of everything so far.
    latest: Option<u64>,
    digest: String,
}

impl Stored {
    fn read(connection: &Connection, id: ExperimentId) -> rusqlite::Result<Option<Self>> {
        let mut statement = connection.prepare_cached(
            "SELECT c.generation, individual, trial_fitness, genotype, held_out_mean,
                    held_out_ci95, held_out_trials, held_out_generation, c.seal, e.digest,
                    (SELECT max(generation) FROM generations WHERE experiment_id = e.id),
                    judged_mean, judged_low, judged_high, judged_trials, judged_generation
             FROM champions c JOIN experiments e ON e.id = c.experiment_id
             WHERE c.experiment_id = ?1",
        )?;
        statement.query_row([id.0], Self::from_row).optional()
    }

    fn from_row(row: &Row<'_>) -> rusqlite::Result<Self> {
        let individual: Option<u32> = row.get(1)?;
        let held_out = match row.get::<_, Option<f64>>(4)? {
            Some(_) => Some(HeldOut {
                mean: real(row, 4)?,
                ci95: bound(row, 5, f64::INFINITY)?,
                n_trials: row.get(6)?,
                generation: row.get(7)?,
            }),
            None => None,
        };
        let judged = match row.get::<_, Option<f64>>(11)? {
            Some(_) => Some(Judged {
                mean: real(row, 11)?,
                low: bound(row, 12, f64::NEG_INFINITY)?,
                high: bound(row, 13, f64::INFINITY)?,
                n_trials: row.get(14)?,
                generation: row.get(15)?,
            }),
            None => None,
        };
        let is_null =
            |column: usize| Ok::<_, rusqlite::Error>(row.get_ref(column)? == ValueRef::Null);
        let (has_held_out, has_judged) = (held_out.is_some(), judged.is_some());
        let are_unknown =
            [has_held_out && is_null(5)?, has_judged && is_null(12)?, has_judged && is_null(13)?];
        let champion = Champion {
            generation: row.get(0)?,
            source: individual.map_or(ChampionSource::Mean, ChampionSource::Individual),
            genotype: Vec::new(),
            trial_fitness: Vec::new(),
            held_out,
            judged,
        };
        Ok(Self {
            champion,
            trial_fitness: row.get(2)?,
            genotype: row.get(3)?,
            seal: row.get(8)?,
            are_unknown,
            digest: row.get(9)?,
            latest: row.get(10)?,
        })
    }

    /// The seal that it should have.
    fn expected_seal(&self, sealer: &Sealer, id: ExperimentId) -> Seal {
        self.seal_with(f64::NAN, sealer, id)
    }

    /// Whether the seal holds.
    fn is_sound(&self, sealer: &Sealer, id: ExperimentId) -> bool {
        // Processors differ in the sign of NaN.
        [f64::NAN, -f64::NAN].iter().any(|&nan| self.seal_with(nan, sealer, id)[..] == self.seal)
    }

    /// The seal for this value in place of NULL.
    fn seal_with(&self, unknown: f64, sealer: &Sealer, id: ExperimentId) -> Seal {
        let Self { champion, trial_fitness, genotype, latest, digest, .. } = self;
        let mut bounds = bounds(champion);
        for (bound, is_unknown) in bounds.iter_mut().zip(self.are_unknown) {
            if is_unknown {
                *bound = unknown;
            }
        }
        seal_of(sealer, id, champion, bounds, trial_fitness, genotype, *latest, digest)
    }
}

/// Seals the stored champion, if there is one.
pub fn seal(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
) -> rusqlite::Result<()> {
    if let Some(stored) = Stored::read(transaction, id)? {
        let seal = stored.expected_seal(sealer, id);
        let sql = "UPDATE champions SET seal = ?2 WHERE experiment_id = ?1";
        transaction.execute(sql, params![id.0, seal])?;
    }
    Ok(())
}

/// Reads an experiment's champion; a broken seal is damage. `sealer`: `None` if the database has
/// no seals yet.
pub fn get(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
) -> Result<Option<Champion>, StoreError> {
    let corrupt = |why: &dyn std::fmt::Display| {
        StoreError::Corrupt(format!("the champion of experiment {id}: {why}"))
    };
    let Some(stored) = Stored::read(connection, id)? else { return Ok(None) };
    if sealer.is_some_and(|sealer| !stored.is_sound(sealer, id)) {
        return Err(corrupt(&"it, or the end of the history, is not what was stored"));
    }
    let list = |text: &str| serde_json::from_str(text).map_err(|error| corrupt(&error));
    let (trial_fitness, genotype) = (list(&stored.trial_fitness)?, list(&stored.genotype)?);
    Ok(Some(Champion { trial_fitness, genotype, ..stored.champion }))
}

/// Reads the end of an interval; `unknown`: the value for NULL.
fn bound(row: &Row<'_>, column: usize, unknown: f64) -> rusqlite::Result<Real> {
    match row.get_ref(column)? {
        ValueRef::Null => Ok(Real::new(unknown).expect("infinity is a number")),
        _ => real(row, column),
    }
}

/// JSON has no numbers for infinity and NaN, and a `null` could not be read back.
fn to_json(values: &[f64]) -> rusqlite::Result<String> {
    if !values.iter().all(|value| value.is_finite()) {
        let what = "a list with a value that is not finite is not stored";
        return Err(rusqlite::Error::ToSqlConversionFailure(what.into()));
    }
    Ok(serde_json::to_string(values).expect("numbers serialise"))
}
