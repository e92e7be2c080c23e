//! Files that leave.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;

/// As many links as Linux follows.
const MOST_LINKS: usize = 40;
/// What a new file may be read and written by, before the umask.
const NEW_FILE: u32 = 0o666;

/// Writes a whole file: beside its place, synced, renamed to it, and the folder synced. What is there already is replaced as a whole,
/// and keeps its permissions. A symbolic link is followed, so that its target changes. What is no regular file (`/dev/null`, a
/// terminal, a FIFO that somebody reads) is written to, never replaced. Nothing half-written stays behind.
///
/// # Errors
/// What the system says; a FIFO that nobody reads is one.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let there = match fs::metadata(path) {
        Ok(there) => Some(there),
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(error),
    };
    if let Some(there) = &there {
        if there.is_dir() {
            return Err(io::Error::from(io::ErrorKind::IsADirectory));
        }
        if !there.is_file() || is_descriptor(path) {
            return write_through(path, there, bytes);
        }
    }
    let target = followed(path)?;
    let folder = folder_of(&target);
    let mut beside = beside(folder)?;
    if let Some(there) = &there {
        beside
            .as_file()
            .set_permissions(Permissions::from_mode(there.mode() & 0o777))?;
    }
    beside.write_all(bytes)?;
    beside.as_file().sync_all()?;
    beside.persist(&target).map_err(|error| error.error)?;
    File::open(folder)?.sync_all()
}

/// Whether [`write()`] could write there now, without changing anything: for work of hours whose end is a file. What is a device or a
/// pipe is only looked at.
///
/// # Errors
/// What [`write()`] would say.
pub fn check(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => return Err(io::Error::from(io::ErrorKind::IsADirectory)),
        Ok(there) if !there.is_file() || is_descriptor(path) => {
            return Ok(rustix::fs::access(path, rustix::fs::Access::WRITE_OK)?);
        }
        Ok(_) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    let target = followed(path)?;
    beside(folder_of(&target)).map(drop)
}

/// Makes a file that is not there yet, to be written bit by bit: no link is followed, and nothing is ever emptied.
///
/// # Errors
/// What the system says; that something of this name is there already is one.
pub fn create_new(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Whether both paths lead to the same file that is there.
pub fn is_same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| fs::metadata(path).map(|file| (file.dev(), file.ino()));
    matches!((place(one), place(other)), (Ok(one), Ok(other)) if one == other)
}

/// Names of open descriptors lead to files that somebody else has opened and goes on writing.
fn is_descriptor(path: &Path) -> bool {
    path.starts_with("/dev") || path.starts_with("/proc")
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A new file that goes away unless it gets another name. Made with O_EXCL under a name that nobody foresees: a link that was planted
/// is not followed.
fn beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    tempfile::Builder::new()
        .prefix(".")
        .suffix(".new")
        .permissions(Permissions::from_mode(NEW_FILE))
        .tempfile_in(folder)
}

/// Where the links lead, be there a file or not.
fn followed(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            // A link of no folder's own counts from the folder of the link.
            Ok(next) => target = target.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("too many links"))
}

fn write_through(path: &Path, there: &fs::Metadata, bytes: &[u8]) -> io::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true);
    let is_fifo = there.file_type().is_fifo();
    if is_fifo {
        // Without it a FIFO that nobody reads would be waited for.
        options.custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    }
    let mut file = options.open(path).map_err(|error| {
        if is_fifo {
            io::Error::new(error.kind(), format!("a FIFO that nobody reads ({error})"))
        } else {
            error
        }
    })?;
    if is_fifo {
        let flags = rustix::fs::fcntl_getfl(&file)?;
        rustix::fs::fcntl_setfl(&file, flags - OFlags::NONBLOCK)?;
    }
    file.write_all(bytes)?;
    match file.sync_all() {
        // Pipes and terminals have nothing to sync.
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::io::Read;
    use std::os::unix::fs::symlink;

    use nix::sys::stat::Mode;
    use nix::unistd::mkfifo;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// A file is replaced as a whole and keeps its permissions; whoever has the old one open still reads the old one, and nothing
    /// stays beside it, after a success or a failure.
    #[test]
    fn a_file_is_replaced_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.yaml");
        write(&file, b"old").unwrap();
        fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        let mut reader = File::open(&file).unwrap();
        write(&file, b"new").unwrap();
        let mut old = String::new();
        reader.read_to_string(&mut old).unwrap();
        assert_eq!(
            (old.as_str(), fs::read(&file).unwrap().as_slice()),
            ("old", &b"new"[..])
        );
        assert_eq!(fs::metadata(&file).unwrap().mode() & 0o777, 0o640);
        write(&folder.path().join("none").join("b"), b"x").unwrap_err();
        write(folder.path(), b"x").unwrap_err();
        assert_eq!(names(folder.path()), ["a.yaml"]);
    }

    /// What is no regular file is written to and stays what it is: a device, and a FIFO that somebody reads. One that nobody reads
    /// is told at once.
    #[test]
    fn devices_and_pipes_stay_what_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let null = folder.path().join("null");
        symlink("/dev/null", &null).unwrap();
        write(&null, b"gone").unwrap();
        let kind = fs::metadata(&null).unwrap().file_type();
        assert!(kind.is_char_device() && fs::symlink_metadata(&null).unwrap().is_symlink());

        let fifo = folder.path().join("fifo");
        mkfifo(&fifo, Mode::S_IRWXU).unwrap();
        let told = write(&fifo, b"x").unwrap_err().to_string();
        assert!(told.contains("nobody reads"), "{told}");
        let path = fifo.clone();
        let (opened, is_open) = std::sync::mpsc::channel();
        let reader = std::thread::spawn(move || {
            // Open for both, so that opening does not wait for the writer.
            let mut fifo = OpenOptions::new()
                .read(true)
                .write(true)
                .open(path)
                .unwrap();
            opened.send(()).unwrap();
            let mut heard = [0; 5];
            fifo.read_exact(&mut heard).unwrap();
            heard
        });
        is_open.recv().unwrap();
        write(&fifo, b"heard").unwrap();
        assert_eq!(&reader.join().unwrap(), b"heard");
        assert!(fs::metadata(&fifo).unwrap().file_type().is_fifo());
        assert_eq!(names(folder.path()), ["fifo", "null"]);
    }

    /// The target of a link changes, the link stays, also where it leads to nothing yet; a link that somebody planted beside the
    /// file is not followed.
    #[test]
    fn links_are_followed_and_traps_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let [link, target, chain, trap, victim] =
            ["link", "target", "chain", "target.new", "victim"]
                .map(|name| folder.path().join(name));
        symlink("target", &link).unwrap();
        symlink("link", &chain).unwrap();
        fs::write(&victim, "whole").unwrap();
        symlink(&victim, &trap).unwrap();
        for (path, text) in [(&link, "one"), (&chain, "two"), (&target, "three")] {
            write(path, text.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&target).unwrap(), text);
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert!(fs::symlink_metadata(&chain).unwrap().is_symlink());
        }
        assert_eq!(fs::read_to_string(&victim).unwrap(), "whole");
        let ring = folder.path().join("ring");
        symlink("ring", &ring).unwrap();
        write(&ring, b"x").unwrap_err();
    }

    /// What could not be written is told before anything is written, and looking changes nothing.
    #[test]
    fn a_place_is_looked_at_beforehand() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.yaml");
        check(&file).unwrap();
        assert_eq!(names(folder.path()), [""; 0]);
        fs::write(&file, "old").unwrap();
        check(&file).unwrap();
        check(Path::new("/dev/null")).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"old");
        for bad in [
            folder.path(),
            &folder.path().join("none/b"),
            &file.join("b"),
            Path::new("/proc/b"),
        ] {
            check(bad).unwrap_err();
        }
        assert_eq!(names(folder.path()), ["a.yaml"]);
    }

    /// What is to be new is not there yet, not even as a link to nothing; the same file under two names is known.
    #[test]
    fn what_is_new_replaces_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        create_new(&file).unwrap();
        create_new(&file).unwrap_err();
        assert!(!is_same(&file, &link));
        symlink("file", &link).unwrap();
        assert!(is_same(&file, &link));
        fs::remove_file(&file).unwrap();
        create_new(&link).unwrap_err();
    }
}
