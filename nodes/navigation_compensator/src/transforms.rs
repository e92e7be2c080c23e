//! Transforms of `/tf` and `/tf_static`: earth → map → odom → base_link → the table's links → the block.

use ros2_interfaces::geometry_msgs::TransformStamped;
use ros2_interfaces::tf2_msgs::TFMessage;
use rotary_sins_msgs::convert::header;
use sins::Stamp;
use sins::earth::Position;
use sins::earth::frames::{Frame, map_in_earth};
use sins::machines::navigator::Solution;
use sins::table::Turntable;
use sins::table::links::table_links;

/// Names of the frames between the ship and the block.
const OUTER_LINK: &str = "turntable_outer_link";
const INNER_LINK: &str = "turntable_inner_link";

fn transform(stamp: Stamp, parent: &str, child: &str, frame: &Frame) -> TransformStamped {
    let mut message = TransformStamped {
        header: header(stamp, parent),
        child_frame_id: child.to_owned(),
        ..TransformStamped::default()
    };
    message.transform.translation = frame.translation.into();
    message.transform.rotation = frame.rotation.into();
    message
}

/// What moves: the table's links by the joint angles, and the ship where there is a solution.
pub fn moving(
    stamp: Stamp,
    table: Turntable,
    angles: [f64; 2],
    ship: Option<(&Solution, &Position)>,
    odometry_frame: &str,
    base_frame: &str,
) -> TFMessage {
    let [outer, inner] = table_links(&table, angles);
    let mut transforms = vec![
        transform(stamp, base_frame, OUTER_LINK, &outer),
        transform(stamp, OUTER_LINK, INNER_LINK, &inner),
    ];
    if let Some((solution, origin)) = ship {
        let n = &solution.navigation;
        let frame = Frame {
            translation: origin.offset_m(&n.position),
            rotation: solution.base_link,
        };
        transforms.push(transform(stamp, odometry_frame, base_frame, &frame));
    }
    TFMessage { transforms }
}

/// What does not: the block in the inner link; and, where the origin is known, the map on the earth with the odometry's frame in it.
pub fn fixed(
    stamp: Stamp,
    block_frame: &str,
    odometry_frame: &str,
    origin: Option<&Position>,
) -> TFMessage {
    let same = Frame {
        translation: nalgebra::Vector3::zeros(),
        rotation: nalgebra::UnitQuaternion::identity(),
    };
    let mut transforms = vec![transform(stamp, INNER_LINK, block_frame, &same)];
    if let Some(origin) = origin {
        transforms.push(transform(stamp, "earth", "map", &map_in_earth(origin)));
        transforms.push(transform(stamp, "map", odometry_frame, &same));
    }
    TFMessage { transforms }
}
