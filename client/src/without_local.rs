//! Replaces `local` in a build without it: each function returns an error that names the
//! remedy.

use std::convert::Infallible;

use crate::error::Error;

/// The error of a command that needs a coordinator in this process.
fn missing() -> Error {
    Error::Input(
        "this swarmctl was built without a coordinator and workers, so it can neither run \
         experiments nor open a data directory: name a coordinator with --coordinator, or install \
         the full program with `cargo install --locked --path client`"
            .into(),
    )
}

pub mod fleet {
    //! No fleet.

    use std::{net::SocketAddr, path::Path};

    use sim_core::Isa;

    use super::{Error, Infallible, missing};
    use crate::{connection::Connection, progress::Progress};

    /// There is none.
    pub struct Fleet(Infallible);

    impl Fleet {
        /// Starts nothing.
        pub async fn start(
            _data_dir: &Path,
            _n_workers: usize,
            _isa: Isa,
            _web_listen: Option<SocketAddr>,
        ) -> Result<Self, Error> {
            Err(missing())
        }

        pub fn connection(&self) -> Connection {
            match self.0 {}
        }

        pub fn pages(&self) -> Option<String> {
            match self.0 {}
        }

        pub async fn failure(&mut self) -> Error {
            match self.0 {}
        }

        pub async fn stop(self, _result: &Result<(), Error>, _progress: &Progress) {
            match self.0 {}
        }

        pub async fn shutdown(self) {
            match self.0 {}
        }
    }
}

pub mod services {
    //! No services.

    use std::{ffi::OsString, path::Path, process::ExitCode, time::Duration};

    use model::store::Holder;
    use tonic::transport::Channel;

    use super::{Error, Infallible, missing};

    /// A program, as a function of its command line.
    pub type Program = fn(Vec<OsString>) -> ExitCode;

    /// The other programs, which this build lacks.
    pub const PROGRAMS: [(&str, Program); 2] =
        [("coordinator", no_program), ("worker", no_program)];

    fn no_program(_words: Vec<OsString>) -> ExitCode {
        let error = missing();
        swarm_telemetry::report(&error.report());
        error.exit_code().into()
    }

    /// There is none.
    #[derive(Debug, Clone)]
    pub struct Door(Infallible);

    impl Door {
        pub fn channel(&self, _timeout: Option<Duration>) -> Channel {
            match self.0 {}
        }
    }

    /// There are none.
    #[derive(Debug)]
    pub struct InProcess(Infallible);

    impl InProcess {
        pub async fn read(_data_dir: &Path) -> Result<Self, Error> {
            Err(missing())
        }

        pub async fn write(_data_dir: &Path) -> Result<Self, Error> {
            Err(missing())
        }

        pub fn door(&self) -> &Door {
            match self.0 {}
        }

        pub async fn holder(&self) -> Option<Holder> {
            match self.0 {}
        }

        pub async fn shutdown(self) {
            match self.0 {}
        }
    }

    /// The unchanged error.
    pub fn refused(error: Error) -> Error {
        error
    }

    /// Evaluates nothing.
    pub fn serve_referee() -> Result<(), Error> {
        Err(missing())
    }
}
