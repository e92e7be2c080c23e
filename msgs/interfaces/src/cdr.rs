//! CDR payloads as rosbag2 and DDS have them: four bytes that name the representation, then the fields.

use crate::RosMessage;
use byteorder::{BigEndian, LittleEndian};

/// Plain CDR, little endian, no options: what every payload written here begins with.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Reads a message from its payload.
///
/// # Errors
/// Why it is none of this type.
pub fn decode<M: RosMessage>(payload: &[u8]) -> Result<M, String> {
    let Some((head, fields)) = payload.split_first_chunk::<4>() else {
        return Err(format!(
            "{} bytes are too short for a CDR payload",
            payload.len()
        ));
    };
    let decoded = match head[..2] {
        [0, 1] => cdr_encoding::from_bytes::<M, LittleEndian>(fields),
        [0, 0] => cdr_encoding::from_bytes::<M, BigEndian>(fields),
        [a, b] => return Err(format!("representation {a:02x} {b:02x} is not plain CDR")),
        _ => return Err("no CDR payload".to_owned()),
    };
    decoded
        .map(|(message, _)| message)
        .map_err(|error| format!("not a {}: {error}", M::TYPE_NAME))
}

/// Appends a message as a payload to `payload`, which is emptied first.
///
/// # Errors
/// Where a value has no place in CDR (a text longer than 4 GiB).
pub fn encode<M: RosMessage>(message: &M, payload: &mut Vec<u8>) -> Result<(), String> {
    payload.clear();
    payload.extend(ENCAPSULATION);
    cdr_encoding::to_writer::<M, LittleEndian, _>(&mut *payload, message)
        .map_err(|error| error.to_string())
}
