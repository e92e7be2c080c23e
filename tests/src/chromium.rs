//! A page as a browser has it: headless Chromium opens a copy with two scripts in it, and says what it found.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::skipping::skip;

/// Names that the browser goes by.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// Stands first in the copy: from here on nothing goes wrong unseen.
const LISTEN: &str = "<script>
window.found = { errors: [] };
addEventListener('error', e => found.errors.push(e.message || `not loaded: ${e.target.outerHTML.slice(0, 200)}`), true);
addEventListener('unhandledrejection', e => found.errors.push(String(e.reason)));
addEventListener('securitypolicyviolation', e => found.errors.push(e.blockedURI));
for (const level of ['error', 'warn']) console[level] = (...words) => found.errors.push(words.join(' '));
</script>";
/// Stands last in the copy, and looks when everything is there.
const LOOK: &str = include_str!("look_at_page.js");

/// The browser; `None`, with a line, where there is none.
pub fn chromium() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&folders)
        .flat_map(|folder| NAMES.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    if found.is_none() {
        skip("there is no Chromium to open pages with: install the package chromium");
    }
    found
}

/// Opens a page without scripts of its own, and says what is in it and what is wrong with it.
pub fn look_at(browser: &Path, html: &str, folder: &Path) -> Value {
    let (head, rest) = html.split_once("<head>").unwrap();
    let (body, end) = rest.rsplit_once("</body>").unwrap();
    let copy = folder.join("copy.html");
    let text = format!("{head}<head>{LISTEN}{body}<script>{LOOK}</script></body>{end}");
    fs::write(&copy, text).unwrap();
    let network = folder.join("network.json");
    let output = Command::new("timeout")
        .args(["--kill-after=5", "120"])
        .arg(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--disable-dev-shm-usage",
            "--hide-scrollbars",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--window-size=1200,900",
            "--virtual-time-budget=10000",
            "--dump-dom",
        ])
        .arg(format!("--log-net-log={}", network.display()))
        .arg(format!(
            "--user-data-dir={}",
            folder.join("browser").display()
        ))
        .arg(format!("file://{}", copy.canonicalize().unwrap().display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let found = dom
        .split_once("id=\"findings\">")
        .and_then(|(_, rest)| rest.split_once("</script>"));
    let Some((json, _)) = found else {
        panic!(
            "{}: no findings ({}):\n{}",
            browser.display(),
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
    };
    let mut found: Value = serde_json::from_str(json).unwrap();
    found["requests"] = requests(&fs::read_to_string(network).unwrap()).into();
    found
}

/// What was asked of a network for the page: every address of the browser's own log but those that it asks for itself.
fn requests(log: &str) -> Vec<String> {
    const OWN: [&str; 3] = ["google.com", "googleapis.com", "gvt1.com"];
    let mut addresses: Vec<String> = log
        .split("\"url\":\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .filter(|address| {
            let host = address.split_once("://").map_or("", |(_, rest)| rest);
            let host = host.split(['/', ':', '?']).next().unwrap_or_default();
            address.starts_with("http") && !OWN.iter().any(|own| host.ends_with(own))
        })
        .map(str::to_owned)
        .collect();
    addresses.sort();
    addresses.dedup();
    addresses
}
