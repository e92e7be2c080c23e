//! `~/get_type_description`: what the node's messages are made of (REP-2016).

use std::sync::PoisonError;

use ros2_interfaces::Registry;
use ros2_interfaces::type_description_interfaces::{
    GetTypeDescriptionRequest, GetTypeDescriptionResponse,
};

use crate::error::Result;
use crate::node::Node;

/// Starts the service.
///
/// # Errors
/// [`crate::Error::Create`].
pub(crate) fn serve(node: &Node) -> Result<()> {
    let types = node.types();
    node.serve(
        "~/get_type_description",
        "type_description_interfaces/srv/GetTypeDescription",
        move |request: GetTypeDescriptionRequest| {
            let types = types.lock().unwrap_or_else(PoisonError::into_inner);
            answer(&types, &request).unwrap_or_else(|failure_reason| GetTypeDescriptionResponse {
                failure_reason,
                ..Default::default()
            })
        },
    )
}

/// The error is the reason, for the one who asked.
fn answer(
    types: &Registry,
    request: &GetTypeDescriptionRequest,
) -> Result<GetTypeDescriptionResponse, String> {
    let name = &request.type_name;
    let unknown = || format!("this node knows no message type '{name}'");
    let known = types.get(name).ok_or_else(unknown)?;
    if !request.type_hash.is_empty() && request.type_hash != known.hash {
        return Err(format!(
            "'{name}' has the hash {} here, not {}",
            known.hash, request.type_hash
        ));
    }
    let type_sources = if request.include_type_sources {
        types.sources(name).ok_or_else(unknown)?
    } else {
        Vec::new()
    };
    Ok(GetTypeDescriptionResponse {
        successful: true,
        type_description: types.description(name).ok_or_else(unknown)?,
        type_sources,
        ..Default::default()
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use ros2_interfaces::{RosMessage, std_msgs};

    use super::*;

    fn ask(name: &str, hash: &str) -> Result<GetTypeDescriptionResponse, String> {
        let request = GetTypeDescriptionRequest {
            type_name: name.to_owned(),
            type_hash: hash.to_owned(),
            include_type_sources: false,
        };
        answer(&Registry::standard(), &request)
    }

    /// A type of another hash is another type; the reason names both.
    #[test]
    fn the_hash_must_fit() {
        let hash = std_msgs::Header::TYPE_HASH;
        let told = ask("std_msgs/msg/Header", hash).unwrap();
        assert_eq!(
            told.type_description.type_description.fields[1].name,
            "frame_id"
        );
        assert!(
            ask("std_msgs/msg/Header", "RIHS01_00")
                .unwrap_err()
                .contains(hash)
        );
        assert!(ask("a/msg/B", "").unwrap_err().contains("a/msg/B"));
    }
}
