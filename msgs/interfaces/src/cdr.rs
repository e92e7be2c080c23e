//! CDR payloads as rosbag2 and DDS have them: four bytes that name the representation, then the fields.

use byteorder::{BigEndian, LittleEndian};

use crate::RosMessage;

/// Plain CDR, little endian, no options: what every payload written here begins with.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Why bytes are no message, or a message no bytes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// There is no room for the four bytes of encapsulation.
    #[error("{0} bytes are too short for a CDR payload")]
    TooShort(usize),
    /// The encapsulation names another representation, such as XCDR2.
    #[error("representation {:02x} {:02x} is not plain CDR", .0[0], .0[1])]
    Representation([u8; 2]),
    /// The fields are not those of the type.
    #[error("not a {type_name}: {reason}")]
    NotOfType {
        /// Full name of the type.
        type_name: &'static str,
        /// What was found.
        reason: String,
    },
    /// A value has no place in CDR: a text longer than 4 GiB.
    #[error("a {type_name} that cannot be written: {reason}")]
    NotWritable {
        /// Full name of the type.
        type_name: &'static str,
        /// Which value.
        reason: String,
    },
}

/// Reads a message from its payload.
///
/// # Errors
/// [`Error`]: why it is none of this type.
pub fn decode<M: RosMessage>(payload: &[u8]) -> Result<M, Error> {
    let Some((&[a, b, _, _], fields)) = payload.split_first_chunk::<4>() else {
        return Err(Error::TooShort(payload.len()));
    };
    let decoded = match [a, b] {
        [0, 1] => cdr_encoding::from_bytes::<M, LittleEndian>(fields),
        [0, 0] => cdr_encoding::from_bytes::<M, BigEndian>(fields),
        other => return Err(Error::Representation(other)),
    };
    let not_of_type = |error: cdr_encoding::Error| Error::NotOfType {
        type_name: M::TYPE_NAME,
        reason: error.to_string(),
    };
    decoded.map(|(message, _)| message).map_err(not_of_type)
}

/// Appends a message as a payload to `payload`, which is emptied first.
///
/// # Errors
/// [`Error::NotWritable`].
pub fn encode<M: RosMessage>(message: &M, payload: &mut Vec<u8>) -> Result<(), Error> {
    payload.clear();
    payload.extend(ENCAPSULATION);
    let not_writable = |error: cdr_encoding::Error| Error::NotWritable {
        type_name: M::TYPE_NAME,
        reason: error.to_string(),
    };
    cdr_encoding::to_writer::<M, LittleEndian, _>(&mut *payload, message).map_err(not_writable)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::diagnostic_msgs::KeyValue;

    /// A payload of a machine that writes the big end first is the same message: texts, numbers of every width, sequences.
    #[test]
    fn the_big_end_may_come_first() {
        let mut message = crate::sensor_msgs::JointState {
            name: vec!["outer_joint".to_owned(), "b".to_owned()],
            position: vec![1.0, -0.5],
            velocity: vec![],
            effort: vec![f64::MAX],
            ..Default::default()
        };
        message.header.stamp.sec = -7;
        message.header.stamp.nanosec = 999_999_999;
        message.header.frame_id = "table".to_owned();
        let mut little = Vec::new();
        encode(&message, &mut little).unwrap();
        let mut big = vec![0, 0, 0, 0];
        cdr_encoding::to_writer::<_, BigEndian, _>(&mut big, &message).unwrap();
        assert_eq!(big[4..12], [0xff, 0xff, 0xff, 0xf9, 0x3b, 0x9a, 0xc9, 0xff]);
        assert_ne!(big, little);
        assert_eq!(decode(&big).as_ref(), Ok(&message));
        assert_eq!(decode(&little), Ok(message));
        // Said to be what it is not, it is none: the length of its first text is beyond its end.
        big[1] = 1;
        assert!(decode::<crate::sensor_msgs::JointState>(&big).is_err());
    }

    /// What is no message says why by its kind, and a message comes back as it was.
    #[test]
    fn what_is_no_message_is_told_by_its_kind() {
        let message = KeyValue {
            key: "gaps".to_owned(),
            value: "3".to_owned(),
        };
        let mut payload = Vec::new();
        encode(&message, &mut payload).unwrap();
        assert_eq!(decode(&payload), Ok(message));
        let decoded = |payload: &[u8]| decode::<KeyValue>(payload).unwrap_err();
        assert_eq!(decoded(&[0, 1]), Error::TooShort(2));
        assert_eq!(decoded(&[0, 7, 0, 0]), Error::Representation([0, 7]));
        assert_eq!(
            decoded(&[0, 7, 0, 0]).to_string(),
            "representation 00 07 is not plain CDR"
        );
        let cut_off = decoded(&payload[..payload.len() - 2]);
        assert!(matches!(
            cut_off,
            Error::NotOfType {
                type_name: "diagnostic_msgs/msg/KeyValue",
                ..
            }
        ));
    }
}
