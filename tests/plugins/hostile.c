/*
 * A small plugin that is good as it stands, and bad in one way with each macro. It reads any folder that has hostile.txt: one
 * camera of 8 x 4 px with depth, three frames that are also stored as PNG, the truth, a stream of motions, the truth as if it
 * were chained, three inertial samples, three points, a suspicion.
 */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "vice_plugin.h"

#ifndef NAME
#define NAME "hostile"
#endif

#define FRAMES 3
#define WIDTH 8
#define HEIGHT 4

static const vice_host *the_host;

static vice_text text(const char *s) {
    vice_text t = {s, strlen(s)};
    return t;
}

/* With VIOLENT the variable HOSTILE_DO says what happens in which call: `exit@open`. */
static void violence(const char *place) {
#if defined(VIOLENT)
    static const char garbage[] = "garbage garbage garbage garbage ";
    const char *what = getenv("HOSTILE_DO"), *at = what ? strchr(what, '@') : NULL;
    long i;
    if (at == NULL || strcmp(at + 1, place) != 0) return;
    if (strncmp(what, "exit@", 5) == 0) exit(0);
    if (strncmp(what, "leave@", 6) == 0) _exit(0);
    if (strncmp(what, "abort@", 6) == 0) abort();
    if (strncmp(what, "segv@", 5) == 0) raise(SIGSEGV);
    if (strncmp(what, "hang@", 5) == 0)
        for (;;) sleep(1);
    if (strncmp(what, "log@", 4) == 0)
        for (i = 0; i < 100000; ++i) the_host->log(the_host->context, VICE_LOG_WARN, text("again and again"));
    if (strncmp(what, "print@", 6) == 0) {
        for (i = 0; i < 100000; ++i) puts("again and again");
        fflush(stdout);
    }
    if (strncmp(what, "take@", 5) == 0)
        for (;;) memset(malloc(64 << 20), 1, 64 << 20);
    if (strncmp(what, "garbage@", 8) == 0)
        for (i = 3; i < 64; ++i)
            if (write((int)i, garbage, sizeof garbage) < 0) continue;
#else
    (void)place;
#endif
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
#if defined(NO_MESSAGE)
    (void)message;
    return VICE_ERROR;
#elif defined(BAD_MESSAGE)
    memcpy(message->data, "caf\xe9 is closed", 14);
    message->length = 14;
    return VICE_ERROR;
#elif defined(OVERRUN_MESSAGE)
    memcpy(message->data, what, n);
    message->length = n;
    return VICE_ERROR;
#elif defined(LONG_MESSAGE)
    memset(message->data, 'x', message->capacity);
    message->length = (size_t)-1;
    return VICE_ERROR;
#elif defined(UNKNOWN_CODE)
    return 77;
#else
    message->length = n;
    memcpy(message->data, what, n < message->capacity ? n : message->capacity);
#if defined(HINT)
    message->hint_start = n - 13;
    message->hint_length = 12;
    return VICE_ERROR_USAGE;
#elif defined(BAD_HINT)
    message->hint_start = n;
    message->hint_length = (size_t)-1;
#endif
    return VICE_ERROR;
#endif
}

static int is_there(vice_text folder) {
    char path[4096];
    if (folder.length > 4000) return 0;
    snprintf(path, sizeof path, "%.*s/hostile.txt", (int)folder.length, folder.data);
    return access(path, R_OK) == 0;
}

static int32_t probe(vice_text path, vice_probe *out, vice_message *message) {
    (void)message;
    violence("probe");
    out->answer = is_there(path) ? VICE_PROBE_YES : VICE_PROBE_NO;
#if defined(CLAIMS_ALL)
    out->answer = VICE_PROBE_YES;
#elif defined(BAD_PROBE)
    out->answer = 12;
#elif defined(EMPTY_COLLECTION)
    if (is_there(path)) out->answer = VICE_PROBE_COLLECTION;
#endif
    return VICE_OK;
}

static int32_t open_dataset(vice_text path, const vice_setting *settings, size_t count, void **dataset,
                            vice_message *message) {
    char line[4200];
    (void)settings;
    (void)count;
    violence("open");
#if defined(ABORTS)
    abort();
#elif defined(LEAKS)
    memset(malloc(200000), 1, 200000);
#elif defined(LEAKS_FILES)
    if (dup(0) < 0) return VICE_ERROR;
#elif defined(PRINTS)
    printf("opening\n");
    fflush(stdout);
#endif
    if (!is_there(path)) {
        snprintf(line, sizeof line, "%.*s: has no hostile.txt (see `labels`)", (int)path.length, path.data);
        return fail(message, line);
    }
#if defined(NULL_DATASET)
    *dataset = NULL;
#else
    *dataset = malloc(16);
#endif
    return VICE_OK;
}

static void close_dataset(void *dataset) { free(dataset); }
static void release(void *owner) { free(owner); }

static int32_t describe(void *dataset, vice_dataset_info *out, vice_message *message) {
    static vice_camera_entry cameras[2];
    static vice_stream_entry streams[3];
    (void)dataset;
    (void)message;
    violence("describe");
    cameras[0].name = text("cam");
    cameras[0].flags = VICE_CAMERA_HAS_DEPTH;
    streams[0].name = text("ground-truth");
    streams[1].name = text("steps");
    streams[1].kind = VICE_STREAM_RELATIVE;
    streams[2].name = text("chained");
    streams[2].kind = VICE_STREAM_CHAINED;
    out->name = text("a run");
    out->cameras = cameras;
    out->camera_count = 1;
    out->streams = streams;
    out->stream_count = 3;
#if defined(SAME_NAMES)
    cameras[1] = cameras[0];
    out->camera_count = 2;
#elif defined(BAD_KIND)
    streams[1].kind = -4;
#elif defined(NULL_CAMERAS)
    out->cameras = NULL;
#elif defined(BAD_NAME)
    cameras[0].name = text("caf\xe9");
#elif defined(LONG_NAME)
    cameras[0].name.length = (size_t)-1;
#elif defined(SHORT_TABLE_OF_CALLS)
    out->stream_count = 1;
    cameras[0].flags = 0;
#elif defined(DESCRIBE_NONE)
    return VICE_NONE;
#endif
    return VICE_OK;
}

static int32_t camera(void *dataset, size_t index, vice_camera *out, vice_message *message) {
    (void)dataset;
    violence("camera");
    if (index != 0) return fail(message, "there is no such camera");
    out->width_px = WIDTH;
    out->height_px = HEIGHT;
    out->fx_px = out->fy_px = 6;
    out->cx_px = 3.5;
    out->cy_px = 1.5;
    out->model = VICE_MODEL_RADTAN;
    out->coefficient_count = 4;
#if defined(BAD_MODEL)
    out->model = 9;
#elif defined(MANY_COEFFICIENTS)
    out->coefficient_count = 4000000000u;
#elif defined(NAN_FOCAL)
    out->fx_px = NAN;
#endif
    return VICE_OK;
}

static int64_t stamp(size_t frame) { return 1700000000000000000 + 100000000 * (int64_t)frame; }

static int32_t frames(void *dataset, size_t index, vice_stamps *out, vice_message *message) {
    int64_t *stamps;
    size_t i;
    (void)dataset;
    violence("frames");
    if (index != 0) return fail(message, "there is no such camera");
    stamps = malloc(FRAMES * sizeof *stamps);
    for (i = 0; i < FRAMES; ++i) stamps[i] = stamp(i);
    out->stamps_ns = stamps;
    out->count = FRAMES;
    out->owner = stamps;
#if defined(UNSORTED_FRAMES)
    stamps[2] = stamps[1];
#elif defined(NULL_LIST)
    out->stamps_ns = NULL;
#elif defined(HUGE_COUNT)
    out->count = (size_t)-1 / 8;
#elif defined(UNALIGNED)
    out->stamps_ns = (const int64_t *)((const char *)stamps + 1);
#endif
    return VICE_OK;
}

static int32_t image(void *dataset, size_t index, size_t frame, vice_image *out, vice_message *message) {
    (void)dataset;
    violence("image");
#if defined(CRASHES)
    raise(SIGSEGV);
#elif defined(HANGS)
    for (;;) sleep(1);
#elif defined(EXITS)
    _exit(0);
#endif
#if !defined(GIVES_ALL)
    if (index != 0 || frame >= FRAMES) return fail(message, "there is no such frame");
#endif
#if defined(NO_PICTURE) || defined(PICTURE_IS_FILE)
    return VICE_NONE;
#endif
    enter();
    out->width_px = WIDTH;
    out->height_px = HEIGHT;
    out->format = VICE_PIXELS_GRAY8;
    out->row_stride_bytes = 16;
    out->data_bytes = (HEIGHT - 1) * 16 + WIDTH;
    out->owner = calloc(1, out->data_bytes);
    out->data = out->owner;
    memset(out->owner, (int)frame, out->data_bytes);
#if defined(OTHER_PICTURE)
    memset(out->owner, 200, out->data_bytes);
#endif
    usleep(200);
#if defined(SHORT_STRIDE)
    out->row_stride_bytes = WIDTH - 1;
#elif defined(SHORT_BUFFER)
    out->data_bytes -= 1;
#elif defined(BIG_IMAGE)
    out->width_px = out->height_px = 0xffffffffu;
    out->row_stride_bytes = 0xffffffffu;
#elif defined(BAD_PIXELS)
    out->format = 5;
#elif defined(OTHER_SIZE)
    out->height_px = HEIGHT - 1;
#endif
    return leave(VICE_OK);
}

static int32_t body_from_camera(void *dataset, size_t index, int64_t at, vice_rigid *out, vice_message *message) {
    (void)dataset;
    (void)at;
    violence("body_from_camera");
    if (index != 0) return fail(message, "there is no such camera");
    out->rotation_wxyz[1] = 1;
#if defined(NOT_UNIT)
    out->rotation_wxyz[1] = 2;
#endif
    return VICE_OK;
}

static int32_t trajectory(void *dataset, size_t index, vice_poses *out, vice_message *message) {
    vice_pose *poses;
    size_t i;
    (void)dataset;
    violence("trajectory");
    if (index != 0 && index != 2) return fail(message, "there is no such stream");
    poses = calloc(FRAMES, sizeof *poses);
    for (i = 0; i < FRAMES; ++i) {
        poses[i].stamp_ns = stamp(i);
        poses[i].world_from_body.translation_m[2] = 1;
        poses[i].world_from_body.rotation_wxyz[0] = 1;
    }
    out->poses = poses;
    out->count = FRAMES;
    out->owner = poses;
#if defined(NAN_POSE)
    poses[1].world_from_body.translation_m[0] = NAN;
#elif defined(UNSORTED_POSES)
    poses[2].stamp_ns = stamp(0);
#elif defined(NO_POSES)
    out->count = 0;
#endif
    return VICE_OK;
}

#include "hostile_more.h"

#if defined(NO_SYMBOL)
#define vice_plugin another_symbol
VICE_EXPORT const vice_plugin_table *another_symbol(const vice_host *host);
#endif

const vice_plugin_table *vice_plugin(const vice_host *host) {
    static vice_plugin_table table;
    the_host = host;
    violence("load");
    table.abi_version = VICE_ABI_VERSION;
    table.struct_size = sizeof table;
    table.name = text(NAME);
    table.version = text("1.2.3");
    table.description = text("A plugin of the tests");
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
#if !defined(NO_PICTURE)
    table.image_file = image_file;
#endif
    table.suspicions = suspicions;
#if defined(NEWER_ABI)
    table.abi_version = VICE_ABI_VERSION + 1;
#elif defined(SHORT_TABLE)
    table.struct_size = 64;
#elif defined(SHORT_TABLE_OF_CALLS)
    table.struct_size = offsetof(vice_plugin_table, relative_motions);
#elif defined(LONG_TABLE)
    table.struct_size = sizeof table; /* a newer and longer one ends with calls that are not known here */
    {
        static struct {
            vice_plugin_table table;
            void *more[4];
        } longer;
        longer.table = table;
        longer.table.struct_size = sizeof longer;
        return &longer.table;
    }
#elif defined(ODD_TABLE)
    table.struct_size -= 4;
#elif defined(NULL_TABLE)
    return NULL;
#elif defined(REFUSES)
    host->log(host->context, VICE_LOG_ERROR, text("the licence has run out"));
    return NULL;
#elif defined(NULL_CALL)
    table.image = NULL;
#elif defined(NULL_NAME)
    table.name.data = NULL;
#elif defined(NO_VERSION)
    table.version.length = 0;
#elif defined(NULL_OFFERS)
    table.offer_count = 2;
#elif defined(NO_RELATIVE)
    table.relative_motions = NULL;
#endif
    return &table;
}
