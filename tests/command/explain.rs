//! Codes of warnings: each follows its message in brackets in text, JSON and pages, and `rodfit explain` prints its entry, also
//! by former names.

use crate::folder::{FIT, Folder, change, refused, status, stderr, stdout, succeeds};
use rodfit::Code;
use rodfit::code::explained;

#[test]
fn explain_prints_entries_and_former_names() {
    let folder = Folder::new();
    let all = stdout(&folder.run(&["explain"]));
    for code in Code::ALL {
        assert!(all.lines().any(|line| line.starts_with(&format!("{code} "))), "{code}");
    }
    for asked in ["beyond-sigma", "[Beyond-Sigma]"] {
        let output = folder.run(&["explain", asked]);
        succeeds(&output);
        let text = stdout(&output);
        assert!(text.starts_with("beyond-sigma: The residuals are larger"), "{text}");
        assert!(text.contains("\nTo do. ") && !text.contains("**"), "{text}");
    }
    let renamed = stdout(&folder.run(&["explain", "could-hide"])); // old name
    assert!(renamed.starts_with("undetected-bias (formerly could-hide): "), "{renamed}"); // old name
    assert!(stdout(&folder.run(&["explain", "3"])).starts_with("3: The computation failed"));
    refused(&folder.run(&["explain", "beyond-sgima"]), &["beyond-sgima", "such as beyond-sigma"]);
}

#[test]
fn warnings_end_with_their_code() {
    let folder = Folder::new();
    folder.write("fit.toml", &FIT.replace("point = \"tip\"", "point = \"tip\"\nsigma = 1e-6"));
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json", "--report", "page"]);
    succeeds(&output);
    let (shown, json, page) =
        (stdout(&output), folder.json("fit.json"), folder.read("page/fit.html"));
    assert!(status(&shown).ends_with(" [model-does-not-explain]"), "{shown}");
    let codes: Vec<&str> =
        json["warning_codes"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    assert!(codes.contains(&"beyond-sigma"), "{codes:?}");
    let warnings = json["warnings"].as_array().unwrap();
    assert_eq!(warnings.len(), codes.len());
    for (words, code) in warnings.iter().zip(codes) {
        let words = words.as_str().unwrap();
        assert!(words.ends_with(&format!(" [{code}]")), "{words}");
        assert!(crate::folder::words(&shown).contains(&format!("warning: {words}")), "{shown}");
        assert!(page.contains(&format!("<code>{code}</code></summary><p>")), "{code}");
        assert!(explained(code).is_some());
    }
    // Why a computation ends.
    folder.write("scene.toml", &change("[time]", "[supports]\nstart = \"free\"\n[time]"));
    let output = folder.run(&["static", "scene.toml"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).trim_end().ends_with(" [no-equilibrium]"), "{}", stderr(&output));
}
