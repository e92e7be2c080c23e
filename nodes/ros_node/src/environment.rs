//! The environment variables of ROS 2 and the DDS participant made by them.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};

use nix::sys::signal::{SigSet, SigmaskHow};
use rustdds::{DomainParticipant, DomainParticipantBuilder};

use crate::error::{Error, Result};

/// What the environment says about discovery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`, 0 by default.
    pub domain_id: u16,
    /// `ROS_LOCALHOST_ONLY=1` or `ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST`.
    pub localhost_only: bool,
    /// `ROS_STATIC_PEERS`, resolved.
    pub static_peers: Vec<Ipv4Addr>,
}

/// Highest domain whose ports stay below 65536.
const MAX_DOMAIN_ID: u16 = 232;

impl Environment {
    /// From the process's environment.
    ///
    /// # Errors
    /// [`Error::Environment`] for a value that means nothing, and for the discovery range `OFF`, which RustDDS does
    /// not have.
    pub fn read() -> Result<Self> {
        Self::from_lookup(|name| std::env::var(name).ok().filter(|value| !value.is_empty()))
    }

    fn from_lookup(lookup: impl Fn(&'static str) -> Option<String>) -> Result<Self> {
        let bad = |name, value: &str, expected| Error::Environment {
            name,
            value: value.to_owned(),
            expected,
        };
        let domain_id = match lookup("ROS_DOMAIN_ID") {
            None => 0,
            Some(value) => value
                .trim()
                .parse()
                .ok()
                .filter(|id| *id <= MAX_DOMAIN_ID)
                .ok_or_else(|| bad("ROS_DOMAIN_ID", &value, "an integer from 0 to 232"))?,
        };
        let localhost_only = match lookup("ROS_LOCALHOST_ONLY").as_deref() {
            None | Some("0") => false,
            Some("1") => true,
            Some(value) => return Err(bad("ROS_LOCALHOST_ONLY", value, "0 or 1")),
        };
        let range = lookup("ROS_AUTOMATIC_DISCOVERY_RANGE");
        // As rcl has it: the older variable goes before the newer one where it is set.
        let localhost_only = match range.as_deref() {
            _ if localhost_only => true,
            None | Some("SUBNET" | "SYSTEM_DEFAULT") => false,
            Some("LOCALHOST") => true,
            Some(value) => {
                return Err(bad(
                    "ROS_AUTOMATIC_DISCOVERY_RANGE",
                    value,
                    "SUBNET, LOCALHOST or SYSTEM_DEFAULT",
                ));
            }
        };
        let peers = lookup("ROS_STATIC_PEERS").unwrap_or_default();
        let mut static_peers = Vec::new();
        for peer in peers
            .split(';')
            .map(str::trim)
            .filter(|peer| !peer.is_empty())
        {
            static_peers.push(resolve(peer).ok_or_else(|| {
                let expected =
                    "IPv4 addresses or names that can be resolved to them, with ';' between them";
                bad("ROS_STATIC_PEERS", peer, expected)
            })?);
        }
        if lookup("ROS_SECURITY_ENABLE").is_some_and(|value| value == "true") {
            return Err(bad(
                "ROS_SECURITY_ENABLE",
                "true",
                "false: this node has no DDS security",
            ));
        }
        Ok(Self {
            domain_id,
            localhost_only,
            static_peers,
        })
    }

    /// The participant of this process.
    ///
    /// # Errors
    /// [`Error::Create`] where the middleware has no socket or no port to itself.
    pub(crate) fn participant(&self) -> Result<DomainParticipant> {
        let builder = DomainParticipantBuilder::new(self.domain_id);
        let builder = if self.localhost_only {
            builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)])
        } else {
            builder
        };
        let failed = |reason: String| Error::Create {
            what: format!("the DDS participant in domain {}", self.domain_id),
            reason,
        };
        // RustDDS's event loops end where a signal interrupts them. Threads inherit the mask of who makes them, so that
        // every signal (SIGINT, a child's SIGCHLD) is handled by others.
        let unmasked = SigSet::all()
            .thread_swap_mask(SigmaskHow::SIG_BLOCK)
            .map_err(|error| failed(error.to_string()))?;
        let participant = builder.build();
        unmasked
            .thread_set_mask()
            .map_err(|error| failed(error.to_string()))?;
        participant.map_err(|error| failed(error.to_string()))
    }
}

fn resolve(peer: &str) -> Option<Ipv4Addr> {
    // The port is only there to be resolved with the name.
    let mut addresses = (peer, 7400).to_socket_addrs().ok()?;
    addresses.find_map(|address| match address {
        SocketAddr::V4(address) => Some(*address.ip()),
        SocketAddr::V6(_) => None,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn with(variables: &[(&str, &str)]) -> Result<Environment> {
        let variables: Vec<(String, String)> = variables
            .iter()
            .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
            .collect();
        Environment::from_lookup(|name| {
            variables
                .iter()
                .find(|(k, _)| k == name)
                .map(|(_, v)| v.clone())
        })
    }

    /// Nothing set is domain 0 on the subnet.
    #[test]
    fn defaults() {
        assert_eq!(with(&[]).unwrap(), Environment::default());
    }

    /// Peers are a list with semicolons, empty places left out.
    #[test]
    fn static_peers_are_a_list() {
        let peers = with(&[("ROS_STATIC_PEERS", "192.168.7.2; 10.0.0.1;")])
            .unwrap()
            .static_peers;
        assert_eq!(
            peers,
            [Ipv4Addr::new(192, 168, 7, 2), Ipv4Addr::new(10, 0, 0, 1)]
        );
    }

    /// Either variable keeps the node on this host.
    #[test]
    fn localhost_by_either_variable() {
        assert!(with(&[("ROS_LOCALHOST_ONLY", "1")]).unwrap().localhost_only);
        assert!(
            with(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")])
                .unwrap()
                .localhost_only
        );
        assert!(
            !with(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")])
                .unwrap()
                .localhost_only
        );
    }

    /// A value without meaning is an error that names the variable.
    #[test]
    fn nonsense_is_an_error() {
        for (name, value) in [
            ("ROS_DOMAIN_ID", "300"),
            ("ROS_DOMAIN_ID", "x"),
            ("ROS_LOCALHOST_ONLY", "yes"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
            ("ROS_STATIC_PEERS", "10.0.0.1;no such host"),
            ("ROS_SECURITY_ENABLE", "true"),
        ] {
            assert!(
                with(&[(name, value)])
                    .unwrap_err()
                    .to_string()
                    .contains(name)
            );
        }
    }
}
