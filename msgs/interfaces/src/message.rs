//! What every message type knows of itself.

use serde::{Serialize, de::DeserializeOwned};

use crate::KnownType;

/// Line between the parts of a `ros2msg` schema.
const SEPARATOR: &str =
    "================================================================================";

/// A ROS message: its name, its definition, its hash.
pub trait RosMessage: Serialize + DeserializeOwned + Clone + Send + Sync + 'static {
    /// Full name, e.g. `sensor_msgs/msg/Imu`.
    const TYPE_NAME: &'static str;
    /// Text of its `.msg` file.
    const DEFINITION: &'static str;
    /// REP-2011 hash of the type, `RIHS01_` and 64 hexadecimal digits.
    const TYPE_HASH: &'static str;

    /// Appends every type this one is made of, each once, in order of first use.
    fn collect_parts(found: &mut Vec<KnownType>);

    /// The `ros2msg` text that bags carry: the definition and, behind separators, those of all it is made of.
    fn schema() -> String {
        let mut parts = Vec::new();
        Self::collect_parts(&mut parts);
        let mut text = Self::DEFINITION.to_owned();
        for KnownType {
            name, definition, ..
        } in parts
        {
            text.push_str(SEPARATOR);
            text.push_str("\nMSG: ");
            text.push_str(&name.replace("/msg/", "/"));
            text.push('\n');
            text.push_str(definition);
        }
        text
    }
}

/// Ties a structure to its ROS type: name, definition, hash, and the structures it is made of.
///
/// ```
/// # use serde::{Deserialize, Serialize};
/// use ros2_interfaces::std_msgs::Header;
/// use ros2_interfaces::{Registry, RosMessage, ros_message};
///
/// /// One echo of a sonar.
/// #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
/// struct Ping {
///     header: Header,
///     range_m: f64,
/// }
///
/// ros_message!(
///     Ping,
///     "acme_msgs/msg/Ping",
///     "std_msgs/Header header\nfloat64 range_m\n",
///     "RIHS01_0000",
///     [Header]
/// );
///
/// // A hash that is not the definition's is refused, and the right one is told.
/// let mut registry = Registry::new();
/// let error = registry.register::<Ping>().unwrap_err().to_string();
/// assert!(error.contains("acme_msgs/msg/Ping says that its hash is RIHS01_0000"), "{error}");
/// ```
#[macro_export]
macro_rules! ros_message {
    ($type:ty, $name:literal, $definition:expr, $hash:literal, [$($part:ty),* $(,)?]) => {
        impl $crate::RosMessage for $type {
            const TYPE_NAME: &'static str = $name;
            const DEFINITION: &'static str = $definition;
            const TYPE_HASH: &'static str = $hash;

            #[allow(unused_variables, reason = "types made of numbers alone have no parts")]
            fn collect_parts(found: &mut ::std::vec::Vec<$crate::KnownType>) {
                $(
                    if !found.iter().any(|part| part.name == <$part as $crate::RosMessage>::TYPE_NAME) {
                        found.push($crate::KnownType::of::<$part>());
                        <$part as $crate::RosMessage>::collect_parts(found);
                    }
                )*
            }
        }

        $crate::ros_service_part!($type);
    };
}

/// Goal (0), result (1) or feedback (2) of the text of an `.action` file; they stand between lines of `---`.
pub const fn action_part(text: &'static str, wanted: usize) -> &'static str {
    let bytes = text.as_bytes();
    let (mut start, mut end, mut part) = (0, 0, 0);
    while end < bytes.len() {
        let at_line = end == 0 || bytes[end - 1] == b'\n';
        if at_line
            && end + 3 < bytes.len()
            && bytes[end] == b'-'
            && bytes[end + 1] == b'-'
            && bytes[end + 2] == b'-'
            && bytes[end + 3] == b'\n'
        {
            if part == wanted {
                break;
            }
            part += 1;
            end += 4;
            start = end;
        } else {
            end += 1;
        }
    }
    text.split_at(end).0.split_at(start).1
}

/// Lets a request or response of a service go through DDS (feature `dds`; otherwise it does nothing).
#[cfg(feature = "dds")]
#[macro_export]
macro_rules! ros_service_part {
    ($type:ty) => {
        impl $crate::ros2_client::Message for $type {}
    };
}

/// Lets a request or response of a service go through DDS (feature `dds`; otherwise it does nothing).
#[cfg(not(feature = "dds"))]
#[macro_export]
macro_rules! ros_service_part {
    ($type:ty) => {};
}
