//! The codes of errors: for each its exit code, its meaning, and the next step if the message has
//! none.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;
use serde_json::json;

/// An entry for each exit code, with its line in the help and a row for each of its codes. Codes
/// are part of the interface for programs: add, but never rename.
macro_rules! codes {
    ($($exit_code:literal: $about:literal {
        $($variant:ident, $name:literal, $meaning:literal, $next:literal;)*
    })*) => {
        /// The code of an error, for programs.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
        pub enum Code {
            $($(#[doc = $meaning] #[serde(rename = $name)] $variant,)*)*
        }

        /// The exit codes of failures, with what they mean.
        pub const EXIT_CODES: &[(u8, &str)] = &[$(($exit_code, $about),)*];

        impl Code {
            /// All codes, in the order of their exit codes.
            pub const ALL: &[Self] = &[$($(Self::$variant,)*)*];

            /// Its name in JSON.
            pub fn name(self) -> &'static str {
                match self { $($(Self::$variant => $name,)*)* }
            }

            /// The exit code of `swarmctl`.
            pub fn exit_code(self) -> u8 {
                match self { $($(Self::$variant => $exit_code,)*)* }
            }

            /// What it says.
            pub fn meaning(self) -> &'static str {
                match self { $($(Self::$variant => $meaning,)*)* }
            }

            /// What to do.
            pub fn next(self) -> &'static str {
                match self { $($(Self::$variant => $next,)*)* }
            }
        }
    };
}

codes! {
    1: "internal error" {
        Internal, "internal",
            "a bug of this program or of the coordinator",
            "report the message as a bug; complete generations are kept";
        WriteFailed, "write_failed",
            "standard output, or a temporary file, cannot be written",
            "free space on the disk, then repeat the command";
    }
    2: "bad input: arguments, settings, a token, a certificate, a genotype, an experiment file, a \
        directory, a file to write; or a limit is reached" {
        BadArgument, "bad_argument",
            "the command line has an unknown command or option, or a value that is not allowed",
            "`swarmctl COMMAND --help` explains every argument";
        BadInput, "bad_input",
            "the request cannot be carried out as it is",
            "change what the message names, then repeat the command";
        InvalidExperiment, "invalid_experiment",
            "an experiment file has mistakes; `mistakes` lists them",
            "mend every mistake, then `swarmctl validate FILE`; `swarmctl schema --key KEY` explains \
             a key";
        UnreadableFile, "unreadable_file",
            "a file does not exist, cannot be read, or is of another kind",
            "name a file that this command reads";
        UnwritableFile, "unwritable_file",
            "a file or a directory cannot be written",
            "name a place that can be written";
        FileExists, "file_exists",
            "a file or a directory exists already, and nothing was changed",
            "choose another name, or replace it with --force";
        BadGenotype, "bad_genotype",
            "a genotype has the wrong number of genes, or a gene outside [0, 1]",
            "give a genotype of this experiment, such as the answer of `swarmctl individual ID`";
        OtherExperiment, "other_experiment",
            "a genotype evolved under another experiment file",
            "give the file under which it evolved, or accept this one with --changed-conditions";
        NoDataDirectory, "no_data_directory",
            "no database is in this directory, or it is of another version",
            "name a directory in which `swarmctl run` or a coordinator has worked, with --data-dir";
        AmbiguousName, "ambiguous_name",
            "several experiments have this name",
            "give the number of one of them";
        LimitReached, "limit_reached",
            "at present the coordinator can compute or store no more, or the request is too large",
            "repeat the command later, or ask for less";
        NeedsConsent, "needs_consent",
            "the command would delete something, and nothing was changed",
            "list what would change with --dry-run, then confirm it with --yes";
        UnknownKey, "unknown_key",
            "experiment files have no such key",
            "`swarmctl schema --key KEY` of the key above lists the keys below it";
    }
    3: "no such experiment, or its state does not allow the request (no champion yet, ended)" {
        NotFound, "not_found",
            "there is no such experiment, group or generation",
            "`swarmctl list` lists the experiments";
        WrongState, "wrong_state",
            "the state of the experiment does not allow the request: it has no champion yet, or has \
             ended",
            "`swarmctl explain ID` says in which state it is";
    }
    4: "the coordinator cannot be reached" {
        Unreachable, "unreachable",
            "no coordinator answers at the address",
            "start one with `coordinator`, or name another one with --coordinator; for a data \
             directory, --data-dir";
    }
    5: "the experiment failed (run, watch, submit --watch)" {
        ExperimentFailed, "experiment_failed",
            "the experiment failed",
            "`swarmctl explain ID` names the cause; `swarmctl resume ID` continues it";
    }
    6: "the experiment was cancelled (the same commands)" {
        ExperimentCancelled, "experiment_cancelled",
            "somebody cancelled the experiment",
            "`swarmctl resume ID` continues it; its generations are kept";
    }
    7: "the coordinator does not accept the token" {
        TokenRefused, "token_refused",
            "the coordinator does not accept the token",
            "name the file of the client's token with --token-file";
    }
    8: "no TLS connection: one side has no TLS, or the certificate is not trusted" {
        NoTls, "no_tls",
            "one side has no TLS, or a certificate is not trusted",
            "compare the address (https://) and --tls-ca with the coordinator's certificate";
    }
    9: "the server at the address is not a coordinator, or has another version" {
        NotACoordinator, "not_a_coordinator",
            "the server at the address is not a coordinator, or has another version",
            "compare the port, and `coordinator --version` with `swarmctl --version`";
    }
    10: "the experiment has not ended within watch --timeout" {
        NotEnded, "not_ended",
            "the experiment has not ended within --timeout; it goes on",
            "repeat the command later; `swarmctl explain ID` says what it waits for";
    }
    11: "the database is damaged" {
        DatabaseDamaged, "database_damaged",
            "the database is damaged",
            "`swarmctl doctor` lists the damage, and recovers what is sound";
    }
    12: "a claim of the bundle is false (verify)" {
        ClaimFalse, "claim_false",
            "a claim of the bundle is false",
            "do not trust this bundle";
    }
    71: "the system provides too few threads or file descriptors, or too little memory" {
        MachineTooSmall, "machine_too_small",
            "the system provides too few threads or file descriptors, or too little memory",
            "raise the limits, or ask for less at once";
    }
    130: "interrupted" {
        Interrupted, "interrupted",
            "a signal ended the command",
            "repeat the command; complete generations are kept";
    }
    141: "standard output was closed (watch, help); other commands continue" {
        OutputClosed, "output_closed",
            "standard output was closed, and the command only prints",
            "read the whole output";
    }
}

impl JsonSchema for Code {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Code".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let code = |code: &Self| {
            let exit = code.exit_code();
            let description =
                format!("Exit code {exit}: {}. Next: {}.", code.meaning(), code.next());
            json!({"const": code.name(), "description": description})
        };
        json_schema!({"oneOf": Self::ALL.iter().map(code).collect::<Vec<_>>()})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_words_in_snake_case_and_their_steps_fit_a_sentence() {
        for code in Code::ALL {
            let is_word = code.name().chars().all(|c| c.is_ascii_lowercase() || c == '_');
            assert!(is_word, "{}", code.name());
            for text in [code.meaning(), code.next()] {
                assert!(!text.is_empty() && !text.ends_with('.'), "{text}");
            }
            assert_eq!(serde_json::to_value(code).unwrap(), code.name());
        }
    }

    #[test]
    fn a_machine_that_is_too_small_has_the_exit_code_of_the_other_programs() {
        assert_eq!(Code::MachineTooSmall.exit_code(), swarm_telemetry::EXIT_STARVED);
    }
}
