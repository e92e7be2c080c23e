//! `~/get_type_description`: what the node's messages are made of (REP-2016).

use rotary_sins_msgs::type_description_interfaces::{
    GetTypeDescriptionRequest, GetTypeDescriptionResponse,
};
use rotary_sins_msgs::{known_type, type_description, type_sources};

use crate::error::Result;
use crate::node::Node;

/// Starts the service.
///
/// # Errors
/// [`crate::Error::Create`].
pub(crate) fn serve(node: &Node) -> Result<()> {
    node.serve(
        "~/get_type_description",
        "type_description_interfaces/srv/GetTypeDescription",
        |request: GetTypeDescriptionRequest| {
            answer(&request).unwrap_or_else(|failure_reason| GetTypeDescriptionResponse {
                failure_reason,
                ..Default::default()
            })
        },
    )
}

/// The error is the reason, for the one who asked.
fn answer(request: &GetTypeDescriptionRequest) -> Result<GetTypeDescriptionResponse, String> {
    let name = &request.type_name;
    let unknown = || format!("this node knows no message type '{name}'");
    let known = known_type(name).ok_or_else(unknown)?;
    if !request.type_hash.is_empty() && request.type_hash != known.hash {
        return Err(format!(
            "'{name}' has the hash {} here, not {}",
            known.hash, request.type_hash
        ));
    }
    let type_sources = if request.include_type_sources {
        type_sources(name).ok_or_else(unknown)?
    } else {
        Vec::new()
    };
    Ok(GetTypeDescriptionResponse {
        successful: true,
        type_description: type_description(name).ok_or_else(unknown)?,
        type_sources,
        ..Default::default()
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn ask(name: &str, hash: &str) -> Result<GetTypeDescriptionResponse, String> {
        answer(&GetTypeDescriptionRequest {
            type_name: name.to_owned(),
            type_hash: hash.to_owned(),
            include_type_sources: false,
        })
    }

    /// A type of another hash is another type; the reason names both.
    #[test]
    fn the_hash_must_fit() {
        let hash = known_type("std_msgs/msg/Header").unwrap().hash;
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
