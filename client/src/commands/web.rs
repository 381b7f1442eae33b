//! `swarmctl web`: the pages of a data directory, without a coordinator.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;
use model::queries::Reader;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_transport::listen_address;
use swarm_web::{Site, demo_file};
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

use crate::{
    error::Error,
    output_file::Overwrite,
    pages::{login_address, random_token, simulator},
    place::data_dir,
    progress::Progress,
    settings::Settings,
};

/// Serve the experiments of a data directory as pages for a browser.
///
/// The pages show curves, every individual, comparisons and replays. The command never
/// writes to the directory, and a coordinator may use it meanwhile. Only browsers
/// that open the printed address get access, so other users of this machine do not.
/// Ctrl-C ends the command.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct WebArgs {
    /// Address to listen on, of this machine only; port 0 selects a free port.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0", value_parser = listen_address)]
    web_listen: SocketAddr,
    /// Serve nothing, and write a page that needs no server: one HTML file with a fleet of twenty
    /// workers to kill, hang, slow down and make lie.
    #[arg(long, value_name = "FILE", conflicts_with = "web_listen")]
    demo: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
From another machine: ssh -L 8080:127.0.0.1:8080 HOST swarmctl web --web-listen 127.0.0.1:8080

Examples:
  swarmctl web
  swarmctl web --data-dir backups/today
  swarmctl web --demo fleet.html";

/// The option with the address.
const OPTION: &str = "--web-listen";

/// Pages that are served until an interrupt, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Served {
    /// The address, with a secret that gives access.
    address: String,
}

/// A written page, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Written {
    /// Path of the file.
    file: String,
}

/// Serves until an interrupt, or writes the page.
pub async fn web(
    settings: &Settings,
    args: &WebArgs,
    progress: &mut Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    if let Some(path) = &args.demo {
        return write_demo(path, args.overwrite, progress);
    }
    let listen = args.web_listen;
    if !listen.ip().to_canonical().is_loopback() {
        let what = format!(
            "{listen}: these pages are for this machine only; use `ssh -L`, or `coordinator \
             --web-listen`, which has tokens and TLS"
        );
        return Err(Error::option(OPTION, what));
    }
    let reader =
        Reader::open_alone(&data_dir(settings)).map_err(|error| Error::from_store(&error))?;
    let cannot = |error| Error::option(OPTION, format!("{listen}: cannot listen there: {error}"));
    let listener = TcpListener::bind(listen).await.map_err(cannot)?;
    let address = listener.local_addr().map_err(cannot)?;
    let token = random_token();
    let address = login_address(address, &token);
    match progress.is_json() {
        true => progress.print_line(&Served { address })?,
        false => progress.print(&address)?,
    }
    let site = Site { reader: Arc::new(reader), control: None, token: Some(token), tls: None };
    site.serve(listener, interrupt).await.map_err(cannot)
}

fn write_demo(path: &Path, overwrite: Overwrite, progress: &mut Progress) -> Result<(), Error> {
    let simulator = simulator("--demo")?;
    overwrite.write(path, demo_file(simulator).as_bytes())?;
    let file = path.display().to_string();
    match progress.is_json() {
        true => progress.print_line(&Written { file }),
        false => progress.print(&file),
    }
}
