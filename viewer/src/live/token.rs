//! The word that whoever may look has in the page's address.

use anyhow::Context;
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use rand::TryRng;
use rand::rngs::SysRng;
use subtle::ConstantTimeEq;

/// Random bytes of a token; 128 bits cannot be guessed.
const BYTES: usize = 16;

/// A token drawn for one server.
#[derive(Clone)]
pub(crate) struct Token(String);

impl Token {
    /// Draws one from the system's randomness.
    pub(crate) fn draw() -> anyhow::Result<Self> {
        let mut bytes = [0; BYTES];
        SysRng
            .try_fill_bytes(&mut bytes)
            .context("the system gives no random numbers")?;
        Ok(Self(URL_SAFE_NO_PAD.encode(bytes)))
    }

    /// As it stands in an address.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether `word` is the token. How long it takes tells nothing but the length.
    pub(crate) fn is(&self, word: &str) -> bool {
        self.0.as_bytes().ct_eq(word.as_bytes()).into()
    }
}

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_server_has_its_own_and_only_the_whole_word_counts() {
        let (one, other) = (Token::draw().unwrap(), Token::draw().unwrap());
        assert_eq!(one.as_str().len(), 22);
        let said = one.as_str().to_owned();
        assert!(one.is(&said));
        assert!(!one.is(other.as_str()));
        for wrong in ["", &one.as_str()[1..], &format!("{}x", one.as_str())] {
            assert!(!one.is(wrong), "{wrong}");
        }
        assert!(!format!("{one:?}").contains(one.as_str()));
    }
}
