//! Participants of this host that are gone without a farewell: killed, or ended by a fault.
//!
//! DDS forgets them when their lease has ended, most of a minute later. Until then a reliable publisher waits for what they will
//! never acknowledge, and whoever else listens to it hears nothing. But on the same host the kernel knows better: a participant listens at
//! a port of its own (RTPS 2.5, 9.6.2.3), and no two live ones at the same. So one whose port nobody has any more is gone, and so is one
//! whose port another participant announces as its own. Ours is then told what the departed would have said ([`leaving`]).

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::time::Duration;

use rustdds::DomainParticipant;
use socket2::{Domain, Protocol, Socket, Type};

use super::{Identity, MULTICAST, PARTICIPANT_WRITER, addresses, leaving, pid};
use crate::environment::Environment;

/// How often the kernel is asked.
const PERIOD: Duration = Duration::from_millis(500);
/// Announcements taken in one go.
const BATCH: usize = 100;
/// Participants that are kept in mind; no network of ours has as many.
const MOST: usize = 1000;
/// Ports that are in use on this host.
const PORTS: &str = "/proc/net/udp";

/// First part of all identities of a participant.
type Prefix = [u8; 12];

/// Looks after the participants of this host until the task is stopped.
pub(crate) async fn watch(participant: DomainParticipant, environment: Environment) {
    let identity = Identity::of(&participant);
    // The task must not keep the participant.
    drop(participant);
    let ears = match listen(identity, &environment) {
        Ok(ears) => ears,
        Err(error) => {
            tracing::debug!("announcements of participants cannot be heard: {error}");
            return;
        }
    };
    let mut own = addresses(&environment, |_| true);
    own.insert(Ipv4Addr::LOCALHOST);
    let mut known = Known::default();
    let mut period = tokio::time::interval(PERIOD);
    period.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut datagram = vec![0; 65_536];
    loop {
        period.tick().await;
        for _ in 0..BATCH {
            let Ok(length) = ears.recv(&mut datagram) else {
                break;
            };
            if let Some(announced) = Announced::read(&datagram[..length])
                && announced.prefix[..] != identity.guid[..12]
                && announced.is_of_this_host(&own)
            {
                known.take(announced);
            }
        }
        let Ok(table) = std::fs::read_to_string(PORTS) else {
            return;
        };
        for prefix in known.departed(&ports(&table)) {
            if let Err(error) = tell(identity, prefix) {
                tracing::debug!("a participant that is gone: {error}");
            }
        }
    }
}

/// Tells our own participant that another is gone, as that would have said it.
fn tell(identity: Identity, prefix: Prefix) -> io::Result<()> {
    let mut departed = identity;
    departed.guid[..12].copy_from_slice(&prefix);
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    let port = identity.metatraffic_port(identity.participant_id);
    socket.send_to(&leaving(departed), (Ipv4Addr::LOCALHOST, port))?;
    Ok(())
}

/// A second pair of ears beside those of RustDDS.
fn listen(identity: Identity, environment: &Environment) -> io::Result<UdpSocket> {
    let ears = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    ears.set_reuse_address(true)?;
    ears.set_reuse_port(true)?;
    ears.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, identity.multicast_port()).into())?;
    // Nothing is joined where multicast is off: what one socket of a host has joined reaches RustDDS' too.
    let is_wanted =
        |interface: &netdev::Interface| interface.is_multicast() || interface.is_loopback();
    for address in addresses(environment, is_wanted) {
        ears.join_multicast_v4(&MULTICAST, &address).ok();
    }
    ears.set_nonblocking(true)?;
    Ok(ears.into())
}

/// What a participant says of itself, as far as it matters here.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Announced {
    prefix: Prefix,
    /// Where it listens to discovery.
    places: BTreeSet<SocketAddrV4>,
}

impl Announced {
    /// Reads an announcement: the first DATA submessage of a participant writer in a datagram.
    fn read(datagram: &[u8]) -> Option<Self> {
        if !datagram.starts_with(b"RTPS") {
            return None;
        }
        let prefix: Prefix = datagram.get(8..20)?.try_into().ok()?;
        let mut rest = datagram.get(20..)?;
        loop {
            let (head, body) = (rest.get(..4)?, rest.get(4..)?);
            let is_little = head[1] & 1 == 1;
            let length = usize::from(number_16(is_little, head.get(2..4)?)?);
            // The last one may go on to the end.
            let length = if length == 0 && head[0] == DATA {
                body.len()
            } else {
                length
            };
            let submessage = body.get(..length)?;
            if head[0] == DATA && submessage.get(8..12)? == PARTICIPANT_WRITER {
                return Self::of_data(prefix, is_little, head[1], submessage);
            }
            rest = body.get(length..)?;
        }
    }

    fn of_data(prefix: Prefix, is_little: bool, flags: u8, data: &[u8]) -> Option<Self> {
        const INLINE_QOS: u8 = 2;
        const PAYLOAD: u8 = 4;
        // What is disposed of has no payload; nobody announces with inline quality of service.
        if flags & (INLINE_QOS | PAYLOAD) != PAYLOAD {
            return None;
        }
        let to_payload = usize::from(number_16(is_little, data.get(2..4)?)?);
        let payload = data.get(4 + to_payload..)?;
        let is_little = payload.get(1)? & 1 == 1;
        let mut list = payload.get(4..)?;
        let mut places = BTreeSet::new();
        loop {
            let number = number_16(is_little, list.get(..2)?)?;
            if number == pid::SENTINEL {
                break;
            }
            let length = usize::from(number_16(is_little, list.get(2..4)?)?);
            let value = list.get(4..4 + length)?;
            if number == pid::METATRAFFIC_UNICAST_LOCATOR {
                places.extend(place(is_little, value));
            }
            list = list.get(4 + length..)?;
        }
        Some(Self { prefix, places })
    }

    fn is_of_this_host(&self, own: &BTreeSet<Ipv4Addr>) -> bool {
        !self.places.is_empty() && self.places.iter().all(|place| own.contains(place.ip()))
    }
}

const DATA: u8 = 0x15;

/// A locator of UDP over IPv4.
fn place(is_little: bool, locator: &[u8]) -> Option<SocketAddrV4> {
    const UDP_V4: u32 = 1;
    let kind = number_32(is_little, locator.get(..4)?)?;
    let port = u16::try_from(number_32(is_little, locator.get(4..8)?)?).ok()?;
    let address: [u8; 4] = locator.get(20..24)?.try_into().ok()?;
    (kind == UDP_V4).then(|| SocketAddrV4::new(address.into(), port))
}

fn number_16(is_little: bool, bytes: &[u8]) -> Option<u16> {
    let bytes = bytes.try_into().ok()?;
    Some(if is_little {
        u16::from_le_bytes(bytes)
    } else {
        u16::from_be_bytes(bytes)
    })
}

fn number_32(is_little: bool, bytes: &[u8]) -> Option<u32> {
    let bytes = bytes.try_into().ok()?;
    Some(if is_little {
        u32::from_le_bytes(bytes)
    } else {
        u32::from_be_bytes(bytes)
    })
}

/// The ports that somebody listens at, by the table of the kernel: `sl local_address rem_address …`, all in hexadecimal.
fn ports(table: &str) -> BTreeSet<u16> {
    let port = |line: &str| {
        let local = line.split_whitespace().nth(1)?;
        u16::from_str_radix(local.rsplit_once(':')?.1, 16).ok()
    };
    table.lines().skip(1).filter_map(port).collect()
}

/// The participants of this host.
#[derive(Debug, Default)]
struct Known {
    participants: BTreeMap<Prefix, BTreeSet<SocketAddrV4>>,
    replaced: Vec<Prefix>,
}

impl Known {
    fn take(&mut self, announced: Announced) {
        let Announced { prefix, places } = announced;
        if self.participants.len() >= MOST || self.participants.contains_key(&prefix) {
            return;
        }
        // A port is one participant's at a time: who had it before is gone.
        let had_it =
            |(_, before): &(&Prefix, &BTreeSet<SocketAddrV4>)| !before.is_disjoint(&places);
        let gone: Vec<Prefix> = self
            .participants
            .iter()
            .filter(had_it)
            .map(|(prefix, _)| *prefix)
            .collect();
        for prefix in gone {
            self.participants.remove(&prefix);
            self.replaced.push(prefix);
        }
        self.participants.insert(prefix, places);
    }

    /// Those that are gone since the last time; they are forgotten.
    fn departed(&mut self, ports: &BTreeSet<u16>) -> Vec<Prefix> {
        let mut departed = std::mem::take(&mut self.replaced);
        self.participants.retain(|prefix, places| {
            let is_there = places.iter().any(|place| ports.contains(&place.port()));
            if !is_there {
                departed.push(*prefix);
            }
            is_there
        });
        departed
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::discovery::announcement;

    fn identity(number: u8, participant_id: u16) -> Identity {
        let mut guid = [number; 16];
        guid[12..].copy_from_slice(&[0, 0, 1, 0xc1]);
        Identity {
            guid,
            domain_id: 0,
            participant_id,
        }
    }

    fn announced(number: u8, participant_id: u16) -> Announced {
        let datagram = announcement(identity(number, participant_id), Ipv4Addr::LOCALHOST);
        Announced::read(&datagram).unwrap()
    }

    /// What a participant announces is read; a farewell, and a datagram that is cut off anywhere, is no announcement.
    #[test]
    fn announcements_are_read() {
        let read = announced(7, 2);
        assert_eq!(read.prefix, [7; 12]);
        let place = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 7414);
        assert_eq!(read.places, BTreeSet::from([place]));
        assert!(read.is_of_this_host(&BTreeSet::from([Ipv4Addr::LOCALHOST])));
        assert!(!read.is_of_this_host(&BTreeSet::from([Ipv4Addr::new(10, 0, 0, 1)])));
        assert_eq!(Announced::read(&leaving(identity(7, 2))), None);
        let whole = announcement(identity(7, 2), Ipv4Addr::LOCALHOST);
        for end in 0..whole.len() {
            assert_eq!(Announced::read(&whole[..end]), None, "{end}");
        }
    }

    /// Who has a port is there; who has none any more, or whose port is another's now, is gone, and is told once.
    #[test]
    fn the_kernel_says_who_is_gone() {
        let table = "  sl  local_address rem_address   st\n\
                     1: 0100007F:1CF2 00000000:0000 07\n 2: 00000000:1CF4 00000000:0000 07\n";
        let ports = ports(table);
        assert_eq!(ports, BTreeSet::from([7410, 7412]));
        let mut known = Known::default();
        for (number, participant_id) in [(1, 0), (2, 1), (3, 2)] {
            known.take(announced(number, participant_id));
        }
        assert_eq!(known.departed(&ports), [[3; 12]]);
        assert_eq!(known.departed(&ports), [[0; 12]; 0]);
        known.take(announced(4, 1));
        assert_eq!(known.departed(&ports), [[2; 12]]);
        known.take(announced(4, 1));
        assert_eq!(known.departed(&ports), [[0; 12]; 0]);
    }
}
