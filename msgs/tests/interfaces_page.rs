//! `docs/interfaces.md` is the table of interfaces. `ROTARY_SINS_WRITE=1 cargo test -p rotary_sins_msgs --test
//! interfaces_page` writes it.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use ros2_interfaces::{Interface, InterfaceKind, Qos};
use rotary_sins_msgs::interfaces::{actions, all, services, topics};
use rotary_sins_msgs::known_type;

/// Says that the page is to be written.
const WRITE: &str = "ROTARY_SINS_WRITE";

const HEAD: &str = "# Interfaces

Generated from `msgs/src/interfaces`, which the nodes and tools work by; a test holds this page equal to it.
Names are relative, so that a namespace or a remap moves them, but for those that begin with `/`; `~` is the node.
[Nodes](nodes.md) says what each node does with them, [In a ROS 2 stack](in-a-ros2-stack.md) how the quality of service
is overridden.
";

const TOPICS: &str = "
## Topics

The quality of service is what a publisher of the suite offers. A subscription asks for the same, with a depth of its
own in some places (`queue_depth`), and hears best-effort publishers too.

| topic | type | from | to | QoS | about |
| --- | --- | --- | --- | --- | --- |
";

const SERVICES: &str = "
## Services

Every node has the parameter services, the lifecycle services and `~/get_type_description` besides.

| service | type | served by | about |
| --- | --- | --- | --- |
";

const ACTIONS: &str = "
## Actions

| action | type | asked by | served by | about |
| --- | --- | --- | --- | --- |
";

/// `sensor_msgs/Imu` for `sensor_msgs/msg/Imu`, as people write it.
fn short(type_name: &str) -> String {
    let mut parts = type_name.split('/');
    let package = parts.next().unwrap_or_default();
    format!("{package}/{}", parts.next_back().unwrap_or_default())
}

fn words(qos: Qos) -> String {
    let mut words = vec![if qos.reliable {
        "reliable".to_owned()
    } else {
        "best effort".to_owned()
    }];
    if qos.transient_local {
        words.push("transient local".to_owned());
    }
    words.push(format!("keep last {}", qos.depth));
    if let Some(lifespan) = qos.lifespan {
        words.push(format!("lifespan {} s", lifespan.as_secs_f64()));
    }
    words.join(", ")
}

fn page() -> String {
    let mut page = HEAD.to_owned();
    let mut section = |head: &str, rows: &[Interface]| {
        page.push_str(head);
        for row in rows {
            let (name, kind, about) = (row.name, short(row.type_name), row.about);
            let (from, to) = (row.from, row.to);
            match row.kind {
                InterfaceKind::Topic(qos) => {
                    let qos = words(qos);
                    writeln!(
                        page,
                        "| `{name}` | {kind} | {from} | {to} | {qos} | {about} |"
                    )
                }
                InterfaceKind::Service => {
                    writeln!(page, "| `{name}` | {kind} | {to} | {about} |")
                }
                InterfaceKind::Action => {
                    writeln!(page, "| `{name}` | {kind} | {from} | {to} | {about} |")
                }
            }
            .unwrap();
        }
    };
    section(TOPICS, topics::ALL);
    section(SERVICES, services::ALL);
    section(ACTIONS, actions::ALL);
    page
}

/// The page of the manual is the table of interfaces.
#[test]
fn page_is_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/interfaces.md");
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, page()).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap();
    assert!(
        there == page(),
        "docs/interfaces.md is not the table: {WRITE}=1 cargo test -p rotary_sins_msgs --test interfaces_page writes it"
    );
}

/// The four nodes, as the page of the nodes tells of them.
const NODES: [&str; 4] = [
    "imu_simulator",
    "scheme_sequencer",
    "self_calibrator",
    "navigation_compensator",
];

/// What a node has to do with each row that names it.
fn table_of(node: &str) -> String {
    let mut table = "| | name | type | QoS | about |\n| --- | --- | --- | --- | --- |\n".to_owned();
    let node = format!("`{node}`");
    // What gives comes first; a row that names the node at both ends stands twice.
    for given in [false, true] {
        for row in all() {
            let (end, qos) = match row.kind {
                InterfaceKind::Topic(qos) => (["subscribes", "publishes"], words(qos)),
                InterfaceKind::Service | InterfaceKind::Action => {
                    (["serves", "asks"], String::new())
                }
            };
            let others = if given { row.from } else { row.to };
            if others.contains(&node) {
                let (end, kind) = (end[usize::from(given)], short(row.type_name));
                writeln!(
                    table,
                    "| {end} | `{}` | {kind} | {qos} | {} |",
                    row.name, row.about
                )
                .unwrap();
            }
        }
    }
    table
}

/// `page` with the tables of the nodes between their marks.
fn with_tables(page: &str) -> String {
    NODES.iter().fold(page.to_owned(), |page, node| {
        let begin = format!("<!-- interfaces of {node} -->\n");
        let (before, rest) = page.split_once(&begin).expect(&begin);
        let (_, after) = rest
            .split_once("<!-- end -->\n")
            .expect("an end of the table");
        format!("{before}{begin}{}<!-- end -->\n{after}", table_of(node))
    })
}

/// The tables of the nodes in the manual are rows of the table of interfaces.
#[test]
fn tables_of_the_nodes_are_of_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/nodes.md");
    let there = std::fs::read_to_string(&path).unwrap();
    let made = with_tables(&there);
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    assert!(
        std::fs::read_to_string(&path).unwrap() == made,
        "docs/nodes.md has other tables: {WRITE}=1 cargo test -p rotary_sins_msgs --test interfaces_page writes them"
    );
}

/// No name stands twice, and every topic's type is known by name.
#[test]
fn rows_are_unique_and_known() {
    let names: BTreeSet<&str> = all().map(|row| row.name).collect();
    assert_eq!(names.len(), all().count());
    for row in topics::ALL {
        assert!(known_type(row.type_name).is_some(), "{}", row.type_name);
    }
}

/// The pages that tell of the nodes name every topic, service and action of the table that the suite has.
#[test]
fn pages_of_the_nodes_name_all() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let read = |name: &str| std::fs::read_to_string(docs.join(name)).unwrap();
    let text = read("nodes.md") + &read("in-a-ros2-stack.md");
    for row in all() {
        // The four outputs without the calibration are named by their prefix; what a bag alone has is no node's.
        let is_told = ["uncompensated/", "smoothed/"]
            .iter()
            .any(|prefix| row.name.starts_with(prefix))
            || text.contains(&format!("`{}`", row.name));
        assert!(
            is_told,
            "neither nodes.md nor in-a-ros2-stack.md names {}",
            row.name
        );
    }
}
