//! Whoever sends datagrams of RTPS that nobody should: on the loopback of one test, and nowhere else.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::time::{Duration, Instant};

use socket2::{Domain, Protocol, Socket, Type};

use crate::chance::Chance;
use crate::isolation::namespaces_are_permitted;
use crate::listener::GUARD;

/// First part of all identities of a participant.
pub type Prefix = [u8; 12];

/// Where all participants of domain 0 say who they are.
const EVERYBODY: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(239, 255, 0, 1), 7400);
/// Ports of so many participants on this host.
const PARTICIPANTS: u16 = 10;
/// Writer and reader of publications in discovery: every participant has both.
const PUBLICATIONS_WRITER: [u8; 4] = [0, 0, 3, 0xc2];
const PUBLICATIONS_READER: [u8; 4] = [0, 0, 3, 0xc7];

/// Kinds of submessages.
mod kind {
    pub const HEARTBEAT: u8 = 0x07;
    pub const GAP: u8 = 0x08;
    pub const INFO_DST: u8 = 0x0e;
    pub const DATA: u8 = 0x15;
    pub const DATA_FRAG: u8 = 0x16;
}

/// Hears announcements, and sends what it likes.
#[derive(Debug)]
pub struct Intruder {
    ears: UdpSocket,
    mouth: UdpSocket,
    announcements: Vec<Vec<u8>>,
}

impl Intruder {
    /// On the network of this test, which it never leaves.
    pub fn new() -> Self {
        assert!(
            namespaces_are_permitted(),
            "only in a network that is nobody else's"
        );
        let ears = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP)).unwrap();
        ears.set_reuse_address(true).unwrap();
        ears.set_reuse_port(true).ok();
        ears.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, EVERYBODY.port()).into())
            .unwrap();
        ears.join_multicast_v4(EVERYBODY.ip(), &Ipv4Addr::LOCALHOST)
            .unwrap();
        ears.set_read_timeout(Some(Duration::from_millis(100)))
            .unwrap();
        Self {
            ears: ears.into(),
            mouth: UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap(),
            announcements: Vec::new(),
        }
    }

    /// Waits until so many participants have said who they are; a participant tells every few seconds.
    pub fn hear(&mut self, count: usize) -> BTreeSet<Prefix> {
        let end = Instant::now() + GUARD;
        let mut prefixes = BTreeSet::new();
        let mut datagram = vec![0; 65_536];
        while prefixes.len() < count {
            assert!(
                Instant::now() < end,
                "{} of {count} participants",
                prefixes.len()
            );
            let Ok(length) = self.ears.recv(&mut datagram) else {
                continue;
            };
            let heard = &datagram[..length];
            if heard.starts_with(b"RTPS")
                && let Some(prefix) = heard.get(8..20)
            {
                prefixes.insert(prefix.try_into().unwrap());
                self.announcements.push(heard.to_owned());
            }
        }
        prefixes
    }

    /// To every participant's ports of discovery and of messages.
    pub fn send(&self, datagram: &[u8]) {
        self.send_from(0, datagram);
    }

    /// As [`Self::send`], but not to those that were there before this one, counted from 0.
    pub fn send_from(&self, participant: u16, datagram: &[u8]) {
        for port in 7410 + 2 * participant..7410 + 2 * PARTICIPANTS {
            // Nobody has to listen there.
            self.mouth
                .send_to(datagram, (Ipv4Addr::LOCALHOST, port))
                .ok();
        }
    }

    /// Datagrams that were once good, or nearly, with a few bytes, lengths and ends changed.
    pub fn mutated(&self, prefixes: &BTreeSet<Prefix>, chance: &mut Chance) -> Vec<u8> {
        let prefixes: Vec<&Prefix> = prefixes.iter().collect();
        let from = prefixes[chance.below(prefixes.len())];
        let to = prefixes[chance.below(prefixes.len())];
        let mut datagram = match chance.below(5) {
            0 => self.announcements[chance.below(self.announcements.len())].clone(),
            1 => fragment_of(from, to, 4096),
            2 => heartbeat(from, to, 1, 5, 1),
            3 => gap(from, to, 1, 3),
            _ => data(from, to, &[0, 3, 0, 0, 1, 0, 0, 0]),
        };
        for _ in 0..=chance.below(8) {
            let at = chance.below(datagram.len());
            match chance.below(4) {
                0 => datagram[at] = chance.bits().to_le_bytes()[0],
                1 => datagram[at] ^= 1 << chance.below(8),
                2 => datagram.truncate(at.max(24)),
                _ => {
                    let value = [0, 0xff, 0x7f, 0x80][chance.below(4)];
                    datagram[at..]
                        .iter_mut()
                        .take(4)
                        .for_each(|byte| *byte = value);
                }
            }
        }
        datagram
    }
}

impl Default for Intruder {
    fn default() -> Self {
        Self::new()
    }
}

fn datagram(from: &Prefix, to: &Prefix, submessage: u8, body: &[u8]) -> Vec<u8> {
    let mut datagram = Vec::new();
    datagram.extend(*b"RTPS\x02\x04\x01\x12");
    datagram.extend(from);
    datagram.extend([kind::INFO_DST, 1, 12, 0]);
    datagram.extend(to);
    datagram.extend([submessage, 1]);
    datagram.extend(u16::try_from(body.len()).unwrap().to_le_bytes());
    datagram.extend(body);
    datagram
}

fn number(sequence: u64) -> [u8; 8] {
    let [high, low] =
        [sequence >> 32, sequence & 0xffff_ffff].map(|half| u32::try_from(half).unwrap());
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&high.to_le_bytes());
    bytes[4..].copy_from_slice(&low.to_le_bytes());
    bytes
}

/// The first kilobyte of a message that claims to have `size` bytes.
pub fn fragment_of(from: &Prefix, to: &Prefix, size: u32) -> Vec<u8> {
    let mut body = vec![0, 0, 28, 0];
    body.extend(PUBLICATIONS_READER);
    body.extend(PUBLICATIONS_WRITER);
    body.extend(number(1_000_000));
    body.extend(1_u32.to_le_bytes());
    body.extend(1_u16.to_le_bytes());
    // So large that 65 535 fragments make up the message.
    body.extend(
        u16::try_from(size.div_ceil(65_535).max(1024))
            .unwrap()
            .to_le_bytes(),
    );
    body.extend(size.to_le_bytes());
    body.extend([0; 1024]);
    datagram(from, to, kind::DATA_FRAG, &body)
}

/// That the samples `first` to `last` are there to be asked for.
pub fn heartbeat(from: &Prefix, to: &Prefix, first: u64, last: u64, count: u32) -> Vec<u8> {
    let mut body = Vec::new();
    body.extend(PUBLICATIONS_READER);
    body.extend(PUBLICATIONS_WRITER);
    body.extend(number(first));
    body.extend(number(last));
    body.extend(count.to_le_bytes());
    datagram(from, to, kind::HEARTBEAT, &body)
}

/// That the samples `first` to before `end` will never come.
pub fn gap(from: &Prefix, to: &Prefix, first: u64, end: u64) -> Vec<u8> {
    let mut body = Vec::new();
    body.extend(PUBLICATIONS_READER);
    body.extend(PUBLICATIONS_WRITER);
    body.extend(number(first));
    body.extend(number(end));
    body.extend(0_u32.to_le_bytes());
    datagram(from, to, kind::GAP, &body)
}

fn data(from: &Prefix, to: &Prefix, payload: &[u8]) -> Vec<u8> {
    let mut body = vec![0, 0, 16, 0];
    body.extend(PUBLICATIONS_READER);
    body.extend(PUBLICATIONS_WRITER);
    body.extend(number(2));
    body.extend(payload);
    let mut datagram = datagram(from, to, kind::DATA, &body);
    // With a payload.
    datagram[37] = 5;
    datagram
}
