//! The common interface of commands that only send requests to a coordinator.

use crate::{connection::Connection, error::Error, place::Intent, progress::Progress};

/// A command, or a family of commands, that only sends requests to a coordinator, so that an
/// interrupt may end it at any time.
pub trait Remote: Sized {
    /// Whether the answer of the command is a table, which can be printed as CSV.
    fn has_table(&self) -> bool {
        false
    }

    /// Whether the command ends when the reader of standard output goes.
    fn ends_with_reader(&self) -> bool {
        false
    }

    /// The kind of access of the command to experiments.
    fn intent(&self) -> Intent {
        Intent::Read
    }

    /// Finds mistakes before any effect.
    fn check(&self) -> Result<(), Error> {
        Ok(())
    }

    /// Sends the requests and prints the answers.
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error>;
}

/// Declares a family of commands, in the order of the help.
macro_rules! family {
    ($(#[$doc:meta])* $family:ident { $($(#[$attribute:meta])* $name:ident($args:ty),)* }) => {
        $(#[$doc])*
        #[derive(Debug, clap::Subcommand)]
        pub enum $family {
            $($(#[$attribute])* $name($args),)*
        }

        impl $crate::remote::Remote for $family {
            fn has_table(&self) -> bool {
                match self {
                    $(Self::$name(command) => command.has_table(),)*
                }
            }

            fn ends_with_reader(&self) -> bool {
                match self {
                    $(Self::$name(command) => command.ends_with_reader(),)*
                }
            }

            fn intent(&self) -> $crate::place::Intent {
                match self {
                    $(Self::$name(command) => command.intent(),)*
                }
            }

            fn check(&self) -> Result<(), $crate::error::Error> {
                match self {
                    $(Self::$name(command) => command.check(),)*
                }
            }

            async fn execute(
                self,
                connection: &$crate::connection::Connection,
                progress: &mut $crate::progress::Progress,
            ) -> Result<(), $crate::error::Error> {
                match self {
                    $(Self::$name(command) => command.execute(connection, progress).await,)*
                }
            }
        }
    };
}

pub(crate) use family;
