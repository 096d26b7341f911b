//! Plugins that should not be loaded, and plugins that end, crash, hang, talk or take without end.

use std::fs;

use vice_tests::{compile_plugin, vice};

use super::text;
use crate::plugin_hostile::{Hostile, one_error};

#[cfg(unix)]
#[test]
fn plugins_through_a_link_in_a_folder_that_anyone_may_write_to() {
    use std::os::unix::fs::PermissionsExt;
    let good = Hostile::new(&[]);
    let open = tempfile::tempdir().unwrap();
    let link = open.path().join("libhostile.so");
    std::os::unix::fs::symlink(&good.library, &link).unwrap();
    fs::set_permissions(open.path(), fs::Permissions::from_mode(0o777)).unwrap();
    one_error(&vice(&["formats", "--plugin", text(&link)]), &["not loaded", "folder of the link"]);
    fs::set_permissions(open.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let listed = vice(&["formats", "--plugin", text(&link)]);
    assert!(listed.code == 0 && listed.stdout.contains("hostile 1.2.3"), "{}{}", listed.stdout, listed.stderr);
}
