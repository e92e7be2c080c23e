//! The six parameter services and `/parameter_events`.

use ros2_client::parameters::raw;
use ros2_client::rcl_interfaces as rcl;
use ros2_interfaces::builtin_interfaces::Time;
use ros2_interfaces::rcl_interfaces as msgs;
use ros2_interfaces::standard_topics::PARAMETER_EVENTS;

use crate::error::Result;
use crate::node::Node;
use crate::publisher::Publisher;

use super::store::Parameters;
use super::value::{Value, not_set};

/// Starts the services and announces the parameters.
///
/// # Errors
/// [`crate::Error::Create`].
pub(crate) fn serve(node: &Node) -> Result<()> {
    let events = node
        .ungated_publisher::<msgs::ParameterEvent>(PARAMETER_EVENTS.name, PARAMETER_EVENTS.qos)?;
    let of = |name: &str| format!("~/{name}");
    let kind = |name: &str| format!("rcl_interfaces/srv/{name}");

    let own = node.clone();
    node.serve(
        &of("get_parameters"),
        &kind("GetParameters"),
        move |request: rcl::GetParametersRequest| rcl::GetParametersResponse {
            values: get(own.parameters(), &request.names),
        },
    )?;
    let own = node.clone();
    node.serve(
        &of("get_parameter_types"),
        &kind("GetParameterTypes"),
        move |request: rcl::GetParameterTypesRequest| rcl::GetParameterTypesResponse {
            values: get(own.parameters(), &request.names)
                .iter()
                .map(|v| v.ptype)
                .collect(),
        },
    )?;
    let own = node.clone();
    node.serve(
        &of("describe_parameters"),
        &kind("DescribeParameters"),
        move |request: rcl::DescribeParametersRequest| rcl::DescribeParametersResponse {
            values: describe(own.parameters(), &request.names),
        },
    )?;
    let own = node.clone();
    node.serve(
        &of("list_parameters"),
        &kind("ListParameters"),
        move |request: rcl::ListParametersRequest| rcl::ListParametersResponse {
            result: list(own.parameters(), &request.prefixes, request.depth),
        },
    )?;
    let (own, announce) = (node.clone(), events.clone());
    node.serve(
        &of("set_parameters"),
        &kind("SetParameters"),
        move |request: rcl::SetParametersRequest| {
            let set_one =
                |parameter: &raw::Parameter| set(&own, &announce, std::slice::from_ref(parameter));
            rcl::SetParametersResponse {
                results: request.parameter.iter().map(set_one).collect(),
            }
        },
    )?;
    let (own, announce) = (node.clone(), events.clone());
    node.serve(
        &of("set_parameters_atomically"),
        &kind("SetParametersAtomically"),
        move |request: rcl::SetParametersRequest| rcl::SetParametersAtomicallyResponse {
            result: set(&own, &announce, &request.parameter),
        },
    )?;

    let declared = node.parameters().declarations();
    let all = declared
        .iter()
        .filter_map(|p| Some((p.name().to_owned(), node.parameters().value(p.name())?)))
        .collect();
    events
        .publish(event(node, all, Vec::new()))
        .left_to_diagnostics();
    Ok(())
}

fn get(parameters: &Parameters, names: &[String]) -> Vec<raw::ParameterValue> {
    names
        .iter()
        .map(|name| {
            parameters
                .value(name)
                .map_or_else(not_set, |value| value.to_message())
        })
        .collect()
}

fn describe(parameters: &Parameters, names: &[String]) -> Vec<raw::ParameterDescriptor> {
    let known = names.iter().filter_map(|name| parameters.declaration(name));
    known.map(|parameter| parameter.descriptor()).collect()
}

/// Names under the prefixes, at most `depth` parts deep; depth 0 is without limit.
fn list(parameters: &Parameters, prefixes: &[String], depth: u64) -> rcl::ListParametersResult {
    let within = |rest: &str| depth == 0 || (rest.matches('.').count() as u64) < depth;
    let wanted = |name: &str| {
        if prefixes.is_empty() {
            return within(name);
        }
        prefixes.iter().any(|prefix| {
            name == prefix
                || name
                    .strip_prefix(prefix.as_str())
                    .and_then(|rest| rest.strip_prefix('.'))
                    .is_some_and(within)
        })
    };
    let names: Vec<String> = parameters
        .declarations()
        .iter()
        .map(|p| p.name().to_owned())
        .filter(|name| wanted(name))
        .collect();
    let mut found: Vec<String> = names
        .iter()
        .filter_map(|name| name.rsplit_once('.').map(|(prefix, _)| prefix.to_owned()))
        .collect();
    found.sort();
    found.dedup();
    rcl::ListParametersResult {
        names,
        prefixes: found,
    }
}

fn set(
    node: &Node,
    events: &Publisher<msgs::ParameterEvent>,
    wanted: &[raw::Parameter],
) -> raw::SetParametersResult {
    let changes: Vec<_> = wanted
        .iter()
        .map(|p| (p.name.clone(), Value::from_message(&p.value)))
        .collect();
    match node.parameters().set(&changes) {
        Ok(()) => {
            let changed = changes
                .into_iter()
                .filter_map(|(name, value)| Some((name, value?)))
                .collect();
            events
                .publish(event(node, Vec::new(), changed))
                .left_to_diagnostics();
            raw::SetParametersResult {
                successful: true,
                reason: String::new(),
            }
        }
        Err(reason) => raw::SetParametersResult {
            successful: false,
            reason,
        },
    }
}

fn event(
    node: &Node,
    new: Vec<(String, Value)>,
    changed: Vec<(String, Value)>,
) -> msgs::ParameterEvent {
    let message = |(name, value): (String, Value)| msgs::Parameter {
        name,
        value: event_value(&value),
    };
    msgs::ParameterEvent {
        stamp: Time::from_nanos(node.clock().now_nanos()),
        node: node.fully_qualified_name(),
        new_parameters: new.into_iter().map(message).collect(),
        changed_parameters: changed.into_iter().map(message).collect(),
        deleted_parameters: Vec::new(),
    }
}

/// The same value in the structure of the message package, which names its fields otherwise.
fn event_value(value: &Value) -> msgs::ParameterValue {
    let raw = value.to_message();
    msgs::ParameterValue {
        r#type: raw.ptype,
        bool_value: raw.boolean_value,
        integer_value: raw.int_value,
        double_value: raw.double_value,
        string_value: raw.string_value,
        byte_array_value: raw.byte_array,
        bool_array_value: raw.bool_array,
        integer_array_value: raw.int_array,
        double_array_value: raw.double_array,
        string_array_value: raw.string_array,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::parameters::Parameter;

    fn parameters() -> Parameters {
        let declared = ["a", "b.c", "b.d.e"]
            .map(|name| Parameter::new(name, 1.0))
            .to_vec();
        Parameters::new(declared, &[]).unwrap()
    }

    fn listed(prefixes: &[&str], depth: u64) -> Vec<String> {
        let prefixes: Vec<_> = prefixes.iter().map(|&p| p.to_owned()).collect();
        list(&parameters(), &prefixes, depth).names
    }

    /// Prefix and depth count parts between dots.
    #[test]
    fn listing_obeys_prefix_and_depth() {
        assert_eq!(listed(&[], 0), ["a", "b.c", "b.d.e", "use_sim_time"]);
        assert_eq!(listed(&[], 1), ["a", "use_sim_time"]);
        assert_eq!(listed(&["b"], 1), ["b.c"]);
        assert_eq!(listed(&["b"], 0), ["b.c", "b.d.e"]);
    }

    /// What is not declared is not set, and has no descriptor.
    #[test]
    fn unknown_names_are_not_set() {
        let names = ["a".to_owned(), "x".to_owned()];
        assert_eq!(
            get(&parameters(), &names)
                .iter()
                .map(|v| v.ptype)
                .collect::<Vec<_>>(),
            [3, 0]
        );
        assert_eq!(describe(&parameters(), &names).len(), 1);
    }
}
