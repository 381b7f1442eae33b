//! A link to a coordinator: its address, and credentials that fit the address.

use std::net::IpAddr;

use tonic::{
    Request, Status,
    metadata::{Ascii, MetadataValue},
    service::Interceptor,
    transport::{ClientTlsConfig, Endpoint, Uri},
};

use crate::{
    Credentials, Token,
    tls_diagnosis::{is_break, tls_diagnosis},
};

/// An address of a coordinator, with the credentials for it.
#[derive(Debug, Clone)]
pub struct Link {
    /// The endpoint; the caller sets its timeouts.
    pub endpoint: Endpoint,
    /// Adds the token to every call.
    pub bearer: Bearer,
    /// The likely cause, as a question, if a connection breaks without an error.
    hint: &'static str,
}

/// Adds the token, if there is one, to every call.
#[derive(Debug, Clone, Default)]
pub struct Bearer(Option<MetadataValue<Ascii>>);

/// Why a link cannot be made; the caller has to fix the input.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The address is not the address of a coordinator.
    #[error(
        "`{address}` is not the address of a coordinator ({reason}); expected something like \
         http://127.0.0.1:7700"
    )]
    Address {
        /// The address.
        address: String,
        /// The mistake in it.
        reason: String,
    },
    /// TLS without an authority to check the coordinator's certificate against.
    #[error("{0} needs --tls-ca: the certificate of the authority that signed the coordinator's")]
    NoAuthority(String),
    /// TLS options with an address without TLS.
    #[error("--tls-... options are given, but {0} is without TLS; use https:// or leave them out")]
    NoTls(String),
    /// The token would be sent unencrypted over a network.
    #[error(
        "the token would be sent to {0} unencrypted; use https://, or pass --plaintext if every \
         member of that network is trusted"
    )]
    Exposed(String),
    /// Certificates or keys that cannot be used.
    #[error("the TLS files cannot be used: {0}")]
    Tls(String),
}

impl Link {
    /// Makes a link.
    ///
    /// # Errors
    ///
    /// If the address is invalid, if the credentials do not fit it, or if the token would be sent
    /// unencrypted over a network.
    pub fn new(address: &str, credentials: &Credentials) -> Result<Self, LinkError> {
        let not_an_address =
            |reason: String| LinkError::Address { address: address.to_owned(), reason };
        let mut endpoint = Endpoint::from_shared(address.to_owned())
            .map_err(|error| not_an_address(deepest(&error)))?;
        let uri = endpoint.uri().clone();
        let host = uri.host().filter(|host| !host.is_empty());
        let hint;
        let Credentials { token, authorities, identity, domain, plaintext } = credentials;
        match (uri.scheme_str(), host) {
            (Some("https"), Some(_)) => {
                let Some(authorities) = authorities else {
                    return Err(LinkError::NoAuthority(address.to_owned()));
                };
                hint = match identity {
                    Some(_) => "does it accept the certificate of --tls-cert?",
                    None => "does it require a client certificate, with --tls-cert and --tls-key?",
                };
                let mut tls = ClientTlsConfig::new().ca_certificate(authorities.clone());
                if let Some(identity) = identity {
                    tls = tls.identity(identity.to_tonic());
                }
                if let Some(domain) = domain {
                    tls = tls.domain_name(domain);
                }
                endpoint = endpoint.tls_config(tls).map_err(|error| {
                    LinkError::Tls(tls_diagnosis(&error).unwrap_or_else(|| deepest(&error)))
                })?;
            }
            (Some("http"), Some(_)) => {
                if authorities.is_some() || identity.is_some() || domain.is_some() {
                    return Err(LinkError::NoTls(address.to_owned()));
                }
                hint = "does it require https://, and is it a coordinator?";
                if token.is_some() && !plaintext && !is_loopback(&uri) {
                    return Err(LinkError::Exposed(address.to_owned()));
                }
            }
            _ => {
                let reason = "it does not start with http:// or https:// and a host";
                return Err(not_an_address(reason.to_owned()));
            }
        }
        let bearer = Bearer(token.as_ref().map(Token::header));
        Ok(Self { endpoint, bearer, hint })
    }

    /// Host and port of the coordinator.
    pub fn authority(&self) -> String {
        let uri = self.endpoint.uri();
        let default = if uri.scheme_str() == Some("https") { 443 } else { 80 };
        format!("{}:{}", uri.host().unwrap_or_default(), uri.port_u16().unwrap_or(default))
    }

    /// The likely cause of a call that failed with this error, as a question.
    pub fn hint(&self, error: &(dyn std::error::Error + 'static)) -> Option<&'static str> {
        is_break(error).then_some(self.hint)
    }
}

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(header) = &self.0 {
            request.metadata_mut().insert("authorization", header.clone());
        }
        Ok(request)
    }
}

/// Whether data sent to this address stays on this machine.
pub fn is_loopback(uri: &Uri) -> bool {
    let Some(host) = uri.host() else { return false };
    let host = host.trim_start_matches('[').trim_end_matches(']');
    host.eq_ignore_ascii_case("localhost")
        || host.parse().is_ok_and(|ip: IpAddr| ip.to_canonical().is_loopback())
}

fn deepest(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = cause.to_string();
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use tonic::transport::Certificate;

    use super::*;

    const SECRET: &str = "0123456789abcdef0123456789abcdef";

    fn with_token() -> Credentials {
        let token = Some(Token::parse(SECRET).unwrap());
        Credentials { token, ..Credentials::default() }
    }

    fn refusal(address: &str, credentials: &Credentials) -> LinkError {
        Link::new(address, credentials).expect_err(address)
    }

    #[test]
    fn an_invalid_address_is_refused() {
        for address in
            ["", "127.0.0.1:7700", "not an address", "ftp://host:1", "http://", "https://"]
        {
            let error = refusal(address, &Credentials::default());
            assert!(matches!(error, LinkError::Address { .. }), "{error}");
        }
    }

    #[test]
    fn a_token_leaves_the_machine_encrypted_or_not_at_all() {
        for address in
            ["http://10.0.0.1:7700", "http://coordinator:7700", "http://localhost.evil.org"]
        {
            assert!(matches!(refusal(address, &with_token()), LinkError::Exposed(_)), "{address}");
            let permitted = Credentials { plaintext: true, ..with_token() };
            assert!(Link::new(address, &permitted).is_ok());
            assert!(Link::new(address, &Credentials::default()).is_ok(), "there is no secret");
        }
        for address in
            ["http://127.0.0.1:1", "http://127.9.9.9:1", "http://LOCALHOST:1", "http://[::1]:1"]
        {
            assert!(Link::new(address, &with_token()).is_ok(), "{address}");
        }
    }

    #[test]
    fn tls_needs_an_authority_and_is_never_left_out_silently() {
        let error = refusal("https://host:1", &with_token());
        assert!(matches!(error, LinkError::NoAuthority(_)), "{error}");
        let domain = Credentials { domain: Some("host".into()), ..Credentials::default() };
        assert!(matches!(refusal("http://host:1", &domain), LinkError::NoTls(_)));
        let broken = Certificate::from_pem("-----BEGIN CERTIFICATE-----\n!\n");
        let broken = Credentials { authorities: Some(broken), ..Credentials::default() };
        assert!(matches!(refusal("https://host:1", &broken), LinkError::Tls(_)));
    }

    #[test]
    fn calls_carry_the_token_and_nothing_shows_it() {
        let mut link = Link::new("http://127.0.0.1:1", &with_token()).unwrap();
        let request = link.bearer.call(Request::new(())).unwrap();
        let header = request.metadata().get("authorization").unwrap();
        assert_eq!(header.to_str().unwrap(), format!("Bearer {SECRET}"));
        for shown in [format!("{link:?}"), format!("{request:?}"), format!("{:?}", with_token())] {
            assert!(!shown.contains(SECRET), "{shown}");
        }
    }
}
