//! What the compensator gives to others aboard: the tree of frames, and NMEA 0183 sentences over UDP.

use std::collections::BTreeMap;
use std::net::UdpSocket;
use std::time::{Duration, Instant};

use ros2_interfaces::tf2_msgs::TFMessage;
use suite_tests::{GUARD, Program, Scene, isolated, messages};

const HEADING_DEG: f64 = 123.25;

/// Lines as they come, by their first field, until `done` says so.
fn listen(
    socket: &UdpSocket,
    done: impl Fn(&BTreeMap<String, Vec<String>>) -> bool,
) -> BTreeMap<String, Vec<String>> {
    let until = Instant::now() + GUARD;
    let mut lines: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut buffer = [0; 256];
    socket
        .set_read_timeout(Some(Duration::from_secs(1)))
        .unwrap();
    while !done(&lines) {
        assert!(Instant::now() < until, "only {lines:?}");
        let Ok(length) = socket.recv(&mut buffer) else {
            continue;
        };
        let line = String::from_utf8(buffer[..length].to_vec()).unwrap();
        let body = line
            .strip_prefix('$')
            .and_then(|l| l.strip_suffix("\r\n"))
            .unwrap();
        let (body, sum) = body.split_once('*').unwrap();
        let expected = body.bytes().fold(0, |sum, byte| sum ^ byte);
        assert_eq!(u8::from_str_radix(sum, 16).unwrap(), expected, "{line}");
        let name = body.split(',').next().unwrap().to_owned();
        lines.entry(name).or_default().push(body.to_owned());
    }
    lines
}

/// Before there is a solution the sentences say so; then they carry the ship's heading while the table turns the block, and
/// the tree of frames leads from the earth to the block.
#[test]
fn sentences_and_frames() {
    isolated(|| {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let to = socket.local_addr().unwrap().to_string();
        let mut scene = Scene::new("aboard");
        let recording = scene.record("recording", &["/tf", "/tf_static"]);
        // The truth stands in for the calibration, so that navigation begins at once.
        scene.start(
            &Program::new("navigation_compensator")
                .parameter("use_sim_time", "true")
                .parameter("nmea_udp", &to)
                .parameter("alignment_s", "120.0")
                .parameter("coarse_alignment_s", "60.0")
                .remap("self_calibration/calibration", "ground_truth/calibration"),
        );
        let void = listen(&socket, |lines| lines.len() == 6);
        assert!(void["INTHS"].iter().all(|l| l == "INTHS,,V"), "{void:?}");
        assert!(void["INGGA"][0].contains(",,,,0,"), "{void:?}");

        scene.start(&Program::sequencer().parameter("use_sim_time", "true"));
        scene.start(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "50.0")
                .parameter("heading_deg", &format!("{HEADING_DEG:?}")),
        );
        // 560 s of simulated time: the first rotation is over.
        let told = listen(&socket, |lines| {
            lines
                .get("INTHS")
                .is_some_and(|l| l.iter().filter(|l| l.ends_with(",S")).count() > 5600)
        });
        scene.end();
        let fields = |name: &str| -> Vec<Vec<String>> {
            told[name]
                .iter()
                .map(|line| line.split(',').map(str::to_owned).collect())
                .collect()
        };
        for heading in fields("INTHS").iter().filter(|f| f[2] == "S") {
            let heading: f64 = heading[1].parse().unwrap();
            assert!((heading - HEADING_DEG).abs() < 0.6, "{heading}");
        }
        let last = fields("PASHR").pop().unwrap();
        assert_eq!(last[3], "T");
        let [roll, pitch] = [4, 5].map(|i| last[i].parse::<f64>().unwrap());
        assert!(roll.abs() < 0.6 && pitch.abs() < 0.6, "{last:?}");
        let gga = fields("INGGA").pop().unwrap();
        assert_eq!(
            (gga[3].as_str(), gga[5].as_str(), gga[6].as_str()),
            ("N", "E", "8")
        );
        assert!(
            gga[2].starts_with("4546.") && gga[4].starts_with("12640."),
            "{gga:?}"
        );

        let children = |topic: &str| {
            let all: Vec<TFMessage> = messages(&recording, topic);
            let mut pairs = BTreeMap::new();
            for transform in all.into_iter().flat_map(|m| m.transforms) {
                let q = transform.transform.rotation;
                let norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
                assert!((norm - 1.0).abs() < 1e-9);
                pairs.insert(transform.child_frame_id.clone(), transform);
            }
            pairs
        };
        let mut tree = children("/tf_static");
        tree.extend(children("/tf"));
        let mut frame = "imu_link".to_owned();
        let mut path = vec![frame.clone()];
        while let Some(transform) = tree.get(&frame) {
            frame.clone_from(&transform.header.frame_id);
            path.push(frame.clone());
        }
        assert_eq!(
            path,
            [
                "imu_link",
                "turntable_inner_link",
                "turntable_outer_link",
                "base_link",
                "odom",
                "map",
                "earth"
            ]
        );
    });
}

#[test]
fn outputs_that_do_not_exist_are_named() {
    for (parameter, value, words) in [
        ("nmea_udp", "nowhere", "HOST:PORT"),
        ("nmea_serial", "/no/such/device", "/no/such/device"),
        ("nmea_sentences", "[HDT, XYZ]", "XYZ"),
        ("nmea_talker", "ins", "two capital letters"),
    ] {
        isolated(|| {
            let scene = Scene::new("aboard_refused");
            let mut node = scene.start_apart(
                &Program::new("navigation_compensator")
                    .label(parameter)
                    .parameter(parameter, value),
            );
            let status = node.wait();
            let log = node.log();
            assert!(!status.success(), "{parameter}: {log}");
            assert!(log.contains(parameter) && log.contains(words), "{log}");
            assert!(!log.contains("panicked"), "{log}");
        });
    }
}
