//! A request without the secrets that addresses in it may hold.

use std::path::PathBuf;

use vice_files::address::{shown, shown_path};

use super::{EstimateFrame, EstimateSpec, ReferenceSpec, Request};

impl Request {
    /// What may be shown and written: addresses without user, password and query.
    #[must_use]
    pub fn without_secrets(&self) -> Self {
        let mut request = self.clone();
        let tell = |path: &mut PathBuf| *path = shown_path(path).into_owned();
        let tell_spec = |spec: &mut EstimateSpec| *spec = EstimateSpec::from(spec.to_string());
        tell(&mut request.dataset.path);
        tell(&mut request.labels.file);
        let own = &mut request.dataset;
        [&mut own.calibration, &mut own.cloud, &mut own.mesh, &mut own.world_from_cloud]
            .into_iter()
            .flatten()
            .for_each(tell);
        request.streams.times.iter_mut().for_each(tell);
        if let EstimateFrame::File(file) = &mut request.streams.estimate_frame {
            tell(file);
        }
        request.streams.estimates.iter_mut().for_each(tell_spec);
        if let ReferenceSpec::Named(spec) = &mut request.streams.reference {
            tell_spec(spec);
        }
        for value in request.dataset.set.values_mut() {
            *value = shown(value).into_owned();
        }
        request
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_or_shown_has_no_secrets() {
        let secret = "https://me:hush@h/x.txt?sig=whisper";
        let mut request = Request::new(secret, secret, [EstimateSpec::Named(secret.to_string())]);
        request.streams.estimates.push(EstimateSpec::Relative(secret.into()));
        request.streams.reference = ReferenceSpec::Named(EstimateSpec::Named(secret.to_string()));
        request.streams.estimate_frame = EstimateFrame::File(secret.into());
        request.streams.times = Some(secret.into());
        request.dataset.calibration = Some(secret.into());
        request.dataset.set.insert("urdf".to_string(), secret.to_string());
        let plain = request.without_secrets();
        let written = serde_json::to_string(&request).unwrap();
        assert_eq!(written, serde_json::to_string(&plain).unwrap());
        for text in [written, request.command_line(), format!("{plain:?}")] {
            assert!(!text.contains("hush") && !text.contains("whisper"), "{text}");
            assert!(text.matches("https://h/x.txt").count() >= 9, "{text}");
        }
        // Whatever else was asked for stays.
        let everything = crate::request::tests::everything();
        assert_eq!(everything.without_secrets(), everything);
    }
}
