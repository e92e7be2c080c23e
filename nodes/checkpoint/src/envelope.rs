//! The bytes of a checkpoint: a header of 56 bytes, and the state in the format of postcard.
//!
//! | bytes | |
//! | --- | --- |
//! | 0 .. 16 | `ROTARY-SINS-KEPT` |
//! | 16 .. 40 | which node's, in ASCII, filled with zeros |
//! | 40 .. 44 | version of the state, little-endian, as all numbers |
//! | 44 .. 52 | length of the state |
//! | 52 .. 56 | CRC-32 of the bytes 16 .. 52 and of the state |

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

const MAGIC: &[u8; 16] = b"ROTARY-SINS-KEPT";
const KIND: std::ops::Range<usize> = 16..40;
const VERSION: std::ops::Range<usize> = 40..44;
const LENGTH: std::ops::Range<usize> = 44..52;
const CHECKSUM: std::ops::Range<usize> = 52..56;
/// Length of the header.
pub const HEADER: usize = 56;
/// No state of ours is longer: ten minutes of gathered samples at 1 kHz are 200 MB.
pub const LONGEST: u64 = 256 << 20;

/// Whose checkpoint it is, and of which version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// The node's name, at most 24 letters.
    pub name: &'static str,
    /// Rises with every change of what is kept.
    pub version: u32,
}

/// Why a checkpoint is not used.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It cannot be read.
    #[error("{0}")]
    Unreadable(String),
    /// It ends before its header does, or does not begin as one.
    #[error("no checkpoint: {0}")]
    NoCheckpoint(&'static str),
    /// It belongs to another node.
    #[error("a checkpoint of {found}, expected one of {expected}")]
    Foreign {
        /// Whose it is.
        found: String,
        /// Who asks.
        expected: &'static str,
    },
    /// Another version of the program wrote it.
    #[error("of version {found}, expected version {expected}")]
    OtherVersion {
        /// Its version.
        found: u32,
        /// This program's.
        expected: u32,
    },
    /// It is not as long as it says.
    #[error("torn: {found} bytes of state, expected {expected}")]
    Torn {
        /// So many are there.
        found: u64,
        /// So many should be.
        expected: u64,
    },
    /// A byte is not what was written.
    #[error("damaged: the checksum is {found:08x}, expected {expected:08x}")]
    Damaged {
        /// Of what is there.
        found: u32,
        /// Of what was written.
        expected: u32,
    },
    /// The checksum is right, and the state cannot be.
    #[error("no state of this program: {0}")]
    Impossible(String),
}

/// A state as bytes.
///
/// # Errors
/// What cannot be serialised.
pub fn encode<T: Serialize>(kind: Kind, state: &T) -> Result<Vec<u8>, String> {
    let mut bytes = vec![0; HEADER];
    bytes[..MAGIC.len()].copy_from_slice(MAGIC);
    for (to, from) in bytes[KIND].iter_mut().zip(kind.name.bytes()) {
        *to = from;
    }
    bytes[VERSION].copy_from_slice(&kind.version.to_le_bytes());
    let mut bytes = postcard::to_extend(state, bytes).map_err(|error| error.to_string())?;
    let length = (bytes.len() - HEADER) as u64;
    bytes[LENGTH].copy_from_slice(&length.to_le_bytes());
    let checksum = checksum(&bytes);
    bytes[CHECKSUM].copy_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

/// A state from bytes.
///
/// # Errors
/// [`Refusal`]: the first thing that is not as it should be.
pub fn decode<T: DeserializeOwned>(kind: Kind, bytes: &[u8]) -> Result<T, Refusal> {
    if bytes.get(..MAGIC.len()) != Some(MAGIC) {
        return Err(Refusal::NoCheckpoint("it does not begin as one"));
    }
    let (Some(of), Some(version), Some(length), Some(expected)) = (
        bytes.get(KIND),
        number(bytes, VERSION),
        number(bytes, LENGTH),
        number(bytes, CHECKSUM),
    ) else {
        return Err(Refusal::NoCheckpoint("it ends within its header"));
    };
    let name = of.iter().take_while(|byte| **byte != 0);
    let name: String = name
        .map(|byte| match *byte {
            letter @ (b'a'..=b'z' | b'_') => char::from(letter),
            _ => '?',
        })
        .collect();
    if name != kind.name {
        return Err(Refusal::Foreign {
            found: name,
            expected: kind.name,
        });
    }
    let version = u32::try_from(version).unwrap_or(u32::MAX);
    if version != kind.version {
        return Err(Refusal::OtherVersion {
            found: version,
            expected: kind.version,
        });
    }
    let state = &bytes[HEADER..];
    if state.len() as u64 != length {
        return Err(Refusal::Torn {
            found: state.len() as u64,
            expected: length,
        });
    }
    let (found, expected) = (checksum(bytes), u32::try_from(expected).unwrap_or(0));
    if found != expected {
        return Err(Refusal::Damaged { found, expected });
    }
    let impossible = |error: postcard::Error| Refusal::Impossible(error.to_string());
    let (state, rest) = postcard::take_from_bytes(state).map_err(impossible)?;
    if !rest.is_empty() {
        let told = format!("{} bytes more than it holds", rest.len());
        return Err(Refusal::Impossible(told));
    }
    Ok(state)
}

/// The state that a file keeps; `None` where there is no file.
///
/// # Errors
/// [`Refusal`].
pub fn read<T: DeserializeOwned>(kind: Kind, path: &Path) -> Result<Option<T>, Refusal> {
    match files::read(path, LONGEST) {
        Ok(bytes) => decode(kind, &bytes).map(Some),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Refusal::Unreadable(error.to_string())),
    }
}

fn number(bytes: &[u8], at: std::ops::Range<usize>) -> Option<u64> {
    let mut number = [0; 8];
    let part = bytes.get(at)?;
    number[..part.len()].copy_from_slice(part);
    Some(u64::from_le_bytes(number))
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&bytes[KIND.start..CHECKSUM.start]);
    hasher.update(&bytes[HEADER..]);
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const OURS: Kind = Kind {
        name: "self_calibrator",
        version: 3,
    };

    type State = (String, Vec<f64>, Option<u64>);

    fn state() -> State {
        ("place".to_owned(), vec![0.1, f64::INFINITY, -0.0], Some(7))
    }

    /// What is kept comes back to the last bit.
    #[test]
    fn there_and_back() {
        let bytes = encode(OURS, &state()).unwrap();
        assert_eq!(decode::<State>(OURS, &bytes), Ok(state()));
    }

    /// Torn at every byte, every bit turned over, something behind it: always refused, never a panic.
    #[test]
    fn every_damage_is_refused() {
        let bytes = encode(OURS, &state()).unwrap();
        for end in 0..bytes.len() {
            decode::<State>(OURS, &bytes[..end]).unwrap_err();
        }
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            decode::<State>(OURS, &damaged).unwrap_err();
        }
        let longer = [&bytes[..], &[0]].concat();
        assert!(matches!(
            decode::<State>(OURS, &longer),
            Err(Refusal::Torn { .. })
        ));
    }

    /// Another node's, another version's, and a state of another shape are told in one line each.
    #[test]
    fn the_reason_is_told() {
        let bytes = encode(OURS, &state()).unwrap();
        let told = |kind: Kind| decode::<State>(kind, &bytes).unwrap_err().to_string();
        let sequencer = Kind {
            name: "scheme_sequencer",
            ..OURS
        };
        assert_eq!(
            told(sequencer),
            "a checkpoint of self_calibrator, expected one of scheme_sequencer"
        );
        let newer = Kind { version: 4, ..OURS };
        assert_eq!(told(newer), "of version 3, expected version 4");
        let refused = decode::<(String, String)>(OURS, &bytes).unwrap_err();
        assert!(matches!(refused, Refusal::Impossible(_)), "{refused}");
        let refused = decode::<String>(OURS, &bytes).unwrap_err();
        assert!(
            refused.to_string().contains("more than it holds"),
            "{refused}"
        );
        assert_eq!(
            decode::<State>(OURS, b"stamp_ns: 0")
                .unwrap_err()
                .to_string(),
            "no checkpoint: it does not begin as one"
        );
    }

    /// Where there is no file there is no checkpoint; a device is none.
    #[test]
    fn a_file_may_be_missing() {
        let folder = tempfile::tempdir().unwrap();
        let nothing = read::<State>(OURS, &folder.path().join("none"));
        assert_eq!(nothing, Ok(None));
        let told = read::<State>(OURS, Path::new("/dev/zero")).unwrap_err();
        assert!(told.to_string().contains("regular file"), "{told}");
    }
}
