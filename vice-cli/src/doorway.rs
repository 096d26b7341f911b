//! How the browser learns the address of the annotator, and nobody else.

use std::io::Write;
use std::path::Path;

/// A page for this user's eyes that leads a browser to the labels: on the command line of the browser every user of the
/// machine could read the address. Removed when it was used, or at the end.
pub(crate) struct Doorway {
    _file: tempfile::NamedTempFile,
}

impl Doorway {
    /// Has the browser open it; says so where that cannot be had.
    pub(crate) fn open(folder: &Path, url: &str) -> Option<Self> {
        let opened = Self::write(folder, url).and_then(|file| {
            open::that_detached(file.path())?;
            Ok(file)
        });
        opened
            .map(|file| Self { _file: file })
            .inspect_err(|error| {
                tracing::warn!("no browser could be opened ({error}): open the address above by hand");
            })
            .ok()
    }

    /// Beside the labels: browsers in a sandbox of their own see no hidden or temporary folders.
    fn write(folder: &Path, url: &str) -> std::io::Result<tempfile::NamedTempFile> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let mut file =
            tempfile::Builder::new().prefix("vice-annotate-").suffix(".html").tempfile_in(folder)?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = file.as_file().metadata()?.permissions().mode();
            if mode & 0o077 != 0 {
                return Err(std::io::Error::other("files beside the labels cannot be kept from other users"));
            }
        }
        writeln!(
            file,
            "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">\
             <meta http-equiv=\"refresh\" content=\"0;url={url}\"><title>VICE</title><p><a href=\"{url}\">To the labels</a>"
        )?;
        file.flush()?;
        Ok(file)
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn only_this_user_can_read_it_and_it_goes_away() {
        let folder = tempfile::tempdir().unwrap();
        let file = Doorway::write(folder.path(), "http://127.0.0.1:1/open?token=t").unwrap();
        let mode = file.as_file().metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        let text = std::fs::read_to_string(file.path()).unwrap();
        assert!(text.contains("0;url=http://127.0.0.1:1/open?token=t\""), "{text}");
        drop(Doorway { _file: file });
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
