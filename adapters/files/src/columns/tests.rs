use super::*;

fn says(name: &str, quantity: Quantity, axis: impl Into<Option<Axis>>, unit: &str) {
    let column = ColumnName::new(name);
    assert_eq!((column.meaning, column.unit.as_str()), (Some((quantity, axis.into())), unit), "{name}");
}

#[test]
fn names_of_every_tool_are_known() {
    use Quantity::{
        AccelBias, Acceleration, Angles, AngularRate, File, GyroBias, Position, Rotation, RotationByNumber,
        Time, Velocity,
    };
    for name in [
        "x",
        "tx",
        "p_x",
        "px",
        "pos_x",
        "posX",
        "position.x",
        "field.pose.pose.position.x",
        "p_RS_R_x",
        "t_wb_x",
        "gt_x",
        "translation_x",
        "\"x\"",
        "Pose_X",
    ] {
        says(name, Position, Axis::X, "");
    }
    for name in ["qw", "q_w", "q_RS_w []", "quat_w", "orientation.w", "rot_w", "qr", "rotation.w", "qW", "w"]
    {
        says(name, Rotation, Axis::W, "");
    }
    says("q_RS_x", Rotation, Axis::X, "");
    says("ang_vel_z", AngularRate, Axis::Z, "");
    says("lin_acc_x", Acceleration, Axis::X, "");
    says("qk", Rotation, Axis::Z, "");
    for name in ["q0", "q[0]", "q_3", "quat1"] {
        says(name, RotationByNumber, None, "");
    }
    for (name, unit) in [
        ("#timestamp [ns]", "ns"),
        ("timestamp", ""),
        ("time_s", "s"),
        ("t(s)", "s"),
        ("stamp_ns", "ns"),
        ("%time", ""),
        ("header.stamp.nsecs", "nsecs"),
        ("secs", "secs"),
        ("timestamp (us)", "us"),
        ("t", ""),
        ("timestampNs", "ns"),
        ("ts_ms", "ms"),
    ] {
        says(name, Time, None, unit);
    }
    says("p_RS_R_y [m]", Position, Axis::Y, "m");
    says("pos_z_mm", Position, Axis::Z, "mm");
    says("x (cm)", Position, Axis::X, "cm");
    says("v_RS_R_x [m s^-1]", Velocity, Axis::X, "m s^-1");
    says("twist.linear.z", Velocity, Axis::Z, "");
    for name in ["w_RS_S_x [rad s^-1]", "gyro_x [rad s^-1]", "angular_velocity.x [rad s^-1]", "wx [rad s^-1]"]
    {
        says(name, AngularRate, Axis::X, "rad s^-1");
    }
    for name in ["a_RS_S_x", "ax", "accel_x", "linear_acceleration.x", "acc_x"] {
        says(name, Acceleration, Axis::X, "");
    }
    says("b_w_RS_S_z [rad s^-1]", GyroBias, Axis::Z, "rad s^-1");
    says("bg_x", GyroBias, Axis::X, "");
    says("b_a_RS_S_x [m s^-2]", AccelBias, Axis::X, "m s^-2");
    says("bax", AccelBias, Axis::X, "");
    for name in ["roll", "yaw_deg", "rx", "euler_x"] {
        assert_eq!(ColumnName::new(name).meaning.unwrap().0, Angles, "{name}");
    }
    says("filename", File, None, "");
    for name in
        ["", "num", "frame_id", "index", "cov_x", "x_std", "exposure_time", "Pr11", "goal_x", "lost", "u"]
    {
        assert_eq!(ColumnName::new(name).meaning, None, "{name}");
    }
}

#[test]
fn units_have_their_worth() {
    assert_eq!(ColumnName::new("tx [mm]").metres(), Some(1e-3));
    assert_eq!(ColumnName::new("tx").metres(), Some(1.0));
    assert_eq!(ColumnName::new("tx [px]").metres(), None);
    assert_eq!(ColumnName::new("w_x [rad s^-1]").radians_per_second(), Some(1.0));
    assert!(ColumnName::new("gx (deg/s)").radians_per_second().unwrap() < 0.02);
    assert_eq!(ColumnName::new("a_x [m s^-2]").metres_per_second2(), Some(1.0));
    assert_eq!(ColumnName::new("ax [g]").metres_per_second2(), Some(9.806_65));
    assert_eq!(TimeUnit::of_magnitude(1.4e9), TimeUnit::Seconds);
    assert_eq!(TimeUnit::of_magnitude(1.4e12), TimeUnit::Millis);
    assert_eq!(TimeUnit::of_magnitude(1.4e15), TimeUnit::Micros);
    assert_eq!(TimeUnit::of_magnitude(1.4e18), TimeUnit::Nanos);
}
