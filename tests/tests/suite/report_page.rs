//! The pages in a browser: nothing is missing, cut off, fetched or wider than a phone.

use std::fs;
use std::path::Path;

use serde_json::Value;
use suite_tests::{Simulation, alter_imu, chromium, copy_bag, look_at, rotary_sins, scratch};

/// Everything that can be wrong with a page, in the words of the browser.
fn complaints(found: &Value) -> Vec<String> {
    [
        "errors",
        "dead_links",
        "broken_images",
        "broken_pictures",
        "sideways",
        "requests",
        "phone",
    ]
    .into_iter()
    .flat_map(|key| {
        let list = found[key]
            .as_array()
            .unwrap_or_else(|| panic!("no list '{key}' in {found}"));
        list.iter()
            .map(move |complaint| format!("{key}: {complaint}"))
    })
    .collect()
}

fn ids(list: &Value) -> Vec<&str> {
    let list = list.as_array().unwrap();
    list.iter().map(|id| id.as_str().unwrap()).collect()
}

/// No complaint, and exactly these figures, each with its picture.
fn assert_page(browser: &Path, html: &str, folder: &Path, figures: &[&str]) {
    let found = look_at(browser, html, folder);
    let complaints = complaints(&found);
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    assert_eq!(ids(&found["figure_ids"]), figures);
    assert_eq!(found["figures"], figures.len());
    assert_eq!(found["pictures"], figures.len());
    assert!(found["links"].as_u64().unwrap() >= 3, "{found}");
    // The name of a language is no place on a network.
    let text = html.replace("http://www.w3.org/2000/svg", "");
    for word in [
        "http:", "https:", "ws://", "wss:", "//fonts", "@import", "url(",
    ] {
        assert!(!text.contains(word), "the page has {word}");
    }
}

#[test]
fn page_of_compare_is_whole() {
    let Some(browser) = chromium() else { return };
    let folder = scratch("page_of_compare");
    let output = folder.to_str().unwrap();
    let short = "compare --runs 2 --hours 1 --rate 10 --output";
    let arguments: Vec<&str> = short.split(' ').chain([output]).collect();
    let _ = rotary_sins(&arguments).expect_status(0);
    let figures = fs::read_to_string(folder.join("figures.json")).unwrap();
    let figures: Value = serde_json::from_str(&figures).unwrap();
    let figures = figures.as_array().unwrap();
    let announced: Vec<&str> = figures.iter().map(|f| f["id"].as_str().unwrap()).collect();
    let html = fs::read_to_string(folder.join("report.html")).unwrap();
    assert_page(&browser, &html, &folder, &announced);
}

#[test]
fn page_of_the_experiment_is_whole() {
    let Some(browser) = chromium() else { return };
    let folder = scratch("page_of_the_experiment");
    let page = folder.join("experiment.html");
    let arguments = ["experiment", "--runs", "2", "--rate", "10", "--output"];
    let arguments = [&arguments[..], &[page.to_str().unwrap()]].concat();
    let _ = rotary_sins(&arguments).expect_status(0);
    let html = fs::read_to_string(page).unwrap();
    let figures: Vec<&str> = html
        .split("<figure id=\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .collect();
    assert!(!figures.is_empty());
    assert_page(&browser, &html, &folder, &figures);
}

/// A page of a run, made of the short simulation; JSON and HTML.
fn page_of_a_run(folder: &Path) -> (Value, String) {
    let bag = Simulation::converging().bag();
    let page = folder.join("run.html");
    let arguments = ["report", bag.to_str().unwrap(), "--json", "--output"];
    let arguments = [&arguments[..], &[page.to_str().unwrap()]].concat();
    let json = rotary_sins(&arguments).expect_status(0).json();
    (json, fs::read_to_string(page).unwrap())
}

#[test]
fn page_of_a_run_is_whole() {
    let Some(browser) = chromium() else { return };
    let folder = scratch("page_of_a_run");
    let (json, html) = page_of_a_run(&folder);
    assert_page(&browser, &html, &folder, &ids(&json["figures"]));
}

/// Long lines about damage and gaps do not make the page wider.
#[test]
fn page_of_a_damaged_run_is_whole() {
    let Some(browser) = chromium() else { return };
    let folder = scratch("page_of_a_damaged_run");
    let (gaps, cut) = (folder.join("gaps.mcap"), folder.join("cut.mcap"));
    let bag = Simulation::converging().bag();
    alter_imu(&bag, &gaps, |index, imu| {
        imu.header.stamp.sec += i32::try_from(index / 2000).unwrap();
        if index == 100 {
            imu.angular_velocity.x = f64::NAN;
        }
    });
    copy_bag(&gaps, &cut, |bytes| bytes.truncate(bytes.len() * 9 / 10));
    let page = folder.join("run.html");
    let [cut, path] = [&cut, &page].map(|path| path.to_str().unwrap());
    let answer = rotary_sins(&["report", cut, "--json", "--output", path]).expect_status(1);
    let json = answer.json();
    assert!(json["gaps"].as_u64().unwrap() > 20, "{json}");
    let html = fs::read_to_string(page).unwrap();
    assert_page(&browser, &html, &folder, &ids(&json["figures"]));
}

/// The look at a page finds what it is there for.
#[test]
fn broken_page_is_found_out() {
    let Some(browser) = chromium() else { return };
    let folder = scratch("broken_page");
    let (_, whole) = page_of_a_run(&folder);
    for (part, broken, complaint) in [
        ("</main>", "<img src='gone.png'></main>", "broken_images"),
        ("</main>", "<img src='gone.png'></main>", "not loaded"),
        (
            "</main>",
            "<svg width='0' height='0'></svg></main>",
            "broken_pictures",
        ),
        ("viewBox=\"0 0 1000", "viewBox=\"0 0 750", "is cut off"),
        (
            "href=\"#section-topics\"",
            "href=\"#nowhere\"",
            "dead_links",
        ),
        (
            "</main>",
            "<p style='width: 700px'>wide</p></main>",
            "phone",
        ),
        (
            "</main>",
            "<div style='width: 1700px'>wide</div></main>",
            "sideways",
        ),
        (
            "</main>",
            "<img src='http://example.invalid/a.png'></main>",
            "requests",
        ),
        (
            "</main>",
            "<script>console.error('no')</script></main>",
            "errors: \"no\"",
        ),
        (
            "</main>",
            "<script>gone()</script></main>",
            "gone is not defined",
        ),
    ] {
        assert!(whole.contains(part), "{part}");
        let found = look_at(&browser, &whole.replace(part, broken), &folder);
        let complaints = complaints(&found);
        assert!(
            complaints.iter().any(|line| line.contains(complaint)),
            "{broken}: no '{complaint}' in {complaints:?}"
        );
    }
}
