//! `~/save` and `~/load`: the calibration as the file that the command line writes and reads. The work on the file is an
//! [`Errand`], beside the node's own: a server that does not answer holds up no estimate and no end.

use std::path::{Path, PathBuf};
use std::time::Duration;

use ros2_interfaces::std_srvs::TriggerResponse;
use rotary_sins_msgs::Calibration;
use sins::machines::self_calibration::Estimate;
use tokio::task::JoinHandle;

use crate::translation;

/// The answer of a service that has to do with a file comes within this; clients wait longer.
const PATIENCE: Duration = Duration::from_secs(5);

/// File work of one service, one at a time.
#[derive(Debug)]
pub struct Errand<T> {
    patience: Duration,
    under_way: Option<JoinHandle<T>>,
}

impl<T> Default for Errand<T> {
    fn default() -> Self {
        Self {
            patience: PATIENCE,
            under_way: None,
        }
    }
}

impl<T: Send + 'static> Errand<T> {
    /// Does the work on another thread, and waits for it no longer than the patience goes. One that has not come back then is left to
    /// itself, and until it has, nothing new is begun.
    ///
    /// # Errors
    /// Why there is no result, with the name of the file.
    pub async fn run(
        &mut self,
        path: &Path,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, String> {
        let is_away = |task: &mut JoinHandle<T>| !task.is_finished();
        if self.under_way.as_mut().is_some_and(is_away) {
            return Err(format!(
                "{}: the disk has not answered the last request yet",
                path.display()
            ));
        }
        let task = self.under_way.insert(tokio::task::spawn_blocking(work));
        match tokio::time::timeout(self.patience, task).await {
            Ok(Ok(done)) => {
                self.under_way = None;
                Ok(done)
            }
            Ok(Err(error)) => {
                self.under_way = None;
                Err(format!("{}: {error}", path.display()))
            }
            Err(_) => Err(format!(
                "{}: the disk has not answered within {:.0} s",
                path.display(),
                self.patience.as_secs_f64()
            )),
        }
    }
}

/// Where calibrations are kept: what the parameter says, else a file in the folder that ROS keeps its own in.
pub fn path(parameter: &str) -> PathBuf {
    if !parameter.is_empty() {
        return parameter.into();
    }
    let home = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    home("ROS_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(home("HOME")?).join(".ros")))
        .unwrap_or_default()
        .join("self_calibration.yaml")
}

/// Writes the calibration that the newest estimate amounts to.
pub fn save(path: &Path, latest: Option<&Estimate>, source: &str) -> TriggerResponse {
    let Some(latest) = latest else {
        return refused("no estimate yet, nothing is saved".to_owned());
    };
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let made = folder.map_or(Ok(()), std::fs::create_dir_all);
    let written = made
        .map_err(anyhow::Error::from)
        .and_then(|()| calibration_file::write(path, &latest.calibration(), source));
    match written {
        Ok(()) => done(format!("{}, phase {}", path.display(), latest.phase.name())),
        Err(error) => refused(format!("{error:#}")),
    }
}

/// Reads a calibration, to be published as it is: one that was inconsistent says in its message that it is not valid. A file whose
/// numbers no sensor can have is refused, by the check of everything that reads calibrations.
pub fn load(path: &Path, frame_id: &str) -> (TriggerResponse, Option<Calibration>) {
    match calibration_file::read(path) {
        Ok(calibration) => {
            let source = path.display().to_string();
            let phase = calibration.phase.name();
            let message = translation::calibration(&calibration, None, frame_id, &source);
            (done(format!("{source}, phase {phase}")), Some(message))
        }
        Err(error) => {
            tracing::warn!("{error:#}");
            let message = answer(path, &error);
            let success = false;
            (TriggerResponse { success, message }, None)
        }
    }
}

/// What a caller of `~/load` is told. A caller need not be who may read the file, and a text that is no calibration may be anything:
/// of that the place is told, and nothing of what stands there. The log has it all.
fn answer(path: &Path, error: &anyhow::Error) -> String {
    let Some(found) = error.downcast_ref::<calibration_file::NoCalibration>() else {
        return format!("{error:#}");
    };
    let line = found
        .line
        .map_or_else(String::new, |line| format!("line {line}: "));
    format!(
        "{}: {line}no calibration; the log of the node says why",
        path.display()
    )
}

fn done(message: String) -> TriggerResponse {
    tracing::info!("{message}");
    TriggerResponse {
        success: true,
        message,
    }
}

/// The answer that says why nothing was done.
pub fn refused(message: String) -> TriggerResponse {
    tracing::warn!("{message}");
    TriggerResponse {
        success: false,
        message,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::UnitQuaternion;
    use sins::Stamp;
    use sins::earth::Position;
    use sins::estimation::groups::bias::GYROSCOPE_DRIFT;
    use sins::estimation::state::NamedCovariance;
    use sins::machines::self_calibration::{Calibration as Calibrated, Phase};
    use sins::sensor::SensorErrors;
    use sins::table::TableErrors;

    use super::*;

    /// A file that does not answer has its answer in time, every further request at once; when it answers again, so does the service.
    #[tokio::test]
    async fn a_silent_disk_holds_up_nobody() {
        let mut errand = Errand {
            patience: Duration::from_millis(20),
            ..Errand::default()
        };
        let path = Path::new("/far/c.yaml");
        let (answer, disk) = std::sync::mpsc::channel::<()>();
        let told = errand.run(path, move || disk.recv().is_ok()).await;
        let told = told.unwrap_err();
        assert!(
            told.contains("/far/c.yaml") && told.contains("within"),
            "{told}"
        );
        let told = errand.run(path, || true).await.unwrap_err();
        assert!(told.contains("the last request"), "{told}");
        answer.send(()).unwrap();
        while errand.run(path, || true).await.is_err() {
            tokio::task::yield_now().await;
        }
    }

    /// What cannot be done says why, and names the file.
    #[test]
    fn refusals_say_why() {
        let nowhere = Path::new("/nowhere/self_calibration.yaml");
        let told = save(nowhere, None, "n");
        assert!(!told.success && told.message.contains("no estimate"));
        let (told, message) = load(nowhere, "imu_link");
        assert!(!told.success && told.message.contains("/nowhere/self_calibration.yaml"));
        assert_eq!(message, None);
    }

    /// A file that cannot be is refused by its name and the number; one that was inconsistent is published as not valid.
    #[test]
    fn loading_looks_at_what_it_loads() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("calibration.yaml");
        let good = Calibrated {
            stamp: Stamp::default(),
            phase: Phase::Converged,
            errors: SensorErrors::default(),
            table: TableErrors::default(),
            attitude: UnitQuaternion::identity(),
            position: Position::from_degrees(45.0, 126.6, 0.0),
            covariance: NamedCovariance::from_sigmas(GYROSCOPE_DRIFT.map(|name| (name, 1e-6)))
                .unwrap(),
            samples: 1,
            gaps: 0,
        };
        let load = |calibration: &Calibrated| {
            calibration_file::write(&file, calibration, "test").unwrap();
            load(&file, "imu_link")
        };
        let (told, message) = load(&good);
        assert!(told.success && message.unwrap().valid, "{}", told.message);

        let mut impossible = good.clone();
        impossible.errors.gyroscope_drift.x = 1e6;
        let (told, message) = load(&impossible);
        let line = &told.message;
        assert!(!told.success && message.is_none(), "{line}");
        assert!(
            line.contains("calibration.yaml") && line.contains("gyroscope_drift"),
            "{line}"
        );
        assert!(!line.contains('\n'), "{line}");

        let (told, message) = load(&Calibrated {
            phase: Phase::Inconsistent,
            ..good
        });
        assert!(
            told.success && told.message.contains("inconsistent"),
            "{}",
            told.message
        );
        assert!(!message.unwrap().valid);
    }

    /// Who asks to load what is no calibration is told file and line, and nothing of what stands in the file.
    #[test]
    fn answers_do_not_quote_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("secret.yaml");
        for text in [
            "root:s3cret:19000\n",
            "source: x\ns3cret: 1\n",
            "source: x\nphase: s3cret\n",
            "source: [s3cret\n",
            "source: x\nstamp_ns: \"s3cret\"\n",
        ] {
            std::fs::write(&file, text).unwrap();
            let log = format!("{:#}", calibration_file::read(&file).unwrap_err());
            let (told, message) = load(&file, "imu_link");
            let line = told.message;
            assert!(!told.success && message.is_none(), "{line}");
            assert!(line.contains("secret.yaml: line "), "{line}");
            assert!(!line.contains("s3cret") && !line.contains('\n'), "{line}");
            assert!(log.contains("secret.yaml: "), "{log}");
        }
        // The log has what the caller has not.
        std::fs::write(&file, "source: x\ns3cret: 1\n").unwrap();
        let log = format!("{:#}", calibration_file::read(&file).unwrap_err());
        assert!(log.contains("s3cret"), "{log}");
    }

    /// The parameter goes before the folder of ROS.
    #[test]
    fn the_parameter_names_the_file() {
        assert_eq!(path("/data/c.yaml"), Path::new("/data/c.yaml"));
        assert!(path("").ends_with("self_calibration.yaml"));
    }
}
