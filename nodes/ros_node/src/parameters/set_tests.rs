#![allow(clippy::unwrap_used)]
use super::*;
use crate::ros_args::Override;
use crate::yaml::Yaml;

const DEGREE: Unit = Unit::new("deg", std::f64::consts::PI / 180.0);

#[derive(Clone, Debug, Default, PartialEq)]
struct Inner {
    angle_rad: f64,
    sides: [f64; 2],
    noise: [f64; 3],
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Outer {
    inner: Inner,
    window: u16,
    end_s: Option<f64>,
    heard: bool,
    name: String,
    port: u16,
}

fn inner() -> ParameterSet<Inner> {
    let base = Inner {
        // Not the double that is nearest to 0.3 deg times PI / 180.
        angle_rad: 0.3 * std::f64::consts::PI / 180.0,
        sides: [1.0, 2.0],
        noise: [0.5; 3],
    };
    ParameterSet::new("Inner", base)
        .number(
            "angle_deg",
            DEGREE,
            -180.0..=180.0,
            |s| &mut s.angle_rad,
            "Angle",
        )
        .numbers("sides_m", Unit::METRE, 0.0..=9.0, |s| &mut s.sides, "Sides")
        .uniform("noise", Unit::NONE, 0.0..=1.0, |s| &mut s.noise, "Noise")
}

fn outer() -> ParameterSet<Outer> {
    let base = Outer {
        window: 30,
        name: "a".to_owned(),
        port: 80,
        ..Outer::default()
    };
    ParameterSet::new("Outer", base)
        .include(inner(), |s| &mut s.inner)
        .count("window", 1..=1000, |s| &mut s.window, "Window")
        .optional(
            "end_s",
            Unit::SECOND,
            (-1.0..=1e6, -1.0),
            |s| &mut s.end_s,
            "End; -1: none",
        )
        .switch("heard", |s| &mut s.heard, "Heard")
        .changeable()
        .text("name", |s| &mut s.name, "Name")
        .choice("port", &["80", "443"], |s| &mut s.port, "Port")
}

fn with(given: &[(&str, &str)]) -> Result<Outer> {
    let overrides: Vec<_> = given
        .iter()
        .map(|(name, yaml)| Override {
            name: (*name).to_owned(),
            value: Yaml::parse(yaml).unwrap(),
            origin: "-p".to_owned(),
        })
        .collect();
    outer().read(&Parameters::new(outer().declarations(), &overrides)?)
}

/// Defaults are those of the struct to the last bit, and those of an included part are the part's.
#[test]
fn defaults_stand_in_the_struct() {
    let set = outer();
    let read = set
        .read(&Parameters::defaults(set.declarations()).unwrap())
        .unwrap();
    assert_eq!(&read, set.base());
    assert_eq!(&read.inner, inner().base());
    assert_eq!(set.declarations()[0].default, Value::Double(0.3));
}

/// Every kind of value comes to its place, in the unit that the program works with.
#[test]
fn values_come_to_their_places() {
    let read = with(&[
        ("angle_deg", "90"),
        ("sides_m", "[3.0, 4.0]"),
        ("noise", "0.25"),
        ("window", "7"),
        ("end_s", "0.0"),
        ("heard", "true"),
        ("name", "b"),
        ("port", "'443'"),
    ])
    .unwrap();
    let expected = Outer {
        inner: Inner {
            angle_rad: std::f64::consts::FRAC_PI_2,
            sides: [3.0, 4.0],
            noise: [0.25; 3],
        },
        window: 7,
        end_s: Some(0.0),
        heard: true,
        name: "b".to_owned(),
        port: 443,
    };
    assert_eq!(read, expected);
}

/// A declaration has its group, unit, range, length and choice, and only what is changeable may be set.
#[test]
fn declarations_say_everything() {
    let all = outer().declarations();
    let told = |name: &str| {
        let parameter = all.iter().find(|p| p.name() == name).unwrap();
        (
            parameter.expected(),
            parameter.group.clone(),
            parameter.read_only,
        )
    };
    assert_eq!(
        told("sides_m"),
        (
            "array of double of 2 elements from 0.0 to 9.0 [m]".to_owned(),
            "Inner".to_owned(),
            true
        )
    );
    assert_eq!(told("window").0, "integer from 1 to 1000");
    assert_eq!(
        told("port"),
        (
            "string, one of 80, 443".to_owned(),
            "Outer".to_owned(),
            true
        )
    );
    assert!(!told("heard").2);
}

/// A default that its own range refuses is a fault of the declaration, and so is a key that stands twice.
#[test]
fn faulty_declarations_are_errors() {
    let wide = ParameterSet::new("", 5.0).number("n", Unit::NONE, 0.0..=1.0, |s| s, "");
    let error = Parameters::defaults(wide.declarations()).unwrap_err();
    assert!(
        error.to_string().contains("default: parameter 'n' is 5.0"),
        "{error}"
    );
    let twice = inner().include(inner(), |s| s).declarations();
    let error = Parameters::defaults(twice).unwrap_err().to_string();
    assert!(error.contains("'angle_deg' is declared twice"), "{error}");
}
