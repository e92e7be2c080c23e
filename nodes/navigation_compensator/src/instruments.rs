//! The ship's other instruments: solutions as NMEA 0183 sentences, over UDP and a serial line, off by default.

use std::path::Path;

use anyhow::{Context, ensure};
use ros_node::{Level, ParameterSet, Report, Unit};
use ship_sentences::{Motion, Output, Quality, Sentence};
use sins::Stamp;
use sins::earth::rotation::{HeadingPitchRoll, base_link_to_block};
use sins::estimation::groups::navigation::MISALIGNMENT;
use sins::machines::navigator::Solution;
use sins::machines::odometry::UNKNOWN_VARIANCE;
use sins::machines::odometry::VehicleMotion;

/// Where the sentences go, and which.
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentSettings {
    udp: String,
    serial: String,
    baud: u32,
    sentences: Vec<String>,
    talker: String,
}

impl Default for InstrumentSettings {
    fn default() -> Self {
        Self {
            udp: String::new(),
            serial: String::new(),
            baud: 38_400,
            sentences: Sentence::ALL.map(|s| s.name().to_owned()).to_vec(),
            talker: "IN".to_owned(),
        }
    }
}

/// Parameters of this part.
pub fn declared() -> ParameterSet<InstrumentSettings> {
    ParameterSet::new("NMEA 0183", InstrumentSettings::default())
        .text(
            "nmea_udp",
            |s| &mut s.udp,
            "HOST:PORT that NMEA 0183 sentences are sent to, a datagram each; empty: nowhere",
        )
        .text(
            "nmea_serial",
            |s| &mut s.serial,
            "Serial device that NMEA 0183 sentences are written to, 8N1; empty: nowhere",
        )
        .count(
            "nmea_baud",
            1200..=115_200,
            |s| &mut s.baud,
            "Rate of the serial device",
        )
        .unit(Unit::si("bit/s"))
        .texts(
            "nmea_sentences",
            |s| &mut s.sentences,
            "Which sentences are sent",
        )
        .one_of(&Sentence::ALL.map(Sentence::name))
        .text(
            "nmea_talker",
            |s| &mut s.talker,
            "Two letters before the standard sentences",
        )
}

/// Open outputs and what goes to them.
pub struct Instruments {
    outputs: Vec<Output>,
    sentences: Vec<Sentence>,
    talker: String,
    /// Seconds without a solution.
    idle: u32,
    /// Whether the time is simulated; it may change while the node runs.
    is_simulated: Box<dyn Fn() -> bool + Send>,
    sent: u64,
    failed: u64,
    last_failure: Option<String>,
}

impl std::fmt::Debug for Instruments {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Instruments")
            .field("outputs", &self.outputs)
            .finish_non_exhaustive()
    }
}

impl Instruments {
    /// Opens what the parameters name; `None` where they name nothing. As long as `is_simulated` the time is, the sentences
    /// say so.
    ///
    /// # Errors
    /// One line with the parameter, what it is and what was expected.
    pub fn open(
        settings: &InstrumentSettings,
        is_simulated: impl Fn() -> bool + Send + 'static,
    ) -> anyhow::Result<Option<Self>> {
        let InstrumentSettings {
            udp,
            serial,
            baud,
            sentences: names,
            talker,
        } = settings;
        let sentences = names
            .iter()
            .map(|name| name.parse::<Sentence>().map_err(anyhow::Error::msg))
            .collect::<anyhow::Result<Vec<_>>>()
            .context("parameter 'nmea_sentences'")?;
        ensure!(
            talker.len() == 2 && talker.bytes().all(|b| b.is_ascii_uppercase()),
            "parameter 'nmea_talker' is '{talker}', expected two capital letters"
        );
        let mut outputs = Vec::new();
        if !udp.is_empty() {
            outputs.push(Output::udp(udp).context("parameter 'nmea_udp'")?);
        }
        if !serial.is_empty() {
            let output =
                Output::serial(Path::new(serial), *baud).context("parameter 'nmea_serial'")?;
            outputs.push(output);
        }
        for output in &outputs {
            tracing::info!(
                "NMEA 0183 sentences {} to {}",
                names.join(", "),
                output.name()
            );
        }
        Ok((!outputs.is_empty()).then_some(Self {
            outputs,
            sentences,
            talker: talker.clone(),
            idle: 0,
            is_simulated: Box::new(is_simulated),
            sent: 0,
            failed: 0,
            last_failure: None,
        }))
    }

    /// Sends what a solution says.
    pub fn send(&mut self, motion: Motion) {
        let quality = if (self.is_simulated)() {
            Quality::Simulated
        } else {
            motion.quality
        };
        self.idle = 0;
        self.write(&Motion { quality, ..motion });
    }

    /// To be called once a second: where no solution came since the last call but one, sentences without values say so.
    pub fn second(&mut self, utc_nanos: i64) {
        self.idle += 1;
        if self.idle > 2 {
            self.write(&Motion {
                utc_nanos,
                ..Motion::default()
            });
        }
    }

    fn write(&mut self, motion: &Motion) {
        for sentence in &self.sentences {
            let line = sentence.text(&self.talker, motion);
            for output in &mut self.outputs {
                match output.send(&line) {
                    Ok(()) => self.sent += 1,
                    Err(error) => {
                        self.failed += 1;
                        let text = error.to_string();
                        // A line that nobody reads fails ten times a second: it is said once.
                        if self.last_failure.as_ref() != Some(&text) {
                            tracing::warn!("NMEA 0183: {text}");
                            self.last_failure = Some(text);
                        }
                    }
                }
            }
        }
    }

    /// How the sentences go out.
    pub fn report(&self) -> Report {
        let names: Vec<_> = self.outputs.iter().map(Output::name).collect();
        let mut report = Report::ok(format!("to {}", names.join(", ")))
            .with("sent", self.sent)
            .with("failed", self.failed);
        if let Some(failure) = &self.last_failure {
            report = report.worsened(Level::Warn, failure);
        }
        report
    }
}

/// The ship's motion as instruments see it. Heading, roll and pitch are those of the vehicle, their sigmas those of the covariance.
pub fn ship_motion(stamp: Stamp, solution: &Solution, motion: &VehicleMotion) -> Motion {
    let vehicle = solution.base_link * base_link_to_block().inverse();
    let angles = HeadingPitchRoll::from_attitude(&vehicle);
    let misalignment = solution
        .covariance
        .block_or(&MISALIGNMENT, UNKNOWN_VARIANCE);
    let sigma = HeadingPitchRoll::sigma(angles.heading, &misalignment);
    Motion {
        utc_nanos: stamp.nanos(),
        latitude_rad: solution.navigation.position.latitude_rad,
        longitude_rad: solution.navigation.position.longitude_rad,
        height_m: solution.navigation.position.height_m,
        heading_rad: angles.heading,
        roll_rad: angles.roll,
        pitch_rad: angles.pitch,
        // Heading grows clockwise, rotation about Up counter-clockwise.
        turn_rate_rad_s: -(solution.base_link * motion.angular_rate).z,
        sigma_rad: [sigma.heading, sigma.roll, sigma.pitch],
        quality: Quality::Valid,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::net::UdpSocket;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    /// Sentences say that the time is simulated exactly as long as it is, however often that changes.
    #[test]
    fn the_quality_follows_the_clock() {
        let ear = UdpSocket::bind("127.0.0.1:0").unwrap();
        let to = ear.local_addr().unwrap().to_string();
        let settings = InstrumentSettings {
            udp: to,
            sentences: vec!["GGA".to_owned()],
            ..declared().base().clone()
        };
        let simulated = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&simulated);
        let open = Instruments::open(&settings, move || asked.load(Ordering::Relaxed));
        let mut instruments = open.unwrap().unwrap();
        let mut buffer = [0; 200];
        let mut quality = |is_simulated: bool| {
            simulated.store(is_simulated, Ordering::Relaxed);
            instruments.send(Motion {
                quality: Quality::Valid,
                ..Motion::default()
            });
            let length = ear.recv(&mut buffer).unwrap();
            let line = String::from_utf8(buffer[..length].to_vec()).unwrap();
            line.split(',').nth(6).unwrap().to_owned()
        };
        let (valid, as_simulated) = (quality(false), quality(true));
        assert_eq!(as_simulated, "8");
        assert_ne!(valid, as_simulated);
        assert_eq!(quality(false), valid);
    }
}
