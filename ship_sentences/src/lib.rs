//! What other instruments aboard expect of a heading and motion sensor: NMEA 0183 sentences over UDP or a serial line.
//!
//! [`Motion`] is what is known of the ship at one moment; [`Sentence::text`] makes a line of it, with checksum, CR and LF;
//! [`Output`] sends lines to a UDP address or a serial device. The crate knows nothing of ROS.
//!
//! | sentence | what | signs |
//! | --- | --- | --- |
//! | HDT | true heading, deg | clockwise from true north |
//! | THS | the same with a mode: A autonomous, E estimated, S simulator, V void | |
//! | ROT | rate of turn, deg/min, A or V | bow to starboard positive |
//! | GGA | time, latitude, longitude, height; quality 6 (dead reckoning), 8 (simulator), 0 (none) | |
//! | PASHR | time, heading, roll, pitch, their one-sigmas, quality | starboard down, bow up positive |
//! | PHTRO | pitch with M (bow up) or P (bow down), roll with T (port up) or B (port down) | by letter |
//!
//! ```
//! use ship_sentences::{Motion, Quality, Sentence};
//!
//! let motion = Motion { heading_rad: 1.5, quality: Quality::Estimated, ..Motion::default() };
//! assert_eq!(Sentence::Ths.text("IN", &motion), "$INTHS,85.94,E*23\r\n");
//! ```

mod output;
mod sentence;

pub use output::{Error, Output};
pub use sentence::{Motion, Quality, Sentence, checksum};
