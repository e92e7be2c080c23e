//! Where sentences go: a UDP address, a serial device.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Rates of serial lines that are known \[bit/s\].
const BAUD_RATES: [u32; 8] = [1200, 2400, 4800, 9600, 19_200, 38_400, 57_600, 115_200];

/// What can be wrong with an output.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The address means nothing.
    #[error("UDP address '{address}': {reason}; expected HOST:PORT")]
    Address {
        /// As it was given.
        address: String,
        /// Why.
        reason: String,
    },
    /// The serial device cannot be used.
    #[error("serial device {}: {reason}", path.display())]
    Serial {
        /// The device.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The rate is none of a serial line.
    #[error("{0} is no rate of a serial line, expected one of {BAUD_RATES:?}")]
    Baud(u32),
    /// A line could not be sent; the next one may be.
    #[error("{to}: {reason}")]
    Send {
        /// Where.
        to: String,
        /// Why.
        reason: String,
    },
}

/// An open output.
#[derive(Debug)]
pub enum Output {
    /// Every line is a datagram.
    Udp {
        /// From any port of this host.
        socket: UdpSocket,
        /// To here; broadcast and multicast are allowed.
        to: SocketAddr,
    },
    /// A serial device, 8 data bits, no parity, 1 stop bit, no flow control.
    Serial {
        /// The open device.
        device: File,
        /// Its path.
        path: PathBuf,
    },
}

impl Output {
    /// Sends to HOST:PORT.
    ///
    /// # Errors
    /// [`Error::Address`].
    pub fn udp(address: &str) -> Result<Self, Error> {
        let fail = |reason: String| Error::Address {
            address: address.to_owned(),
            reason,
        };
        let to = address
            .to_socket_addrs()
            .map_err(|e| fail(e.to_string()))?
            .next()
            .ok_or_else(|| fail("no such host".to_owned()))?;
        let any: SocketAddr = if to.is_ipv4() {
            ([0, 0, 0, 0], 0).into()
        } else {
            ([0u16; 8], 0).into()
        };
        let socket = UdpSocket::bind(any).map_err(|e| fail(e.to_string()))?;
        socket
            .set_broadcast(true)
            .and_then(|()| socket.set_nonblocking(true))
            .map_err(|e| fail(e.to_string()))?;
        Ok(Self::Udp { socket, to })
    }

    /// Opens a serial device at `baud` bit/s.
    ///
    /// # Errors
    /// [`Error::Baud`], [`Error::Serial`].
    pub fn serial(path: &Path, baud: u32) -> Result<Self, Error> {
        if !BAUD_RATES.contains(&baud) {
            return Err(Error::Baud(baud));
        }
        let fail = |reason: String| Error::Serial {
            path: path.to_owned(),
            reason,
        };
        // Not blocking: a line that nobody reads must not stop navigation.
        let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
        let device = OpenOptions::new()
            .write(true)
            .read(true)
            .custom_flags(flags.bits().cast_signed())
            .open(path)
            .map_err(|e| fail(e.to_string()))?;
        let mut settings = tcgetattr(&device).map_err(|e| fail(format!("no terminal: {e}")))?;
        settings.make_raw();
        settings
            .set_speed(baud)
            .and_then(|()| tcsetattr(&device, OptionalActions::Now, &settings))
            .map_err(|e| fail(format!("{baud} bit/s: {e}")))?;
        Ok(Self::Serial {
            device,
            path: path.to_owned(),
        })
    }

    /// Where it goes, for messages.
    pub fn name(&self) -> String {
        match self {
            Self::Udp { to, .. } => format!("udp {to}"),
            Self::Serial { path, .. } => format!("serial {}", path.display()),
        }
    }

    /// Sends one line, or none of it where the receiver is too slow.
    ///
    /// # Errors
    /// [`Error::Send`]; the next line may succeed.
    pub fn send(&mut self, line: &str) -> Result<(), Error> {
        let sent = match self {
            Self::Udp { socket, to } => socket.send_to(line.as_bytes(), *to).map(|_| ()),
            Self::Serial { device, .. } => device.write_all(line.as_bytes()),
        };
        sent.map_err(|error| Error::Send {
            to: self.name(),
            reason: error.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::io::Read;
    use std::time::Duration;

    #[test]
    fn a_line_is_a_datagram() {
        let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
        receiver
            .set_read_timeout(Some(Duration::from_secs(5)))
            .unwrap();
        let mut output = Output::udp(&receiver.local_addr().unwrap().to_string()).unwrap();
        output.send("$INHDT,1.00,T*24\r\n").unwrap();
        let mut buffer = [0; 100];
        let length = receiver.recv(&mut buffer).unwrap();
        assert_eq!(&buffer[..length], b"$INHDT,1.00,T*24\r\n");
    }

    /// Through a pseudo-terminal: nothing turns CR LF into something else.
    #[test]
    fn a_serial_line_carries_it_unchanged() {
        use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let name = ptsname(&master, Vec::new()).unwrap();
        let mut output = Output::serial(Path::new(name.to_str().unwrap()), 38_400).unwrap();
        output.send("$INROT,-2.5,A*2F\r\n").unwrap();
        let mut buffer = [0; 18];
        File::from(master).read_exact(&mut buffer).unwrap();
        assert_eq!(&buffer, b"$INROT,-2.5,A*2F\r\n");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let words = |error: Error| error.to_string();
        assert!(words(Output::udp("nowhere").unwrap_err()).contains("HOST:PORT"));
        assert!(
            words(Output::serial(Path::new("/dev/null"), 4800).unwrap_err()).contains("/dev/null")
        );
        assert!(
            words(Output::serial(Path::new("/no/such"), 4800).unwrap_err()).contains("/no/such")
        );
        assert!(words(Output::serial(Path::new("/dev/null"), 4801).unwrap_err()).contains("4801"));
    }
}
