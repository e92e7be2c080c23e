//! Files that enter: whole, small, and at once.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
/// What the system says, and what is no regular file (a device may go on for ever, a FIFO may never begin) or is longer.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let (file, length) = open(path, limit)?;
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(too_long(bytes.len() as u64, limit));
    }
    Ok(bytes)
}

/// The same as text.
///
/// # Errors
/// As [`read`]; bytes that are no UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    String::from_utf8(read(path, limit)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let told = format!("no text: byte {at} is no UTF-8");
        io::Error::new(io::ErrorKind::InvalidData, told)
    })
}

fn open(path: &Path, limit: u64) -> io::Result<(File, u64)> {
    // Opening a FIFO would wait for a writer.
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(OFlags::NONBLOCK.bits().cast_signed())
        .open(path)?;
    let there = file.metadata()?;
    if there.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    if !there.is_file() {
        let told = "a device or a pipe, expected a regular file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, told));
    }
    if there.len() > limit {
        return Err(too_long(there.len(), limit));
    }
    Ok((file, there.len()))
}

fn too_long(length: u64, limit: u64) -> io::Error {
    let told = format!("{length} bytes, expected at most {limit}");
    io::Error::new(io::ErrorKind::FileTooLarge, told)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A file is read where it is small enough and text; what never ends or never begins is refused at once.
    #[test]
    fn only_small_regular_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        std::fs::write(&file, "text").unwrap();
        assert_eq!(read_text(&file, 4).unwrap(), "text");
        let told = read(&file, 3).unwrap_err().to_string();
        assert_eq!(told, "4 bytes, expected at most 3");
        std::fs::write(&file, b"te\xffxt").unwrap();
        let told = read_text(&file, 9).unwrap_err().to_string();
        assert_eq!(told, "no text: byte 2 is no UTF-8");
        let fifo = folder.path().join("fifo");
        nix::unistd::mkfifo(&fifo, nix::sys::stat::Mode::S_IRWXU).unwrap();
        for path in [Path::new("/dev/zero"), &fifo] {
            let told = read(path, 1000).unwrap_err().to_string();
            assert!(told.contains("expected a regular file"), "{told}");
        }
        assert!(read(folder.path(), 9).is_err() && read(&folder.path().join("b"), 9).is_err());
    }
}
