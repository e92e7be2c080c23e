//! One scheme of four hours at one heading, as the search of schemes looks at it, against the second-by-second bound:
//! `cargo bench -p sins --bench design`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use sins::estimation::grade::GroupPriors;
use sins::studies::design::{self, Catalogue, Goal, Rules, Search, Turn};
use sins::studies::observability::Setting;
use sins::studies::observability::bound::bound;
use sins::studies::stretch::{Physics, States};
use sins::table::scheme::Scheme;
use sins::units::ARC_SECOND;

const HOURS_4: f64 = 14_400.0;

fn search(physics: &Physics) -> Search {
    let catalogue = Catalogue::new(physics, vec![0.0], 4, Turn::all(4), vec![500]).unwrap();
    let rules = Rules {
        closed: true,
        limits: [-4..=4, -4..=4],
        rotations: 4..=14,
    };
    Search::new(
        catalogue,
        &Goal::paper(),
        design::Criterion::default(),
        rules,
        HOURS_4,
        1,
    )
    .unwrap()
}

fn whole() -> Physics {
    let mut physics = Physics {
        states: States::Groups(GroupPriors::default()),
        ..Physics::default()
    };
    physics.measurements.velocity_up_m_s = Some(0.01);
    physics.measurements.encoder_rad = Some(3.0 * ARC_SECOND);
    physics
}

fn evaluations(criterion: &mut Criterion) {
    let scheme = Scheme::eight_position();
    let mut group = criterion.benchmark_group("4 h of a scheme");
    group.sample_size(10);
    for (name, physics) in [("13 states", Physics::default()), ("whole", whole())] {
        let search = search(&physics);
        let sequence = search.sequence(&scheme).unwrap();
        group.bench_function(name, |b| {
            b.iter(|| black_box(search.standing(&sequence, 0)));
        });
    }
    let program = scheme.program(scheme.default_table()).unwrap();
    group.bench_function("13 states, second by second", |b| {
        b.iter(|| black_box(bound(&program, &Setting::default(), 14_400).unwrap()));
    });
}

criterion_group!(benches, evaluations);
criterion_main!(benches);
