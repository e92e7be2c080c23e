//! Which topic of a bag is what.

use std::collections::BTreeSet;

use bags::{Bag, Error, SensorOptions, SensorTopics};
use ros2_interfaces::{
    RosMessage,
    diagnostic_msgs::DiagnosticArray,
    nav_msgs::Odometry,
    sensor_msgs::{Imu, JointState, NavSatFix},
};
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};

/// What a message is to the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Of the calibrator.
    Estimate,
    /// Of the sequencer.
    Scheme,
    /// How nodes are.
    Diagnostics,
    /// True sensor errors and first attitude.
    TrueCalibration,
    /// True pose of the block.
    TruePose,
    /// Where navigation has gone: with the calibration (0), without it (1).
    Odometry(usize),
    /// The same on the globe.
    Fix(usize),
}

/// The topics of a run.
pub struct Topics {
    /// Those of the sensors.
    pub sensors: SensorTopics,
    /// By the number of the topic.
    pub roles: Vec<Option<Role>>,
}

impl Topics {
    /// Finds them: by their usual names within the namespace of the run, else as the only one of a type.
    ///
    /// # Errors
    /// [`Error::MissingTopic`] without a topic that was asked for by name.
    pub fn find(bag: &Bag, options: &SensorOptions) -> Result<Self, Error> {
        let space = namespace(bag, options);
        let named = |usual: &str, type_name: &str| {
            let at = bag.topic(&format!("{space}/{usual}"))?;
            (bag.topics()[at].type_name == type_name).then_some(at)
        };
        let within = |wanted: &Option<String>, usual: &str, type_name: &str| {
            wanted
                .clone()
                .or_else(|| named(usual, type_name).map(|at| bag.topics()[at].name.clone()))
        };
        let options = SensorOptions {
            imu_topic: within(&options.imu_topic, "imu/data_raw", Imu::TYPE_NAME),
            joints_topic: within(
                &options.joints_topic,
                "turntable/joint_states",
                JointState::TYPE_NAME,
            ),
            fix_topic: within(&options.fix_topic, "fix", NavSatFix::TYPE_NAME),
            ..options.clone()
        };
        let mut roles = vec![None; bag.topics().len()];
        // Of these types there is one topic in a run, whatever its name.
        for (role, usual, type_name) in [
            (
                Role::Estimate,
                "self_calibration/estimate",
                SelfCalibrationEstimate::TYPE_NAME,
            ),
            (Role::Scheme, "scheme/status", SchemeStatus::TYPE_NAME),
        ] {
            let only = || bag.find_topic(type_name, usual, None).ok();
            if let Some(at) = named(usual, type_name).or_else(only) {
                roles[at] = Some(role);
            }
        }
        for (role, usual, type_name) in [
            (
                Role::TrueCalibration,
                "ground_truth/calibration",
                Calibration::TYPE_NAME,
            ),
            (Role::TruePose, "ground_truth/odometry", Odometry::TYPE_NAME),
            (Role::Odometry(0), "odometry", Odometry::TYPE_NAME),
            (
                Role::Odometry(1),
                "uncompensated/odometry",
                Odometry::TYPE_NAME,
            ),
            (Role::Fix(0), "fix_ins", NavSatFix::TYPE_NAME),
            (Role::Fix(1), "uncompensated/fix_ins", NavSatFix::TYPE_NAME),
        ] {
            if let Some(at) = named(usual, type_name) {
                roles[at] = Some(role);
            }
        }
        for (role, topic) in roles.iter_mut().zip(bag.topics()) {
            if topic.type_name == DiagnosticArray::TYPE_NAME {
                *role = Some(Role::Diagnostics);
            }
        }
        Ok(Self {
            sensors: SensorTopics::find(bag, &options)?,
            roles,
        })
    }

    /// The topic of a role.
    pub fn of(&self, role: Role) -> Option<usize> {
        self.roles.iter().position(|found| *found == Some(role))
    }
}

/// What stands before the usual names: that of the IMU asked for, else that of topics that
/// end like the suite's.
fn namespace(bag: &Bag, options: &SensorOptions) -> String {
    const MARKS: [(&str, &str); 5] = [
        ("/imu/data_raw", Imu::TYPE_NAME),
        (
            "/self_calibration/estimate",
            SelfCalibrationEstimate::TYPE_NAME,
        ),
        ("/scheme/status", SchemeStatus::TYPE_NAME),
        ("/turntable/joint_states", JointState::TYPE_NAME),
        ("/ground_truth/calibration", Calibration::TYPE_NAME),
    ];
    if let Some(space) = options
        .imu_topic
        .as_ref()
        .and_then(|name| name.strip_suffix(MARKS[0].0))
    {
        return space.to_owned();
    }
    for (usual, type_name) in MARKS {
        let spaces: BTreeSet<&str> = bag
            .topics()
            .iter()
            .filter(|topic| topic.type_name == type_name)
            .filter_map(|topic| topic.name.strip_suffix(usual))
            .collect();
        // With several ships in one bag, the options have to tell.
        match spaces.first() {
            Some(space) if spaces.len() == 1 || space.is_empty() => return (*space).to_owned(),
            _ => {}
        }
    }
    String::new()
}
