//! Slurm, by its commands.

use std::{ffi::OsStr, process::Output, time::Duration};

use tokio::process::Command;

use super::autoscaler::{Done, Job, Plan};
use crate::{error::Error, text};

/// Worker jobs of one fleet in Slurm.
#[derive(Debug)]
pub struct Slurm {
    /// The name that identifies the jobs of this fleet.
    pub job_name: String,
    /// The worker's command line, for a shell.
    pub script: String,
    /// Time after which an idle worker ends.
    pub idle_timeout: Duration,
    /// More arguments of `sbatch`.
    pub sbatch_args: Vec<String>,
}

impl Slurm {
    /// The jobs of the fleet that wait or run, oldest first.
    pub async fn jobs(&self) -> Result<Vec<Job>, Error> {
        let name = format!("--name={}", self.job_name);
        let arguments = ["--me", "--noheader", "--sort=i", "--format=%i %t", &name];
        Ok(parse_jobs(&call("squeue", arguments).await?))
    }

    /// Submits and ends jobs, up to the first failure. Adds to `done` what was done.
    pub async fn carry_out(&self, plan: Plan, done: &mut Done) -> Result<(), Error> {
        for _ in 0..plan.n_submit {
            done.submitted.push(self.submit().await?);
        }
        // A job that begins to run meanwhile stays; the next check handles it.
        cancel(&["--state=PENDING"], &plan.withdraw).await?;
        done.withdrawn = plan.withdraw;
        // The script has replaced itself by the worker, which finishes its items.
        cancel(&["--batch", "--signal=TERM"], &plan.finish).await?;
        done.finishing = plan.finish;
        Ok(())
    }

    /// Submits a job, and returns its number.
    async fn submit(&self) -> Result<String, Error> {
        let own = [
            "--parsable",
            "--output=swarm-worker-%j.log",
            &format!("--job-name={}", self.job_name),
            &format!("--wrap={}", self.script),
        ];
        let given = self.sbatch_args.iter().map(String::as_str);
        let answer = call("sbatch", own.into_iter().chain(given)).await?;
        // NUMBER, or NUMBER;CLUSTER.
        Ok(answer.trim().split(';').next().unwrap_or_default().to_owned())
    }
}

/// The command line of a worker in a job: as many slots as the job has cores for a task.
pub fn script(
    worker: &str,
    coordinator: &str,
    idle_timeout: Duration,
    time_limit: Option<Duration>,
) -> String {
    let quoted = [worker, "--coordinator", coordinator].map(str::to_owned);
    let time_limit = time_limit.map(|limit| format!(" --time-limit {}s", limit.as_secs()));
    format!(
        "exec {} --name \"$(hostname -s)-$SLURM_JOB_ID\" --slots \"${{SLURM_CPUS_PER_TASK:-1}}\" \
         --idle-timeout {}s{}",
        text::shell_command(quoted),
        idle_timeout.as_secs(),
        time_limit.unwrap_or_default()
    )
}

async fn cancel(how: &[&str], ids: &[String]) -> Result<(), Error> {
    if ids.is_empty() {
        return Ok(());
    }
    let ids = ids.iter().map(String::as_str);
    call("scancel", how.iter().copied().chain(ids)).await.map(drop)
}

/// Runs a command of Slurm, and returns its standard output.
async fn call(
    program: &str,
    arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
) -> Result<String, Error> {
    let output = Command::new(program).args(arguments).output().await.map_err(|error| {
        Error::Input(format!(
            "cannot run {program}: {error}; this command needs a machine that has Slurm"
        ))
        .about(program)
    })?;
    let Output { status, stdout, stderr } = output;
    if !status.success() {
        let reason = String::from_utf8_lossy(&stderr).trim().replace('\n', "; ");
        return Err(Error::Input(format!("{program}: {reason}")).about(program));
    }
    Ok(String::from_utf8_lossy(&stdout).into_owned())
}

/// Reads lines of `NUMBER STATE`. Leaves out jobs that are about to end.
fn parse_jobs(text: &str) -> Vec<Job> {
    let job = |line: &str| {
        let (id, state) = line.trim().split_once(' ')?;
        let is_running = match state {
            "R" | "CF" | "S" | "ST" => true,
            "PD" | "RQ" | "RH" | "RF" | "RD" | "SE" => false,
            _ => return None,
        };
        Some(Job { id: id.to_owned(), is_running })
    };
    text.lines().filter_map(job).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_wait_run_or_are_gone() {
        let job = |id: &str, is_running| Job { id: id.to_owned(), is_running };
        let found = parse_jobs("7 R\n12 PD\n13 CG\n\n14 CF\n");
        assert_eq!(found, [job("7", true), job("12", false), job("14", true)]);
    }

    #[test]
    fn the_script_is_one_command_that_replaces_the_shell() {
        let script = script("my worker", "https://h:1", Duration::from_secs(600), None);
        assert!(script.starts_with("exec 'my worker' --coordinator https://h:1 "), "{script}");
        assert!(script.ends_with("--idle-timeout 600s"), "{script}");
    }
}
