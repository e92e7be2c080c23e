//! A simulated run as a bag: what the sensors say, what the sequencer does, and what is true.

use std::path::Path;

use bags::{BagSummary, BagWriter, NewTopic, TopicId, WriteOptions};
use ros2_interfaces::{
    RosMessage,
    geometry_msgs::TwistWithCovarianceStamped,
    sensor_msgs::{JointState, NavSatFix},
};
use rotary_sins_msgs::convert::{ToMessage, imu_from_sample, odometry_of_block};
use rotary_sins_msgs::interfaces::topics;
use rotary_sins_msgs::{Calibration, SchemeStatus};
use sins::{
    simulation::{Run, Simulator, SimulatorSettings, Tick, Wandering},
    table::scheme::{Scheme, Sequencer, sequencer::SequencerSettings},
    time::Stamp,
};

use crate::{Error, Listener};

/// Frame of the sensor block.
const IMU_LINK: &str = "imu_link";

/// What was written.
pub struct SimulatedBag {
    /// The bag.
    pub summary: BagSummary,
    /// The run at its end.
    pub run: Run,
    /// Samples of the IMU.
    pub samples: u64,
}

/// Simulates `duration_s` of a scheme on the settings' table and writes it.
///
/// # Errors
/// Where settings or scheme are refused, or the bag cannot be written.
pub fn write_simulated_bag(
    path: &Path,
    write_options: WriteOptions,
    scheme: &Scheme,
    settings: SimulatorSettings,
    duration_s: f64,
    listener: &dyn Listener,
) -> Result<SimulatedBag, Error> {
    let simulator = Simulator::new(settings)?;
    let program = scheme.program(settings.plant.turntable)?;
    let sequencer = Sequencer::new(program, SequencerSettings::default())?;
    let start = settings.plant.start;
    let moves = !simulator.plant().motion().is_at_rest();
    let mut output = Output::new(path, write_options, moves)?;
    output.write_truth(&simulator)?;
    output.write(
        output.joints,
        start,
        &ToMessage::<JointState>::to_message(&simulator.first_joints()),
    )?;
    let mut run = Run::new(simulator, sequencer, duration_s);
    let mut count = 0_u64;
    while let Some(tick) = run.next() {
        let tick = tick?;
        let stamp = tick.truth.stamp;
        output.write_tick(&tick, run.simulator())?;
        if tick.joints.is_some() {
            output.write_status(stamp, run.sequencer().status().to_message())?;
        }
        count += 1;
        if count.is_multiple_of(10_000) {
            listener.reached(stamp.seconds_since(start));
        }
    }
    if settings.imu.wandering != Wandering::default() {
        output.write_truth(run.simulator())?;
    }
    Ok(SimulatedBag {
        summary: output.bag.finish()?,
        run,
        samples: count,
    })
}

/// The bag with its topics.
struct Output {
    bag: BagWriter,
    imu: TopicId,
    joints: TopicId,
    fix: TopicId,
    velocity: TopicId,
    status: TopicId,
    truth: TopicId,
    /// The true odometry, of a ship that moves.
    odometry: Option<TopicId>,
    last_status: Option<SchemeStatus>,
}

impl Output {
    fn new(path: &Path, write_options: WriteOptions, moves: bool) -> Result<Self, bags::Error> {
        let mut bag = BagWriter::create(path, write_options)?;
        Ok(Self {
            imu: bag.add_topic(NewTopic::on(&topics::IMU_DATA_RAW.with_depth(1000)))?,
            joints: bag.add_topic(NewTopic::on(&topics::JOINT_STATES.with_depth(1000)))?,
            fix: bag.add_topic(NewTopic::on(&topics::FIX.with_depth(10)))?,
            velocity: bag.add_topic(NewTopic::on(&topics::AIDING_VELOCITY.with_depth(10)))?,
            // Who comes late in a replay wants the newest only.
            status: bag.add_topic(NewTopic::on(&topics::SCHEME_STATUS.with_depth(1)))?,
            truth: bag.add_topic(NewTopic::on(&topics::TRUE_CALIBRATION))?,
            odometry: if moves {
                Some(bag.add_topic(NewTopic::on(&topics::TRUE_ODOMETRY))?)
            } else {
                None
            },
            bag,
            last_status: None,
        })
    }

    fn write<M: RosMessage>(
        &mut self,
        topic: TopicId,
        stamp: Stamp,
        message: &M,
    ) -> Result<(), bags::Error> {
        self.bag.write(topic, stamp.nanos().unsigned_abs(), message)
    }

    /// What is true now.
    fn write_truth(&mut self, simulator: &Simulator) -> Result<(), bags::Error> {
        let truth = Calibration::ground_truth(simulator);
        self.write(self.truth, simulator.plant().now(), &truth)
    }

    /// The measurements of an interval.
    fn write_tick(&mut self, tick: &Tick, simulator: &Simulator) -> Result<(), bags::Error> {
        let stamp = tick.truth.stamp;
        self.write(self.imu, stamp, &imu_from_sample(&tick.imu, IMU_LINK))?;
        if let Some(joints) = &tick.joints {
            let message: JointState = joints.to_message();
            self.write(self.joints, stamp, &message)?;
        }
        if let Some(position) = &tick.position {
            let message: NavSatFix = position.to_message();
            self.write(self.fix, stamp, &message)?;
        }
        if let Some(velocity) = &tick.velocity {
            let message: TwistWithCovarianceStamped = velocity.to_message();
            self.write(self.velocity, stamp, &message)?;
        }
        if let (Some(topic), true) = (self.odometry, tick.position.is_some()) {
            let plant = simulator.plant();
            let message = odometry_of_block(
                stamp,
                plant.place_m(),
                plant.attitude(),
                plant.ship().velocity,
                plant.block_rate(),
            );
            self.write(topic, stamp, &message)?;
        }
        Ok(())
    }

    /// Writes the status where step or state are new.
    fn write_status(&mut self, stamp: Stamp, status: SchemeStatus) -> Result<(), bags::Error> {
        let place = |s: &SchemeStatus| (s.state, s.cycle, s.step);
        if self.last_status.as_ref().map(place) == Some(place(&status)) {
            return Ok(());
        }
        let result = self.write(self.status, stamp, &status);
        self.last_status = Some(status);
        result
    }
}
