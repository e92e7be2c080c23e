//! Parameters of the node, in the units of the people who set them, and the settings they amount to.

use std::time::Duration;

use node_parameters::{
    CheckpointParameters, FilterParameters, InputParameters, ThresholdParameters, checkpoint,
    filter, input, thresholds,
};
use ros_node::{ParameterSet, Parameters, Unit};
use sins::machines::self_calibration::{Settings, Thresholds};

/// Everything the node is told.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeSettings {
    filter: FilterParameters,
    thresholds: ThresholdParameters,
    input: InputParameters,
    joint_patience_s: f64,
    /// What `~/save` writes and `~/load` reads; empty: where ROS keeps its files.
    pub calibration_file: String,
    /// How the state is kept.
    pub checkpoint: CheckpointParameters,
}

/// All parameters of the node. The defaults are those of [`Settings`], with the whole model.
pub fn declared() -> ParameterSet<NodeSettings> {
    let base = NodeSettings {
        filter: filter().base().clone(),
        thresholds: *thresholds().base(),
        input: *input().base(),
        joint_patience_s: Settings::default().joint_patience_s,
        calibration_file: String::new(),
        checkpoint: CheckpointParameters::default(),
    };
    ParameterSet::new("Files", base)
        .include(filter(), |s| &mut s.filter)
        .include(thresholds(), |s| &mut s.thresholds)
        .include(input(), |s| &mut s.input)
        .number(
            "joint_patience_s",
            Unit::SECOND,
            0.01..=3600.0,
            |s| &mut s.joint_patience_s,
            "How much later than its sample, by the stamps, a joint state may come; more for bags that play fast",
        )
        .text(
            "calibration_file",
            |s| &mut s.calibration_file,
            "File that ~/save writes and ~/load reads; empty: self_calibration.yaml in ROS_HOME, or in .ros at home",
        )
        .include(checkpoint(), |s| &mut s.checkpoint)
}

/// What the parameters amount to.
///
/// # Errors
/// One line naming the parameter that means nothing.
pub fn settings(parameters: &Parameters) -> anyhow::Result<NodeSettings> {
    Ok(declared().read(parameters)?)
}

impl NodeSettings {
    /// Settings of the machine.
    ///
    /// # Errors
    /// One line naming the parameter that makes no sense together with the others.
    pub fn machine(&self) -> anyhow::Result<Settings> {
        Ok(Settings {
            thresholds: self.thresholds(),
            joint_patience_s: self.joint_patience_s,
            ..self.filter.clone().settings()?
        })
    }

    /// What the parameters ask for.
    pub fn thresholds(&self) -> Thresholds {
        self.thresholds.into()
    }

    /// An input that is silent for longer is a fault.
    pub fn silence(&self) -> Duration {
        Duration::from_secs_f64(self.input.silence_s)
    }

    /// Messages of an input that the middleware keeps.
    pub fn queue_depth(&self) -> usize {
        self.input.queue_depth
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The defaults are those of the command line to the last bit.
    #[test]
    fn defaults_are_those_of_the_machine() {
        let parameters = Parameters::defaults(declared().declarations()).unwrap();
        let machine = settings(&parameters).unwrap().machine().unwrap();
        assert_eq!(machine, node_parameters::calibrating());
    }
}
