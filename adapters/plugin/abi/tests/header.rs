//! `include/vice_plugin.h` and the Rust types are the same contract: the header is compiled, and every size, place and
//! constant in it is compared.

// Helpers of tests fail their test.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use vice_abi::contract::*;

fn include() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include")
}

/// `struct.field` to its place, and `struct` to its size, of the types of Rust.
fn rust_layout() -> BTreeMap<String, usize> {
    let mut layout = BTreeMap::new();
    macro_rules! layout {
        ($($c:literal = $rust:ident { $($field:ident),* $(,)? })*) => {$(
            layout.insert($c.to_string(), size_of::<$rust>());
            $(layout.insert(format!("{}.{}", $c, stringify!($field)), std::mem::offset_of!($rust, $field));)*
            // Naming every field here fails to compile when one is forgotten.
            let _ = |value: $rust| { let $rust { $($field: _),* } = value; };
        )*};
    }
    layout! {
        "vice_text" = Text { data, length }
        "vice_message" = Message { data, capacity, length }
        "vice_host" = Host { abi_version, struct_size, context, log }
        "vice_setting_info" = SettingInfo { key, description }
        "vice_setting" = Setting { key, value }
        "vice_probe" = Probe { answer, reserved, paths, count, owner }
        "vice_camera_entry" = CameraEntry { name, flags }
        "vice_stream_entry" = StreamEntry { name, kind, reserved }
        "vice_dataset_info" = DatasetInfo { name, cameras, camera_count, streams, stream_count, owner }
        "vice_rigid" = Rigid { translation_m, rotation_wxyz }
        "vice_camera" = Camera {
            width_px, height_px, fx_px, fy_px, cx_px, cy_px, model, coefficient_count, coefficients,
        }
        "vice_stamps" = Stamps { stamps_ns, count, owner }
        "vice_image" = Image { width_px, height_px, format, row_stride_bytes, data, data_bytes, owner }
        "vice_depth_image" = DepthImage {
            stamp_ns, width_px, height_px, z_m, data_bytes, row_stride_bytes, reserved, owner,
        }
        "vice_pose" = Pose { stamp_ns, world_from_body }
        "vice_poses" = Poses { poses, count, owner }
        "vice_motion" = Motion { from_ns, to_ns, later_from_earlier }
        "vice_motions" = Motions { motions, count, owner }
        "vice_imu_sample" = ImuSample { stamp_ns, gyro_body_rad_s, accel_body_m_s2 }
        "vice_imu_samples" = ImuSamples { samples, count, owner }
        "vice_inertial_state" = InertialState {
            stamp_ns, world_from_body, velocity_world_m_s, gyro_bias_body_rad_s, accel_bias_body_m_s2,
        }
        "vice_point" = Point { x_m, y_m, z_m }
        "vice_cloud" = Cloud { kind, reserved, ply_path, points, count, world_from_cloud, owner }
        "vice_floor" = Floor { frame, reserved, normal, d_m }
        "vice_fact" = Fact { section, text }
        "vice_facts" = Facts { facts, count, owner }
        "vice_plugin_table" = PluginTable {
            abi_version, struct_size, flags, name, version, description, offers, offer_count, settings,
            setting_count, probe, open, close, release, describe, camera, frames, image, body_from_camera,
            trajectory, relative_motions, imu, inertial_state, depth_image, cloud, floor, facts,
        }
    }
    layout
}

fn rust_constants() -> BTreeMap<String, u64> {
    [
        ("ABI_VERSION", u64::from(ABI_VERSION)),
        ("OK", OK as u64),
        ("NONE", NONE as u64),
        ("ERROR", ERROR as u64),
        ("EXCEPTION", EXCEPTION as u64),
        ("FLAG_THREAD_SAFE", FLAG_THREAD_SAFE),
        ("PROBE_NO", PROBE_NO as u64),
        ("PROBE_YES", PROBE_YES as u64),
        ("PROBE_COLLECTION", PROBE_COLLECTION as u64),
        ("MODEL_PINHOLE", MODEL_PINHOLE as u64),
        ("MODEL_RADTAN", MODEL_RADTAN as u64),
        ("MODEL_RATIONAL", MODEL_RATIONAL as u64),
        ("MODEL_EQUIDISTANT", MODEL_EQUIDISTANT as u64),
        ("MAX_COEFFICIENTS", MAX_COEFFICIENTS as u64),
        ("CAMERA_HAS_DEPTH", CAMERA_HAS_DEPTH),
        ("STREAM_POSES", STREAM_POSES as u64),
        ("STREAM_RELATIVE", STREAM_RELATIVE as u64),
        ("PIXELS_GRAY8", PIXELS_GRAY8 as u64),
        ("PIXELS_RGB8", PIXELS_RGB8 as u64),
        ("CLOUD_PLY", CLOUD_PLY as u64),
        ("CLOUD_POINTS", CLOUD_POINTS as u64),
        ("FLOOR_WORLD", FLOOR_WORLD as u64),
        ("FLOOR_BODY", FLOOR_BODY as u64),
        ("LOG_ERROR", LOG_ERROR as u64),
        ("LOG_WARN", LOG_WARN as u64),
        ("LOG_INFO", LOG_INFO as u64),
    ]
    .into_iter()
    .map(|(name, value)| (format!("VICE_{name}"), value))
    .collect()
}

/// The names of a C header of this plain form: `struct` and `struct.field`, and constants with a value.
fn names_of(header: &str) -> (Vec<String>, Vec<String>) {
    let mut text = String::new();
    for (i, part) in header.split("/*").enumerate() {
        text += if i == 0 { part } else { part.split_once("*/").expect("comments end").1 };
    }
    let constants = text
        .lines()
        .filter_map(|line| line.strip_prefix("#define ")?.split_once(' '))
        .filter(|(_, value)| value.trim().parse::<u64>().is_ok())
        .map(|(name, _)| name.to_string())
        .collect();
    let mut places = Vec::new();
    for definition in text.split("typedef struct ").skip(1) {
        let (name, rest) = definition.split_once(" {").expect("a structure has a body");
        let (body, _) = rest.split_once(&format!("}} {name};")).expect("a structure ends with its name");
        places.push(name.to_string());
        for field in body.split(';').map(str::trim).filter(|f| !f.is_empty()) {
            let field = match field.split_once("(*") {
                Some((_, call)) => call.split(')').next().unwrap(),
                None => field.split('[').next().unwrap().rsplit([' ', '*']).next().unwrap(),
            };
            places.push(format!("{name}.{field}"));
        }
    }
    (places, constants)
}

fn c_compiler() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".to_string())
}

#[test]
fn the_header_is_what_rust_says() {
    let header = std::fs::read_to_string(include().join("vice_plugin.h")).unwrap();
    let (places, constants) = names_of(&header);
    let mut source = "#include <stdio.h>\n#include \"vice_plugin.h\"\nint main(void) {\n".to_string();
    for place in &places {
        let value = match place.split_once('.') {
            Some((name, field)) => format!("offsetof({name}, {field})"),
            None => format!("sizeof({place})"),
        };
        writeln!(source, "    printf(\"{place} %zu\\n\", {value});").unwrap();
    }
    for name in &constants {
        writeln!(source, "    printf(\"{name} %llu\\n\", (unsigned long long)({name}));").unwrap();
    }
    source += "    return 0;\n}\n";
    let folder = tempfile::tempdir().unwrap();
    let (c, program) = (folder.path().join("layout.c"), folder.path().join("layout"));
    std::fs::write(&c, source).unwrap();
    compile(
        Command::new(c_compiler())
            .args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
            .arg("-o")
            .arg(&program)
            .arg(&c),
    );
    let output = Command::new(&program).output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let in_c: BTreeMap<String, u64> = printed
        .lines()
        .map(|line| line.split_once(' ').unwrap())
        .map(|(name, value)| (name.to_string(), value.parse().unwrap()))
        .collect();
    let mut in_rust = rust_constants();
    in_rust.extend(rust_layout().into_iter().map(|(name, place)| (name, place as u64)));
    assert_eq!(in_c, in_rust);
}

#[test]
fn the_headers_compile_without_warnings_as_cpp() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("uses.cpp");
    std::fs::write(&source, "#include \"vice_plugin.hpp\"\n").unwrap();
    let warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"];
    let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".to_string());
    compile(Command::new(compiler).arg("-std=c++17").args(warnings).arg("-fsyntax-only").arg(&source));
}

fn compile(command: &mut Command) {
    let output = command.arg("-I").arg(include()).output().expect("the system has a C and a C++ compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
