//! Which samples of a bag, and what the bag does not say itself.

use bags::{Bag, Sample, SensorOptions};
use sins::{earth::Position, table::Turntable, time::Stamp};

use crate::Error;

/// The samples that were asked for.
#[derive(Clone, Debug)]
pub struct SensorSource {
    /// Topics, and the part of the bag.
    pub options: SensorOptions,
    /// A position in place of the bag's.
    pub given_position: Option<Position>,
    /// The table.
    pub turntable: Turntable,
}

impl SensorSource {
    /// What comes before the first sample: the position of the command line, else the last one before the chosen part.
    ///
    /// # Errors
    /// Where the bag cannot be read.
    pub fn first_position(
        &self,
        bag: &Bag,
        fix_topic: Option<usize>,
    ) -> Result<Option<Sample>, Error> {
        let position = match (self.given_position, self.options.start_offset) {
            (None, Some(offset)) => position_before(bag, offset, fix_topic)?,
            (given, _) => given,
        };
        Ok(position.map(|position| {
            Sample::Fix(bags::Fix {
                stamp: Stamp::default(),
                position: Some(position),
                sigma_m: nalgebra::Vector3::zeros(),
            })
        }))
    }

    /// Whether the position is that of the command line, and those of the bag are left aside.
    pub fn has_given_position(&self) -> bool {
        self.given_position.is_some()
    }
}

/// The last position before the part that is read, as a latched topic would give it to a late subscriber.
fn position_before(
    bag: &Bag,
    offset: f64,
    topic: Option<usize>,
) -> Result<Option<Position>, Error> {
    let (Some(topic), Some((start, _))) = (topic, bag.time_range()) else {
        return Ok(None);
    };
    let end = start.saturating_add((offset * 1e9).round() as u64);
    Ok(bags::last_position_before(bag, topic, end)?)
}
