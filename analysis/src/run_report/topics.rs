//! Which topic of a bag is what.

use std::collections::BTreeSet;

use bags::{Bag, Error, SensorOptions, SensorTopics};
use ros2_interfaces::Interface;
use rotary_sins_msgs::interfaces::topics;

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
        let named = |usual: Interface| {
            let at = bag.topic(&usual.within(&space))?;
            (bag.topics()[at].type_name == usual.type_name).then_some(at)
        };
        let within = |wanted: &Option<String>, usual: Interface| {
            wanted
                .clone()
                .or_else(|| named(usual).map(|at| bag.topics()[at].name.clone()))
        };
        let options = SensorOptions {
            imu_topic: within(&options.imu_topic, topics::IMU_DATA_RAW.row()),
            joints_topic: within(&options.joints_topic, topics::JOINT_STATES.row()),
            fix_topic: within(&options.fix_topic, topics::FIX.row()),
            ..options.clone()
        };
        let mut roles = vec![None; bag.topics().len()];
        // Of these types there is one topic in a run, whatever its name.
        for (role, usual) in [
            (Role::Estimate, topics::ESTIMATE.row()),
            (Role::Scheme, topics::SCHEME_STATUS.row()),
        ] {
            let only = || bag.find_topic(usual.type_name, usual.name, None).ok();
            if let Some(at) = named(usual).or_else(only) {
                roles[at] = Some(role);
            }
        }
        for (role, usual) in [
            (Role::TrueCalibration, topics::TRUE_CALIBRATION.row()),
            (Role::TruePose, topics::TRUE_ODOMETRY.row()),
            (Role::Odometry(0), topics::ODOMETRY.row()),
            (Role::Odometry(1), topics::UNCOMPENSATED_ODOMETRY.row()),
            (Role::Fix(0), topics::FIX_INS.row()),
            (Role::Fix(1), topics::UNCOMPENSATED_FIX_INS.row()),
        ] {
            if let Some(at) = named(usual) {
                roles[at] = Some(role);
            }
        }
        for (role, topic) in roles.iter_mut().zip(bag.topics()) {
            if topic.type_name == topics::DIAGNOSTICS.row().type_name {
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
    const MARKS: [Interface; 5] = [
        topics::IMU_DATA_RAW.row(),
        topics::ESTIMATE.row(),
        topics::SCHEME_STATUS.row(),
        topics::JOINT_STATES.row(),
        topics::TRUE_CALIBRATION.row(),
    ];
    if let Some(space) = options
        .imu_topic
        .as_ref()
        .and_then(|name| name.strip_suffix(&MARKS[0].within("")))
    {
        return space.to_owned();
    }
    for usual in MARKS {
        let suffix = usual.within("");
        let spaces: BTreeSet<&str> = bag
            .topics()
            .iter()
            .filter(|topic| topic.type_name == usual.type_name)
            .filter_map(|topic| topic.name.strip_suffix(&suffix))
            .collect();
        // With several ships in one bag, the options have to tell.
        match spaces.first() {
            Some(space) if spaces.len() == 1 || space.is_empty() => return (*space).to_owned(),
            _ => {}
        }
    }
    String::new()
}
