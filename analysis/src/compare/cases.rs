//! Which cases there are: simulation, reading of the noise, gimbal order.

use sins::{
    simulation::NoiseReading,
    table::scheme::{Program, Scheme},
    table::{Axis, Turntable},
};

/// The paper's three simulations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simulation {
    /// At rest.
    Static,
    /// Eight positions about x and y.
    Xy,
    /// The same about y and z.
    Yz,
}

impl Simulation {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Static, Self::Xy, Self::Yz];

    /// Its scheme.
    pub fn scheme(self) -> Scheme {
        match self {
            Self::Static => Scheme::stationary(),
            Self::Xy => Scheme::eight_position(),
            Self::Yz => Scheme::eight_position_yz(),
        }
    }

    /// What the paper calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Xy => "x-y",
            Self::Yz => "y-z",
        }
    }

    /// The tables it runs on, the default one first.
    pub fn tables(self) -> Vec<Turntable> {
        let of = |outer, inner| Turntable { outer, inner };
        match self {
            Self::Static => vec![Turntable::default()],
            Self::Xy => vec![of(Axis::X, Axis::Y), of(Axis::Y, Axis::X)],
            Self::Yz => vec![of(Axis::Y, Axis::Z), of(Axis::Z, Axis::Y)],
        }
    }
}

/// One simulation on one table under one reading of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Which of the three.
    pub simulation: Simulation,
    /// Its table.
    pub table: Turntable,
    /// Noise.
    pub reading: NoiseReading,
}

impl Case {
    /// Every case: simulation, reading, gimbal order.
    pub fn all() -> Vec<Self> {
        let mut cases = Vec::new();
        for reading in [NoiseReading::D, NoiseReading::H] {
            for simulation in Simulation::ALL {
                for table in simulation.tables() {
                    cases.push(Self {
                        simulation,
                        table,
                        reading,
                    });
                }
            }
        }
        cases
    }

    /// Whether the table is the one that the simulation runs on by default.
    pub fn has_default_table(self) -> bool {
        self.table == self.simulation.tables()[0]
    }

    /// Its name in tables and files.
    pub fn name(self) -> String {
        match self.simulation {
            Simulation::Static => format!("{} static", self.reading.letter()),
            other => format!(
                "{} {}, outer {} inner {}",
                self.reading.letter(),
                other.name(),
                self.table.outer,
                self.table.inner
            ),
        }
    }

    /// The program on its table.
    pub fn program(self) -> Result<Program, sins::Error> {
        self.simulation.scheme().program(self.table)
    }
}
