//! Tokens: shared secrets that determine the rights of a peer.

use std::{
    env, fmt,
    fs::File,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;
use tonic::metadata::{Ascii, MetadataValue};

/// The prefix of a token in the `authorization` header.
pub const BEARER: &str = "Bearer ";

/// Fewest characters: 128 bits, written in hexadecimal.
const LEN_MIN: usize = 32;
/// Most characters, so that the token fits into a header.
const LEN_MAX: usize = 1024;

/// A shared secret. Neither `Debug` nor any error shows it.
#[derive(Clone)]
pub struct Token(String);

/// Why a token cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file cannot be read.
    #[error("cannot read the token file {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The text is not a valid token.
    #[error("{origin} {problem}; `openssl rand -hex 32` makes a good one")]
    Unfit {
        /// The source of the text.
        origin: String,
        /// The mistake in it.
        problem: String,
    },
    /// Two sources give a token.
    #[error("both the token file {} and {variable} are given; leave one out", path.display())]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The environment variable.
        variable: &'static str,
    },
}

impl Token {
    /// Parses a token: 32 to 1,024 visible ASCII characters; surrounding white space is ignored.
    ///
    /// # Errors
    ///
    /// The problem of the text, without the text itself.
    pub fn parse(text: &str) -> Result<Self, String> {
        let token = text.trim_ascii();
        if token.is_empty() {
            return Err("is empty".to_owned());
        }
        if !token.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err("has other characters than visible ASCII".to_owned());
        }
        if !(LEN_MIN..=LEN_MAX).contains(&token.len()) {
            let n = token.len();
            return Err(format!(
                "has {n} characters; a token has {LEN_MIN} to {LEN_MAX}, chosen at random"
            ));
        }
        Ok(Self(token.to_owned()))
    }

    /// The secret itself, for the program that made the token and passes it on.
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// A secret of 256 bits, in hexadecimal, that is derived from the token and does not reveal
    /// it. `purpose`: each purpose has a different secret.
    pub fn derived(&self, purpose: &str) -> String {
        let digest = Sha256::new().chain_update(purpose).chain_update([0]).chain_update(&self.0);
        digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Loads the token from a file, or else from an environment variable, if there is any.
    ///
    /// # Errors
    ///
    /// If both give a token, if the file cannot be read, or if the token is invalid.
    pub fn load(file: Option<&Path>, variable: &'static str) -> Result<Option<Self>, TokenError> {
        Self::choose(file, variable, env::var_os(variable).map(|v| v.into_encoded_bytes()))
    }

    fn choose(
        file: Option<&Path>,
        variable: &'static str,
        value: Option<Vec<u8>>,
    ) -> Result<Option<Self>, TokenError> {
        let (origin, bytes) = match (file, value) {
            (None, None) => return Ok(None),
            (Some(path), Some(_)) => {
                return Err(TokenError::Ambiguous { path: path.into(), variable });
            }
            (None, Some(value)) => (format!("the token in {variable}"), value),
            (Some(path), None) => {
                let error = |source| TokenError::File { path: path.into(), source };
                let bytes = read_start(path).map_err(error)?;
                (format!("the token in {}", path.display()), bytes)
            }
        };
        let text = String::from_utf8_lossy(&bytes);
        Self::parse(&text).map(Some).map_err(|problem| TokenError::Unfit { origin, problem })
    }

    /// Whether a peer presents this token. Takes the same time wherever the two differ; the time
    /// reveals only whether their lengths are equal.
    pub fn matches(&self, presented: &[u8]) -> bool {
        self.0.as_bytes().ct_eq(presented).into()
    }

    /// The value of the `authorization` header; marked so that libraries neither
    /// print nor compress it.
    pub fn header(&self) -> MetadataValue<Ascii> {
        let mut value: MetadataValue<Ascii> =
            format!("{BEARER}{}", self.0).parse().expect("visible ASCII is a valid header");
        value.set_sensitive(true);
        value
    }
}

impl PartialEq for Token {
    fn eq(&self, other: &Self) -> bool {
        self.matches(other.0.as_bytes())
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

/// Reads the start of a file: no token is longer, and `/dev/zero` has no end.
fn read_start(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(2 * LEN_MAX as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const SECRET: &str = "0123456789abcdef0123456789abcdef";
    const VARIABLE: &str = "SWARM_TEST_TOKEN";

    fn chosen(file: Option<&Path>, value: Option<&str>) -> Result<Option<Token>, String> {
        Token::choose(file, VARIABLE, value.map(Into::into)).map_err(|error| error.to_string())
    }

    #[test]
    fn a_token_matches_itself_alone() {
        let token = Token::parse(SECRET).unwrap();
        assert!(token.matches(SECRET.as_bytes()));
        let mut other = SECRET.as_bytes().to_vec();
        other[31] ^= 1;
        for other in
            [&other[..], b"", &SECRET.as_bytes()[..31], &[SECRET.as_bytes(), b"0"].concat()]
        {
            assert!(!token.matches(other));
        }
    }

    #[test]
    fn nothing_shows_a_token() {
        let token = Token::parse(SECRET).unwrap();
        assert_eq!(format!("{token:?}"), "Token(..)");
        assert_eq!(format!("{:?}", token.header()), "Sensitive");
        for bad in [&SECRET[1..], &format!("{SECRET}\u{e9}"), &format!("{SECRET} x")] {
            let error = chosen(None, Some(bad)).unwrap_err();
            assert!(!error.contains(&SECRET[1..8]), "{error}");
        }
    }

    #[test]
    fn short_empty_and_unprintable_tokens_are_refused_with_their_origin() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("token");
        for bad in ["", "\n", &SECRET[1..], &format!("{SECRET}\0"), &"x".repeat(LEN_MAX + 1)] {
            fs::write(&path, bad).unwrap();
            let error = chosen(Some(&path), None).unwrap_err();
            assert!(error.contains(path.to_str().unwrap()), "{error}");
            let error = chosen(None, Some(bad)).unwrap_err();
            assert!(error.contains(VARIABLE) && error.contains("openssl rand"), "{error}");
        }
    }

    #[test]
    fn a_file_may_end_in_a_newline_but_not_be_missing_or_endless() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("token");
        fs::write(&path, format!("{SECRET}\n")).unwrap();
        assert!(chosen(Some(&path), None).unwrap().unwrap().matches(SECRET.as_bytes()));
        let missing = directory.path().join("missing");
        assert!(chosen(Some(&missing), None).unwrap_err().contains("missing"));
        assert!(chosen(Some(Path::new("/dev/zero")), None).is_err());
    }

    #[test]
    fn two_sources_of_a_token_are_refused() {
        assert!(chosen(None, None).unwrap().is_none());
        assert!(chosen(None, Some(SECRET)).unwrap().is_some());
        let error = chosen(Some(Path::new("a-file")), Some(SECRET)).unwrap_err();
        assert!(error.contains("a-file") && error.contains(VARIABLE), "{error}");
    }
}
