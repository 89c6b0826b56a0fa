//! The text of an error for people.

/// An error with its causes. A cause that the text before it already ends with is said once.
pub(crate) fn error_text(error: &anyhow::Error) -> String {
    let causes = error.chain().skip(1).map(ToString::to_string);
    causes.fold(
        error.to_string(),
        |text, cause| if text.ends_with(&cause) { text } else { format!("{text}: {cause}") },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_is_said_once() {
        let cause = || anyhow::anyhow!("no such file");
        assert_eq!(error_text(&cause().context("reading log.csv")), "reading log.csv: no such file");
        let whole = cause().context("log.csv: cannot be read: no such file").context("reading the logs");
        assert_eq!(error_text(&whole), "reading the logs: log.csv: cannot be read: no such file");
    }
}
