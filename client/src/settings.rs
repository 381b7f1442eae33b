//! How to reach the coordinator: from flags, else the environment, else the settings
//! file, else the default address.

use std::{
    env, io,
    path::{Path, PathBuf},
};

use clap::{Args as ClapArgs, Command, FromArgMatches, ValueHint};
use serde::Deserialize;
use swarm_transport::{CredentialArgs, Credentials};

use crate::{
    defaults::DEFAULT_COORDINATOR,
    error::{Code, Error},
    input::{SETTINGS_BYTES, read_text},
};

/// Heading of the options that only `--help-all` shows.
pub const CONNECTION: &str = "Where experiments are";
/// The environment variable that holds the client token itself.
const TOKEN_VARIABLE: &str = "SWARM_CLIENT_TOKEN";
/// The environment variable that names the coordinator.
pub const COORDINATOR_VARIABLE: &str = "SWARM_COORDINATOR";
/// The environment variable that names the settings file.
pub const FILE_VARIABLE: &str = "SWARM_CONFIG";
/// The default settings file, relative to the user's configuration directory.
const FILE: &str = "swarmevo/config.json";

/// The remedy if the settings are unusable.
const REMEDY: &str =
    "correct it, or name another file with SWARM_CONFIG; --data-dir DIR needs none";

/// Address of the coordinator and credentials, if set.
#[derive(Debug, Clone, Default, PartialEq, Eq, ClapArgs)]
#[command(next_help_heading = CONNECTION)]
pub struct Settings {
    /// Address of the coordinator [default: http://127.0.0.1:7700]
    #[arg(
        long,
        global = true,
        value_name = "URL",
        env = COORDINATOR_VARIABLE,
        hide_env_values = true
    )]
    pub coordinator: Option<String>,
    /// Work on the experiments in this data directory of `run` or of a coordinator, instead of
    /// connecting to a coordinator [env: SWARM_DATA_DIR] [default: ./swarm-data if nothing
    /// listens at the coordinator's default address]
    #[arg(long, global = true, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub data_dir: Option<PathBuf>,
    /// File with the client token, if the coordinator requires one; alternatively
    /// SWARM_CLIENT_TOKEN holds the token itself.
    #[arg(
        long,
        global = true,
        value_name = "FILE",
        env = "SWARM_CLIENT_TOKEN_FILE",
        hide_env_values = true
    )]
    pub token_file: Option<PathBuf>,
    #[command(flatten)]
    pub credentials: CredentialArgs,
    /// The words of the command line that give these settings, without those that the environment
    /// gives as well: a further command needs them to reach the same coordinator.
    #[arg(skip)]
    pub said: Vec<String>,
}

/// The settings file: the same settings, under the names of their flags.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
struct SettingsFile {
    coordinator: Option<String>,
    token_file: Option<PathBuf>,
    tls_ca: Option<PathBuf>,
    tls_cert: Option<PathBuf>,
    tls_key: Option<PathBuf>,
    tls_domain: Option<String>,
    plaintext: bool,
}

impl Settings {
    /// These settings, completed from the settings file.
    pub fn or_file(self) -> Result<Self, Error> {
        let mut this = self.without_empty();
        this.said = this.words(&Self::of_environment());
        let (path, must_exist) = match env::var_os(FILE_VARIABLE).filter(|path| !path.is_empty()) {
            Some(path) => (PathBuf::from(path), true),
            None => match user_file() {
                Some(path) => (path, false),
                None => return Ok(this),
            },
        };
        let mut others = match read_text(&path, SETTINGS_BYTES) {
            Ok(text) => parse(&path, &text)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound && !must_exist => {
                return Ok(this);
            }
            Err(error) => {
                let path = path.display();
                let message = format!("cannot read the settings in {path}: {error}; {REMEDY}");
                return Err(Error::at(Code::UnreadableFile, path, message));
            }
        };
        if env::var_os(TOKEN_VARIABLE).is_some() {
            others.token_file = None;
        }
        Ok(this.or(others))
    }

    /// The settings that the environment gives alone.
    fn of_environment() -> Self {
        let command = Self::augment_args(Command::new("swarmctl"));
        let matches = command.try_get_matches_from(["swarmctl"]);
        matches.and_then(|matches| Self::from_arg_matches(&matches)).unwrap_or_default()
    }

    /// The options that give these settings, except those that the environment gives as well.
    fn words(&self, environment: &Self) -> Vec<String> {
        let values = |settings: &Self| {
            let path = |path: &Option<PathBuf>| path.as_ref().map(|p| p.display().to_string());
            let credentials = &settings.credentials;
            [
                ("--coordinator", settings.coordinator.clone()),
                ("--token-file", path(&settings.token_file)),
                ("--tls-ca", path(&credentials.tls_ca)),
                ("--tls-cert", path(&credentials.tls_cert)),
                ("--tls-key", path(&credentials.tls_key)),
                ("--tls-domain", credentials.tls_domain.clone()),
            ]
        };
        let both = values(self).into_iter().zip(values(environment));
        let said = both.filter(|(own, of_environment)| own != of_environment);
        let said = said.filter_map(|((option, value), _)| Some([option.to_owned(), value?]));
        let mut words: Vec<String> = said.flatten().collect();
        if self.credentials.plaintext && !environment.credentials.plaintext {
            words.push("--plaintext".to_owned());
        }
        words
    }

    /// Whether the command line or the environment names a coordinator.
    pub fn has_coordinator(&self) -> bool {
        self.coordinator.as_ref().is_some_and(|url| !url.is_empty())
    }

    /// An empty variable counts as unset.
    fn without_empty(self) -> Self {
        Self { coordinator: self.coordinator.filter(|url| !url.is_empty()), ..self }
    }

    /// The coordinator's address.
    pub fn address(&self) -> &str {
        self.coordinator.as_deref().unwrap_or(DEFAULT_COORDINATOR)
    }

    /// Reads the token file and the certificate files.
    pub fn credentials(&self) -> Result<Credentials, Error> {
        self.credentials
            .load(self.token_file.as_deref(), TOKEN_VARIABLE)
            .map_err(|error| Error::Input(error.to_string()))
    }

    /// These settings, completed from `others`. Ignores `others` if they name another
    /// coordinator, so that no coordinator sees the token of another one.
    fn or(self, others: Self) -> Self {
        if self.coordinator.is_some() && self.address() != others.address() {
            return self;
        }
        let (these, those) = (self.credentials, others.credentials);
        Self {
            coordinator: self.coordinator.or(others.coordinator),
            data_dir: self.data_dir,
            token_file: self.token_file.or(others.token_file),
            credentials: CredentialArgs {
                tls_ca: these.tls_ca.or(those.tls_ca),
                tls_cert: these.tls_cert.or(those.tls_cert),
                tls_key: these.tls_key.or(those.tls_key),
                tls_domain: these.tls_domain.or(those.tls_domain),
                plaintext: these.plaintext || those.plaintext,
            },
            said: self.said,
        }
    }
}

impl SettingsFile {
    /// The settings; relative paths in the file are relative to its directory.
    fn within(self, directory: &Path) -> Settings {
        let beside = |path: Option<PathBuf>| path.map(|path| directory.join(path));
        Settings {
            coordinator: self.coordinator,
            data_dir: None,
            token_file: beside(self.token_file),
            credentials: CredentialArgs {
                tls_ca: beside(self.tls_ca),
                tls_cert: beside(self.tls_cert),
                tls_key: beside(self.tls_key),
                tls_domain: self.tls_domain,
                plaintext: self.plaintext,
            },
            said: Vec::new(),
        }
    }
}

/// The settings file of this user.
fn user_file() -> Option<PathBuf> {
    let directory = |name| env::var_os(name).filter(|path| !path.is_empty()).map(PathBuf::from);
    let config = directory("XDG_CONFIG_HOME").filter(|path| path.is_absolute());
    let config = config.or_else(|| Some(directory("HOME")?.join(".config")))?;
    Some(config.join(FILE))
}

fn parse(path: &Path, text: &str) -> Result<Settings, Error> {
    // Comments and trailing commas are as in experiment files.
    let file: SettingsFile =
        serde_json::from_str(&experiment_file::plain(text)).map_err(|error| {
            let place = format!(" at line {} column {}", error.line(), error.column());
            let message = error.to_string();
            let message = message.strip_suffix(&place).unwrap_or(&message);
            let (path, line) = (path.display(), error.line());
            let message = format!("{path}: line {line}: {message}; {REMEDY}");
            Error::at(Code::UnreadableFile, format!("{path}:{line}"), message)
        })?;
    Ok(file.within(path.parent().unwrap_or(Path::new(""))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::shell_command;

    const EVERY_KEY: &str = r#"{
        "coordinator": "https://h:1", "token-file": "client.token", "tls-ca": "/etc/ca.pem",
        "tls-cert": "c.pem", "tls-key": "c.key", "tls-domain": "name", "plaintext": true
    }"#;

    fn settings(address: Option<&str>) -> Settings {
        Settings { coordinator: address.map(str::to_owned), ..Settings::default() }
    }

    #[test]
    fn flags_take_precedence_over_the_file() {
        let (flag, file) = (settings(Some("http://flag:1")), settings(Some("http://file:1")));
        assert_eq!(flag.clone().or(file.clone()), flag);
        assert_eq!(settings(None).or(file.clone()), file);
        assert_eq!(settings(None).address(), "http://127.0.0.1:7700");
    }

    #[test]
    fn an_empty_variable_counts_as_unset() {
        let file = settings(Some("http://file:1"));
        assert_eq!(settings(Some("")).without_empty().or(file.clone()), file);
        assert!(!settings(Some("")).has_coordinator() && file.has_coordinator());
    }

    #[test]
    fn further_commands_repeat_the_options_that_the_environment_does_not_give() {
        let given = parse(Path::new("my files/config.json"), EVERY_KEY).unwrap();
        let all = given.words(&Settings::default());
        assert_eq!(
            shell_command(all.clone()),
            "--coordinator https://h:1 --token-file 'my files/client.token' --tls-ca /etc/ca.pem \
             --tls-cert 'my files/c.pem' --tls-key 'my files/c.key' --tls-domain name --plaintext"
        );
        let options = Settings::augment_args(Command::new("swarmctl"));
        for option in options.get_arguments().filter(|option| option.get_id() != "data_dir") {
            let name = format!("--{}", option.get_long().unwrap());
            assert!(all.contains(&name), "{name}");
        }
        assert_eq!(given.words(&settings(Some("https://h:1"))), all[2..]);
        assert_eq!(given.words(&settings(Some("https://h:2"))), all);
        assert_eq!(given.words(&given), Vec::<String>::new());
    }

    #[test]
    fn every_flag_has_its_key_and_files_are_beside_the_settings() {
        let expected = Settings {
            said: Vec::new(),
            coordinator: Some("https://h:1".into()),
            data_dir: None,
            token_file: Some("/home/ada/client.token".into()),
            credentials: CredentialArgs {
                tls_ca: Some("/etc/ca.pem".into()),
                tls_cert: Some("/home/ada/c.pem".into()),
                tls_key: Some("/home/ada/c.key".into()),
                tls_domain: Some("name".into()),
                plaintext: true,
            },
        };
        let found = parse(Path::new("/home/ada/config.json"), EVERY_KEY).unwrap();
        assert_eq!(found, expected);
        assert_eq!(settings(None).or(found.clone()), expected);
        let said = Settings { token_file: Some("other".into()), ..settings(Some("https://h:1")) };
        assert_eq!(said.clone().or(found), Settings { token_file: said.token_file, ..expected });
    }

    #[test]
    fn a_token_reaches_only_its_coordinator() {
        let file = Settings { token_file: Some("secret".into()), ..settings(Some("http://a:1")) };
        assert_eq!(settings(Some("http://b:1")).or(file).token_file, None);
        let file = Settings { token_file: Some("secret".into()), ..settings(None) };
        assert_eq!(settings(Some("http://b:1")).or(file).token_file, None);
    }

    #[test]
    fn a_mistake_in_the_file_is_named_with_its_line() {
        let path = Path::new("config.json");
        for empty in ["{}", "{ // the usual place\n}", "/* none */ {}"] {
            assert_eq!(parse(path, empty).unwrap(), settings(None));
        }
        for (text, expected) in [
            (
                "{\n  \"coordinater\": \"http://h:1\"\n}",
                "config.json: line 2: unknown field `coordinater`, expected one of `coordinator`, \
                 `token-file`, `tls-ca`, `tls-cert`, `tls-key`, `tls-domain`, `plaintext`",
            ),
            (
                "{\n\n  \"coordinator\": 7700}",
                "config.json: line 3: invalid type: integer `7700`, expected a string",
            ),
            ("{", "config.json: line 1: EOF while parsing an object"),
        ] {
            let error = parse(path, text).unwrap_err();
            let expected = format!("{expected}; {REMEDY}");
            assert_eq!((error.exit_code(), error.to_string()), (2, expected));
        }
    }
}
