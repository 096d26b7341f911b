//! Labels to "CVAT for video 1.1".

use std::collections::BTreeMap;
use std::io::{self, Write};

use vice_core::label::{LabelSet, PointLabels};
use vice_core::time::Stamp;

use super::cvat::CENTRE_PX;

/// Writes "CVAT for video 1.1". `frame_stamps` are the stamps of the camera's frames, which CVAT counts.
///
/// Where a point is not labelled for longer than is usual between its observations, it is said to be outside, so that
/// CVAT does not carry it on. The confidence and the tracker's version have no place there.
///
/// # Errors
/// [`io::Error`] of the writer, and for a stamp that is no frame or a name that XML cannot hold.
pub fn write_cvat(writer: &mut dyn Write, labels: &LabelSet, frame_stamps: &[Stamp]) -> io::Result<()> {
    writeln!(writer, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>")?;
    writeln!(writer, "  <meta>\n    <task>")?;
    if let Some(name) = &labels.dataset {
        writeln!(writer, "      <name>{}</name>", escaped(name)?)?;
    }
    writeln!(
        writer,
        "      <size>{}</size>\n      <mode>interpolation</mode>\n      <labels>",
        frame_stamps.len()
    )?;
    for point in labels.points() {
        writeln!(
            writer,
            "        <label>\n          <name>{}</name>\n          <type>points</type>",
            escaped(&point.name)?
        )?;
        writeln!(writer, "          <attributes>")?;
        for (name, kind, values) in [
            ("source", "select", "manual\nauto\ndetected\ninterpolated"),
            ("keyframe", "checkbox", "false"),
            ("uncertain", "checkbox", "false"),
        ] {
            writeln!(
                writer,
                "            <attribute><name>{name}</name><mutable>True</mutable><input_type>{kind}</input_type>\
                 <values>{values}</values></attribute>"
            )?;
        }
        writeln!(writer, "          </attributes>\n        </label>")?;
    }
    writeln!(writer, "      </labels>\n    </task>\n  </meta>")?;
    for (id, point) in labels.points().iter().enumerate() {
        write_track(writer, id, point, frame_stamps)?;
    }
    writeln!(writer, "</annotations>")
}

fn write_track(writer: &mut dyn Write, id: usize, point: &PointLabels, stamps: &[Stamp]) -> io::Result<()> {
    writeln!(writer, "  <track id=\"{id}\" label=\"{}\" source=\"manual\">", escaped(&point.name)?)?;
    let frames = point.observations.iter().map(|o| {
        stamps.binary_search(&o.stamp).map_err(|_| {
            let problem = format!("point {}: {} ns is none of the camera's frames", point.name, o.stamp);
            io::Error::new(io::ErrorKind::InvalidData, problem)
        })
    });
    let frames: Vec<usize> = frames.collect::<io::Result<_>>()?;
    // The step between labelled frames that is seen most often: labels at 10 Hz of frames at 20 Hz have gaps of two.
    let mut steps: BTreeMap<usize, usize> = BTreeMap::new();
    for pair in frames.windows(2) {
        *steps.entry(pair[1] - pair[0]).or_default() += 1;
    }
    let usual =
        steps.into_iter().max_by_key(|(step, count)| (*count, usize::MAX - step)).map_or(1, |(s, _)| s);
    for (i, (o, frame)) in point.observations.iter().zip(&frames).enumerate() {
        let place = format!("{:?},{:?}", o.px.u + CENTRE_PX, o.px.v + CENTRE_PX);
        let occluded = u8::from(o.occluded);
        writeln!(
            writer,
            "    <points frame=\"{frame}\" outside=\"0\" occluded=\"{occluded}\" keyframe=\"1\" points=\"{place}\" z_order=\"0\">"
        )?;
        for (name, value) in [
            ("source", o.source.name()),
            ("keyframe", if o.keyframe { "true" } else { "false" }),
            ("uncertain", if o.uncertain { "true" } else { "false" }),
        ] {
            writeln!(writer, "      <attribute name=\"{name}\">{value}</attribute>")?;
        }
        writeln!(writer, "    </points>")?;
        let next = frames.get(i + 1).copied().unwrap_or(stamps.len());
        let respawned = point.observations.get(i + 1).is_some_and(|n| n.keyframe);
        if next > frame + 1 && (next > frame + usual || respawned || i + 1 == frames.len()) {
            writeln!(
                writer,
                "    <points frame=\"{}\" outside=\"1\" occluded=\"0\" keyframe=\"1\" points=\"{place}\" z_order=\"0\"/>",
                frame + 1
            )?;
        }
    }
    writeln!(writer, "  </track>")
}

/// Text as XML holds it, in an element or an attribute.
fn escaped(text: &str) -> io::Result<String> {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push_str(&format!("&#{};", u32::from(c))),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => {
                let problem = format!("the name {text:?} has a character that XML cannot hold");
                return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
            }
            other => out.push(other),
        }
    }
    Ok(out)
}
