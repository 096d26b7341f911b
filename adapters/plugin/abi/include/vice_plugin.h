/*
 * The contract between VICE and a plugin: a shared library that reads one format of robot data.
 *
 * A plugin exports one symbol, `vice_plugin`, which hands over a table of calls. C++ authors include vice_plugin.hpp
 * instead, which fills the table from a class and turns exceptions into errors; Rust authors use the crate vice-abi.
 *
 * CONVENTIONS
 * - Time is integer nanoseconds (`_ns`); never a double, which loses 238 ns at today's epoch.
 * - Lengths are metres (`_m`), angles radians (`_rad`), places in an image pixels (`_px`); pixel centres are integers and
 *   (0, 0) is the centre of the top left pixel.
 * - `a_from_b` takes coordinates in frame b to coordinates in frame a: `p_a = R p_b + t`.
 * - Frames: world (fixed, z up), body (IMU or robot base), camera (x right, y down, z forward), cloud (that of a scan).
 * - A rotation is a unit quaternion in the order its name says: `wxyz`, w first.
 * - Text is UTF-8 with a length, not ended by a zero. Paths are text whose bytes are those of the operating system.
 *
 * MEMORY
 * - The host gives the memory of the structure that a call fills, zeroed, and of the message.
 * - What such a structure points at belongs to the plugin. If `owner` is not null the host hands it to `release` exactly once,
 *   as soon as it has copied what it wants and before `close`; if it is null the memory must live until `close`, or for
 *   a probe as long as the library.
 * - After a call that did not return VICE_OK nothing is read from the structure and nothing is released.
 * - The table, and all that it points at, lives as long as the library. Libraries are never unloaded.
 *
 * ERRORS
 * - A call returns VICE_OK, VICE_NONE where its comment allows it, or an error with a message: one line that says what is
 *   wrong, with the file and line, and what to do about it. The code says of which kind it is; where in doubt, VICE_ERROR.
 * - No exception and no longjmp may leave a call: that is undefined behaviour. vice_plugin.hpp sees to it.
 *
 * THREADS
 * - Without VICE_FLAG_THREAD_SAFE no two calls of the library overlap, but they may come from different threads. With it, calls
 *   on the same data set and on different ones may overlap; only `close` of a data set never overlaps other calls on it.
 *
 * A table may be shorter than this one (`struct_size`): calls beyond its end count as null. Calls marked optional may be null.
 */
#ifndef VICE_PLUGIN_H
#define VICE_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/*
 * Version of this contract, and the oldest that a program of this version still loads. What came with version 2 is marked so;
 * a plugin of version 0 is used as far as it goes. There was no version 1.
 */
#define VICE_ABI_VERSION 2
#define VICE_ABI_OLDEST 0

/* What calls return. */
#define VICE_OK 0
#define VICE_NONE 1      /* there is none: no depth image for this frame, no cloud, no state */
#define VICE_ERROR 2     /* it failed, the message says why: bytes or numbers that cannot be what they should be */
#define VICE_EXCEPTION 3 /* an exception or a panic was caught, the message says which: a bug of the plugin */
/* Since version 2: as VICE_ERROR, of a kind that programs act on. */
#define VICE_ERROR_MISSING 4       /* a file, stream, camera or topic that is asked for is not there */
#define VICE_ERROR_UNSUPPORTED 5   /* well-formed data that the plugin does not read */
#define VICE_ERROR_CONTRADICTORY 6 /* two statements of the data, or of the data and a setting, exclude each other */
#define VICE_ERROR_USAGE 7         /* a setting that makes no sense, whatever the data */

/* Flags of the table. */
#define VICE_FLAG_THREAD_SAFE 1

/* Answers of a probe. */
#define VICE_PROBE_NO 0         /* not this format */
#define VICE_PROBE_YES 1        /* a data set of this format */
#define VICE_PROBE_COLLECTION 2 /* a folder of several, each of which `open` takes by its path */

/* Camera models and the order of their coefficients. */
#define VICE_MODEL_PINHOLE 0     /* none */
#define VICE_MODEL_RADTAN 1      /* k1 k2 p1 p2, or k1 k2 p1 p2 k3: Brown-Conrady, ROS plumb_bob */
#define VICE_MODEL_RATIONAL 2    /* k1 k2 p1 p2 k3 k4 k5 k6: ROS rational_polynomial */
#define VICE_MODEL_EQUIDISTANT 3 /* k1 k2 k3 k4: Kannala-Brandt, OpenCV fisheye */
#define VICE_MODEL_DS 4          /* xi alpha: double sphere; since version 2, as those below */
#define VICE_MODEL_EUCM 5        /* alpha beta: extended unified */
#define VICE_MODEL_OMNI 6        /* xi k1 k2 p1 p2: Mei, OpenCV omnidir */
#define VICE_MODEL_FOV 7         /* w, radians: Devernay, ATAN */
#define VICE_MAX_COEFFICIENTS 8

/* Flags of a camera. */
#define VICE_CAMERA_HAS_DEPTH 1 /* depth_image can be expected to give something */

/* Kinds of a pose stream. */
#define VICE_STREAM_POSES 0    /* `trajectory` gives it */
#define VICE_STREAM_RELATIVE 1 /* `relative_motions` gives it; VICE chains the motions */
#define VICE_STREAM_CHAINED 2  /* since version 2: `trajectory` gives it, chained by the plugin from motions: it starts anywhere */

/* Formats of pixels. */
#define VICE_PIXELS_GRAY8 0 /* one byte a pixel */
#define VICE_PIXELS_RGB8 1  /* three bytes a pixel: red, green, blue */

/* Where the points of a cloud are. */
#define VICE_CLOUD_PLY 0    /* in a PLY file, which VICE reads */
#define VICE_CLOUD_POINTS 1 /* in memory */

/* The frame in which a floor is known. */
#define VICE_FLOOR_WORLD 0
#define VICE_FLOOR_BODY 1 /* in the body at the key frame, as of a robot that stands on it */

/* States of a finding. */
#define VICE_STATE_UNKNOWN 0 /* there was nothing to look at, or it does not suffice: no praise */
#define VICE_STATE_OK 1      /* looked at, and as it should be */
#define VICE_STATE_LOOK 2    /* may make numbers wrong: a person should look */
#define VICE_STATE_WRONG 3   /* is wrong, or the data contradicts itself */

/* Levels of a line to the user. */
#define VICE_LOG_ERROR 1
#define VICE_LOG_WARN 2
#define VICE_LOG_INFO 3

/* UTF-8, `length` bytes, not ended by a zero. */
typedef struct vice_text {
    const char *data;
    size_t length;
} vice_text;

/* Where a call writes its error: at most `capacity` bytes of UTF-8. `length` is that of the whole text, even where it is cut. */
typedef struct vice_message {
    char *data;
    size_t capacity;
    size_t length;
    /* Since version 2, optional: the bytes of the text that say what to do about it. They stand in brackets, which do not count:
       `poses.csv:7: x is NaN (remove the row)`. */
    size_t hint_start;
    size_t hint_length;
} vice_message;

/* What the host gives. It lives as long as the process. */
typedef struct vice_host {
    uint32_t abi_version;
    uint32_t struct_size;
    void *context;
    /* A line to the user, from any thread; `context` is the one above. A warning is for data that is used all the same. */
    void (*log)(void *context, int32_t level, vice_text line);
} vice_host;

/* A setting that `--set key=value` may give. */
typedef struct vice_setting_info {
    vice_text key;
    vice_text description; /* what it does, with its default */
} vice_setting_info;

/* A setting as given. */
typedef struct vice_setting {
    vice_text key;
    vice_text value;
} vice_setting;

/* What a path is. */
typedef struct vice_probe {
    int32_t answer;         /* VICE_PROBE_... */
    uint32_t reserved;      /* 0 */
    const vice_text *paths; /* of a collection */
    size_t count;
    void *owner;
} vice_probe;

typedef struct vice_camera_entry {
    vice_text name;
    uint64_t flags; /* VICE_CAMERA_... */
} vice_camera_entry;

typedef struct vice_stream_entry {
    vice_text name;    /* "ground-truth" for the truth */
    int32_t kind;      /* VICE_STREAM_... */
    uint32_t reserved; /* 0 */
} vice_stream_entry;

/* What a data set has. Calls name a camera or a stream by its place in these lists; the first camera is the default. */
typedef struct vice_dataset_info {
    vice_text name; /* a short one for tables, such as the folder's */
    const vice_camera_entry *cameras;
    size_t camera_count;
    const vice_stream_entry *streams;
    size_t stream_count;
    void *owner;
} vice_dataset_info;

/* A rigid transform a_from_b. */
typedef struct vice_rigid {
    double translation_m[3];
    double rotation_wxyz[4];
} vice_rigid;

/* A calibrated camera. */
typedef struct vice_camera {
    uint32_t width_px;
    uint32_t height_px;
    double fx_px;
    double fy_px;
    double cx_px;
    double cy_px;
    int32_t model; /* VICE_MODEL_... */
    uint32_t coefficient_count;
    double coefficients[VICE_MAX_COEFFICIENTS];
} vice_camera;

/* Stamps of frames, strictly increasing. */
typedef struct vice_stamps {
    const int64_t *stamps_ns;
    size_t count;
    void *owner;
} vice_stamps;

/* A decoded image, rows from the top. */
typedef struct vice_image {
    uint32_t width_px;
    uint32_t height_px;
    int32_t format;            /* VICE_PIXELS_... */
    uint32_t row_stride_bytes; /* from the start of a row to the start of the next, at least a row */
    const uint8_t *data;
    size_t data_bytes; /* at least (height_px - 1) * row_stride_bytes + a row */
    void *owner;
} vice_image;

/* Since version 2. The stored file of an image, as it lies on the disk or in a message: PNG or JPEG. */
typedef struct vice_image_file {
    const uint8_t *data;
    size_t data_bytes;
    void *owner;
} vice_image_file;

/* A depth image registered to a frame of a camera, rows from the top. */
typedef struct vice_depth_image {
    int64_t stamp_ns;
    uint32_t width_px;
    uint32_t height_px;
    const float *z_m;          /* along the optical axis; 0, negative or NaN: none */
    size_t data_bytes;         /* at least (height_px - 1) * row_stride_bytes + a row */
    uint32_t row_stride_bytes; /* a multiple of 4, at least 4 * width_px */
    uint32_t reserved;         /* 0 */
    void *owner;
} vice_depth_image;

typedef struct vice_pose {
    int64_t stamp_ns;
    vice_rigid world_from_body;
} vice_pose;

/* Poses, stamps strictly increasing, at least one. */
typedef struct vice_poses {
    const vice_pose *poses;
    size_t count;
    void *owner;
} vice_poses;

/* The motion between two instants, the paper's T^{B_t1, B_t0}. */
typedef struct vice_motion {
    int64_t from_ns;
    int64_t to_ns;
    vice_rigid later_from_earlier; /* from the body at from_ns to the body at to_ns */
} vice_motion;

/* Motions, each from where the one before ended. */
typedef struct vice_motions {
    const vice_motion *motions;
    size_t count;
    void *owner;
} vice_motions;

typedef struct vice_imu_sample {
    int64_t stamp_ns;
    double gyro_body_rad_s[3];
    double accel_body_m_s2[3]; /* specific force: about +9.81 on the axis that points up, at rest */
} vice_imu_sample;

/* Inertial samples, stamps strictly increasing. */
typedef struct vice_imu_samples {
    const vice_imu_sample *samples;
    size_t count;
    void *owner;
} vice_imu_samples;

/* The reference state at a stamp: where integrating the inertial samples begins. */
typedef struct vice_inertial_state {
    int64_t stamp_ns;
    vice_rigid world_from_body;
    double velocity_world_m_s[3];
    double gyro_bias_body_rad_s[3];
    double accel_bias_body_m_s2[3];
} vice_inertial_state;

typedef struct vice_point {
    float x_m;
    float y_m;
    float z_m;
} vice_point;

/* The scan of the scene. */
typedef struct vice_cloud {
    int32_t kind;      /* VICE_CLOUD_... */
    uint32_t reserved; /* 0 */
    vice_text ply_path;
    const vice_point *points;
    size_t count;
    vice_rigid world_from_cloud;
    void *owner;
} vice_cloud;

/* The plane n.p + d = 0. */
typedef struct vice_floor {
    int32_t frame;     /* VICE_FLOOR_...: that of the two numbers below */
    uint32_t reserved; /* 0 */
    double normal[3];
    double d_m;
} vice_floor;

/* A line that `vice info` shows under a heading. */
typedef struct vice_fact {
    vice_text section;
    vice_text text;
} vice_fact;

typedef struct vice_facts {
    const vice_fact *facts;
    size_t count;
    void *owner;
} vice_facts;

/* Since version 2. Something in the data that may make the numbers wrong, but does not stop the work. */
typedef struct vice_suspicion {
    vice_text code;     /* a stable name such as `rows-left-out`, for programs: a-z, 0-9 and - */
    vice_text about;    /* a file, a stream, a topic or a camera; empty: the whole data set */
    vice_text message;  /* what looks wrong, in a sentence */
    vice_text evidence; /* the numbers that make it look so, or empty */
    vice_text advice;   /* what to do about it, or empty */
    uint64_t count;     /* how often the same was seen, at least 1 */
} vice_suspicion;

typedef struct vice_suspicions {
    const vice_suspicion *suspicions;
    size_t count;
    void *owner;
} vice_suspicions;

/* A number behind a finding. */
typedef struct vice_number {
    vice_text name; /* a-z, 0-9, % and - */
    double value;   /* finite */
    vice_text unit; /* empty for shares and counts */
} vice_number;

/* What a check of the format found, for `vice check`. */
typedef struct vice_finding {
    vice_text check; /* name of the check: a-z, 0-9 and - */
    vice_text about; /* a stream, a camera; empty: the whole data set */
    vice_text says;  /* what was found, in a sentence */
    vice_text mend;  /* what mends it, or empty */
    const vice_number *numbers;
    size_t number_count;
    int32_t state;     /* VICE_STATE_... */
    uint32_t reserved; /* 0 */
} vice_finding;

typedef struct vice_findings {
    const vice_finding *findings;
    size_t count;
    void *owner;
} vice_findings;

/* What a plugin hands over. */
typedef struct vice_plugin_table {
    uint32_t abi_version; /* VICE_ABI_VERSION */
    uint32_t struct_size; /* sizeof(vice_plugin_table) */
    uint64_t flags;       /* VICE_FLAG_... */
    vice_text name;       /* of the format, as --format takes it: a-z, 0-9, - and _ */
    vice_text version;    /* of the plugin */
    vice_text description; /* one line for `vice formats` */
    const vice_text *offers; /* what data sets can have, such as "images", "imu" */
    size_t offer_count;
    const vice_setting_info *settings;
    size_t setting_count;

    /* Whether a path looks like this format. Cheap: names and first bytes. */
    int32_t (*probe)(vice_text path, vice_probe *probe, vice_message *message);
    /* Opens a data set; *dataset is then handed to the calls below. */
    int32_t (*open)(vice_text path, const vice_setting *settings, size_t setting_count, void **dataset,
                    vice_message *message);
    /* Closes it, once. */
    void (*close)(void *dataset);
    /* Frees what an `owner` stands for. */
    void (*release)(void *owner);
    /* The same for as long as the data set is open. */
    int32_t (*describe)(void *dataset, vice_dataset_info *info, vice_message *message);
    int32_t (*camera)(void *dataset, size_t camera_index, vice_camera *camera, vice_message *message);
    int32_t (*frames)(void *dataset, size_t camera_index, vice_stamps *frames, vice_message *message);
    /* Since version 2 VICE_NONE where `image_file` gives a file: VICE decodes it. */
    int32_t (*image)(void *dataset, size_t camera_index, size_t frame_index, vice_image *image,
                     vice_message *message);
    int32_t (*body_from_camera)(void *dataset, size_t camera_index, int64_t stamp_ns,
                                vice_rigid *body_from_camera, vice_message *message);
    /* A stream of VICE_STREAM_POSES or VICE_STREAM_CHAINED. */
    int32_t (*trajectory)(void *dataset, size_t stream_index, vice_poses *poses, vice_message *message);

    /* Optional: a stream of VICE_STREAM_RELATIVE. */
    int32_t (*relative_motions)(void *dataset, size_t stream_index, vice_motions *motions,
                                vice_message *message);
    /* Optional. VICE_NONE: the robot has none. */
    int32_t (*imu)(void *dataset, vice_imu_samples *samples, vice_message *message);
    /* Optional. VICE_NONE: none is recorded at that stamp. */
    int32_t (*inertial_state)(void *dataset, int64_t stamp_ns, vice_inertial_state *state,
                              vice_message *message);
    /* Optional. VICE_NONE: this frame has none. */
    int32_t (*depth_image)(void *dataset, size_t camera_index, size_t frame_index, vice_depth_image *depth,
                           vice_message *message);
    /* Optional. VICE_NONE: the scene was not scanned. */
    int32_t (*cloud)(void *dataset, vice_cloud *cloud, vice_message *message);
    /* Optional. VICE_NONE, or no call: z = 0 of the world. */
    int32_t (*floor)(void *dataset, int64_t keyframe_ns, vice_floor *floor, vice_message *message);
    /* Optional. */
    int32_t (*facts)(void *dataset, vice_facts *facts, vice_message *message);

    /* Since version 2, optional. VICE_NONE: this image is no PNG or JPEG of its own. A browser shows the file in place of `image`. */
    int32_t (*image_file)(void *dataset, size_t camera_index, size_t frame_index, vice_image_file *file,
                          vice_message *message);
    /* Since version 2, optional: what looked wrong when the data set was opened and read so far, each once. Asked after reading. */
    int32_t (*suspicions)(void *dataset, vice_suspicions *suspicions, vice_message *message);
    /* Optional, and behind the end of the table that older programs of version 2 know: what the format's own checks find. Nothing
     * large is read for it. */
    int32_t (*checks)(void *dataset, vice_findings *findings, vice_message *message);
} vice_plugin_table;

#if defined(_WIN32)
#define VICE_EXPORT __declspec(dllexport)
#else
#define VICE_EXPORT __attribute__((visibility("default")))
#endif

/*
 * The one symbol of a plugin. Null where it cannot work with this host, having logged why. `host` lives as long as the process.
 * Called before everything else; if it is called again it hands over the same table.
 */
VICE_EXPORT const vice_plugin_table *vice_plugin(const vice_host *host);

#ifdef __cplusplus
}
#endif

#endif
