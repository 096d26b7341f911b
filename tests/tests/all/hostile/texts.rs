//! Descriptions that nest, repeat or go on for ever.

use super::{Flight, SENSOR, refused, within_limits};

fn evaluated(what: &str, flight: &Flight, more: &[&str], words: &[&str]) {
    let (run, labels) = (flight.text("run"), flight.text("labels.csv"));
    let fixed = ["evaluate", &run, "--labels", &labels, "--reference", "none"];
    refused(what, &[&fixed[..], more].concat(), words);
}

#[test]
fn resources_of_yaml() {
    let nested = format!("{SENSOR}more: {}{}\n", "[".repeat(100_000), "]".repeat(100_000));
    let mut aliases = format!("{SENSOR}a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n");
    for level in 1..12 {
        let again = vec![format!("*a{}", level - 1); 10].join(", ");
        aliases += &format!("a{level}: &a{level} [{again}]\n");
    }
    let long = format!("{SENSOR}note: \"{}\"\n", "x".repeat(5 << 20));
    let keys: String = (0..200_000).map(|i| format!("k{i}: 0\n")).collect();
    for (what, text) in [
        ("nested", nested),
        ("aliases", aliases),
        ("a long text", long),
        ("many keys", SENSOR.to_string() + &keys),
    ] {
        let flight = Flight::new();
        flight.write("run/mav0/cam0/sensor.yaml", text.as_bytes());
        let ran = within_limits(what, &["info", &flight.text("run")]);
        let said = format!("{}{}", ran.run.stdout, ran.run.stderr);
        assert!(ran.run.code == 0 || said.contains("sensor.yaml"), "{what}: {said}");
    }
}

#[test]
fn resources_of_toml_and_json() {
    let flight = Flight::new();
    flight.write("deep.toml", format!("a = {}{}\n", "[".repeat(100_000), "]".repeat(100_000)).as_bytes());
    flight.write("deep.json", format!("{}{}\n", "[".repeat(100_000), "]".repeat(100_000)).as_bytes());
    for name in ["deep.toml", "deep.json"] {
        let file = flight.text(name);
        evaluated(name, &flight, &["--estimate", "ground-truth", "--calibration", &file], &[name]);
    }
    refused(
        "a result",
        &["report", &flight.text("deep.json"), "--out", &flight.text("page.html")],
        &["deep.json"],
    );
    assert!(!flight.path("page.html").exists());
}

#[test]
fn resources_of_tables_of_poses() {
    let flight = Flight::new();
    flight.write("line.txt", &vec![b'1'; 8 << 20]);
    flight.write_sparse("hole.txt", b"# t x y z qx qy qz qw\n", 1 << 40);
    flight.write("zeros.txt", &[0; 1 << 20]);
    for name in ["line.txt", "hole.txt", "zeros.txt"] {
        let file = flight.text(name);
        evaluated(name, &flight, &["--estimate", &file], &[name]);
        refused(name, &["trajectory", &file, &file], &[name]);
    }
}
