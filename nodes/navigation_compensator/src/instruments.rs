//! The ship's other instruments: solutions as NMEA 0183 sentences, over UDP and a serial line, off by default.

use std::path::Path;

use anyhow::{Context, ensure};
use ros_node::{Level, Parameter, Parameters, Report};
use ship_sentences::{Motion, Output, Quality, Sentence};
use sins::Stamp;
use sins::earth::rotation::{HeadingPitchRoll, base_link_to_block};
use sins::estimation::error_state::MISALIGNMENT;
use sins::machines::navigator::Solution;
use sins::machines::odometry::VehicleMotion;

/// Parameters of this part.
pub fn declarations() -> Vec<Parameter> {
    vec![
        Parameter::new("nmea_udp", "").describe(
            "HOST:PORT that NMEA 0183 sentences are sent to, a datagram each; empty: nowhere",
        ),
        Parameter::new("nmea_serial", "")
            .describe("serial device that NMEA 0183 sentences are written to, 8N1; empty: nowhere"),
        Parameter::new("nmea_baud", 38_400_i64)
            .unit("bit/s")
            .range(1200.0, 115_200.0)
            .describe("rate of the serial device"),
        Parameter::new("nmea_rate_hz", 10.0)
            .unit("Hz")
            .range(0.1, 100.0)
            .describe("how often every sentence is sent, by the time of the samples"),
        Parameter::new(
            "nmea_sentences",
            Sentence::ALL.map(|s| s.name().to_owned()).to_vec(),
        )
        .describe("which sentences: HDT, THS, ROT, GGA, PASHR, PHTRO"),
        Parameter::new("nmea_talker", "IN").describe("two letters before the standard sentences"),
    ]
}

/// Open outputs and what goes to them.
#[derive(Debug)]
pub struct Instruments {
    outputs: Vec<Output>,
    sentences: Vec<Sentence>,
    talker: String,
    /// Seconds without a solution.
    idle: u32,
    simulated: bool,
    sent: u64,
    failed: u64,
    last_failure: Option<String>,
}

impl Instruments {
    /// Opens what the parameters name; `None` where they name nothing. `simulated`: the time is simulated, and the sentences
    /// say so.
    ///
    /// # Errors
    /// One line with the parameter, what it is and what was expected.
    pub fn open(parameters: &Parameters, simulated: bool) -> anyhow::Result<Option<Self>> {
        let text = |name: &str| parameters.get::<String>(name);
        let (udp, serial) = (text("nmea_udp")?, text("nmea_serial")?);
        let names: Vec<String> = parameters.get("nmea_sentences")?;
        let sentences = names
            .iter()
            .map(|name| name.parse::<Sentence>().map_err(anyhow::Error::msg))
            .collect::<anyhow::Result<Vec<_>>>()
            .context("parameter 'nmea_sentences'")?;
        let talker = text("nmea_talker")?;
        ensure!(
            talker.len() == 2 && talker.bytes().all(|b| b.is_ascii_uppercase()),
            "parameter 'nmea_talker' is '{talker}', expected two capital letters"
        );
        let mut outputs = Vec::new();
        if !udp.is_empty() {
            outputs.push(Output::udp(&udp).context("parameter 'nmea_udp'")?);
        }
        if !serial.is_empty() {
            let baud: i64 = parameters.get("nmea_baud")?;
            let output = Output::serial(Path::new(&serial), u32::try_from(baud)?)
                .context("parameter 'nmea_serial'")?;
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
            talker,
            idle: 0,
            simulated,
            sent: 0,
            failed: 0,
            last_failure: None,
        }))
    }

    /// Sends what a solution says.
    pub fn send(&mut self, motion: Motion) {
        let quality = if self.simulated {
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
        .fixed_view::<3, 3>(MISALIGNMENT, MISALIGNMENT)
        .into_owned();
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
