//! The token that clients on other machines need.

use std::fmt::Write;

use anyhow::{anyhow, bail};
use percent_encoding::percent_decode_str;
use subtle::ConstantTimeEq;

/// The least number of characters: 64 bits even if all are hexadecimal digits.
const MIN_LENGTH: usize = 16;
/// Random bytes of a generated token: 128 bits.
const GENERATED_BYTES: usize = 16;

/// A secret shared with all clients that may drive.
#[derive(Clone)]
pub(crate) struct Token(String);

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// A token that was chosen by the operator.
    ///
    /// # Errors
    /// It is too short, or cannot be sent in a header.
    pub(crate) fn chosen(text: &str) -> anyhow::Result<Self> {
        if !text.bytes().all(|byte| byte.is_ascii_graphic()) {
            bail!(
                "FOOTPLATE_TOKEN has other signs than the letters, digits and signs of ASCII: use those only"
            );
        }
        if text.len() < MIN_LENGTH {
            bail!(
                "FOOTPLATE_TOKEN has {} characters: use at least {MIN_LENGTH}, or unset it, and beyond this machine one \
                 is generated",
                text.len()
            );
        }
        Ok(Self(text.to_owned()))
    }

    /// A random token.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub(crate) fn generated() -> anyhow::Result<Self> {
        let mut bytes = [0_u8; GENERATED_BYTES];
        getrandom::fill(&mut bytes).map_err(|error| {
            anyhow!("no token could be generated ({error}): set one in the environment as FOOTPLATE_TOKEN")
        })?;
        let mut text = String::new();
        for byte in bytes {
            // Writing to memory cannot fail.
            let _ = write!(text, "{byte:02x}");
        }
        Ok(Self(text))
    }

    /// The token as part of an address; a generated one needs no encoding.
    pub(crate) fn text(&self) -> &str {
        &self.0
    }

    /// Compares with the token of a header, in time that depends only on the length.
    pub(super) fn is(&self, shown: &str) -> bool {
        self.0.as_bytes().ct_eq(shown.as_bytes()).into()
    }

    /// Compares with the token of an address, where some characters are encoded like `%2B`.
    pub(super) fn is_decoded(&self, shown: &str) -> bool {
        let decoded: Vec<u8> = percent_decode_str(shown).collect();
        self.0.as_bytes().ct_eq(&decoded).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_tokens_and_those_that_no_header_holds_are_refused() {
        let refused = |text| Token::chosen(text).expect_err(text).to_string();
        assert!(refused("s3cret").contains("6 characters: use at least 16"));
        assert!(refused("sixteen letters and spaces").contains("ASCII"));
        assert!(refused("schlüsselwort-mit-ü").contains("ASCII"));
        assert!(Token::chosen("0123456789abcdef").is_ok());
    }

    #[test]
    fn a_base64_token_is_known_in_headers_and_addresses() {
        let token = Token::chosen("Zm9vdHBsYXRl+/8=").expect("16 characters");
        assert!(token.is("Zm9vdHBsYXRl+/8="));
        assert!(token.is_decoded("Zm9vdHBsYXRl%2B%2F8%3D"), "as browsers write it");
        assert!(token.is_decoded("Zm9vdHBsYXRl+/8="), "as people paste it");
        assert!(!token.is_decoded("Zm9vdHBsYXRl%2B%2F8"));
        assert!(!token.is("Zm9vdHBsYXRl%2B%2F8%3D"), "headers are not encoded");
    }

    #[test]
    fn generated_tokens_differ_and_are_long_enough() {
        let one = Token::generated().expect("random numbers");
        assert!(Token::chosen(one.text()).is_ok());
        assert!(!one.is(Token::generated().expect("random numbers").text()));
    }
}
