//! Access of a browser to the pages of this process, and what files for browsers contain.

use std::net::SocketAddr;

use swarm_transport::Token;
use swarm_web::SIMULATOR;

use crate::error::Error;

/// The address that logs a browser in. Browsers do not send the part after `#`: a script of
/// the page reads it.
pub fn login_address(pages: SocketAddr, token: &Token) -> String {
    format!("http://{pages}/login#{}", token.reveal())
}

/// 256 bits from the system's source of randomness.
pub fn random_token() -> Token {
    let [high, low]: [u128; 2] = rand::random();
    Token::parse(&format!("{high:032x}{low:032x}")).expect("hexadecimal digits are fit for a token")
}

/// The simulator for the file that an option names.
pub fn simulator(option: &str) -> Result<&'static [u8], Error> {
    SIMULATOR.ok_or_else(|| {
        Error::Input(format!(
            "{option}: this program was compiled without the simulator for browsers, which \
             releases have; `dist/build simulator` makes it"
        ))
    })
}
