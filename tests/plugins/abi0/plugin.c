/*
 * A plugin of version 0 of the contract, which must keep loading: it and the header beside it stay as they were when that
 * version was made. It reads any folder that has abi0.txt: one camera of 8 x 4 px with depth, three frames, the truth, a
 * stream of motions, three inertial samples, three points.
 */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "vice_plugin.h"


#define FRAMES 3
#define WIDTH 8
#define HEIGHT 4

static const vice_host *the_host;

static vice_text text(const char *s) {
    vice_text t = {s, strlen(s)};
    return t;
}

/* Calls must not overlap, since this plugin does not say that it is thread-safe. */
static int busy;
static void enter(void) {
    if (__atomic_fetch_add(&busy, 1, __ATOMIC_SEQ_CST) != 0) abort();
}
static int32_t leave(int32_t code) {
    __atomic_fetch_sub(&busy, 1, __ATOMIC_SEQ_CST);
    return code;
}

static int32_t fail(vice_message *message, const char *what) {
    size_t n = strlen(what);
    message->length = n;
    memcpy(message->data, what, n < message->capacity ? n : message->capacity);
    return VICE_ERROR;
}

static int is_there(vice_text folder) {
    char path[4096];
    if (folder.length > 4000) return 0;
    snprintf(path, sizeof path, "%.*s/abi0.txt", (int)folder.length, folder.data);
    return access(path, R_OK) == 0;
}

static int32_t probe(vice_text path, vice_probe *out, vice_message *message) {
    (void)message;
    out->answer = is_there(path) ? VICE_PROBE_YES : VICE_PROBE_NO;
    return VICE_OK;
}

static int32_t open_dataset(vice_text path, const vice_setting *settings, size_t count, void **dataset,
                            vice_message *message) {
    char line[4200];
    (void)settings;
    (void)count;
    if (!is_there(path)) {
        snprintf(line, sizeof line, "%.*s: has no abi0.txt", (int)path.length, path.data);
        return fail(message, line);
    }
    *dataset = malloc(16);
    return VICE_OK;
}

static void close_dataset(void *dataset) { free(dataset); }
static void release(void *owner) { free(owner); }

static int32_t describe(void *dataset, vice_dataset_info *out, vice_message *message) {
    static vice_camera_entry cameras[2];
    static vice_stream_entry streams[2];
    (void)dataset;
    (void)message;
    cameras[0].name = text("cam");
    cameras[0].flags = VICE_CAMERA_HAS_DEPTH;
    streams[0].name = text("ground-truth");
    streams[1].name = text("steps");
    streams[1].kind = VICE_STREAM_RELATIVE;
    out->name = text("a run");
    out->cameras = cameras;
    out->camera_count = 1;
    out->streams = streams;
    out->stream_count = 2;
    return VICE_OK;
}

static int32_t camera(void *dataset, size_t index, vice_camera *out, vice_message *message) {
    (void)dataset;
    if (index != 0) return fail(message, "there is no such camera");
    out->width_px = WIDTH;
    out->height_px = HEIGHT;
    out->fx_px = out->fy_px = 6;
    out->cx_px = 3.5;
    out->cy_px = 1.5;
    out->model = VICE_MODEL_RADTAN;
    out->coefficient_count = 4;
    return VICE_OK;
}

static int64_t stamp(size_t frame) { return 1700000000000000000 + 100000000 * (int64_t)frame; }

static int32_t frames(void *dataset, size_t index, vice_stamps *out, vice_message *message) {
    int64_t *stamps;
    size_t i;
    (void)dataset;
    if (index != 0) return fail(message, "there is no such camera");
    stamps = malloc(FRAMES * sizeof *stamps);
    for (i = 0; i < FRAMES; ++i) stamps[i] = stamp(i);
    out->stamps_ns = stamps;
    out->count = FRAMES;
    out->owner = stamps;
    return VICE_OK;
}

static int32_t image(void *dataset, size_t index, size_t frame, vice_image *out, vice_message *message) {
    (void)dataset;
    if (index != 0 || frame >= FRAMES) return fail(message, "there is no such frame");
    enter();
    out->width_px = WIDTH;
    out->height_px = HEIGHT;
    out->format = VICE_PIXELS_GRAY8;
    out->row_stride_bytes = 16;
    out->data_bytes = (HEIGHT - 1) * 16 + WIDTH;
    out->owner = calloc(1, out->data_bytes);
    out->data = out->owner;
    memset(out->owner, (int)frame, out->data_bytes);
    usleep(200);
    return leave(VICE_OK);
}

static int32_t body_from_camera(void *dataset, size_t index, int64_t at, vice_rigid *out, vice_message *message) {
    (void)dataset;
    (void)at;
    if (index != 0) return fail(message, "there is no such camera");
    out->rotation_wxyz[1] = 1;
    return VICE_OK;
}

static int32_t trajectory(void *dataset, size_t index, vice_poses *out, vice_message *message) {
    vice_pose *poses;
    size_t i;
    (void)dataset;
    if (index != 0) return fail(message, "there is no such stream");
    poses = calloc(FRAMES, sizeof *poses);
    for (i = 0; i < FRAMES; ++i) {
        poses[i].stamp_ns = stamp(i);
        poses[i].world_from_body.translation_m[2] = 1;
        poses[i].world_from_body.rotation_wxyz[0] = 1;
    }
    out->poses = poses;
    out->count = FRAMES;
    out->owner = poses;
    return VICE_OK;
}

static int32_t relative_motions(void *dataset, size_t index, vice_motions *out, vice_message *message) {
    static vice_motion motions[2];
    size_t i;
    (void)dataset;
    if (index != 1) return fail(message, "there is no such stream");
    for (i = 0; i < 2; ++i) {
        motions[i].from_ns = stamp(i);
        motions[i].to_ns = stamp(i + 1);
        motions[i].later_from_earlier.rotation_wxyz[0] = 1;
    }
    out->motions = motions;
    out->count = 2;
    return VICE_OK;
}

static int32_t imu(void *dataset, vice_imu_samples *out, vice_message *message) {
    static vice_imu_sample samples[3];
    size_t i;
    (void)dataset;
    (void)message;
    for (i = 0; i < 3; ++i) {
        samples[i].stamp_ns = stamp(i);
        samples[i].accel_body_m_s2[2] = 9.81;
    }
    out->samples = samples;
    out->count = 3;
    return VICE_OK;
}

static int32_t inertial_state(void *dataset, int64_t at, vice_inertial_state *out, vice_message *message) {
    (void)dataset;
    (void)message;
    out->stamp_ns = at;
    out->world_from_body.rotation_wxyz[0] = 1;
    return VICE_OK;
}

static int32_t depth_image(void *dataset, size_t index, size_t frame, vice_depth_image *out, vice_message *message) {
    float *z_m;
    size_t i;
    (void)dataset;
    if (index != 0 || frame >= FRAMES) return fail(message, "there is no such frame");
    z_m = malloc(WIDTH * HEIGHT * sizeof *z_m);
    for (i = 0; i < WIDTH * HEIGHT; ++i) z_m[i] = i % 3 == 0 ? NAN : 1.0f;
    out->stamp_ns = stamp(frame);
    out->width_px = WIDTH;
    out->height_px = HEIGHT;
    out->z_m = z_m;
    out->data_bytes = WIDTH * HEIGHT * sizeof *z_m;
    out->row_stride_bytes = WIDTH * sizeof *z_m;
    out->owner = z_m;
    return VICE_OK;
}

static int32_t cloud(void *dataset, vice_cloud *out, vice_message *message) {
    static const vice_point points[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    (void)dataset;
    (void)message;
    out->kind = VICE_CLOUD_POINTS;
    out->points = points;
    out->count = 3;
    out->world_from_cloud.rotation_wxyz[0] = 1;
    return VICE_OK;
}

static int32_t floor_at(void *dataset, int64_t at, vice_floor *out, vice_message *message) {
    (void)dataset;
    (void)message;
    (void)at;
    out->frame = VICE_FLOOR_WORLD;
    out->normal[2] = 1;
    return VICE_OK;
}

static int32_t facts(void *dataset, vice_facts *out, vice_message *message) {
    static vice_fact fact;
    (void)dataset;
    (void)message;
    fact.section = text("notes");
    fact.text = text("a fact");
    out->facts = &fact;
    out->count = 1;
    the_host->log(the_host->context, VICE_LOG_WARN, text("a remark of the plugin"));
    return VICE_OK;
}


const vice_plugin_table *vice_plugin(const vice_host *host) {
    static vice_plugin_table table;
    the_host = host;
    table.abi_version = VICE_ABI_VERSION;
    table.struct_size = sizeof table;
    table.name = text("abi0");
    table.version = text("1.2.3");
    table.description = text("A plugin of version 0 of the contract");
    table.probe = probe;
    table.open = open_dataset;
    table.close = close_dataset;
    table.release = release;
    table.describe = describe;
    table.camera = camera;
    table.frames = frames;
    table.image = image;
    table.body_from_camera = body_from_camera;
    table.trajectory = trajectory;
    table.relative_motions = relative_motions;
    table.imu = imu;
    table.inertial_state = inertial_state;
    table.depth_image = depth_image;
    table.cloud = cloud;
    table.floor = floor_at;
    table.facts = facts;
    return &table;
}
