//! A small separate file system, for tests that fill it up.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
    process::Command,
};

use tempfile::TempDir;

/// A mounted file system in memory; unmounted when dropped.
#[derive(Debug)]
pub struct SmallDisk {
    directory: TempDir,
}

impl SmallDisk {
    /// Mounts a disk; `None` if this process lacks the privilege.
    pub fn mount(n_bytes: u64) -> Option<Self> {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let size = format!("size={n_bytes}");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(directory.path());
        let is_mounted = mount.output().is_ok_and(|output| output.status.success());
        is_mounted.then_some(Self { directory })
    }

    /// Its mount point.
    pub fn path(&self) -> &Path {
        self.directory.path()
    }

    /// Writes until not another byte fits.
    pub fn fill(&self) {
        let mut ballast = File::create(self.ballast()).expect("there is room for an empty file");
        for block in [&[0_u8; 4096][..], &[0]] {
            let full = loop {
                if let Err(error) = ballast.write_all(block) {
                    break error;
                }
            };
            assert_eq!(full.kind(), io::ErrorKind::StorageFull);
        }
    }

    /// Removes the file that filled it.
    pub fn make_room(&self) {
        fs::remove_file(self.ballast()).expect("it is there");
    }

    /// Makes it read-only, or writable again; no program may be writing to it.
    pub fn set_read_only(&self, is_read_only: bool) {
        let options = if is_read_only { "remount,ro" } else { "remount,rw" };
        let mut mount = Command::new("mount");
        let status = mount.args(["-o", options]).arg(self.path()).status();
        assert!(status.is_ok_and(|status| status.success()));
    }

    fn ballast(&self) -> PathBuf {
        self.path().join("ballast")
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.path()).status();
    }
}
