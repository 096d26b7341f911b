"""Small recordings in the layouts of public data sets, and where their points are seen: makes layouts.json beside this file.

    python layouts.py

Each recording is written as its public description says, with the numbers in that data set's own conventions. A point is
given in the camera of one frame; where another frame sees it is worked out here by the data set's own formulas: with
pycolmap for COLMAP, with pykitti for the raw data of KITTI, else with NumPy. Nothing of VICE is used. Pixels are given with
integer pixel centres (COLMAP and nerfstudio have halves).

Needs numpy, scipy, pycolmap and pykitti (made with 2.4, 1.17, 4.2 and 0.3).
"""
import json
import pathlib
import tempfile

import numpy as np
import pycolmap
from scipy.spatial.transform import Rotation

rng = np.random.default_rng(7)
FRAMES = 5
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def matrix(rotation, translation):
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = rotation, translation
    return m


def smooth_poses(first):
    """world_from_camera of a camera that moves a little and turns a little."""
    poses = [first]
    for _ in range(FRAMES - 1):
        step = matrix(Rotation.from_rotvec(rng.normal(0, 0.02, 3)).as_matrix(), rng.normal(0, 0.05, 3))
        poses.append(poses[-1] @ step)
    return poses


# A camera that looks along x of a world whose z points up: x right, y down, z forward.
LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def poses_z_up():
    return smooth_poses(matrix(LEVEL @ Rotation.from_rotvec([0.1, 0.2, 0.05]).as_matrix(), [1.0, -2.0, 1.5]))


def points():
    """Points in the first camera, metres, within view."""
    return np.column_stack([rng.uniform(-0.25, 0.25, 6), rng.uniform(-0.2, 0.2, 6), np.ones(6)]) * rng.uniform(2, 5, (6, 1))


def move(m, x):
    return m[:3, :3] @ x + m[:3, 3]


def pinhole(k, x):
    fx, fy, cx, cy = k
    return np.array([fx * x[0] / x[2] + cx, fy * x[1] / x[2] + cy])


def radtan(k, d, x):
    a, b = x[0] / x[2], x[1] / x[2]
    r2 = a * a + b * b
    k1, k2, p1, p2, k3 = d
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
    v = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
    return np.array([k[0] * u + k[2], k[1] * v + k[3]])


def equidistant(k, d, x):
    r = np.hypot(x[0], x[1])
    theta = np.arctan2(r, x[2])
    bent = theta * (1 + d[0] * theta**2 + d[1] * theta**4 + d[2] * theta**6 + d[3] * theta**8)
    return np.array([k[0] * bent * x[0] / r + k[2], k[1] * bent * x[1] / r + k[3]])


def seen(camera, poses, project):
    """Points of the first frame in each later one; `poses` are world_from_camera, `project` takes a point in the camera."""
    rows = []
    for x in points():
        world = move(poses[0], x)
        for frame in range(1, len(poses)):
            there = move(np.linalg.inv(poses[frame]), world)
            rows.append(
                {
                    "camera": camera,
                    "frame": frame,
                    "from_px": list(project(x)),
                    "z_m": x[2],
                    "to_px": list(project(there)),
                }
            )
    return rows


def quaternion(m):
    return Rotation.from_matrix(m[:3, :3]).as_quat()  # x, y, z, w


def tum_row(stamp, m):
    return f"{stamp} " + " ".join(f"{v:.12f}" for v in [*m[:3, 3], *quaternion(m)])


def text(s):
    return {"text": s}


def png(w, h):
    return {"png": [w, h]}


def depth(w, h, counts):
    return {"depth": [w, h, counts]}


def tum():
    poses = poses_z_up()
    files, rgb, dep, truth = {}, [], [], []
    stamps = [1305031102.175304 + 0.033 * i for i in range(FRAMES)]
    for s, m in zip(stamps, poses):
        t, d = f"{s:.6f}", f"{s + 0.004:.6f}"
        files[f"rgb/{t}.png"], files[f"depth/{d}.png"] = png(640, 480), depth(640, 480, 7500)
        rgb.append(f"{t} rgb/{t}.png")
        dep.append(f"{d} depth/{d}.png")
        truth.append(tum_row(t, m))
    files["rgb.txt"] = text("# color images\n# file: 'x.bag'\n# timestamp filename\n" + "\n".join(rgb) + "\n")
    files["depth.txt"] = text("# depth maps\n# file: 'x.bag'\n# timestamp filename\n" + "\n".join(dep) + "\n")
    files["groundtruth.txt"] = text("# ground truth trajectory\n# file: 'x.bag'\n# timestamp tx ty tz qx qy qz qw\n" + "\n".join(truth) + "\n")
    k, d = [517.3, 516.5, 318.6, 255.3], [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]
    return {
        "folder": "rgbd_dataset_freiburg1_mini",
        "layout": "TUM RGB-D",
        "files": files,
        "stream": "ground-truth",
        "stamps_ns": [round(s * 1e6) * 1000 for s in stamps],
        "seen": seen("rgb", poses, lambda x: radtan(k, d, x)),
        "up_in_first_camera": list(poses[0][:3, :3].T @ [0, 0, 1]),
        "depth_m": 1.5,
    }


def tum_vi():
    poses = poses_z_up()  # of the IMU, which looks as a camera here: only the numbers matter
    k, d = [190.97, 190.97, 254.93, 256.89], [0.0034, 0.0007, -0.002, 0.0002]
    t_cam_imu = matrix(Rotation.from_rotvec([0.1, -0.05, 0.02]).as_matrix(), [0.04, -0.07, 0.01])
    t_cn_cnm1 = matrix(Rotation.from_rotvec([0.0, 0.02, 0.0]).as_matrix(), [-0.1, 0.0, 0.0])
    stamps = [1520530308199447626 + 50_000_000 * i for i in range(FRAMES)]
    files = {}
    for cam in ("cam0", "cam1"):
        files[f"mav0/{cam}/data.csv"] = text("#timestamp [ns],filename\n" + "".join(f"{s},{s}.png\n" for s in stamps))
        for s in stamps:
            files[f"mav0/{cam}/data/{s}.png"] = png(512, 512)
    row = lambda s, m: ",".join([str(s), *(f"{v:.12f}" for v in [*m[:3, 3], quaternion(m)[3], *quaternion(m)[:3]])])
    files["mav0/mocap0/data.csv"] = text(
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
        + "".join(row(s, m) + "\n" for s, m in zip(stamps, poses))
    )
    files["mav0/imu0/data.csv"] = text(
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
        + "".join(f"{stamps[0] + 5_000_000 * i},0.1,0.2,0.3,0.0,0.0,9.81\n" for i in range(30))
    )
    lines = lambda m: "".join(f"  - [{', '.join(f'{v:.15f}' for v in r)}]\n" for r in m)
    chain = ""
    for cam, key, m in (("cam0", "T_cam_imu", t_cam_imu), ("cam1", "T_cn_cnm1", t_cn_cnm1)):
        chain += f"{cam}:\n  {key}:\n{lines(m)}  camera_model: pinhole\n  distortion_coeffs: {d}\n  distortion_model: equidistant\n"
        chain += f"  intrinsics: {k}\n  resolution: [512, 512]\n  rostopic: /{cam}/image_raw\n"
    files["dso/camchain.yaml"] = text(chain)
    world_from = lambda cam_from_imu: [m @ np.linalg.inv(cam_from_imu) for m in poses]
    return {
        "folder": "dataset-mini_512_16",
        "layout": "TUM-VI",
        "files": files,
        "stream": "ground-truth",
        "stamps_ns": stamps,
        "seen": seen("cam0", world_from(t_cam_imu), lambda x: equidistant(k, d, x))
        + seen("cam1", world_from(t_cn_cnm1 @ t_cam_imu), lambda x: equidistant(k, d, x)),
        "imu": {"count": 30, "gyro_rad_s": [0.1, 0.2, 0.3], "accel_m_s2": [0.0, 0.0, 9.81]},
    }


def uzh_fpv():
    poses = poses_z_up()
    k, d = [275.46, 274.99, 315.96, 242.71], [-0.0145, 0.0049, -0.0032, 0.0007]
    t_cam_imu = matrix(Rotation.from_rotvec([1.2, -1.1, 1.3]).as_matrix(), [0.01, -0.02, 0.03])
    stamps = [f"{1540818801.5 + 0.033 * i:.9f}" for i in range(FRAMES)]
    files = {f"img/image_0_{i}.png": png(640, 480) for i in range(FRAMES)}
    files["left_images.txt"] = text("# id timestamp image_name\n" + "".join(f"{i} {s} img/image_0_{i}.png\n" for i, s in enumerate(stamps)))
    files["groundtruth.txt"] = text("# timestamp tx ty tz qx qy qz qw\n" + "".join(tum_row(s, m) + "\n" for s, m in zip(stamps, poses)))
    files["imu.txt"] = text(
        "# id timestamp ang_vel_x ang_vel_y ang_vel_z lin_acc_x lin_acc_y lin_acc_z\n"
        + "".join(f"{i} {1540818801.5 + 0.002 * i:.9f} 0.1 0.2 0.3 0.0 0.0 9.81\n" for i in range(30))
    )
    rows = "".join(f"  - [{', '.join(f'{v:.15f}' for v in r)}]\n" for r in t_cam_imu)
    files["camchain-imucam.yaml"] = text(
        f"cam0:\n  T_cam_imu:\n{rows}  camera_model: pinhole\n  distortion_coeffs: {d}\n  distortion_model: equidistant\n"
        f"  intrinsics: {k}\n  resolution: [640, 480]\n  rostopic: /snappy_cam/stereo_l\n  timeshift_cam_imu: -0.0166\n"
    )
    return {
        "folder": "indoor_forward_3_snapdragon_with_gt",
        "layout": "UZH-FPV",
        "files": files,
        "stream": "ground-truth",
        "stamps_ns": [int(s.replace(".", "")) for s in stamps],
        "seen": seen("cam0", [m @ np.linalg.inv(t_cam_imu) for m in poses], lambda x: equidistant(k, d, x)),
        "imu": {"count": 30, "gyro_rad_s": [0.1, 0.2, 0.3], "accel_m_s2": [0.0, 0.0, 9.81]},
    }


def seven_scenes():
    poses = poses_z_up()
    files = {}
    for i, m in enumerate(poses):
        files[f"frame-{i:06d}.color.png"] = png(640, 480)
        files[f"frame-{i:06d}.depth.png"] = depth(640, 480, 1500)
        files[f"frame-{i:06d}.pose.txt"] = text("\n".join("\t ".join(f"{v: .12e}" for v in r) for r in m) + "\n")
    k = [585.0, 585.0, 320.0, 240.0]
    return {
        "folder": "seq-01",
        "layout": "7-Scenes",
        "files": files,
        "stream": "ground-truth",
        "stamps_ns": [round(i * 1e9 / 30) for i in range(FRAMES)],
        "seen": seen("color", poses, lambda x: pinhole(k, x)),
        "depth_m": 1.5,
        "invalid_depth_count": 65535,
    }


def icl_nuim():
    # POV-Ray's frames are left-handed: x right, y up, z forward. pixel = (481.2 x / z + 319.5, -480 y / z + 239.5).
    poses = smooth_poses(matrix(Rotation.from_rotvec([0.05, 0.3, 0.02]).as_matrix(), [0.5, 1.2, -2.25]))
    files = {}
    for i in range(FRAMES):
        files[f"rgb/{i + 1}.png"], files[f"depth/{i + 1}.png"] = png(640, 480), depth(640, 480, 7500)
    files["associations.txt"] = text("".join(f"{i + 1} depth/{i + 1}.png {i + 1} rgb/{i + 1}.png\n" for i in range(FRAMES)))
    files["livingRoom0.gt.freiburg"] = text("".join(tum_row(i + 1, m) + "\n" for i, m in enumerate(poses)))
    return {
        "folder": "living_room_traj0_frei_png",
        "layout": "ICL-NUIM",
        "files": files,
        "stream": "ground-truth",
        "stamps_ns": [round((i + 1) * 1e9 / 30) for i in range(FRAMES)],
        "seen": seen("rgb", poses, lambda x: np.array([481.20 * x[0] / x[2] + 319.50, -480.00 * x[1] / x[2] + 239.50])),
        # y up of the world, in the camera with y down.
        "up_in_first_camera": list((poses[0][:3, :3].T @ [0, 1, 0]) * [1, -1, 1]),
        "depth_m": 1.5,
    }


def kitti_odometry():
    first = np.eye(4)
    poses = smooth_poses(first)  # of image_0, x right, y down, z forward
    p0 = np.array([[718.856, 0, 607.1928, 0], [0, 718.856, 185.2157, 0], [0, 0, 1, 0]])
    p2 = p0.copy()
    p2[:, 3] = [45.38225, -0.1130887, 0.003779761]
    line = lambda p: " ".join(f"{v:.12e}" for v in p.reshape(-1))
    files = {f"sequences/00/image_{c}/{i:06d}.png": png(1241, 376) for c in (0, 2) for i in range(FRAMES)}
    files["sequences/00/calib.txt"] = text(f"P0: {line(p0)}\nP1: {line(p0)}\nP2: {line(p2)}\nP3: {line(p0)}\nTr: {line(np.eye(4)[:3])}\n")
    files["sequences/00/times.txt"] = text("".join(f"{0.1036 * i:.6e}\n" for i in range(FRAMES)))
    files["poses/00.txt"] = text("".join(line(m[:3]) + "\n" for m in poses))
    rows = []
    for camera, p in (("image_0", p0), ("image_2", p2)):
        for x in points():
            # The point is given by where and how deep the camera itself sees it: in the camera's frame that is K^-1 P X.
            for frame in range(1, FRAMES):
                now = p @ [*x, 1]
                there = p @ [*move(np.linalg.inv(poses[frame]), move(poses[0], x)), 1]
                rows.append({"camera": camera, "frame": frame, "from_px": list(now[:2] / now[2]), "z_m": now[2], "to_px": list(there[:2] / there[2])})
    return {
        "folder": "sequences/00",
        "layout": "KITTI odometry",
        "files": files,
        "outside": True,
        "stream": "ground-truth",
        "stamps_ns": [round(0.1036e9 * i) for i in range(FRAMES)],
        "seen": rows,
        "up_in_first_camera": [0.0, -1.0, 0.0],
    }


def kitti_raw():
    import pykitti

    day, drive = "2011_09_26", "2011_09_26_drive_0001_sync"
    # pykitti takes the baseline's x only: what a real file has beside it is some 0.2 mm, and is left out here.
    p = {c: np.array([[721.5377, 0, 609.5593, t], [0, 721.5377, 172.854, 0.0], [0, 0, 1, 0.0]]) for c, t in (("00", 0.0), ("02", 44.85728), ("01", -387.5744), ("03", -339.5242))}
    p["00"][:, 3] = 0
    r_rect = Rotation.from_rotvec([0.004, 0.01, -0.007]).as_matrix()
    r_velo = Rotation.from_rotvec([0.01, -0.01, 0.012]).as_matrix() @ LEVEL.T
    r_imu = Rotation.from_rotvec([0.001, -0.002, 0.014]).as_matrix()
    line = lambda v: " ".join(f"{x:.12e}" for x in np.asarray(v).reshape(-1))
    calib = "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.95e-02\n"
    for c in ("00", "01", "02", "03"):
        calib += f"S_{c}: 1.392e+03 5.12e+02\nK_{c}: {line(np.eye(3))}\nD_{c}: {line(np.zeros(5))}\nR_{c}: {line(np.eye(3))}\nT_{c}: {line(np.zeros(3))}\n"
        calib += f"S_rect_{c}: 1.242e+03 3.75e+02\nR_rect_{c}: {line(r_rect)}\nP_rect_{c}: {line(p[c])}\n"
    base = f"{day}/{drive}"
    files = {
        f"{day}/calib_cam_to_cam.txt": text(calib),
        f"{day}/calib_velo_to_cam.txt": text(f"calib_time: 15-Mar-2012 11:37:16\nR: {line(r_velo)}\nT: {line([-0.004, -0.0763, -0.2718])}\ndelta_f: 0 0\ndelta_c: 0 0\n"),
        f"{day}/calib_imu_to_velo.txt": text(f"calib_time: 25-May-2012 16:47:16\nR: {line(r_imu)}\nT: {line([-0.8087, 0.3196, -0.7997])}\n"),
    }
    clock = lambda i: f"2011-09-26 13:02:{25 + 0.1 * i:012.9f}"
    for c in ("00", "02"):
        files[f"{base}/image_{c}/timestamps.txt"] = text("".join(clock(i) + "\n" for i in range(FRAMES)))
        for i in range(FRAMES):
            files[f"{base}/image_{c}/data/{i:010d}.png"] = png(1242, 375)
    files[f"{base}/oxts/timestamps.txt"] = text("".join(clock(i) + "\n" for i in range(FRAMES)))
    for i in range(FRAMES):
        packet = [49.015 + 2e-6 * i, 8.4342 + 3e-6 * i, 116.4 + 0.01 * i, 0.02 + 0.001 * i, -0.01, 0.6 + 0.01 * i]
        rest = [0.0] * 5 + [0.1, 0.2, 9.8, 0, 0, 0, 0.01, 0.02, 0.03, 0, 0, 0, 0.05, 0.01]
        files[f"{base}/oxts/data/{i:010d}.txt"] = text(" ".join(repr(v) for v in packet + rest) + " 4 11 6 6 6\n")
    with tempfile.TemporaryDirectory() as folder:
        for path, what in files.items():
            target = pathlib.Path(folder, path)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(what.get("text", ""))
        # pykitti wants the laser's files too.
        for name in ("velodyne_points/data",):
            pathlib.Path(folder, base, name).mkdir(parents=True)
        data = pykitti.raw(folder, day, "0001")
        t_w_imu = [o.T_w_imu for o in data.oxts]
        rows = []
        for camera, from_imu, kk in (("image_00", data.calib.T_cam0_imu, data.calib.K_cam0), ("image_02", data.calib.T_cam2_imu, data.calib.K_cam2)):
            poses = [m @ np.linalg.inv(from_imu) for m in t_w_imu]
            rows += seen(camera, poses, lambda x: pinhole([kk[0, 0], kk[1, 1], kk[0, 2], kk[1, 2]], x))
        up = np.linalg.inv(t_w_imu[0] @ np.linalg.inv(data.calib.T_cam0_imu))[:3, :3] @ [0, 0, 1]
    return {
        "folder": base,
        "layout": "KITTI raw",
        "files": files,
        "outside": True,
        "stream": "ground-truth",
        "stamps_ns": [1317042145000000000 + 100_000_000 * i for i in range(FRAMES)],
        "seen": rows,
        "up_in_first_camera": list(up),
        "imu": {"count": FRAMES, "gyro_rad_s": [0.01, 0.02, 0.03], "accel_m_s2": [0.1, 0.2, 9.8]},
    }


def nerfstudio():
    poses = poses_z_up()
    k, d = [600.5, 601.25, 321.75, 243.5], [0.03, -0.05, 0.001, -0.002]
    frames = [{"file_path": f"images/frame_{i + 1:05d}.png", "depth_file_path": f"depths/frame_{i + 1:05d}.png", "transform_matrix": (m @ OPENGL).tolist()} for i, m in enumerate(poses)]
    files = {}
    for i in range(FRAMES):
        files[f"images/frame_{i + 1:05d}.png"], files[f"depths/frame_{i + 1:05d}.png"] = png(640, 480), depth(640, 480, 1500)
    document = {"camera_model": "OPENCV", "fl_x": k[0], "fl_y": k[1], "cx": k[2], "cy": k[3], "w": 640, "h": 480, "k1": d[0], "k2": d[1], "p1": d[2], "p2": d[3], "frames": frames[::-1]}
    files["transforms.json"] = text(json.dumps(document, indent=1))
    return {
        "folder": "nerf",
        "layout": "nerfstudio",
        "files": files,
        "stream": "transforms",
        "stamps_ns": [round(i * 1e9 / 30) for i in range(FRAMES)],
        "seen": seen("camera", poses, lambda x: radtan(k, [*d, 0.0], x) - 0.5),
        "up_in_first_camera": list(poses[0][:3, :3].T @ [0, 0, 1]),
        "depth_m": 1.5,
    }


COLMAP_MODELS = {
    "SIMPLE_PINHOLE": [600.0, 320.5, 240.25],
    "PINHOLE": [600.0, 610.0, 320.5, 240.25],
    "SIMPLE_RADIAL": [600.0, 320.5, 240.25, 0.05],
    "RADIAL": [600.0, 320.5, 240.25, 0.05, -0.02],
    "OPENCV": [600.0, 610.0, 320.5, 240.25, 0.05, -0.02, 0.001, -0.002],
    "OPENCV_FISHEYE": [400.0, 410.0, 320.5, 240.25, 0.01, -0.004, 0.002, -0.0003],
    "FULL_OPENCV": [600.0, 610.0, 320.5, 240.25, 0.05, -0.02, 0.001, -0.002, 0.01, 0.02, -0.01, 0.003],
    "SIMPLE_RADIAL_FISHEYE": [400.0, 320.5, 240.25, 0.02],
    "RADIAL_FISHEYE": [400.0, 320.5, 240.25, 0.02, -0.005],
}


def colmap(model, parameters, binary):
    poses = poses_z_up()
    camera = pycolmap.Camera(model=model, width=640, height=480, params=parameters, camera_id=1)
    made = pycolmap.Reconstruction()
    made.add_camera_with_trivial_rig(camera)
    for i, m in enumerate(poses):
        image = pycolmap.Image(name=f"frame{i + 1}.png", camera_id=1, image_id=i + 1)
        image.points2D = pycolmap.Point2DList([pycolmap.Point2D(np.array([1.5 + i, 2.5]))])
        cam_from_world = np.linalg.inv(m)
        made.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pycolmap.Rotation3d(cam_from_world[:3, :3]), cam_from_world[:3, 3]))
    cloud = [[1.0, 2.0, 3.0], [-4.0, 5.5, -6.25], [1e6, 0.5, 2.0]]
    for xyz in cloud:
        made.add_point3D(np.array(xyz), pycolmap.Track([pycolmap.TrackElement(1, 0)]) if False else pycolmap.Track(), np.array([1, 2, 3], np.uint8))
    files = {f"images/frame{i + 1}.png": png(640, 480) for i in range(FRAMES)}
    with tempfile.TemporaryDirectory() as folder:
        (made.write_binary if binary else made.write_text)(folder)
        for name in ("cameras", "images", "points3D"):
            path = pathlib.Path(folder, f"{name}.{'bin' if binary else 'txt'}")
            files[f"sparse/0/{path.name}"] = {"hex": path.read_bytes().hex()} if binary else text(path.read_text())
    project = lambda x: camera.img_from_cam(np.asarray(x, float).reshape(1, 3)).reshape(2) - 0.5
    return {
        "folder": f"colmap_{model.lower()}",
        "layout": "COLMAP",
        "files": files,
        "stream": "colmap",
        "stamps_ns": [round(i * 1e9 / 30) for i in range(FRAMES)],
        "seen": seen("camera", poses, project),
        "cloud_m": cloud,
    }


def plain(value):
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    return float(value) if isinstance(value, np.floating) else value


recordings = [tum(), tum_vi(), uzh_fpv(), seven_scenes(), icl_nuim(), kitti_odometry(), kitti_raw(), nerfstudio()]
recordings += [colmap(model, parameters, i % 2 == 0) for i, (model, parameters) in enumerate(COLMAP_MODELS.items())]
path = pathlib.Path(__file__).with_suffix(".json")
path.write_text(json.dumps(plain({"recordings": recordings}), indent=0) + "\n")
print(path, path.stat().st_size)
