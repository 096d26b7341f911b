//! Trajectories to files. Stamps keep every nanosecond, numbers come back as they were.

use std::io::{self, Write};
use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::frames::Rigid;
use vice_core::trajectory::{RelativeMotion, Trajectory};

use super::InertialRow;
use crate::atomic::{self, Overwrite};

/// Writes `t tx ty tz qx qy qz qw` rows, `t` in seconds with nine decimals, under a comment that names the columns.
///
/// # Errors
/// [`DataError`] if the file cannot be written or may not be replaced.
pub fn write_tum(path: impl AsRef<Path>, trajectory: &Trajectory, overwrite: Overwrite) -> DataResult<()> {
    atomic::write(path, overwrite, |w| {
        writeln!(w, "# timestamp tx ty tz qx qy qz qw")?;
        for (stamp, pose) in trajectory.iter() {
            write!(w, "{}", stamp.to_seconds_text())?;
            vector_and_xyzw(w, &pose)?;
        }
        Ok(())
    })
}

/// Writes the upper three rows of each 4x4 matrix, and the stamps in seconds into a file of times.
///
/// A reader looks for the stamps in `times.txt` beside the poses.
///
/// # Errors
/// [`DataError`] if a file cannot be written or may not be replaced; then neither is left half written.
pub fn write_kitti(
    path: impl AsRef<Path>,
    times: impl AsRef<Path>,
    trajectory: &Trajectory,
    overwrite: Overwrite,
) -> DataResult<()> {
    let (path, times) = (path.as_ref(), times.as_ref());
    if path == times {
        return Err(DataError::new("poses and times cannot go into the same file").at(path));
    }
    atomic::write(times, overwrite, |w| {
        trajectory.stamps().iter().try_for_each(|stamp| writeln!(w, "{}", stamp.to_seconds_text()))
    })?;
    atomic::write(path, overwrite, |w| {
        for pose in trajectory.poses() {
            let m = pose.to_row_major();
            for (i, value) in m[..12].iter().enumerate() {
                write!(w, "{}{value}", if i == 0 { "" } else { " " })?;
            }
            writeln!(w)?;
        }
        Ok(())
    })
}

/// Writes the ground-truth layout of EuRoC: 17 columns with velocity and biases, else the first 8.
///
/// # Errors
/// [`DataError`] if the numbers of rows differ, or the file cannot be written or may not be replaced.
pub fn write_euroc(
    path: impl AsRef<Path>,
    trajectory: &Trajectory,
    inertial: Option<&[InertialRow]>,
    overwrite: Overwrite,
) -> DataResult<()> {
    let path = path.as_ref();
    if let Some(rows) = inertial.filter(|rows| rows.len() != trajectory.len()) {
        let (got, expected) = (rows.len(), trajectory.len());
        return Err(DataError::new(format!("{got} inertial rows for {expected} poses")).at(path));
    }
    atomic::write(path, overwrite, |w| {
        write!(
            w,
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
        )?;
        if inertial.is_some() {
            write!(w, ",v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1]")?;
            write!(w, ",b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1]")?;
            write!(w, ",b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]")?;
        }
        writeln!(w)?;
        for (i, (stamp, pose)) in trajectory.iter().enumerate() {
            let (t, q) = (pose.translation(), pose.rotation());
            write!(w, "{stamp},{},{},{},{},{},{},{}", t.x, t.y, t.z, q.w, q.i, q.j, q.k)?;
            if let Some(rows) = inertial {
                let row = &rows[i];
                for v in [row.velocity_m_s, row.gyro_bias_rad_s, row.accel_bias_m_s2] {
                    write!(w, ",{},{},{}", v.x, v.y, v.z)?;
                }
            }
            writeln!(w)?;
        }
        Ok(())
    })
}

/// Writes `t0 t1 tx ty tz qx qy qz qw` rows of `T^{B_t1,B_t0}`, the paper's primary input.
///
/// # Errors
/// [`DataError`] if the file cannot be written or may not be replaced.
pub fn write_relative(
    path: impl AsRef<Path>,
    motions: &[RelativeMotion],
    overwrite: Overwrite,
) -> DataResult<()> {
    atomic::write(path, overwrite, |w| {
        writeln!(w, "# t0 t1 tx ty tz qx qy qz qw")?;
        for motion in motions {
            write!(w, "{} {}", motion.from.to_seconds_text(), motion.to.to_seconds_text())?;
            vector_and_xyzw(w, &motion.later_from_earlier)?;
        }
        Ok(())
    })
}

fn vector_and_xyzw<D, S>(w: &mut dyn Write, pose: &Rigid<D, S>) -> io::Result<()> {
    let (t, q) = (pose.translation(), pose.rotation());
    writeln!(w, " {} {} {} {} {} {} {}", t.x, t.y, t.z, q.i, q.j, q.k, q.w)
}
