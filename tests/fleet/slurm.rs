//! Workers as jobs of a real Slurm, with a controller and a node on this machine; and a Slurm of
//! scripts that fails on purpose.

use std::{
    env, fs,
    io::{BufRead as _, BufReader, Read as _},
    net::TcpListener,
    os::unix::fs::PermissionsExt as _,
    path::Path,
    process::{Child, Command, Stdio},
};

use harness::{CoordinatorProcess, Experiment, binary, skipped, undisturbed};
use serde_json::{Value, json};

/// Processes that end with the test.
struct Running(Vec<Child>);

impl Drop for Running {
    fn drop(&mut self) {
        for child in &mut self.0 {
            // A failed test must not leave processes behind.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn output(program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// The settings of a controller and a node of two processors without accounts, cgroups or
/// authentication.
fn settings(directory: &Path) -> String {
    let (host, user) = (output("hostname", &["-s"]), output("id", &["-un"]));
    let (controller, node, directory) = (free_port(), free_port(), directory.display());
    format!(
        "ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
StateSaveLocation={directory}/state
SlurmdSpoolDir={directory}/spool
SlurmctldPidFile={directory}/slurmctld.pid
SlurmdPidFile={directory}/slurmd.pid
SlurmctldLogFile={directory}/slurmctld.log
SlurmdLogFile={directory}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MpiDefault=none
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=short Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"
    )
}

#[test]
fn workers_are_jobs_of_slurm_as_long_as_there_is_something_to_compute() {
    let has = |program: &str| Command::new(program).arg("-V").output().is_ok();
    if !["slurmctld", "slurmd", "sbatch", "squeue", "scancel"].into_iter().all(has) {
        return skipped("there is no Slurm (Debian: slurmctld, slurmd, slurm-client)");
    }
    let directory = tempfile::tempdir().unwrap();
    for part in ["state", "spool"] {
        fs::create_dir(directory.path().join(part)).unwrap();
    }
    let conf = directory.path().join("slurm.conf");
    fs::write(&conf, settings(directory.path())).unwrap();
    let start = |program: &Path, args: &[&str]| {
        let mut command = Command::new(program);
        command.args(args).env("SLURM_CONF", &conf).current_dir(directory.path());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let _slurm =
        Running(["slurmctld", "slurmd"].map(|daemon| start(daemon.as_ref(), &["-D"])).into());

    let coordinator = CoordinatorProcess::start();
    // Enough work for more than one worker.
    let population = |file: &mut Value| file["algorithm"]["population_size"] = 24.into();
    let experiment = Experiment::tiny(3).edit(population);
    let id = coordinator.submit(&experiment.path());
    let (url, worker) = (coordinator.url(), binary("worker"));
    let args = ["--coordinator", &url, "fleet", "slurm", "--max", "2", "--interval", "1s"];
    let more = ["--idle-timeout", "4s", "--worker", worker.to_str().unwrap()];
    let sbatch = ["--", "--partition=short"];
    let swarmctl = |sbatch: &[&str]| {
        let mut command = Command::new(binary("swarmctl"));
        command.args([&args[..], &more, sbatch].concat()).env("SLURM_CONF", &conf);
        command.current_dir(directory.path());
        command
    };
    // The controller answers as soon as it is up, and refuses what does not exist.
    let refused = loop {
        let refused = swarmctl(&["--", "--partition=none"]).output().unwrap();
        let reason = String::from_utf8(refused.stderr).unwrap();
        if !reason.contains("Unable to contact slurm controller") {
            break (refused.status.code(), reason);
        }
    };
    assert_eq!(refused.0, Some(2));
    assert!(refused.1.contains("invalid partition"), "{}", refused.1);

    let quiet = Stdio::null;
    let fleet = swarmctl(&sbatch).stdout(quiet()).stderr(quiet()).spawn().unwrap();
    let _fleet = Running(vec![fleet]);
    let finished = coordinator.watch(id).finish();
    assert_eq!(finished.digests(), undisturbed(&experiment));
    let left = |line: &Value| line["message"] == "worker left";
    let (n_seen, first) = coordinator.process.find(0, "the end of a worker", left);
    let (_, second) = coordinator.process.find(n_seen, "the end of the other", left);
    assert_ne!(first["name"], second["name"]);
    assert_eq!(second["workers"], 0);
}

/// Lists the jobs, except at the second call.
const SQUEUE: &str = "#!/bin/sh
cd \"$(dirname \"$0\")\" && echo >> looks
if [ \"$(wc -l < looks)\" -eq 2 ]; then echo 'Unable to contact slurm controller' >&2; exit 1; fi
touch jobs && cat jobs
";

/// Accepts a job that waits, except at the second call.
const SBATCH: &str = "#!/bin/sh
cd \"$(dirname \"$0\")\" && echo >> submissions
n=$(($(wc -l < submissions)))
if [ $n -eq 2 ]; then echo 'QOSMaxSubmitJobPerUserLimit' >&2; exit 1; fi
echo \"$n PD\" >> jobs
echo $n
";

#[test]
fn a_slurm_that_fails_for_a_while_is_asked_again_and_no_job_is_forgotten() {
    let directory = tempfile::tempdir().unwrap();
    for (name, script) in [("squeue", SQUEUE), ("sbatch", SBATCH)] {
        let path = directory.path().join(name);
        fs::write(&path, script).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    let path = env::var_os("PATH").unwrap();
    let path = [directory.path().to_owned()].into_iter().chain(env::split_paths(&path));
    let path = env::join_paths(path).unwrap();

    let coordinator = CoordinatorProcess::start();
    // Enough work for two workers.
    let population = |file: &mut Value| file["algorithm"]["population_size"] = 24.into();
    coordinator.submit(&Experiment::tiny(3).edit(population).path());
    let mut fleet = Command::new(binary("swarmctl"))
        .args(["--output", "json", "--coordinator", &coordinator.url()])
        .args(["fleet", "slurm", "--max", "2", "--interval", "1s"])
        .env("PATH", path)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (looks, mut stderr) = (fleet.stdout.take().unwrap(), fleet.stderr.take().unwrap());
    let fleet = Running(vec![fleet]);
    let mut looks = BufReader::new(looks).lines().map(Result::unwrap);
    for (n_jobs, submitted) in [(0, "1"), (1, "3")] {
        let look: Value = serde_json::from_str(&looks.next().unwrap()).unwrap();
        assert_eq!((&look["jobs"], &look["submitted"]), (&json!(n_jobs), &json!([submitted])));
    }
    drop(fleet);
    let mut remarks = String::new();
    stderr.read_to_string(&mut remarks).unwrap();
    for program in ["sbatch: QOSMaxSubmitJobPerUserLimit", "squeue: Unable to contact"] {
        assert!(remarks.contains(program), "{remarks}");
    }
}
