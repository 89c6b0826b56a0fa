//! Checks that no file to write is one that is read, or another one to write.

use std::path::{Path, PathBuf};

use anyhow::bail;

/// The name that stands for standard input or output.
const STANDARD: &str = "-";

/// Refuses an output that would replace an input or another output; `outputs` are the option and the file of each that was given.
///
/// # Errors
/// Which output, and what it would replace.
pub(crate) fn check_outputs<'p>(
    inputs: impl IntoIterator<Item = &'p Path>,
    outputs: &[(&str, Option<&Path>)],
) -> anyhow::Result<()> {
    let inputs: Vec<PathBuf> = inputs.into_iter().filter_map(place).collect();
    let mut taken: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in outputs.iter().filter_map(|(option, path)| Some((*option, (*path)?))) {
        let Some(place) = place(path) else { continue };
        if inputs.contains(&place) {
            bail!("{option} {}: it would replace a file that is read; name another file", path.display());
        }
        if let Some((other, _)) = taken.iter().find(|(_, written)| *written == place) {
            bail!("{option} {}: {other} writes this file, too; name another file", path.display());
        }
        taken.push((option, place));
    }
    Ok(())
}

/// Where a file is, whatever path leads there; `None` if it is no file that could be replaced, such as a pipe.
fn place(path: &Path) -> Option<PathBuf> {
    if path.as_os_str() == STANDARD || path.metadata().is_ok_and(|about| !about.is_file()) {
        return None;
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = || Some(folder.canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(beside).or_else(|| Some(path.to_path_buf()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_replaces_no_input_and_no_other_output() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        std::fs::write(file("in.csv"), "t_s").unwrap();
        let (input, roundabout) = (file("in.csv"), folder.path().join("./in.csv"));
        let check = |outputs: &[(&str, Option<&Path>)]| {
            check_outputs([input.as_path()], outputs).map_err(|error| error.to_string())
        };
        let refused = check(&[("--out", Some(&roundabout))]).unwrap_err();
        assert!(refused.starts_with("--out ") && refused.contains("a file that is read"), "{refused}");
        let (one, same) = (file("out.csv"), folder.path().join("./out.csv"));
        let refused = check(&[("--out", Some(&one)), ("--report", Some(&same))]).unwrap_err();
        assert!(refused.contains("--out writes this file, too"), "{refused}");
        assert_eq!(
            check(&[("--out", Some(&one)), ("--report", None), ("--plot", Some(Path::new("-")))]),
            Ok(())
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_an_input_is_that_input() {
        let folder = tempfile::tempdir().unwrap();
        let (input, link) = (folder.path().join("in.csv"), folder.path().join("link.csv"));
        std::fs::write(&input, "t_s").unwrap();
        std::os::unix::fs::symlink(&input, &link).unwrap();
        assert!(check_outputs([input.as_path()], &[("--out", Some(&link))]).is_err());
    }
}
