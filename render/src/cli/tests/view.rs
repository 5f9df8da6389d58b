//! `luxel view`: from a bake to its page.

use super::*;

#[test]
fn a_bake_becomes_a_page() {
    let folder = Folder::new();
    let baked = folder.path("baked");
    let cornell = example("cornell");
    let bake = [
        "bake", &cornell, "-o", &baked, "--size", "64", "--error", "20%", "--for", "three",
    ];
    assert_eq!(luxel(&bake).0, ExitCode::Ok);

    let (exit, stdout, stderr) = luxel(&["view", &baked]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let page = fs::read(format!("{baked}/view.html")).expect("the page");
    assert!(stdout.trim().ends_with("view.html"));

    let other = folder.path("other.html");
    let (exit, stdout, _) = luxel(&["--json", "view", &baked, "-o", &other]);
    assert_eq!(exit, ExitCode::Ok);
    assert_eq!(json(&stdout)["bytes"], page.len());
    assert_eq!(fs::read(&other).expect("the page"), page);
    // Scene and maps are small here: the rest is three.js.
    assert!(page.len() < 900_000, "{}", page.len());
}

#[test]
fn what_is_no_bake_is_refused() {
    let folder = Folder::new();
    let page = folder.path("view.html");
    let (exit, _, stderr) = luxel(&["view", &folder.path("."), "-o", &page]);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(stderr.contains("luxel bake SCENE -o"), "{stderr}");
    folder.write("manifest.json", "{\"schema\": 9}");
    let (exit, _, stderr) = luxel(&["view", &folder.path("."), "-o", &page]);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(stderr.contains("schema 9"), "{stderr}");
    assert!(fs::read(&page).is_err(), "no page of nothing");
}
