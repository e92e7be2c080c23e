//! Names of nodes, topics and services: rules, resolution, remapping.
//!
//! A relative name stands in the node's namespace, `~` is the node itself, an absolute name stays as it is.
//! Remapping compares resolved names, and the first rule that matches wins, as in rcl.

use crate::error::{Error, Result};

/// Namespace and name of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeIdentity {
    /// Begins with a slash and does not end with one, but for the root, which is `/`.
    pub namespace: String,
    /// Without slashes.
    pub name: String,
}

impl NodeIdentity {
    /// Checks both parts. A namespace without a leading slash is given one, as rcl does.
    ///
    /// # Errors
    /// [`Error::Name`] where a part breaks the rules.
    pub fn new(namespace: &str, name: &str) -> Result<Self> {
        let bad = |name: &str, kind, reason: &str| Error::Name {
            name: name.to_owned(),
            kind,
            reason: reason.to_owned(),
        };
        check_token(name).map_err(|reason| bad(name, "node name", reason))?;
        let namespace = format!("/{}", namespace.trim_start_matches('/'));
        if namespace != "/" {
            for token in namespace[1..].split('/') {
                check_token(token).map_err(|reason| bad(&namespace, "namespace", reason))?;
            }
        }
        Ok(Self {
            namespace,
            name: name.to_owned(),
        })
    }

    /// `/namespace/name`.
    pub fn fully_qualified(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.name)
    }

    /// Absolute form of a topic or service name: relative to the namespace, `~` to the node; `{node}`, `{ns}` and
    /// `{namespace}` are replaced.
    ///
    /// # Errors
    /// [`Error::Name`] where the name breaks the rules of ROS 2.
    pub fn resolve(&self, name: &str) -> Result<String> {
        let bad = |reason: &str| Error::Name {
            name: name.to_owned(),
            kind: "topic or service name",
            reason: reason.to_owned(),
        };
        let replaced = name
            .replace("{node}", &self.name)
            .replace("{namespace}", self.namespace.trim_start_matches('/'))
            .replace("{ns}", self.namespace.trim_start_matches('/'));
        let absolute = match replaced.strip_prefix('~') {
            Some("") => self.fully_qualified(),
            Some(rest) if rest.starts_with('/') => format!("{}{rest}", self.fully_qualified()),
            Some(_) => return Err(bad("after '~' comes '/'")),
            None if replaced.starts_with('/') => replaced,
            None => format!("{}/{replaced}", self.namespace.trim_end_matches('/')),
        };
        for token in absolute[1..].split('/') {
            check_token(token).map_err(bad)?;
        }
        Ok(absolute)
    }
}

/// A part of a name between slashes.
fn check_token(token: &str) -> Result<(), &'static str> {
    if token.is_empty() {
        Err("it is empty or has an empty part")
    } else if token.starts_with(|c: char| c.is_ascii_digit()) {
        Err("a part begins with a digit")
    } else if !token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        Err("only letters, digits, '_' and '/' are allowed")
    } else if token.contains("__") {
        Err("'__' is not allowed")
    } else {
        Ok(())
    }
}

/// A remapping rule `[node:]from:=to` of the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemapRule {
    /// Only for the node of this name.
    pub node: Option<String>,
    /// What is replaced.
    pub target: RemapTarget,
    /// By what.
    pub to: String,
}

/// What a rule replaces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RemapTarget {
    /// The node's name, `__node` or `__name`.
    NodeName,
    /// The node's namespace, `__ns`.
    Namespace,
    /// A topic of this name (`rostopic://` or no scheme).
    Topic(String),
    /// A service of this name (`rosservice://`).
    Service(String),
    /// A topic or service of this name.
    TopicOrService(String),
}

impl RemapRule {
    /// From the text behind `-r`.
    ///
    /// # Errors
    /// [`Error::Argument`] where it does not have the form `[node:]from:=to`.
    pub fn parse(text: &str) -> Result<Self> {
        let bad = |reason: &str| Error::Argument(format!("remapping '{text}': {reason}"));
        let (from, to) = text
            .split_once(":=")
            .ok_or_else(|| bad("expected [node:]from:=to"))?;
        if from.is_empty() || to.is_empty() {
            return Err(bad("both sides of ':=' must be given"));
        }
        let (scheme, from) = match from.split_once("://") {
            Some((scheme @ ("rostopic" | "rosservice"), rest)) => (Some(scheme), rest),
            Some(_) => return Err(bad("only rostopic:// and rosservice:// are known")),
            None => (None, from),
        };
        let (node, from) = match from.split_once(':') {
            Some((node, rest)) => {
                check_token(node)
                    .map_err(|reason| bad(&format!("node name '{node}': {reason}")))?;
                (Some(node.to_owned()), rest)
            }
            None => (None, from),
        };
        let to = to
            .trim_start_matches("rostopic://")
            .trim_start_matches("rosservice://")
            .to_owned();
        let target = match (scheme, from) {
            (None, "__node" | "__name") => RemapTarget::NodeName,
            (None, "__ns") => RemapTarget::Namespace,
            (_, name) if name.starts_with("__") => {
                return Err(bad("expected __node, __name or __ns"));
            }
            (Some("rosservice"), name) => RemapTarget::Service(name.to_owned()),
            (Some(_), name) => RemapTarget::Topic(name.to_owned()),
            (None, name) => RemapTarget::TopicOrService(name.to_owned()),
        };
        Ok(Self { node, target, to })
    }

    fn is_for(&self, node_name: &str) -> bool {
        self.node.as_deref().is_none_or(|node| node == node_name)
    }
}

/// What a name is of, for remapping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameKind {
    /// A topic.
    Topic,
    /// A service.
    Service,
}

/// Name and namespace after the rules `__node` and `__ns`. Node-specific rules go by the node's original name.
///
/// # Errors
/// [`Error::Name`] where the result breaks the rules of ROS 2.
pub fn remap_node(namespace: &str, name: &str, rules: &[RemapRule]) -> Result<NodeIdentity> {
    let first = |target: &RemapTarget| {
        rules
            .iter()
            .find(|rule| rule.target == *target && rule.is_for(name))
            .map(|rule| rule.to.as_str())
    };
    NodeIdentity::new(
        first(&RemapTarget::Namespace).unwrap_or(namespace),
        first(&RemapTarget::NodeName).unwrap_or(name),
    )
}

/// Resolves a name and applies the first rule that matches it.
///
/// # Errors
/// [`Error::Name`] where the name, or that of a rule, breaks the rules of ROS 2.
pub fn resolve(
    node: &NodeIdentity,
    original_node_name: &str,
    rules: &[RemapRule],
    kind: NameKind,
    name: &str,
) -> Result<String> {
    let resolved = node.resolve(name)?;
    for rule in rules {
        if !(rule.is_for(&node.name) || rule.is_for(original_node_name)) {
            continue;
        }
        let (RemapTarget::TopicOrService(from)
        | RemapTarget::Topic(from)
        | RemapTarget::Service(from)) = &rule.target
        else {
            continue;
        };
        let other_kind = match kind {
            NameKind::Topic => matches!(rule.target, RemapTarget::Service(_)),
            NameKind::Service => matches!(rule.target, RemapTarget::Topic(_)),
        };
        if other_kind {
            continue;
        }
        if node.resolve(from)? == resolved {
            return node.resolve(&rule.to);
        }
    }
    Ok(resolved)
}

/// Text from outside, for a line: at most its first 80 letters, and how long it is.
pub fn short(text: &str) -> std::borrow::Cow<'_, str> {
    const LETTERS: usize = 80;
    match text.char_indices().nth(LETTERS) {
        None => text.into(),
        Some((end, _)) => format!("{}… ({} bytes)", &text[..end], text.len()).into(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A text of any length becomes part of a line.
    #[test]
    fn long_texts_are_cut() {
        assert_eq!(short("imu_rate_hz"), "imu_rate_hz");
        let long = short(&"Ω".repeat(1_000_000)).into_owned();
        assert!(
            long.len() < 200 && long.ends_with("… (2000000 bytes)"),
            "{long}"
        );
    }

    fn node() -> NodeIdentity {
        NodeIdentity::new("/ship", "calibrator").unwrap()
    }

    fn resolved(rules: &[&str], name: &str) -> String {
        let rules: Vec<_> = rules.iter().map(|r| RemapRule::parse(r).unwrap()).collect();
        resolve(&node(), "calibrator", &rules, NameKind::Topic, name).unwrap()
    }

    /// Relative, private and absolute names each have their own home.
    #[test]
    fn names_resolve_against_namespace_and_node() {
        assert_eq!(resolved(&[], "imu/data"), "/ship/imu/data");
        assert_eq!(resolved(&[], "~/status"), "/ship/calibrator/status");
        assert_eq!(resolved(&[], "~"), "/ship/calibrator");
        assert_eq!(resolved(&[], "/clock"), "/clock");
        assert_eq!(resolved(&[], "{node}/x"), "/ship/calibrator/x");
        assert_eq!(
            NodeIdentity::new("/", "n").unwrap().resolve("a").unwrap(),
            "/a"
        );
    }

    /// Names that DDS or ROS tools would choke on are refused.
    #[test]
    fn bad_names_are_refused() {
        for name in ["", "/", "a//b", "a/", "1a", "a b", "a__b", "~x", "ä"] {
            assert!(node().resolve(name).is_err(), "{name}");
        }
        assert!(NodeIdentity::new("/a/", "n").is_err());
        assert!(NodeIdentity::new("/a", "n/m").is_err());
    }

    /// The first matching rule wins, compared on resolved names; what it maps to is resolved as well.
    #[test]
    fn first_matching_remap_wins() {
        let rules = [
            "other:imu/data:=wrong",
            "imu/data:=imu/raw",
            "/ship/imu/data:=late",
        ];
        assert_eq!(resolved(&rules, "imu/data"), "/ship/imu/raw");
        assert_eq!(resolved(&rules, "/ship/imu/data"), "/ship/imu/raw");
        assert_eq!(resolved(&["calibrator:imu/data:=/abs"], "imu/data"), "/abs");
        assert_eq!(
            resolved(&["rosservice://imu/data:=/abs"], "imu/data"),
            "/ship/imu/data"
        );
    }

    /// `__node` and `__ns` rename the node; a rule for another node does not.
    #[test]
    fn node_and_namespace_are_remapped() {
        let rules: Vec<_> = ["other:__node:=x", "__node:=b", "a:__ns:=/port"]
            .iter()
            .map(|r| RemapRule::parse(r).unwrap())
            .collect();
        assert_eq!(
            remap_node("/", "a", &rules).unwrap().fully_qualified(),
            "/port/b"
        );
    }

    /// A rule that is not one is an error, not a rule that never matches.
    #[test]
    fn malformed_rules_are_errors() {
        for rule in ["a", "a:=", ":=b", "__nod:=x", "http://a:=b", "a b:c:=d"] {
            assert!(RemapRule::parse(rule).is_err(), "{rule}");
        }
    }
}
