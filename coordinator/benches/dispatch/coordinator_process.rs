//! The coordinator's program, on a data directory and a port of its own.

use std::{
    env,
    fs::{self, File},
    net::{SocketAddr, TcpListener},
    path::PathBuf,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use swarm_proto::v1::{
    SubmitExperimentRequest, experiment_service_client::ExperimentServiceClient,
};
use tempfile::TempDir;

const RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// Killed when it is dropped.
pub struct CoordinatorProcess {
    child: Child,
    address: String,
    /// The address of its pages.
    pub pages: SocketAddr,
    data_dir: TempDir,
}

impl CoordinatorProcess {
    /// Starts a coordinator with an empty data directory.
    pub fn start() -> Self {
        let data_dir = TempDir::new().expect("a temporary directory");
        let (address, pages) = (free_address().to_string(), free_address());
        Self { child: spawn(&address, pages, &data_dir), address, pages, data_dir }
    }

    /// Ends it without warning.
    pub fn kill(&mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it is ours");
    }

    /// Restarts it after [`kill`](Self::kill); returns the time of the restart.
    #[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
    pub fn restart(&mut self) -> Instant {
        let now = Instant::now();
        self.child = spawn(&self.address, self.pages, &self.data_dir);
        now
    }

    /// Its URL.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Submits an experiment file as soon as it listens.
    pub async fn submit(&self, config_json: &str) {
        let mut client = loop {
            match ExperimentServiceClient::connect(self.url()).await {
                Ok(client) => break client,
                Err(_) => tokio::time::sleep(RETRY_INTERVAL).await,
            }
        };
        let request = SubmitExperimentRequest {
            config_json: config_json.to_owned(),
            ..SubmitExperimentRequest::default()
        };
        client.submit_experiment(request).await.expect("the file is right");
    }

    /// Largest resident memory so far.
    pub fn peak_memory_mib(&self) -> f64 {
        let path = format!("/proc/{}/status", self.child.id());
        let status = fs::read_to_string(path).expect("it runs on Linux");
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().strip_suffix(" kB")).expect("it has memory");
        kib.parse::<f64>().expect("a number") / 1024.0
    }
}

impl Drop for CoordinatorProcess {
    fn drop(&mut self) {
        self.kill();
    }
}

fn free_address() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("it is bound")
}

fn spawn(address: &str, pages: SocketAddr, data_dir: &TempDir) -> Child {
    let log = File::create(data_dir.path().join("log")).expect("a new directory can be written");
    // As in the harness of the fleet tests, the variable can name programs of another version.
    let program = env::var_os("SWARM_PROGRAMS").map_or_else(
        || env!("CARGO_BIN_EXE_coordinator").into(),
        |programs| PathBuf::from(programs).join("coordinator"),
    );
    Command::new(program)
        .args(["--listen", address, "--web-listen", &pages.to_string()])
        .args(["--log-format", "json", "--data-dir"])
        .arg(data_dir.path())
        .stdout(Stdio::null())
        .stderr(log)
        .spawn()
        .expect("the program has been built")
}
