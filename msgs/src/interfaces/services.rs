//! Services. Every node has the standard ones too: parameters, lifecycle, `~/get_type_description`.

use ros2_interfaces::std_srvs::{TRIGGER, TriggerRequest, TriggerResponse};
use ros2_interfaces::{Interface, Service};

macro_rules! triggers {
    ($($constant:ident = $name:literal, $server:literal, $about:literal;)*) => {
        $(
            #[doc = $about]
            pub const $constant: Service<TriggerRequest, TriggerResponse> =
                Service::new($name, TRIGGER, $server, $about);
        )*

        /// The rows of all services.
        pub const ALL: &[Interface] = &[$($constant.row()),*];
    };
}

triggers! {
    START = "~/start", "`scheme_sequencer`", "Starts the scheme";
    PAUSE = "~/pause", "`scheme_sequencer`", "Stops the table; the scheme goes on by `~/resume`";
    RESUME = "~/resume", "`scheme_sequencer`", "Goes on with a scheme that was paused";
    ABORT = "~/abort", "`scheme_sequencer`", "Stops the table and ends the scheme";
    RESET = "~/reset", "`self_calibrator`", "Forgets the estimate and begins with coarse alignment";
    PUBLISH_CALIBRATION = "~/publish_calibration", "`self_calibrator`", "Publishes the calibration of the newest estimate";
    SAVE = "~/save", "`self_calibrator`", "Writes the calibration of the newest estimate to `calibration_file`";
    LOAD = "~/load", "`self_calibrator`", "Publishes the calibration of `calibration_file`";
}
