//! Untrusted names and files: control characters are escaped on terminals and pages, spreadsheets compute no cells, and of
//! an unreadable file only the faulty token is printed.
#![cfg(unix)]

use crate::folder::{Folder, change, refused, replaced, stderr, stdout, succeeds};

/// Terminal control sequences: erase the line, red text, bell, and a sequence introducer in one character.
const ESCAPES: &str = "A\x1b[2K\x1b[31mB\x07\u{9b}1mC";
const SHOWN: &str = "A\\x1b[2K\\x1b[31mB\\x07\\x9b1mC";

/// Requires a text without control characters other than newlines and tabs.
#[track_caller]
fn is_plain(text: &str) {
    let acts = |c: char| c.is_control() && !"\n\t".contains(c);
    assert!(!text.contains(acts), "{text:?}");
}

#[test]
fn control_characters_of_names_are_escaped() {
    let folder = Folder::new();
    folder.write("marks.csv", &format!("t[s],x{ESCAPES},y{ESCAPES}\n0,1,2\n0.1,1,2\n0.2,1,2\n"));
    let output = folder.run(&["inspect", "marks.csv"]);
    succeeds(&output);
    is_plain(&stdout(&output));
    assert!(stdout(&output).to_lowercase().contains(&SHOWN.to_lowercase()), "{}", stdout(&output));

    // Names with line breaks cannot pretend to be lines of the program.
    folder
        .write("lines.csv", "t,\"xa\nwarning: forged\",\"ya\nwarning: forged\"\n0,1,2\n0.1,1,2\n");
    let output = folder.run(&["inspect", "lines.csv"]);
    assert!(!stdout(&output).lines().any(|line| line.starts_with("warning: forged")));

    // Names of files, in messages, in words of the command line and in results.
    let name = format!("{ESCAPES}.toml");
    folder.write(&name, &change("end = 0.3", "end = -1"));
    folder.write("good.toml", &change("end = 0.3", "end = 0.02"));
    for arguments in [
        vec!["simulate", &name],
        vec!["simulate", "good.toml", &name],
        vec!["fit", &name],
        vec!["campaign", "plan", &name, "--out", "out"],
        vec!["simulate", "good.toml", "--out", "none/\x1b[31m/a"],
        vec!["explain", "\x1b[31m"],
    ] {
        let output = folder.run(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        is_plain(&stderr(&output));
        assert!(stderr(&output).contains("\\x1b["), "{arguments:?}: {}", stderr(&output));
    }
    // Quoted lines and keys of TOML.
    let scenes = [
        change("[time]", "[time]\n\"\x1b[31mred\" = 1"),
        change("[time]", "[time]\nscheme = \"\\u001b[31mred\""),
        change("end = 0.3", "end = 0.3 \x1b[31m"),
        change("[time]", "[rod.\"\\u009b31m\"]\n[time]"),
    ];
    for scene in scenes {
        folder.write("bad.toml", &scene);
        let output = folder.run(&["simulate", "bad.toml"]);
        refused(&output, &["bad.toml"]);
        is_plain(&stderr(&output));
    }
}

#[test]
fn control_characters_are_escaped_in_pages() {
    let folder = Folder::new();
    let name = "\x1b[31mred.toml";
    folder.write(name, &change("end = 0.3", "end = 0.02"));
    succeeds(&folder.run(&["simulate", name, "--report", "page"]));
    let page = folder.read("page/simulation.html");
    is_plain(&page);
    assert!(page.contains("\\x1b[31mred.toml"));
}

#[test]
fn content_of_unreadable_files_is_not_printed() {
    let folder = Folder::new();
    let secret = "root:$6$Zk3:19000:0:99999:7:::";
    let shadow: String = (0..5).map(|k| format!("{secret}{k}\n")).collect();
    let long: String = (0..40).map(|k| format!("secret {k} ")).collect();
    let key = format!("key = \"{long}\"\nother = secret\n");
    let one_line = format!("{}\n", "password=hunter2,".repeat(40));
    for content in [&shadow, &key, &one_line, &format!("t,x,y\n0,{long},{long}\n")] {
        folder.write("private", content);
        let scene = change(
            "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
            "kind = \"polyline\", file = \"private\"",
        );
        folder.write("bad.toml", &replaced(&scene, "segments = 20\n", ""));
        folder.write("bad-fit.toml", &crate::folder::FIT.replace("tip.csv", "private"));
        folder.write("bad-campaign.toml", "fits = [\"fit.toml\"]\ntable = \"private\"\n");
        for arguments in [
            &["simulate", "bad.toml"][..],
            &["simulate", "private"],
            &["fit", "private"],
            &["fit", "bad-fit.toml"],
            &["inspect", "private"],
            &["campaign", "plan", "private", "--out", "out"],
            &["campaign", "plan", "bad-campaign.toml", "--out", "out"],
        ] {
            let output = folder.run(arguments);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}");
            // The longest piece of the file that the message has.
            let message = stderr(&output);
            let start = |k: &usize| content.is_char_boundary(*k);
            let shown = |k: usize| {
                let piece = content.get(k..k + 90);
                piece.is_some_and(|piece| message.contains(piece))
            };
            // Tokens are cut to 80 characters, so that no piece of 90 bytes is printed.
            assert!(!(0..content.len()).filter(start).any(shown), "{arguments:?}: {message}");
            // Of several lines at most one.
            let lines = content.lines().filter(|line| line.len() > 20 && message.contains(line));
            assert!(lines.count() <= 1, "{arguments:?}: {message}");
        }
    }
}

#[test]
fn errors_of_toml_name_line_column_and_token() {
    let folder = Folder::new();
    for (from, to, words) in [
        ("segments = 20", "segmnts = 20", "line 3, column 1: unknown field `segmnts`"),
        (
            "radius = 0.005",
            "radius = \"thin\"",
            "line 5, column 11: at `section = { kind = \"circle\", radius = \"thin\" }`",
        ),
        ("density = 1273.52", "density = 12 73", "line 8, column 11: at `density = 12 73`"),
        ("density = 1273.52", "density", "line 8, column 8"),
        ("[material]", "[rod]", "line 7, column 2"),
    ] {
        folder.write("bad.toml", &change(from, to));
        refused(&folder.run(&["simulate", "bad.toml"]), &["bad.toml: ", words]);
    }
}
