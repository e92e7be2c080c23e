//! The sentences.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;
use std::str::FromStr;

const NANOS_A_DAY: i64 = 86_400 * 1_000_000_000;

/// How far what is sent may be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Not valid: the sentences say so, and leave the values out.
    #[default]
    Void,
    /// Dead reckoning or an alignment that is not finished.
    Estimated,
    /// Heading and attitude are as good as their sigmas say. The position stays one of dead reckoning.
    Valid,
    /// From a simulated sensor.
    Simulated,
}

/// The ship at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// UTC, nanoseconds since 1970.
    pub utc_nanos: i64,
    /// Geodetic latitude, WGS-84 \[rad\].
    pub latitude_rad: f64,
    /// Longitude, east positive \[rad\].
    pub longitude_rad: f64,
    /// Height above the ellipsoid \[m\].
    pub height_m: f64,
    /// Clockwise from true north \[rad\].
    pub heading_rad: f64,
    /// Starboard down positive \[rad\].
    pub roll_rad: f64,
    /// Bow up positive \[rad\].
    pub pitch_rad: f64,
    /// Change of heading, bow to starboard positive \[rad/s\].
    pub turn_rate_rad_s: f64,
    /// One-sigma of heading, roll and pitch \[rad\].
    pub sigma_rad: [f64; 3],
    /// Trust.
    pub quality: Quality,
}

/// A sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sentence {
    /// True heading.
    Hdt,
    /// True heading and mode.
    Ths,
    /// Rate of turn.
    Rot,
    /// Position.
    Gga,
    /// Attitude with accuracies (Ashtech, OxTS, Trimble).
    Pashr,
    /// Pitch and roll (iXblue).
    Phtro,
}

impl Sentence {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Hdt,
        Self::Ths,
        Self::Rot,
        Self::Gga,
        Self::Pashr,
        Self::Phtro,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hdt => "HDT",
            Self::Ths => "THS",
            Self::Rot => "ROT",
            Self::Gga => "GGA",
            Self::Pashr => "PASHR",
            Self::Phtro => "PHTRO",
        }
    }

    /// The line, from `$` to CR LF. `talker` (two letters, IN for an inertial system) stands before the standard sentences.
    /// Values that are not finite make it void.
    pub fn text(self, talker: &str, motion: &Motion) -> String {
        let finite = [
            motion.latitude_rad,
            motion.longitude_rad,
            motion.height_m,
            motion.heading_rad,
            motion.roll_rad,
            motion.pitch_rad,
            motion.turn_rate_rad_s,
        ]
        .iter()
        .all(|v| v.is_finite());
        let quality = if finite {
            motion.quality
        } else {
            Quality::Void
        };
        let void = quality == Quality::Void;
        let body = match self {
            Self::Hdt if void => format!("{talker}HDT,,T"),
            Self::Hdt => format!("{talker}HDT,{},T", degrees_of_turn(motion.heading_rad)),
            Self::Ths if void => format!("{talker}THS,,V"),
            Self::Ths => {
                let mode = match quality {
                    Quality::Valid => 'A',
                    Quality::Simulated => 'S',
                    _ => 'E',
                };
                format!("{talker}THS,{},{mode}", degrees_of_turn(motion.heading_rad))
            }
            Self::Rot if void => format!("{talker}ROT,,V"),
            Self::Rot => {
                let rate = signed(motion.turn_rate_rad_s.to_degrees() * 60.0, 1);
                format!("{talker}ROT,{rate},A")
            }
            Self::Gga => gga(talker, motion, quality),
            Self::Pashr => pashr(motion, quality),
            Self::Phtro if void => "PHTRO,,,,".to_owned(),
            Self::Phtro => {
                let [pitch, roll] = [motion.pitch_rad, motion.roll_rad].map(f64::to_degrees);
                format!(
                    "PHTRO,{:.2},{},{:.2},{}",
                    pitch.abs(),
                    if pitch < 0.0 { 'P' } else { 'M' },
                    roll.abs(),
                    // Starboard down is port up.
                    if roll < 0.0 { 'B' } else { 'T' },
                )
            }
        };
        format!("${body}*{:02X}\r\n", checksum(&body))
    }
}

impl FromStr for Sentence {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|s| s.name().eq_ignore_ascii_case(name))
            .ok_or_else(|| {
                let known: Vec<_> = Self::ALL.iter().map(|s| s.name()).collect();
                format!(
                    "'{name}' is no sentence, expected one of {}",
                    known.join(", ")
                )
            })
    }
}

/// Exclusive or of all characters between `$` and `*`.
pub fn checksum(body: &str) -> u8 {
    body.bytes().fold(0, |sum, byte| sum ^ byte)
}

/// 0.00 .. 359.99; what rounds to 360.00 is 0.00.
fn degrees_of_turn(angle_rad: f64) -> String {
    let hundredths = (angle_rad.rem_euclid(TAU).to_degrees() * 100.0).round() % 36_000.0;
    format!("{:.2}", hundredths / 100.0)
}

/// Rounded, and without a minus before zero.
fn signed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text
        .trim_start_matches('-')
        .bytes()
        .all(|b| matches!(b, b'0' | b'.'))
    {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// hhmmss with this many decimals, cut off and not rounded: a time that has not come yet is not sent.
fn time_of_day(utc_nanos: i64, decimals: u32) -> String {
    let nanos = utc_nanos.rem_euclid(NANOS_A_DAY);
    let (seconds, rest) = (nanos / 1_000_000_000, nanos % 1_000_000_000);
    let part = rest / 10_i64.pow(9 - decimals);
    format!(
        "{:02}{:02}{:02}.{part:0width$}",
        seconds / 3600,
        seconds / 60 % 60,
        seconds % 60,
        width = decimals as usize
    )
}

/// Degrees and minutes, five decimals of a minute (2 cm), with the letter of the hemisphere.
fn degrees_minutes(angle_rad: f64, width: usize, letters: [char; 2]) -> String {
    // Whole units of 1e-5 minutes, so that 59.999999 minutes become the next degree and not 60.
    let units = (angle_rad.to_degrees().abs() * 60.0 * 1e5).round() as u64;
    let (degrees, rest) = (units / 6_000_000, units % 6_000_000);
    let letter = letters[usize::from(angle_rad < 0.0 && units > 0)];
    format!(
        "{degrees:0width$}{:02}.{:05},{letter}",
        rest / 100_000,
        rest % 100_000
    )
}

fn gga(talker: &str, motion: &Motion, quality: Quality) -> String {
    let indicator = match quality {
        Quality::Void => 0,
        Quality::Estimated | Quality::Valid => 6,
        Quality::Simulated => 8,
    };
    let mut text = format!("{talker}GGA,{},", time_of_day(motion.utc_nanos, 2));
    if quality == Quality::Void {
        text += ",,,,0,,,,M,,M,,";
        return text;
    }
    let latitude = motion.latitude_rad.clamp(-FRAC_PI_2, FRAC_PI_2);
    let longitude = (motion.longitude_rad + PI).rem_euclid(TAU) - PI;
    // No satellites and no dilution: they are left out. Height above the ellipsoid, so the geoid's separation is zero.
    write!(
        text,
        "{},{},{indicator},00,,{},M,0.0,M,,",
        degrees_minutes(latitude, 2, ['N', 'S']),
        degrees_minutes(longitude, 3, ['E', 'W']),
        signed(motion.height_m, 1)
    )
    .ok();
    text
}

fn pashr(motion: &Motion, quality: Quality) -> String {
    let time = time_of_day(motion.utc_nanos, 3);
    if quality == Quality::Void {
        return format!("PASHR,{time},,T,,,,,,,0,0");
    }
    let plus = |value: f64| {
        let text = signed(value.to_degrees(), 2);
        if text.starts_with('-') {
            text
        } else {
            format!("+{text}")
        }
    };
    let [heading, roll, pitch] = motion.sigma_rad.map(|s| {
        if s.is_finite() {
            format!("{:.3}", s.to_degrees())
        } else {
            String::new()
        }
    });
    // No GNSS in the position (0), IMU aligned (1) or not yet (0).
    let aligned = u8::from(quality != Quality::Estimated);
    format!(
        "PASHR,{time},{},T,{},{},,{roll},{pitch},{heading},0,{aligned}",
        degrees_of_turn(motion.heading_rad),
        plus(motion.roll_rad),
        plus(motion.pitch_rad),
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nmea::ParseResult;

    fn motion() -> Motion {
        Motion {
            // 2025-10-09 08:53:20.987654321 UTC.
            utc_nanos: 1_760_000_000_987_654_321,
            latitude_rad: -33.123_456_7_f64.to_radians(),
            longitude_rad: 151.987_654_3_f64.to_radians(),
            height_m: -0.04,
            heading_rad: 359.997_f64.to_radians(),
            roll_rad: -1.234_f64.to_radians(),
            pitch_rad: 0.567_f64.to_radians(),
            turn_rate_rad_s: -2.5_f64.to_radians() / 60.0,
            sigma_rad: [0.01, 0.002, 0.003].map(f64::to_radians),
            quality: Quality::Valid,
        }
    }

    #[test]
    fn sentences_as_they_stand_on_the_line() {
        let line = |s: Sentence| s.text("IN", &motion());
        assert_eq!(line(Sentence::Hdt), "$INHDT,0.00,T*15\r\n");
        assert_eq!(line(Sentence::Ths), "$INTHS,0.00,A*17\r\n");
        assert_eq!(line(Sentence::Rot), "$INROT,-2.5,A*0B\r\n");
        assert!(
            line(Sentence::Gga)
                .starts_with("$INGGA,085320.98,3307.40740,S,15159.25926,E,6,00,,0.0,M,0.0,M,,*")
        );
        assert!(
            line(Sentence::Pashr)
                .starts_with("$PASHR,085320.987,0.00,T,-1.23,+0.57,,0.002,0.003,0.010,0,1*")
        );
        // Roll −1.23: port down (B); pitch +0.57: bow up (M).
        assert!(line(Sentence::Phtro).starts_with("$PHTRO,0.57,M,1.23,B*5C"));
    }

    /// Another program's parser reads back the sentences that it knows, and accepts their checksums.
    #[test]
    fn a_foreign_parser_agrees() {
        for sentence in [Sentence::Hdt, Sentence::Gga, Sentence::Rot] {
            let line = sentence.text("IN", &motion());
            let raw = nmea::parse_nmea_sentence(line.trim_end()).unwrap();
            assert_eq!(raw.checksum, raw.calc_checksum(), "{line}");
        }
        let Ok(ParseResult::GGA(gga)) =
            nmea::parse_str(Sentence::Gga.text("GP", &motion()).trim_end())
        else {
            panic!("no GGA");
        };
        assert!((gga.latitude.unwrap() + 33.123_456_7).abs() < 1e-7);
        assert!((gga.longitude.unwrap() - 151.987_654_3).abs() < 1e-7);
        assert_eq!(gga.fix_type, Some(nmea::sentences::FixType::Estimated));
        let Ok(ParseResult::HDT(hdt)) = nmea::parse_str(
            Sentence::Hdt
                .text(
                    "HE",
                    &Motion {
                        heading_rad: 1.0,
                        ..motion()
                    },
                )
                .trim_end(),
        ) else {
            panic!("no HDT");
        };
        assert!((hdt.heading.unwrap() - 57.3).abs() < 0.01);
    }

    /// Minutes never read 60, seconds never round up, zero has no minus, and the date line is crossed to the right side.
    #[test]
    fn edges() {
        assert_eq!(
            degrees_minutes(59.999_999_99_f64.to_radians(), 2, ['N', 'S']),
            "6000.00000,N"
        );
        assert_eq!(degrees_minutes(-1e-12, 3, ['E', 'W']), "00000.00000,E");
        assert_eq!(time_of_day(NANOS_A_DAY - 1, 2), "235959.99");
        assert_eq!(signed(-0.04, 1), "0.0");
        let line = Sentence::Gga.text(
            "IN",
            &Motion {
                longitude_rad: 3.5,
                ..motion()
            },
        );
        assert!(line.contains(",15927.88630,W,"), "{line}");
        assert_eq!("pashr".parse::<Sentence>(), Ok(Sentence::Pashr));
        assert!("XYZ".parse::<Sentence>().unwrap_err().contains("HDT"));
    }

    /// What cannot be trusted is not sent as a number.
    #[test]
    fn void_has_no_values() {
        let lines = |m: &Motion| Sentence::ALL.map(|s| s.text("IN", m));
        let void = Motion {
            quality: Quality::Void,
            ..motion()
        };
        let nan = Motion {
            heading_rad: f64::NAN,
            ..motion()
        };
        for m in [void, nan] {
            let [hdt, ths, rot, gga, pashr, phtro] = lines(&m);
            assert!(hdt.starts_with("$INHDT,,T*") && ths.starts_with("$INTHS,,V*"));
            assert!(rot.starts_with("$INROT,,V*") && phtro.starts_with("$PHTRO,,,,*"));
            assert!(gga.starts_with("$INGGA,085320.98,,,,,0,"), "{gga}");
            assert!(
                pashr.starts_with("$PASHR,085320.987,,T,,,,,,,0,0*"),
                "{pashr}"
            );
        }
    }
}
