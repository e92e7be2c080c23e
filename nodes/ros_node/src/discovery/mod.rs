//! What RustDDS leaves out of the discovery of participants: a farewell that every vendor understands, and peers that
//! multicast does not reach.
//!
//! RustDDS 0.15 takes its leave by the serialized key of the participant. Fast DDS reads keys from the inline quality of
//! service only, and keeps the endpoints of the departed in its graph until their lease ends, most of a minute later. So
//! [`farewell`] says it once more with the key hash (RTPS 2.5, 9.6.4.8; `docs/upstream/rustdds-key-hash.md`).
//!
//! RustDDS has no list of peers either. [`announce`] sends the announcement of our participant to the peers of
//! `ROS_STATIC_PEERS`, from where both sides go on by unicast (RTPS 2.5, 8.5.3; `docs/upstream/rustdds-initial-peers.md`).

pub(crate) mod departures;

use std::collections::BTreeSet;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use rustdds::{DomainParticipant, DomainParticipantStatusEvent, RTPSEntity, StatusEvented as _};
use socket2::{Domain, Protocol, Socket, Type};

use crate::environment::Environment;

/// Where all participants of a domain listen.
const MULTICAST: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);
/// Participants of one host that are looked for, as many as ROS 2 looks for at a static peer.
const PARTICIPANTS: u16 = 32;
/// Between two announcements.
const PERIOD: Duration = Duration::from_secs(3);
/// A peer that hears nothing for so long forgets us.
const LEASE_S: i32 = 20;

const RTPS_VERSION: [u8; 2] = [2, 4];
/// RustDDS.
const VENDOR: [u8; 2] = [0x01, 0x12];
const PARTICIPANT_WRITER: [u8; 4] = [0, 1, 0, 0xc2];
const PARTICIPANT_READER: [u8; 4] = [0, 1, 0, 0xc7];

/// Numbers of parameters (RTPS 2.5, table 9.18).
mod pid {
    pub const SENTINEL: u16 = 0x0001;
    pub const PARTICIPANT_LEASE_DURATION: u16 = 0x0002;
    pub const PROTOCOL_VERSION: u16 = 0x0015;
    pub const VENDORID: u16 = 0x0016;
    pub const DEFAULT_UNICAST_LOCATOR: u16 = 0x0031;
    pub const METATRAFFIC_UNICAST_LOCATOR: u16 = 0x0032;
    pub const PARTICIPANT_GUID: u16 = 0x0050;
    pub const BUILTIN_ENDPOINT_SET: u16 = 0x0058;
    pub const KEY_HASH: u16 = 0x0070;
    pub const STATUS_INFO: u16 = 0x0071;
}

/// Announcer and detector of participants, publications and subscriptions, and the writer and reader of liveliness.
const BUILTIN_ENDPOINTS: u32 = 0x0000_0c3f;

/// The participant as the messages of discovery name it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Identity {
    guid: [u8; 16],
    domain_id: u16,
    participant_id: u16,
}

impl Identity {
    pub(crate) fn of(participant: &DomainParticipant) -> Self {
        Self {
            guid: Gid::from(participant.guid()).to_bytes16(),
            domain_id: participant.domain_id(),
            participant_id: participant.participant_id(),
        }
    }

    /// Ports of RTPS 2.5, 9.6.2.3.
    fn multicast_port(self) -> u16 {
        7400 + 250 * self.domain_id
    }

    fn metatraffic_port(self, participant_id: u16) -> u16 {
        7410 + 250 * self.domain_id + 2 * participant_id
    }

    fn user_port(self) -> u16 {
        self.metatraffic_port(self.participant_id) + 1
    }
}

/// A participant that has not been met within this of the one before is not waited for.
const MEETING_PAUSE: Duration = Duration::from_millis(400);
/// Nor is anybody after this.
const LONGEST_MEETING: Duration = Duration::from_secs(2);
/// Between two looks at who has come.
const MEETING_LOOK: Duration = Duration::from_millis(10);

/// Waits until the participants that are there have been met, before anything is made that they are told of. RustDDS writes what
/// it tells without a source timestamp; where such a sample is lost and sent again, because its reader was not there yet, Fast
/// DDS may acknowledge it and never hand it on, and the node is not seen for good (`docs/upstream/rustdds-sedp-order.md`).
/// A participant answers at once to one that is new to it, so that a pause says that all have answered.
///
/// To be called before anybody else listens to the participant's events.
pub(crate) fn meet(participant: &DomainParticipant) {
    let events = participant.status_listener();
    let own = participant.guid().prefix;
    let begin = Instant::now();
    let mut met = begin;
    while met.elapsed() < MEETING_PAUSE && begin.elapsed() < LONGEST_MEETING {
        while let Some(event) = events.try_recv_status() {
            if let DomainParticipantStatusEvent::ParticipantDiscovered { dpd } = event
                && dpd.guid.prefix != own
            {
                met = Instant::now();
            }
        }
        std::thread::sleep(MEETING_LOOK);
    }
}

/// Addresses of this host at such interfaces; the local one alone where nothing may leave it.
fn addresses(
    environment: &Environment,
    is_wanted: impl Fn(&netdev::Interface) -> bool,
) -> BTreeSet<Ipv4Addr> {
    if environment.localhost_only {
        return BTreeSet::from([Ipv4Addr::LOCALHOST]);
    }
    let interfaces = netdev::get_interfaces().into_iter().filter(is_wanted);
    interfaces
        .flat_map(|interface| interface.ipv4)
        .map(|net| net.addr())
        .collect()
}

/// Tells everybody that the participant is gone; to be called after it was dropped. Where a network cannot be reached,
/// nobody there has to be told.
pub(crate) fn farewell(identity: Identity, environment: &Environment) {
    let message = leaving(identity);
    let everybody = SocketAddrV4::new(MULTICAST, identity.multicast_port());
    for interface in addresses(environment, |_| true) {
        if let Err(error) = multicast(interface, everybody, &message) {
            tracing::debug!("farewell on {interface}: {error}");
        }
    }
    // Same host, where multicast may be off, and the peers that it does not reach.
    if let Ok(socket) = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)) {
        for peer in environment
            .static_peers
            .iter()
            .chain([&Ipv4Addr::LOCALHOST])
        {
            to_participants(&socket, identity, *peer, &message);
        }
    }
}

/// To every participant that may be on a host. Nobody has to listen at each of these ports.
fn to_participants(socket: &UdpSocket, identity: Identity, host: Ipv4Addr, message: &[u8]) {
    for participant_id in 0..PARTICIPANTS {
        socket
            .send_to(message, (host, identity.metatraffic_port(participant_id)))
            .ok();
    }
}

fn multicast(interface: Ipv4Addr, to: SocketAddrV4, message: &[u8]) -> io::Result<()> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_multicast_if_v4(&interface)?;
    socket.set_multicast_loop_v4(true)?;
    socket.send_to(message, &SocketAddr::V4(to).into())?;
    Ok(())
}

/// Announces the participant to static peers until the task is stopped.
pub(crate) async fn announce(participant: DomainParticipant, peers: Vec<Ipv4Addr>) {
    let identity = Identity::of(&participant);
    // The task must not keep the participant.
    drop(participant);
    let mut period = tokio::time::interval(PERIOD);
    let mut told = false;
    loop {
        period.tick().await;
        for peer in &peers {
            if let Err(error) = announce_to(identity, *peer)
                && !std::mem::replace(&mut told, true)
            {
                tracing::warn!("ROS_STATIC_PEERS: {peer} cannot be reached: {error}");
            }
        }
    }
}

fn announce_to(identity: Identity, peer: Ipv4Addr) -> io::Result<()> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    // The address that this peer sees us by.
    socket.connect((peer, identity.metatraffic_port(0)))?;
    let SocketAddr::V4(own) = socket.local_addr()? else {
        return Ok(());
    };
    let socket = UdpSocket::bind((*own.ip(), 0))?;
    to_participants(&socket, identity, peer, &announcement(identity, *own.ip()));
    Ok(())
}

/// A DATA submessage of the participant writer, with what comes behind its header.
fn message(identity: Identity, flags: u8, sequence_number: u32, rest: &[u8]) -> Vec<u8> {
    const DATA: u8 = 0x15;
    const LITTLE_ENDIAN: u8 = 1;
    let mut data = Vec::with_capacity(20 + rest.len());
    data.extend([0, 0]);
    // From here to what follows the sequence number.
    data.extend(16_u16.to_le_bytes());
    data.extend(PARTICIPANT_READER);
    data.extend(PARTICIPANT_WRITER);
    data.extend(0_u32.to_le_bytes());
    data.extend(sequence_number.to_le_bytes());
    data.extend(rest);

    let mut message = Vec::with_capacity(24 + data.len());
    message.extend(*b"RTPS");
    message.extend(RTPS_VERSION);
    message.extend(VENDOR);
    message.extend(&identity.guid[..12]);
    message.extend([DATA, flags | LITTLE_ENDIAN]);
    message.extend(u16::try_from(data.len()).unwrap_or(0).to_le_bytes());
    message.extend(data);
    message
}

/// "Disposed and unregistered", by key hash in the inline quality of service, without a payload.
fn leaving(identity: Identity) -> Vec<u8> {
    const INLINE_QOS: u8 = 2;
    let mut list = ParameterList::default();
    list.push(pid::KEY_HASH, &identity.guid);
    list.push(pid::STATUS_INFO, &[0, 0, 0, 3]);
    // Above every number that RustDDS has given to its own.
    message(identity, INLINE_QOS, u32::MAX >> 1, &list.end())
}

/// Who we are and where we listen.
fn announcement(identity: Identity, address: Ipv4Addr) -> Vec<u8> {
    const PAYLOAD: u8 = 4;
    const PL_CDR_LE: [u8; 4] = [0, 3, 0, 0];
    let metatraffic = identity.metatraffic_port(identity.participant_id);
    let mut lease = LEASE_S.to_le_bytes().to_vec();
    lease.extend([0; 4]);
    let mut list = ParameterList(PL_CDR_LE.to_vec());
    list.push(
        pid::PROTOCOL_VERSION,
        &[RTPS_VERSION[0], RTPS_VERSION[1], 0, 0],
    );
    list.push(pid::VENDORID, &[VENDOR[0], VENDOR[1], 0, 0]);
    list.push(pid::PARTICIPANT_GUID, &identity.guid);
    list.push(
        pid::METATRAFFIC_UNICAST_LOCATOR,
        &locator(address, metatraffic),
    );
    list.push(
        pid::DEFAULT_UNICAST_LOCATOR,
        &locator(address, identity.user_port()),
    );
    list.push(pid::PARTICIPANT_LEASE_DURATION, &lease);
    list.push(pid::BUILTIN_ENDPOINT_SET, &BUILTIN_ENDPOINTS.to_le_bytes());
    message(identity, PAYLOAD, 1, &list.end())
}

fn locator(address: Ipv4Addr, port: u16) -> Vec<u8> {
    const UDP_V4: i32 = 1;
    let mut locator = UDP_V4.to_le_bytes().to_vec();
    locator.extend(u32::from(port).to_le_bytes());
    locator.extend([0; 12]);
    locator.extend(address.octets());
    locator
}

/// Parameters one behind the other, little-endian.
#[derive(Default)]
struct ParameterList(Vec<u8>);

impl ParameterList {
    /// `value` has a multiple of four bytes.
    fn push(&mut self, number: u16, value: &[u8]) {
        self.0.extend(number.to_le_bytes());
        self.0
            .extend(u16::try_from(value.len()).unwrap_or(0).to_le_bytes());
        self.0.extend(value);
    }

    fn end(mut self) -> Vec<u8> {
        self.push(pid::SENTINEL, &[]);
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: Identity = Identity {
        guid: [1, 18, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 1, 0xc1],
        domain_id: 1,
        participant_id: 2,
    };

    /// Header, submessage and lists are as long as they say, and end together.
    #[test]
    fn messages_are_whole() {
        for message in [
            leaving(IDENTITY),
            announcement(IDENTITY, Ipv4Addr::new(10, 1, 2, 3)),
        ] {
            assert_eq!(&message[..4], b"RTPS");
            let length = u16::from_le_bytes([message[22], message[23]]);
            assert_eq!(message.len(), 24 + usize::from(length));
            assert_eq!(length % 4, 0);
            assert_eq!(&message[message.len() - 4..], &[1, 0, 0, 0]);
        }
    }

    /// Ports follow the formula of the standard.
    #[test]
    fn ports() {
        assert_eq!(IDENTITY.multicast_port(), 7650);
        assert_eq!(IDENTITY.metatraffic_port(2), 7664);
        assert_eq!(IDENTITY.user_port(), 7665);
    }
}
