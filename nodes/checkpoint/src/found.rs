//! What a node does with the checkpoint that it finds.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::envelope::{self, Kind};

/// The state that a file keeps; `None` where there is none, or none that can be used. That is told, and the file is put aside, so that
/// the next checkpoint does not write over what somebody may want to look at.
pub async fn find<T: DeserializeOwned + Send + 'static>(kind: Kind, path: &Path) -> Option<T> {
    let file = path.to_owned();
    let read = tokio::task::spawn_blocking(move || envelope::read::<T>(kind, &file)).await;
    match read {
        Ok(Ok(found)) => found,
        Ok(Err(refusal)) => {
            put_aside(path, &refusal.to_string());
            None
        }
        Err(error) => {
            put_aside(path, &error.to_string());
            None
        }
    }
}

/// Says why a checkpoint is not used, and gives it another name: `.refused` behind its own.
pub fn put_aside(path: &Path, why: &str) {
    let aside = aside(path);
    let told = format!(
        "checkpoint {}: {why}; everything begins anew",
        path.display()
    );
    match std::fs::rename(path, &aside) {
        Ok(()) => tracing::warn!("{told}. It is kept as {}", aside.display()),
        Err(error) => tracing::warn!("{told}. It cannot be put aside: {error}"),
    }
}

fn aside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".refused");
    name.into()
}

/// Takes a checkpoint away: what it holds is to be forgotten.
pub(crate) fn forget(path: &Path) {
    if let Err(error) = std::fs::remove_file(path)
        && error.kind() != std::io::ErrorKind::NotFound
    {
        tracing::warn!("checkpoint {}: {error}", path.display());
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const KIND: Kind = Kind {
        name: "a_node",
        version: 2,
    };

    /// What cannot be used is put aside under another name, so that nothing writes over it; what is good stays.
    #[tokio::test]
    async fn what_is_refused_is_put_aside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.kept");
        assert_eq!(find::<u8>(KIND, &path).await, None);
        std::fs::write(&path, envelope::encode(KIND, &7_u8).unwrap()).unwrap();
        assert_eq!(find::<u8>(KIND, &path).await, Some(7));
        std::fs::write(&path, "somebody's own words").unwrap();
        assert_eq!(find::<u8>(KIND, &path).await, None);
        assert!(!path.exists());
        let kept = std::fs::read_to_string(folder.path().join("a.kept.refused")).unwrap();
        assert_eq!(kept, "somebody's own words");
        forget(&path);
    }
}
