//! What the first sample waits for: `topic:count`.

use anyhow::{Result, bail};
use rotary_sins_msgs::interfaces::topics::IMU_DATA_RAW;

/// One entry of the parameter `wait_for_subscribers`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wait {
    /// Name of the topic, as it was given.
    pub topic: String,
    /// How many other ends it must have.
    pub count: usize,
}

/// Reads the entries; `known` are the names that may be given.
///
/// # Errors
/// An entry of another form or of an unknown topic, with what is known.
pub fn parse(entries: &[String], known: &[&str]) -> Result<Vec<Wait>> {
    entries
        .iter()
        .map(|entry| parse_one(entry, known))
        .collect()
}

fn parse_one(entry: &str, known: &[&str]) -> Result<Wait> {
    let expected = format!("expected topic:count, e.g. {}:2", IMU_DATA_RAW.name);
    let Some((topic, count)) = entry.rsplit_once(':') else {
        bail!("parameter 'wait_for_subscribers': '{entry}', {expected}");
    };
    let Ok(count) = count.parse() else {
        bail!("parameter 'wait_for_subscribers': '{entry}', {expected}");
    };
    if !known.contains(&topic) {
        bail!(
            "parameter 'wait_for_subscribers': '{topic}' is none of {}",
            known.join(", ")
        );
    }
    Ok(Wait {
        topic: topic.to_owned(),
        count,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn entry(text: &str) -> Result<Vec<Wait>> {
        parse(&[text.to_owned()], &["imu/data_raw", "fix"])
    }

    /// Topic and count are read; what cannot be meant is refused with what can.
    #[test]
    fn entries_are_read_or_refused() {
        assert_eq!(
            entry("imu/data_raw:2").unwrap(),
            [Wait {
                topic: "imu/data_raw".to_owned(),
                count: 2
            }]
        );
        assert!(
            entry("imu/data_raw")
                .unwrap_err()
                .to_string()
                .contains("topic:count")
        );
        assert!(
            entry("fix:many")
                .unwrap_err()
                .to_string()
                .contains("fix:many")
        );
        assert!(
            entry("imu:2")
                .unwrap_err()
                .to_string()
                .contains("imu/data_raw, fix")
        );
    }
}
